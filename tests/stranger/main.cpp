// stranger: a renderer by someone who has only read the README. Raw OpenGL 3.3 core, forward shading, a matrix type of its own, boxes on a
// plain. It links gnomon::gnomon and OSMesa alone, takes nothing from this repository's samples, and judges its own picture: every pixel
// against rays that it casts through the boxes in double.
#define GL_GLEXT_PROTOTYPES 1  // for decltype alone
#include <GL/osmesa.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gnomon/gnomon.h"

// ---- OpenGL, loaded by name

// clang-format off
#define FUNCTIONS(X) \
  X(AttachShader) X(BindBuffer) X(BindBufferBase) X(BindFramebuffer) X(BindTexture) X(BindVertexArray) X(BufferData) X(Clear) X(CompileShader) \
  X(CreateProgram) X(CreateShader) X(Disable) X(DrawArrays) X(DrawBuffer) X(Enable) X(EnableVertexAttribArray) X(FramebufferTexture2D) \
  X(GenBuffers) X(GenFramebuffers) X(GenTextures) X(GenVertexArrays) X(GetError) X(GetShaderInfoLog) X(GetShaderiv) \
  X(GetUniformBlockIndex) X(GetUniformLocation) X(LinkProgram) X(ReadPixels) X(Scissor) X(ShaderSource) X(TexImage2D) X(TexParameteri) \
  X(UniformBlockBinding) X(UniformMatrix4fv) X(UseProgram) X(VertexAttribPointer) X(Viewport)
// clang-format on
namespace gl {
#define X(f) decltype(&::gl##f) f = nullptr;
FUNCTIONS(X)
#undef X
}  // namespace gl

// ---- My own vectors and matrices: doubles, row-major, row times column

struct Vec {
  double x, y, z;
  double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec unit(Vec a) { return a * (1.0 / std::sqrt(dot(a, a))); }

struct Matrix {
  double m[4][4] = {};
};
Matrix operator*(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 4; ++k) c.m[i][j] += a.m[i][k] * b.m[k][j];
  return c;
}
glm::dmat4 toGlm(const Matrix& a) {
  glm::dmat4 out;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) out[j][i] = a.m[i][j];
  return out;
}
void setMatrix(GLuint program, const char* name, const Matrix& a) {
  float rows[16];
  for (int i = 0; i < 16; ++i) rows[i] = static_cast<float>(a.m[i / 4][i % 4]);
  gl::UniformMatrix4fv(gl::GetUniformLocation(program, name), 1, GL_TRUE, rows);
}
Matrix lookTo(Vec eye, Vec right, Vec up, Vec back) {  // view space: x right, y up, looking along -z
  return {{{right.x, right.y, right.z, -dot(right, eye)},
           {up.x, up.y, up.z, -dot(up, eye)},
           {back.x, back.y, back.z, -dot(back, eye)},
           {0, 0, 0, 1}}};
}
Matrix projection(double t, double aspect, double n, double f) {
  return {{{1 / (t * aspect), 0, 0, 0}, {0, 1 / t, 0, 0}, {0, 0, (f + n) / (n - f), 2 * f * n / (n - f)}, {0, 0, -1, 0}}};
}

// ---- The scene: boxes; the first is the plain

struct Crate {
  Vec least, most;
};

// The nearest box that a ray meets beyond `from`; -1: none. axis: of the face it enters by.
int cast(const std::vector<Crate>& crates, Vec origin, Vec ray, double from, double& distance, int& axis) {
  int found = -1;
  distance = 1e30;
  for (std::size_t c = 0; c < crates.size(); ++c) {
    double enter = -1e30, leave = 1e30;
    int side = 0;
    for (int i = 0; i < 3; ++i) {
      double a = (crates[c].least[i] - origin[i]) / ray[i], b = (crates[c].most[i] - origin[i]) / ray[i];
      if (a > b) std::swap(a, b);
      if (a > enter) enter = a, side = i;
      leave = std::min(leave, b);
    }
    if (enter > leave || enter < from || enter >= distance) continue;
    distance = enter;
    axis = side;
    found = static_cast<int>(c);
  }
  return found;
}

// ---- Shaders

