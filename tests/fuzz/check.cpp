// Any text as a fragment shader: a report, whatever it says.
#include <cstdint>
#include <string>

#include "check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gnomon::check;
  Shader shader;
  shader.file = "fuzz.frag";
  shader.text.assign(reinterpret_cast<const char*>(data), size);
  shader.targets.emplace_back();
  (void)checkShader(shader, false);
  return 0;
}
