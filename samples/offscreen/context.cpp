#include "context.h"

#include <cstdlib>
#include <stdexcept>

namespace gnomon::offscreen {

Backend defaultBackend() {
  const char* word = std::getenv("GNOMON_CONTEXT");
  if (!word || std::string(word).empty() || std::string(word) == "osmesa") return Backend::osmesa;
  if (std::string(word) == "egl") return Backend::egl;
  throw std::runtime_error("GNOMON_CONTEXT: must be osmesa or egl, got " + std::string(word));
}

std::unique_ptr<Context> createContext(Backend backend, int major, int minor, Profile profile) {
  if (backend == Backend::osmesa && profile == Profile::es) throw std::runtime_error("OSMesa: no OpenGL ES contexts");
  auto context = backend == Backend::egl ? createEglContext(major, minor, profile) : createOsmesaContext(major, minor);
  context->makeCurrent();
  return context;
}

}  // namespace gnomon::offscreen
