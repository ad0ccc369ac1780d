#include <GL/osmesa.h>

#include <array>
#include <stdexcept>

#include "context.h"

namespace gnomon::offscreen {
namespace {

class OsmesaContext final : public Context {
 public:
  explicit OsmesaContext(OSMesaContext context) : context_(context) {}
  ~OsmesaContext() override { OSMesaDestroyContext(context_); }
  void makeCurrent() override {
    // OSMesa wants a colour buffer; everything is drawn into framebuffer objects.
    if (!OSMesaMakeCurrent(context_, pixels_.data(), GL_UNSIGNED_BYTE, kSide, kSide))
      throw std::runtime_error("OSMesa: cannot make the context current");
  }
  Proc getProc(const char* name) const override { return OSMesaGetProcAddress(name); }
  std::string name() const override { return "OSMesa"; }

 private:
  static constexpr int kSide = 16;
  OSMesaContext context_;
  std::array<unsigned char, kSide * kSide * 4> pixels_{};
};

}  // namespace

std::unique_ptr<Context> createOsmesaContext(int major, int minor) {
  const std::array<int, 13> attributes{OSMESA_FORMAT,
                                       OSMESA_RGBA,
                                       OSMESA_DEPTH_BITS,
                                       24,
                                       OSMESA_PROFILE,
                                       OSMESA_CORE_PROFILE,
                                       OSMESA_CONTEXT_MAJOR_VERSION,
                                       major,
                                       OSMESA_CONTEXT_MINOR_VERSION,
                                       minor,
                                       0,
                                       0,
                                       0};
  OSMesaContext context = OSMesaCreateContextAttribs(attributes.data(), nullptr);
  if (!context) throw std::runtime_error("OSMesa: no core profile context " + std::to_string(major) + "." + std::to_string(minor));
  return std::make_unique<OsmesaContext>(context);
}

}  // namespace gnomon::offscreen
