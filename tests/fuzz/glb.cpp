// Any bytes as a .glb: a mesh whose indices and positions are sound, or an error of one line.
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string path = (std::filesystem::temp_directory_path() / ("gnomon_fuzz_" + std::to_string(getpid()) + ".glb")).string();
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    const gnomon::offscreen::Mesh mesh = gnomon::offscreen::loadGlb(path);
    for (const auto index : mesh.indices)
      if (index >= mesh.positionsWs.size()) std::abort();
    for (const auto& p : mesh.positionsWs)
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) std::abort();
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find('\n') != std::string::npos) std::abort();
  }
  std::filesystem::remove(path);
  return 0;
}
