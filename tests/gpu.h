// gpu: shaders in each dialect of the includes, run by the driver on points in a float texture.
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "gnomon/gnomon.h"
#include "shader.h"

namespace gnomon::test {

// How a shader's text reaches the driver: as it stands, or by way of another language and back.
enum class Route { plain, vulkan, hlsl };

struct Dialect {
  const char* name;
  const char* version;  // what the driver's #version line says
  offscreen::Profile profile = offscreen::Profile::core;
  Route route = Route::plain;
};

inline void PrintTo(const Dialect& dialect, std::ostream* out) { *out << dialect.name; }

inline constexpr Dialect kDialects[] = {{"Glsl330", "330 core"},
                                        {"Glsl410", "410"},
                                        {"Glsl450", "450"},
                                        {"Es300", "300 es", offscreen::Profile::es},
                                        {"Es310", "310 es", offscreen::Profile::es},
                                        {"Vulkan", "330 core", offscreen::Profile::core, Route::vulkan},
                                        {"Hlsl", "330 core", offscreen::Profile::core, Route::hlsl}};

// Patterns of texels that a test can work out too: the usual gnomonCompare() answers pattern().
[[nodiscard]] double pattern(int x, int y, int layer, int map);
extern const char* const kPattern;

class Gpu {
 public:
  static constexpr int kWidth = 512;  // points to a row

  // held: GNOMON_MAX_PARTITIONS of the shaders, which get no more of a block than they hold.
  explicit Gpu(const Dialect& dialect, int held = kMaxPartitions);
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;
  ~Gpu();

  // Runs the body on each point: it has vec4 point, vec3 world (its xyz), int index (its w), and writes vec4 result.
  std::vector<glm::vec4> run(const std::string& body, const GnomonBlock& block, std::vector<glm::vec4> points,
                             const std::string& hook = kPattern);

  [[nodiscard]] std::string ask(GLenum what) const;  // glGetString

 private:
  Dialect dialect_;
  int held_;
  std::unique_ptr<offscreen::Context> context_;
  GLuint vertexArray_ = 0, buffer_ = 0;
  std::map<std::string, GLuint> programs_;
};

}  // namespace gnomon::test
