// Prints a hash of what every method answers to its first hard cases, a line for each: compiled otherwise, the solver must print the same.
// With THREADS, as many threads solve all of it at once, each from another place on, and must get what one alone gets.
// gnomon_answers CASES [THREADS]
#include "hard/cases.h"

#include <atomic>
#include <cinttypes>
#include <cstdio>
#include <thread>

using namespace gnomon;
using namespace gnomon::test;

namespace {

std::uint64_t answer(const HardMethod& method, std::uint64_t seed) {
  Random random = hardRandom(seed);
  HardCase c;
  makeHardCase(random, method.isSampled, c);
  const auto solution = std::make_unique<Solution>();
  (void)method.solve(c, random, *solution);
  return hashOf(*solution);
}

}  // namespace

int main(int count, char** arguments) {
  const std::uint64_t cases = count > 1 ? std::strtoull(arguments[1], nullptr, 10) : 0;
  const std::size_t threads = count > 2 ? std::strtoul(arguments[2], nullptr, 10) : 0, all = cases * kHardMethodCount;
  if (all == 0) return std::fprintf(stderr, "gnomon_answers CASES [THREADS]\n"), 2;
  const auto answerAt = [](std::size_t i) { return answer(kHardMethods[i % kHardMethodCount], 1 + i / kHardMethodCount); };
  std::vector<std::uint64_t> alone(all);
  for (std::size_t i = 0; i < all; ++i) {
    alone[i] = answerAt(i);
    if (threads == 0) std::printf("%s %zu %016" PRIx64 "\n", kHardMethods[i % kHardMethodCount].name, 1 + i / kHardMethodCount, alone[i]);
  }
  std::atomic<int> different{0};
  std::vector<std::thread> running;
  for (std::size_t t = 0; t < threads; ++t)
    running.emplace_back([&, t] {
      for (std::size_t n = 0; n < all; ++n) {
        const std::size_t i = (n + t * (all / threads)) % all;
        if (answerAt(i) == alone[i]) continue;
        ++different;
        std::fprintf(stderr, "%s, seed %zu: another answer among threads\n", kHardMethods[i % kHardMethodCount].name,
                     1 + i / kHardMethodCount);
      }
    });
  for (std::thread& each : running) each.join();
  return different == 0 ? 0 : 1;
}
