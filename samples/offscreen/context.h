// context: a headless OpenGL context, behind an interface with two implementations: OSMesa (gone from Mesa 25.1) and EGL surfaceless.
#pragma once

#include <memory>
#include <string>

namespace gnomon::offscreen {

enum class Backend { osmesa, egl };
enum class Profile { core, es };  // OpenGL core profile, or OpenGL ES: EGL alone has it

class Context {
 public:
  using Proc = void (*)();
  virtual ~Context() = default;
  virtual void makeCurrent() = 0;
  [[nodiscard]] virtual Proc getProc(const char* name) const = 0;
  [[nodiscard]] virtual std::string name() const = 0;
};

// OSMesa, or what the environment variable GNOMON_CONTEXT says (osmesa, egl). Throws std::runtime_error for any other word.
[[nodiscard]] Backend defaultBackend();

// A context of at least this version, made current. Throws std::runtime_error with the reason.
[[nodiscard]] std::unique_ptr<Context> createContext(Backend backend, int major, int minor, Profile profile = Profile::core);

// One for each implementation file, which alone includes its API's headers.
[[nodiscard]] std::unique_ptr<Context> createOsmesaContext(int major, int minor);
[[nodiscard]] std::unique_ptr<Context> createEglContext(int major, int minor, Profile profile);

}  // namespace gnomon::offscreen
