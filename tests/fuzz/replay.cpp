// Runs a fuzz target without a fuzzer: over every file of a corpus, and over mutations of each that the same seed makes again.
// replay CORPUS MUTATIONS [SEED]; the bytes that a failure aborts on are left in ./failed-input.
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

std::vector<std::uint8_t> tried;

// The process ends here whatever it calls.
void keepInput(int signal) {
  if (std::FILE* file = std::fopen("failed-input", "wb")) {
    std::fwrite(tried.data(), 1, tried.size(), file);
    std::fclose(file);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void attempt(const std::vector<std::uint8_t>& bytes) {
  tried = bytes;
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3 && count != 4) return std::fprintf(stderr, "replay CORPUS MUTATIONS [SEED]\n"), 2;
  std::signal(SIGABRT, keepInput);
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(arguments[1])) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  if (files.empty()) return std::fprintf(stderr, "%s: no files\n", arguments[1]), 1;
  const long mutations = std::strtol(arguments[2], nullptr, 10);
  std::mt19937 random(count > 3 ? static_cast<std::uint32_t>(std::strtoul(arguments[3], nullptr, 10)) : 1u);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  for (const auto& path : files) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<std::uint8_t> original{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    std::fprintf(stderr, "%s\n", path.filename().c_str());  // the last one is the one that failed
    attempt(original);
    for (long i = 0; i < mutations && !original.empty(); ++i) {
      std::vector<std::uint8_t> bytes = original;
      for (std::size_t n = 1 + below(8); n > 0 && !bytes.empty(); --n) {
        const auto at = static_cast<std::ptrdiff_t>(below(bytes.size())),
                   length = static_cast<std::ptrdiff_t>(std::min(bytes.size() - static_cast<std::size_t>(at), 1 + below(16)));
        const int kind = static_cast<int>(below(4));
        if (kind == 0) bytes[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1u << below(8));
        if (kind == 1) bytes[static_cast<std::size_t>(at)] = static_cast<std::uint8_t>(below(256));
        if (kind == 2) bytes.erase(bytes.begin() + at, bytes.begin() + at + length);
        if (kind == 3) {
          const std::vector<std::uint8_t> part(bytes.begin() + at, bytes.begin() + at + length);
          bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())), part.begin(), part.end());
        }
      }
      attempt(bytes);
    }
  }
  return 0;
}
