// Any text as CASE.json: an answer of finite numbers, or a refusal of one line.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "case.h"
#include "result.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gnomon;
  const auto refuse = [](const std::string& why) {
    if (!why.empty() && why.find('\n') == std::string::npos) return;
    std::fprintf(stderr, "a refusal is one line: '%s'\n", why.c_str());
    std::abort();
  };
  try {
    const cli::Case input = cli::parseCase(cli::parseJson(std::string(reinterpret_cast<const char*>(data), size), "fuzz"));
    static const auto solution = std::make_unique<Solution>();
    const double ns = cli::timedSolve(input, 1, *solution);
    if (solution->status != Status::ok)
      refuse(cli::refusalText(input, *solution));
    else if (cli::resultJson(input.method, input.frame, *solution, ns)["error"]["max"].is_null())
      std::abort();
  } catch (const cli::Refusal& refusal) {
    refuse(refusal.what());
  }
  return 0;
}