const char* const kShadowVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 clipFromWorld;
void main() { gl_Position = clipFromWorld * vec4(position, 1.0); }
)";
const char* const kVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 faceNormal;
uniform mat4 clipFromWorld;
out vec3 world, normal;
void main() {
  world = position;
  normal = faceNormal;
  gl_Position = clipFromWorld * vec4(position, 1.0);
}
)";
const char* const kFragment = R"(
#include "gnomon.glsl"
uniform sampler2DShadow shadowMaps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return texture(shadowMaps, vec3(uv, depth)); }
in vec3 world, normal;
out vec4 colour;
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  float lit = gnomonShadow(gnomon, 0, index, world, normal);
  float sun = max(dot(normal, -gnomon.lightDirection.xyz), 0.0);
  colour = vec4(lit, 0.2 + 0.8 * sun * lit, 0.3, 1.0);
}
)";

std::string withIncludes(const std::string& source, std::set<std::string>& seen) {
  std::istringstream lines(source);
  std::string out;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("#include \"", 0) != 0) {
      out += line + "\n";
      continue;
    }
    const std::string name = line.substr(10, line.rfind('"') - 10);
    if (!seen.insert(name).second) continue;
    std::ifstream file(std::string(STRANGER_GLSL) + "/" + name);
    std::ostringstream text;
    text << file.rdbuf();
    out += withIncludes(text.str(), seen);
  }
  return out;
}
GLuint build(const char* vertex, const char* fragment) {
  const GLuint program = gl::CreateProgram();
  for (const auto& [type, source] : {std::pair<GLenum, const char*>{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}) {
    std::set<std::string> seen;
    const std::string text = "#version 330 core\n" + withIncludes(source, seen);
    const char* pointer = text.c_str();
    const GLuint shader = gl::CreateShader(type);
    gl::ShaderSource(shader, 1, &pointer, nullptr);
    gl::CompileShader(shader);
    GLint isFine = 0;
    gl::GetShaderiv(shader, GL_COMPILE_STATUS, &isFine);
    if (!isFine) {
      char log[4096] = {};
      gl::GetShaderInfoLog(shader, sizeof log, nullptr, log);
      std::fprintf(stderr, "shader: %s\n", log);
      std::exit(1);
    }
    gl::AttachShader(program, shader);
  }
  gl::LinkProgram(program);
  return program;
}
void attachTexture(GLuint texture, GLenum attachment, GLint format, GLenum pixels, int width, int height) {
  gl::BindTexture(GL_TEXTURE_2D, texture);
  gl::TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, pixels, GL_FLOAT, nullptr);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl::FramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture, 0);
}

