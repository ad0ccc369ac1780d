#define EGL_NO_X11 1
#include <EGL/egl.h>
#include <EGL/eglext.h>

#include <stdexcept>

#include "context.h"

namespace gnomon::offscreen {
namespace {

class EglContext final : public Context {
 public:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  ~EglContext() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
  }
  void makeCurrent() override {
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      throw std::runtime_error("EGL: cannot make the context current");
  }
  Proc getProc(const char* name) const override { return eglGetProcAddress(name); }
  std::string name() const override { return "EGL surfaceless"; }

 private:
  EGLDisplay display_;
  EGLContext context_;
};

}  // namespace

std::unique_ptr<Context> createEglContext(int major, int minor, Profile profile) {
  const auto getDisplay = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  EGLDisplay display = getDisplay ? getDisplay(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr) : EGL_NO_DISPLAY;
  EGLint eglMajor = 0, eglMinor = 0;
  if (display == EGL_NO_DISPLAY || !eglInitialize(display, &eglMajor, &eglMinor)) throw std::runtime_error("EGL: no surfaceless display");
  const bool isEs = profile == Profile::es;
  eglBindAPI(isEs ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
  const EGLint attributes[] = {
      EGL_CONTEXT_MAJOR_VERSION,           major,   EGL_CONTEXT_MINOR_VERSION, minor, isEs ? EGL_NONE : EGL_CONTEXT_OPENGL_PROFILE_MASK,
      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
  EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
  if (context == EGL_NO_CONTEXT)
    throw std::runtime_error(std::string("EGL: no ") + (isEs ? "OpenGL ES" : "core profile") + " context " + std::to_string(major) + "." +
                             std::to_string(minor));
  return std::make_unique<EglContext>(display, context);
}

}  // namespace gnomon::offscreen