int main() {
  constexpr int kWidth = 640, kHeight = 360;
  const int attributes[] = {
      OSMESA_FORMAT, OSMESA_RGBA, OSMESA_PROFILE, OSMESA_CORE_PROFILE, OSMESA_CONTEXT_MAJOR_VERSION, 3, OSMESA_CONTEXT_MINOR_VERSION, 3, 0};
  const OSMesaContext context = OSMesaCreateContextAttribs(attributes, nullptr);
  std::vector<unsigned char> window(4 * 16 * 16);
  if (!context || !OSMesaMakeCurrent(context, window.data(), GL_UNSIGNED_BYTE, 16, 16)) return 1;
#define X(f) gl::f = reinterpret_cast<decltype(gl::f)>(OSMesaGetProcAddress("gl" #f));
  FUNCTIONS(X)
#undef X

  // A plain with crates, posts and a slab on legs, far from the world's origin.
  const Vec here{120000.0, 40.0, -70000.0};
  std::vector<Crate> crates{{here + Vec{-600, -5, -600}, here + Vec{600, 0, 600}}};
  for (int i = 0; i < 90; ++i) {
    const double x = -3.0 + (i * 37 % 101 - 50) * 0.05 * (2 + i), z = -4.0 - 2.6 * i, width = 0.1 + (i * 7 % 11) * (0.15 + 0.006 * i);
    crates.push_back({here + Vec{x, 0, z}, here + Vec{x + width, 0.5 + (i * 13 % 17) * (0.3 + 0.01 * i), z + width}});
  }
  crates.push_back({here + Vec{1, 2.5, -14}, here + Vec{5, 2.7, -8}});
  for (const double x : {1.1, 4.7})
    for (const double z : {-13.9, -8.3}) crates.push_back({here + Vec{x, 0, z}, here + Vec{x + 0.2, 2.5, z + 0.2}});

  // My camera and its matrices.
  const Vec eye = here + Vec{0.3, 3.1, 2.0}, ahead = unit({0.02, -0.16, -1.0}), right = unit(cross(ahead, {0, 1, 0})),
            up = cross(right, ahead);
  const double tangent = 0.55, aspect = static_cast<double>(kWidth) / kHeight, near = 0.2, far = 300.0;
  const Matrix clipFromView = projection(tangent, aspect, near, far);

  // gnomon: matrices in, block out.
  gnomon::Frame frame;
  gnomon::Solution solution;
  frame.image = {kWidth, kHeight};
  frame.light.directionWs = {0.75, -0.45, -0.35};
  frame.shadowMap.depth = gnomon::DepthConvention::negativeOneToOne;
  frame.budget = {.partitions = 4, .resolution = 2048};
  std::vector<gnomon::Box> boxes;
  for (const Crate& c : crates) boxes.push_back({{c.least.x, c.least.y, c.least.z}, {c.most.x, c.most.y, c.most.z}});
  frame.scene.casters = boxes;
  if (gnomon::cameraFromMatrices(toGlm(lookTo(eye, right, up, ahead * -1.0)), toGlm(clipFromView),
                                 gnomon::DepthConvention::negativeOneToOne, frame.image, {0.0, 0.0}, frame.camera) != gnomon::Status::ok ||
      gnomon::solvePssm(frame, {}, solution) != gnomon::Status::ok)
    return 1;
  const Vec origin{solution.originWs.x, solution.originWs.y, solution.originWs.z};

  // Vertices: position - origin and normal, 36 for each box.
  std::vector<float> vertices;
  for (const Crate& c : crates)
    for (int face = 0; face < 6; ++face)
      for (const int corner : {0, 1, 2, 2, 1, 3}) {
        const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        Vec position{}, normal{};
        position[axis] = face % 2 ? c.most[axis] : c.least[axis];
        position[u] = corner & 1 ? c.most[u] : c.least[u];
        position[v] = corner & 2 ? c.most[v] : c.least[v];
        normal[axis] = face % 2 ? 1.0 : -1.0;
        for (const Vec& each : {position - origin, normal})
          for (int i = 0; i < 3; ++i) vertices.push_back(static_cast<float>(each[i]));
      }
  GLuint vertexArray = 0, buffers[2] = {}, textures[3] = {}, targets[2] = {};
  gl::GenVertexArrays(1, &vertexArray);
  gl::BindVertexArray(vertexArray);
  gl::GenBuffers(2, buffers);
  gl::BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  gl::BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(4 * vertices.size()), vertices.data(), GL_STATIC_DRAW);
  for (GLuint i = 0; i < 2; ++i) {
    gl::EnableVertexAttribArray(i);
    gl::VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 24, reinterpret_cast<const void*>(12 * static_cast<std::size_t>(i)));
  }
  gl::BindBuffer(GL_UNIFORM_BUFFER, buffers[1]);
  gl::BufferData(GL_UNIFORM_BUFFER, sizeof solution.block, &solution.block, GL_STATIC_DRAW);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffers[1]);
  const GLuint shadowProgram = build(kShadowVertex, "void main() {}\n"), program = build(kVertex, kFragment);
  gl::UniformBlockBinding(program, gl::GetUniformBlockIndex(program, "gnomonUniforms"), 0);

  // Shadow maps.
  gl::GenTextures(3, textures);
  gl::GenFramebuffers(2, targets);
  gl::BindFramebuffer(GL_FRAMEBUFFER, targets[1]);
  attachTexture(textures[1], GL_COLOR_ATTACHMENT0, GL_RGBA8, GL_RGBA, kWidth, kHeight);
  attachTexture(textures[2], GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, kWidth, kHeight);
  gl::BindFramebuffer(GL_FRAMEBUFFER, targets[0]);
  attachTexture(textures[0], GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, solution.atlas.x, solution.atlas.y);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  gl::DrawBuffer(GL_NONE);
  gl::Enable(GL_DEPTH_TEST);
  gl::Clear(GL_DEPTH_BUFFER_BIT);
  gl::Enable(GL_SCISSOR_TEST);
  if (solution.depthClamp) gl::Enable(GL_DEPTH_CLAMP);
  gl::UseProgram(shadowProgram);
  int drawn = 0;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const gnomon::Partition& map = solution.partitions[i];
    gl::Viewport(map.viewport.x, map.viewport.y, map.viewport.z, map.viewport.w);
    gl::Scissor(map.viewport.x, map.viewport.y, map.viewport.z, map.viewport.w);
    gl::UniformMatrix4fv(gl::GetUniformLocation(shadowProgram, "clipFromWorld"), 1, GL_FALSE, &map.clipFromWorld[0][0]);
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      if (!gnomon::mayCast(map, boxes[b])) continue;
      gl::DrawArrays(GL_TRIANGLES, static_cast<GLint>(36 * b), 36);
      ++drawn;
    }
  }
  gl::Disable(GL_SCISSOR_TEST);
  gl::Disable(GL_DEPTH_CLAMP);

  // The view.
  gl::BindFramebuffer(GL_FRAMEBUFFER, targets[1]);
  gl::Viewport(0, 0, kWidth, kHeight);
  gl::Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  gl::UseProgram(program);
  gl::BindTexture(GL_TEXTURE_2D, textures[0]);
  setMatrix(program, "clipFromWorld", clipFromView * lookTo(eye - origin, right, up, ahead * -1.0));
  gl::DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(36 * crates.size()));
  std::vector<unsigned char> pixels(4 * kWidth * kHeight);
  gl::ReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_UNSIGNED_BYTE, pixels.data());
  if (gl::GetError() != GL_NO_ERROR) return 1;

  // The truth: what each pixel sees, and whether the sun reaches it.
  const Vec towardsSun = unit({-0.75, 0.45, 0.35});
  std::vector<int> seen(kWidth * kHeight), truth(kWidth * kHeight, -1);  // truth: -1 nothing or turned from the sun, 0 shadowed, 1 lit
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec ray = ahead + right * (((x + 0.5) / kWidth * 2 - 1) * tangent * aspect) + up * (((y + 0.5) / kHeight * 2 - 1) * tangent);
      double distance = 0.0, unused = 0.0;
      int axis = 0, unusedAxis = 0;
      const int crate = cast(crates, eye, ray, near, distance, axis);  // distance: view depth, since the ray advances by 1 along it
      seen[static_cast<std::size_t>(y * kWidth + x)] = crate < 0 || distance > far ? -1 : 3 * crate + axis;
      if (crate < 0 || distance > far || ray[axis] * towardsSun[axis] >= 0.0) continue;
      const bool isLit = cast(crates, eye + ray * distance, towardsSun, 1e-6 * distance, unused, unusedAxis) < 0;
      truth[static_cast<std::size_t>(y * kWidth + x)] = isLit;
    }
  int counted = 0, shadowed = 0, wrong = 0, wrongFar = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto at = static_cast<std::size_t>(y * kWidth + x);
      if (truth[at] < 0) continue;
      ++counted;
      shadowed += truth[at] == 0;
      if ((pixels[4 * at] > 127) == (truth[at] == 1)) continue;
      ++wrong;
      // An edge may be off by a texel: maxError pixels on the plane perpendicular to the light, more on a face that leans away from it.
      const int edge = 1 + static_cast<int>(std::ceil(solution.maxError / std::abs(towardsSun[seen[at] % 3])));
      bool isNearEdge = false;
      for (int v = std::max(y - edge, 0); v <= std::min(y + edge, kHeight - 1); ++v)
        for (int u = std::max(x - edge, 0); u <= std::min(x + edge, kWidth - 1); ++u) {
          const auto other = static_cast<std::size_t>(v * kWidth + u);
          isNearEdge |= seen[other] != seen[at] || truth[other] != truth[at];
        }
      wrongFar += !isNearEdge;
    }
  std::printf("%d maps, %d of %zu draws; %d pixels face the sun, %d in shadow; wrong: %d (%.2f %%), %d of them off an edge\n",
              solution.partitionCount, drawn, 4 * boxes.size(), counted, shadowed, wrong, 100.0 * wrong / counted, wrongFar);
  OSMesaDestroyContext(context);
  const bool isTelling = counted > kWidth * kHeight / 3 && shadowed > counted / 20 && drawn < static_cast<int>(4 * boxes.size());
  return isTelling && wrong < counted / 100 && wrongFar == 0 ? 0 : 1;
}
