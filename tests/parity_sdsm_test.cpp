// The depth buffer's reductions and the partitions made from them on the GPU, against the CPU's.
#include <algorithm>
#include <cstring>
#include <limits>

#include "glsl_compile.h"
#include "parity.h"

#include "gnomon/sdsm.h"

namespace gnomon::test {
namespace {

using namespace offscreen;

constexpr DepthConvention kDepthKinds[] = {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne,
                                           DepthConvention::reversedZeroToOne};

// A number in GLSL that reads back as the same float.
std::string literal(float x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9e", static_cast<double>(x));
  return text;
}
std::string literal(const glm::vec4& v) {
  return "vec4(" + literal(v.x) + ", " + literal(v.y) + ", " + literal(v.z) + ", " + literal(v.w) + ")";
}

// Each kind of view with each depth convention, or one of each.
std::vector<Frame> views(bool isAll = true) {
  std::vector<Frame> out;
  for (const DepthConvention depth : kDepthKinds)
    for (int view = 0; view < 4; ++view) {
      Frame frame = usualFrame();
      if (view == 1) frame.camera.far = kInfinity, frame.camera.shadowDistance = 100.0;
      if (view == 2) frame.camera = orthographic({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 20.0, 1.5, -15.0, 80.0);
      if (view == 3) frame.camera.left *= 0.3, frame.camera.up *= 1.4;
      frame.camera.depth = depth;
      out.push_back(frame);
    }
  if (!isAll) out = {out[0], out[5], out[10], out[3]};
  return out;
}

std::vector<float> depthsOf(const Camera& camera, int width, int height, Random& random, bool isEmpty = false) {
  const float background = camera.depth == DepthConvention::reversedZeroToOne ? 0.0f : 1.0f;
  std::vector<float> depths;
  for (int i = 0; i < width * height; ++i) {
    const double z = camera.projection == Projection::orthographic ? random.uniform(-14.0, 79.0) : random.logUniform(0.2, 90.0);
    const int kind = random.index(8);
    const bool isNone = isEmpty || (kind < 2 && i > 0);
    depths.push_back(isNone ? (kind == 1 ? std::numeric_limits<float>::quiet_NaN() : background)
                            : static_cast<float>(windowDepth(camera, z)));
  }
  return depths;
}

float ulps(double a, double b) {
  const float x = static_cast<float>(b);
  return static_cast<float>(std::abs(a - b) / static_cast<double>(std::nextafter(std::abs(x), 1e38f) - std::abs(x)));
}

// Equal-ratio planes within four units in the last place, for each number of slices and ranges of all ratios.
TEST_P(Parity, SdsmPlanes) {
  Gpu gpu(GetParam());
  Random random(91);
  for (const glm::vec4& law : {glm::vec4(10.0f, 0.01f, 1.0f, 1.0f), glm::vec4(-15.0f, 80.0f, 1.0f, 0.0f)})
    for (const int count : {1, 2, 3, 4, 5, 6, 8}) {
      std::vector<glm::vec4> points;
      for (int k = 0; k < 512; ++k) {
        const double near = random.logUniform(1e-3, 1e3);
        points.emplace_back(static_cast<float>(near), static_cast<float>(near * random.logUniform(1.0001, 1e5)), 0.0f,
                            static_cast<float>(random.index(count + 1)));
      }
      const auto out = gpu.run("vec4 law = " + literal(law) + ";\n  result = vec4(gnomonPlane(law, point.xy, index, " +
                                   std::to_string(count) + "), gnomonSlice(law, point.xy, index, " + std::to_string(count) + "), 0.0);\n",
                               GnomonBlock{}, points);
      for (std::size_t k = 0; k < points.size(); ++k) {
        const double near = static_cast<double>(points[k].x), far = static_cast<double>(points[k].y),
                     share = static_cast<double>(points[k].w) / count;
        const double want = law.w > 0.0f ? near * std::pow(far / near, share) : near + (far - near) * share;
        ASSERT_LE(ulps(static_cast<double>(out[k].x), want), 4.0f) << near << " " << far << " " << points[k].w << " of " << count;
      }
    }
}

// View depth, positions and bins of depth values, against the formulas in double.
TEST_P(Parity, SamplesOfAView) {
  Gpu gpu(GetParam());
  Random random(92);
  for (const Frame& frame : views(false)) {
    glm::dmat3 lsFromView;
    ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
    const SampleView view = sampleView(frame.camera, 640, 360, lsFromView);
    std::vector<glm::vec4> points;
    for (const float depth : depthsOf(frame.camera, 512, 1, random))
      points.emplace_back(depth, static_cast<float>(random.index(640)), static_cast<float>(random.index(360)), 0.0f);
    const auto out = gpu.run("vec4 law = " + literal(view.law) + ";\n  vec2 at = gnomonSamplePosition(law, " + literal(view.corner) + ", " +
                                 literal(view.pixels) + ", " + literal(view.forward) +
                                 ", ivec2(point.yz), point.x);\n  result = vec4(gnomonIsSample(law, point.x) ? 1.0 : 0.0, "
                                 "gnomonSampleDepth(law, point.x), at);\n",
                             GnomonBlock{}, points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const float d = points[k].x;
      const bool isSample = frame.camera.depth == DepthConvention::reversedZeroToOne ? d > 0.0f && d <= 1.0f : d >= 0.0f && d < 1.0f;
      ASSERT_EQ(out[k].x, isSample ? 1.0f : 0.0f) << d;
      if (!isSample) continue;
      const double z = viewDepthAt(frame.camera, static_cast<double>(d));
      const glm::dvec3 fromEye =
          viewPoint(frame.camera, (static_cast<double>(points[k].y) + 0.5) / 640.0, (static_cast<double>(points[k].z) + 0.5) / 360.0, z);
      const Axes axes(frame.camera);
      const glm::dvec3 ls =
          lsFromView * glm::dvec3(glm::dot(fromEye, axes.right), glm::dot(fromEye, axes.up), glm::dot(fromEye, axes.forward));
      const double reach = glm::length(fromEye) + 15.0 * (frame.camera.projection == Projection::orthographic);
      // A compiler may take the law for mix() and lose as much as the depth value itself cannot tell.
      const double lost = depthQuantum(frame.camera, z) * reach / std::abs(z);
      ASSERT_NEAR(out[k].y, z, 2e-6 * reach + lost);
      ASSERT_NEAR(out[k].z, ls.x, 3e-6 * reach + lost);
      ASSERT_NEAR(out[k].w, ls.y, 3e-6 * reach + lost);
    }
  }
}

// The depth values of a slice hold those of its ends, off by what a view depth may be in float32, and little more.
TEST_P(Parity, SdsmSliceDepths) {
  Gpu gpu(GetParam());
  Random random(94);
  for (const Frame& frame : views(false)) {
    const Camera& camera = frame.camera;
    const SampleView view = sampleView(camera, 640, 360, glm::dmat3(1.0));
    std::vector<glm::vec4> points;
    for (int k = 0; k < 512; ++k) {
      const bool isOrthographic = camera.projection == Projection::orthographic;
      const double near = isOrthographic ? random.uniform(-14.0, 78.0) : camera.near * random.logUniform(1.0, 500.0);
      points.emplace_back(static_cast<float>(near), static_cast<float>(near + std::abs(near) * random.logUniform(1e-4, 1.0)), 0.0f, 0.0f);
    }
    const auto out = gpu.run("vec4 law = " + literal(view.law) + ";\n  result = vec4(gnomonSliceDepths(law, point.xy), 0.0, 0.0);\n",
                             GnomonBlock{}, points);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const glm::dvec2 slice(points[k]);
      const auto ends = [&](double share) {
        const double a = windowDepth(camera, slice.x - share * std::abs(slice.x)),
                     b = windowDepth(camera, slice.y + share * std::abs(slice.y));
        return glm::dvec2(std::min(a, b), std::max(a, b));
      };
      constexpr double kLost = 3e-6, kMost = 1e-5, kRoom = 3e-6;
      ASSERT_LE(static_cast<double>(out[k].x), ends(kLost).x) << slice.x << " " << slice.y;
      ASSERT_GE(static_cast<double>(out[k].y), ends(kLost).y) << slice.x << " " << slice.y;
      ASSERT_GE(static_cast<double>(out[k].x), ends(kMost).x - kRoom) << slice.x << " " << slice.y;
      ASSERT_LE(static_cast<double>(out[k].y), ends(kMost).y + kRoom) << slice.x << " " << slice.y;
    }
  }
}

// Floats keep their order as integers, and come back.
TEST_P(Parity, OrderedFloats) {
  Gpu gpu(GetParam());
  std::vector<glm::vec4> points;
  for (const float x : {-3e38f, -1e10f, -1.0f, -1e-10f, 0.0f, 1e-10f, 0.5f, 1.0f, 1e10f, 3e38f}) points.emplace_back(x, 0.0f, 0.0f, 0.0f);
  const auto out = gpu.run(R"(
  uvec4 ordered = gnomonOrdered(vec4(point.x, -point.x, 0.0, 1.0));
  bool isRight = (ordered.x < ordered.z) == (point.x < 0.0) && (ordered.x > ordered.w) == (point.x > 1.0) && ordered.x > 0u;
  vec4 back = gnomonUnordered(ordered);
  result = vec4(isRight ? 1.0 : 0.0, back.x, back.y, gnomonUnordered(uvec4(0u)).x);
)",
                           GnomonBlock{}, points);
  for (std::size_t k = 0; k < points.size(); ++k) {
    EXPECT_EQ(out[k].x, 1.0f) << points[k].x;
    EXPECT_EQ(out[k].y, points[k].x);
    EXPECT_EQ(out[k].z, -points[k].x);
    EXPECT_EQ(out[k].w, -3e38f);
  }
}

// A slice's partition: every sample of it lies in the map, which is no larger than the solver's for the same bounds; selection finds it.
TEST_P(Parity, SdsmFitsASlice) {
  Gpu gpu(GetParam());
  Random random(93);
  int which = 0;
  for (Frame frame : views(std::string(GetParam().name) == "Glsl330")) {
    frame.shadowMap.layout = MapLayout::layers;
    frame.shadowMap.depth = kDepthKinds[which++ % 3];
    frame.shadowMap.style = static_cast<ClipStyle>(which % 2 ? 0 : which % 3);
    frame.worldSpace = which % 2 == 0;
    const auto place = solve(frame, {.split = {}, .fit = FitMode::slice});
    ASSERT_EQ(place->partitionCount, 4);
    SdsmSetup setup;
    ASSERT_EQ(sdsmSetup(frame, setup), Status::ok);
    glm::dmat3 lsFromView;
    ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
    const std::vector<float> depths = depthsOf(frame.camera, 160, 90, random);
    const DepthImage image{depths.data(), 160, 90, 160};
    SampleBounds bounds[] = {{1.5f, 11.25f, {}, {}}};
    sampleBounds(frame.camera, image, lsFromView, bounds);
    const SampleView view = sampleView(frame.camera, 160, 90, lsFromView);
    const glm::vec4 maxima(glm::dvec4(-bounds[0].least, bounds[0].most));
    std::string body = "vec4 law = " + literal(view.law) + ";\n  GnomonSdsmSetup setup = GnomonSdsmSetup(";
    for (const glm::vec4* v : {&setup.lsX, &setup.lsY, &setup.clipZ, &setup.rays, &setup.depth, &setup.style})
      body += (v == &setup.lsX ? "" : ", ") + literal(*v);
    body += ");\n  GnomonPartition map = gnomonFitSlice(setup, law, gnomon.partitions[0], gnomon.viewPlane, vec2(1.5, 11.25), vec2(0.0), " +
            literal(maxima) +
            ");\n  result = index < 4 ? map.clipFromWorld[index] : index < 8 ? map.atlasFromWorld[index - 4] : index == 8 ? map.interval : "
            "map.range;\n";
    std::vector<glm::vec4> points;
    for (int i = 0; i < 10; ++i) points.emplace_back(0.0f, 0.0f, 0.0f, static_cast<float>(i));
    const auto out = gpu.run(body, place->block, points);
    glm::mat4 clip, atlas;
    for (int i = 0; i < 4; ++i) clip[i] = out[static_cast<std::size_t>(i)], atlas[i] = out[static_cast<std::size_t>(i + 4)];
    // The solver's, from the same bounds.
    const Samples samples{.near = 1.5, .far = 11.25, .bounds = bounds};
    Frame given = frame;
    given.samples = &samples;
    given.budget.partitions = 1;
    Solution solution;
    SdsmState state;
    ASSERT_EQ(solveSdsm(given, {}, state, solution), Status::ok);
    ASSERT_EQ(solution.partitionCount, 1);
    const double lowest = frame.shadowMap.depth == DepthConvention::negativeOneToOne ? -1.0 : 0.0;
    const Axes axes(frame.camera);
    for (int p = 0; p < 160 * 90; ++p) {
      const float d = depths[static_cast<std::size_t>(p)];
      if (!(d > 0.0f && d < 1.0f)) continue;
      const double z = viewDepthAt(frame.camera, static_cast<double>(d));
      if (!(z >= 1.5 && z <= 11.25)) continue;
      const glm::dvec3 fromEye = viewPoint(frame.camera, (p % 160 + 0.5) / 160.0, (p / 160 + 0.5) / 90.0, z);
      const glm::dvec4 world(frame.camera.positionWs + fromEye - place->originWs, 1.0);
      const glm::dvec4 q = glm::dmat4(clip) * world, uv = glm::dmat4(atlas) * world;
      ASSERT_TRUE(std::abs(q.x) <= 1.0 + 1e-6 && std::abs(q.y) <= 1.0 + 1e-6 && q.z >= lowest && q.z <= 1.0 && q.w == 1.0)
          << q.x << " " << q.y << " " << q.z;
      const double v = frame.shadowMap.style == ClipStyle::direct3d ? 0.5 - 0.5 * q.y : 0.5 + 0.5 * q.y;
      ASSERT_NEAR(uv.x, 0.5 + 0.5 * q.x, 1e-5);
      ASSERT_NEAR(uv.y, v, 1e-5);
      ASSERT_NEAR(uv.z, lowest < 0.0 ? 0.5 + 0.5 * q.z : q.z, 1e-5);
      ASSERT_GE(z, static_cast<double>(out[8].x));
      ASSERT_LE(z, static_cast<double>(out[8].y));
      const double sign = frame.camera.depth == DepthConvention::reversedZeroToOne ? -1.0 : 1.0;
      ASSERT_GE(sign * static_cast<double>(d), static_cast<double>(out[8].z));
      ASSERT_LE(sign * static_cast<double>(d), static_cast<double>(out[8].w));
    }
    // Sides: the plain rectangle of the bounds; the solver's is cut by the slice and turned besides, and so no larger.
    const auto sides = [](const glm::mat4& m) {
      return glm::dvec2(2.0 / std::sqrt(static_cast<double>(m[0][0] * m[0][0] + m[1][0] * m[1][0] + m[2][0] * m[2][0])),
                        2.0 / std::sqrt(static_cast<double>(m[0][1] * m[0][1] + m[1][1] * m[1][1] + m[2][1] * m[2][1])));
    };
    const glm::dvec2 mine = sides(clip), theirs = sides(solution.partitions[0].clipFromWorld);
    EXPECT_GE(mine.x * mine.y, theirs.x * theirs.y * (1.0 - 1e-3));
    for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(mine[axis], bounds[0].most[axis] - bounds[0].least[axis], 0.02 * mine[axis]);
  }
}

// ---- whole images, by tiles and by workgroups ----

struct Reduced {
  glm::vec4 extremes, bounds;
  std::vector<std::uint32_t> counts;
};

constexpr int kBins = 64;

// The CPU's answer in the GPU's form.
Reduced reference(const Frame& frame, const std::vector<float>& depths, int width, int height, const SampleView& view,
                  const glm::vec2& interval, const std::vector<float>& edges) {
  Reduced out{glm::vec4(-3e38f), glm::vec4(-3e38f), std::vector<std::uint32_t>(kBins)};
  const DepthImage image{depths.data(), width, height, width};
  const bool isReversed = frame.camera.depth == DepthConvention::reversedZeroToOne;
  for (int p = 0; p < width * height; ++p) {
    const float d = depths[static_cast<std::size_t>(p)];
    if (!(isReversed ? d > 0.0f && d <= 1.0f : d >= 0.0f && d < 1.0f)) continue;
    out.extremes = glm::max(out.extremes, glm::vec4(-d, d, 0.0f, 0.0f));
    if (!(d >= interval.x && d <= interval.y)) continue;
    const float t = isReversed ? 1.0f - d : d, u = isReversed ? d : 1.0f - d;
    float z = view.law.x * u + view.law.y * t;
    if (view.law.w > 0.0f) z = 1.0f / z;
    const glm::vec2 at = glm::vec2(view.corner) + glm::vec2(view.pixels) * (static_cast<float>(p % width) + 0.5f) +
                         glm::vec2(view.pixels.z, view.pixels.w) * (static_cast<float>(p / width) + 0.5f);
    const glm::vec2 ls = view.law.w > 0.0f ? (at + glm::vec2(view.forward)) * z : at + glm::vec2(view.forward) * z;
    out.bounds = glm::max(out.bounds, glm::vec4(-ls, ls));
  }
  sampleHistogram(frame.camera, image, edges, out.counts);
  return out;
}

void expectSame(const Reduced& got, const Reduced& want, bool hasCounts) {
  EXPECT_EQ(got.extremes.x, want.extremes.x);
  EXPECT_EQ(got.extremes.y, want.extremes.y);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(got.bounds[i], want.bounds[i], 4e-6 * (std::abs(static_cast<double>(want.bounds[i])) + 100.0)) << i;
  if (hasCounts) {
    EXPECT_EQ(got.counts, want.counts);
  }
}

GLuint floatTexture(int width, int height, GLint format, GLenum layout, const void* data) {
  GLuint texture = 0;
  gl::GenTextures(1, &texture);
  gl::BindTexture(GL_TEXTURE_2D, texture);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  gl::TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, layout, GL_FLOAT, data);
  return texture;
}

// Level by level, as gnomon_samples.glsl says.
glm::vec4 reduceByTiles(const std::string& version, GLuint depths, int width, int height, const std::string& first,
                        const std::string& before) {
  const char* const vertex =
      "void main() { vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(p * 2.0 - 1.0, 0.0, 1.0); }\n";
  const auto program = [&](const std::string& value) {
    return buildProgram(
        version,
        {{GL_VERTEX_SHADER, vertex},
         {GL_FRAGMENT_SHADER, "#include \"gnomon_sdsm.glsl\"\nuniform highp sampler2D level;\nlayout(location = 0) out vec4 result;\n" +
                                  before + "#define VALUE(pixel) " + value + R"(
void main() {
  vec4 all;
  GNOMON_REDUCE_TILE(all, ivec2(gl_FragCoord.xy), textureSize(level, 0), VALUE)
  result = all;
}
)"}});
  };
  const GLuint firstProgram = program(first), nextProgram = program("texelFetch(level, pixel, 0)");
  GLuint source = depths, frame = 0;
  gl::GenFramebuffers(1, &frame);
  gl::BindFramebuffer(GL_FRAMEBUFFER, frame);
  glm::vec4 out(0.0f);
  for (bool isFirst = true; isFirst || width > 1 || height > 1; isFirst = false) {
    width = (width + 15) / 16;
    height = (height + 15) / 16;
    const GLuint target = floatTexture(width, height, GL_RGBA32F, GL_RGBA, nullptr);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, target, 0);
    gl::BindTexture(GL_TEXTURE_2D, source);
    gl::Viewport(0, 0, width, height);
    gl::UseProgram(isFirst ? firstProgram : nextProgram);
    gl::DrawArrays(GL_TRIANGLES, 0, 3);
    if (!isFirst) gl::DeleteTextures(1, &source);
    source = target;
  }
  gl::ReadPixels(0, 0, 1, 1, GL_RGBA, GL_FLOAT, &out.x);
  gl::DeleteTextures(1, &source);
  gl::DeleteFramebuffers(1, &frame);
  gl::DeleteProgram(firstProgram);
  gl::DeleteProgram(nextProgram);
  EXPECT_EQ(gl::GetError(), static_cast<GLenum>(GL_NO_ERROR));
  return out;
}

// What a buffer holds; OpenGL ES reads it no other way.
void readBuffer(GLuint buffer, std::size_t bytes, void* out) {
  gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
  const void* mapped = gl::MapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>(bytes), GL_MAP_READ_BIT);
  ASSERT_NE(mapped, nullptr);
  std::memcpy(out, mapped, bytes);
  gl::UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

// One dispatch: extremes, bounds of an interval and a histogram.
std::string groupKernel(const std::string& before) {
  const std::string bins = std::to_string(kBins);
  return "#include \"gnomon_sdsm.glsl\"\nlayout(local_size_x = 16, local_size_y = 16) in;\nuniform highp sampler2D level;\n" + before + R"(
layout(std430, binding = 0) buffer Maxima { uvec4 extremes, bounds; uint counts[)" +
         bins + R"(]; };
layout(std430, binding = 1) readonly buffer Edges { float edges[)" +
         bins + R"( + 1]; };
shared vec4 scratch[256];
shared uint held[)" +
         bins + R"(];
#define EDGE(i) edges[i]
void main() {
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = textureSize(level, 0);
  bool isIn = pixel.x < size.x && pixel.y < size.y;
  float depth = isIn ? texelFetch(level, pixel, 0).r : -1.0;
  uint at = gl_LocalInvocationIndex;
  if (at < )" +
         bins + R"(u) held[at] = 0u;
  GNOMON_REDUCE_GROUP(scratch, at, gnomonExtremes(law, depth))
  if (at == 0u) GNOMON_JOIN(extremes, scratch[0])
  barrier();
  GNOMON_REDUCE_GROUP(scratch, at, gnomonBoundsOf(law, gnomonSamplePosition(law, corner, pixels, forward, pixel, depth), depth, interval))
  if (at == 0u) GNOMON_JOIN(bounds, scratch[0])
  int bin;
  if (gnomonIsSample(law, depth)) {
    GNOMON_FIND_BIN(bin, law, depth, )" +
         bins + R"(, EDGE)
    atomicAdd(held[bin], 1u);
  }
  barrier();
  if (at < )" +
         bins + R"(u && held[at] > 0u) atomicAdd(counts[at], held[at]);
}
)";
}

Reduced reduceByGroups(const std::string& version, GLuint depths, int width, int height, const std::string& before,
                       const std::vector<float>& edges) {
  const GLuint program = buildProgram(version, {{GL_COMPUTE_SHADER, groupKernel(before)}});
  GLuint buffers[2] = {};
  gl::GenBuffers(2, buffers);
  std::vector<std::uint32_t> words(8 + kBins, 0u);
  gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[0]);
  gl::BufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(words.size() * 4), words.data(), GL_DYNAMIC_DRAW);
  gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[1]);
  gl::BufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(edges.size() * 4), edges.data(), GL_STATIC_DRAW);
  gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffers[0]);
  gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffers[1]);
  gl::BindTexture(GL_TEXTURE_2D, depths);
  gl::UseProgram(program);
  gl::DispatchCompute(static_cast<GLuint>((width + 15) / 16), static_cast<GLuint>((height + 15) / 16), 1);
  gl::MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  readBuffer(buffers[0], words.size() * 4, words.data());
  gl::DeleteBuffers(2, buffers);
  gl::DeleteProgram(program);
  EXPECT_EQ(gl::GetError(), static_cast<GLenum>(GL_NO_ERROR));
  const auto unordered = [](std::uint32_t x) {
    if (x == 0u) return -3e38f;
    x = (x & 0x80000000u) != 0u ? x & 0x7fffffffu : ~x;
    float out;
    std::memcpy(&out, &x, 4);
    return out;
  };
  Reduced out;
  for (int i = 0; i < 4; ++i)
    out.extremes[i] = unordered(words[static_cast<std::size_t>(i)]), out.bounds[i] = unordered(words[static_cast<std::size_t>(4 + i)]);
  out.counts.assign(words.begin() + 8, words.end());
  return out;
}

struct Image {
  int width, height;
  bool isEmpty;
};
constexpr Image kImages[] = {{1, 1, false}, {1, 1, true}, {17, 9, false}, {17, 9, true}, {1280, 720, false}, {1920, 1080, false}};

// Every view at the small sizes, one of each convention at the large ones.
void forEachImage(const std::function<void(const Frame&, const Image&, const std::vector<float>&, const SampleView&, const glm::vec2&,
                                           const std::string&)>& visit) {
  Random random(94);
  const std::vector<Frame> frames = views();
  for (const Image& image : kImages)
    for (std::size_t f = 0; f<frames.size(); f += image.width> 100 ? 5 : 1) {
      const Frame& frame = frames[f];
      glm::dmat3 lsFromView;
      ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
      const SampleView view = sampleView(frame.camera, image.width, image.height, lsFromView);
      const double a = windowDepth(frame.camera, 2.0), b = windowDepth(frame.camera, 30.0);
      const glm::vec2 interval(static_cast<float>(std::min(a, b)), static_cast<float>(std::max(a, b)));
      const std::string before = "const vec4 law = " + literal(view.law) + ", corner = " + literal(view.corner) +
                                 ", pixels = " + literal(view.pixels) + ", forward = " + literal(view.forward) +
                                 ";\nconst vec2 interval = vec2(" + literal(interval.x) + ", " + literal(interval.y) + ");\n";
      visit(frame, image, depthsOf(frame.camera, image.width, image.height, random, image.isEmpty), view, interval, before);
    }
}

std::vector<float> edgesOf(const Camera& camera) {
  std::vector<float> edges(kBins + 1);
  windowEdges(camera, camera.projection == Projection::orthographic ? 1.0 : 0.2, 79.0, edges);
  return edges;
}

TEST(SdsmReduction, TilesAgree) {
  for (const bool isEs : {false, true}) {
    const auto context = isEs ? createContext(Backend::egl, 3, 0, Profile::es) : createContext(defaultBackend(), 3, 3);
    gl::load(*context);
    GLuint vertexArray = 0;
    gl::GenVertexArrays(1, &vertexArray);
    gl::BindVertexArray(vertexArray);
    forEachImage([&](const Frame& frame, const Image& image, const std::vector<float>& depths, const SampleView& view,
                     const glm::vec2& interval, const std::string& before) {
      if (isEs && image.width > 100) return;
      const GLuint texture = floatTexture(image.width, image.height, GL_R32F, GL_RED, depths.data());
      Reduced got;
      const std::string version = isEs ? "300 es" : "330 core", depth = "texelFetch(level, pixel, 0).r";
      got.extremes = reduceByTiles(version, texture, image.width, image.height, "gnomonExtremes(law, " + depth + ")", before);
      got.bounds = reduceByTiles(
          version, texture, image.width, image.height,
          "gnomonBoundsOf(law, gnomonSamplePosition(law, corner, pixels, forward, pixel, " + depth + "), " + depth + ", interval)", before);
      gl::DeleteTextures(1, &texture);
      expectSame(got, reference(frame, depths, image.width, image.height, view, interval, edgesOf(frame.camera)), false);
    });
    gl::DeleteVertexArrays(1, &vertexArray);
  }
}

TEST(SdsmReduction, WorkgroupsAgree) {
  for (const bool isEs : {false, true}) {
    const auto context = isEs ? createContext(Backend::egl, 3, 1, Profile::es) : createContext(defaultBackend(), 4, 5);
    gl::load(*context);
    forEachImage([&](const Frame& frame, const Image& image, const std::vector<float>& depths, const SampleView& view,
                     const glm::vec2& interval, const std::string& before) {
      if (isEs && image.width > 100) return;
      const GLuint texture = floatTexture(image.width, image.height, GL_R32F, GL_RED, depths.data());
      const std::vector<float> edges = edgesOf(frame.camera);
      const Reduced got = reduceByGroups(isEs ? "310 es" : "450", texture, image.width, image.height, before, edges);
      gl::DeleteTextures(1, &texture);
      expectSame(got, reference(frame, depths, image.width, image.height, view, interval, edges), true);
    });
  }
}

constexpr int kBoxes = 96;

// The whole of it: extremes, bounds of four slices, the block with the cull planes, and which boxes cast into which map.
std::vector<std::string> wholeKernels(const SdsmSetup& setup, const SampleView& view) {
  std::string before = R"(
#define GNOMON_NO_UNIFORM
#include "gnomon_sdsm.glsl"
uniform highp sampler2D level;
layout(std140) uniform Place { GnomonBlock place; };
layout(std430, binding = 0) buffer Maxima { uvec4 extremes, bounds[4]; };
layout(std140, binding = 1) buffer Made { GnomonBlock made; };
layout(std430, binding = 2) buffer Cull { vec4 planes[4 * GNOMON_MAX_PARTITIONS]; uint maps; };
layout(std430, binding = 3) buffer Casters { vec4 boxes[)" +
                       std::to_string(2 * kBoxes) + R"(]; uint counts[4], draws[)" + std::to_string(4 * 5 * kBoxes) + R"(]; };
shared vec4 scratch[256];
const vec4 law = )" + literal(view.law) +
                       ", corner = " + literal(view.corner) + ", pixels = " + literal(view.pixels) +
                       ", forward = " + literal(view.forward) + ";\nconst GnomonSdsmSetup setup = GnomonSdsmSetup(";
  for (const glm::vec4* v : {&setup.lsX, &setup.lsY, &setup.clipZ, &setup.rays, &setup.depth, &setup.style})
    before += (v == &setup.lsX ? "" : ", ") + literal(*v);
  before += ");\n";
  const std::string group = before + R"(
layout(local_size_x = 16, local_size_y = 16) in;
void main() {
  uint at = gl_LocalInvocationIndex;
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = textureSize(level, 0);
  float depth = pixel.x < size.x && pixel.y < size.y ? texelFetch(level, pixel, 0).r : -1.0;
)";
  return {group + R"(
  GNOMON_REDUCE_GROUP(scratch, at, gnomonExtremes(law, depth))
  if (at == 0u) GNOMON_JOIN(extremes, scratch[0])
}
)",
          group + R"(
  vec2 range = gnomonShadowedRange(setup, law, gnomonUnordered(extremes));
  vec2 position = gnomonSamplePosition(law, corner, pixels, forward, pixel, depth);
  for (int i = 0; i < 4; ++i) {
    GNOMON_REDUCE_GROUP(scratch, at, gnomonBoundsOf(law, position, depth, gnomonSliceDepths(law, gnomonSlice(law, range, i, 4))))
    if (at == 0u && scratch[0].x > -3e38) GNOMON_JOIN(bounds[i], scratch[0])
    barrier();
  }
}
)",
          before + R"(
layout(local_size_x = 1) in;
void main() {
  GNOMON_FINISH(made, place, setup, law, gnomonUnordered(extremes), bounds, 4)
  GNOMON_FINISH_CULL(planes, maps, made)
}
)",
          before + R"(
layout(local_size_x = 32) in;
void main() {
  int box = int(gl_GlobalInvocationID.x), map = int(gl_GlobalInvocationID.y);
  bool isIn;
  GNOMON_CULL_BOX(isIn, planes, map, boxes[2 * box].xyz, boxes[2 * box + 1].xyz)
  draws[5 * ()" +
              std::to_string(kBoxes) +
              R"( * map + box) + 1] = isIn ? 1u : 0u;  // instances, of count, instances, first, base vertex, base instance
  if (isIn) atomicAdd(counts[map], 1u);
}
)"};
}

// Every kernel in every dialect that has compute shaders, as SPIR-V where it has that.
TEST(SdsmReduction, KernelsCompileInEveryDialect) {
  const Frame frame = usualFrame();
  SdsmSetup setup;
  ASSERT_EQ(sdsmSetup(frame, setup), Status::ok);
  const SampleView view = sampleView(frame.camera, 64, 36, glm::dmat3(1.0));
  std::vector<std::string> kernels = wholeKernels(setup, view);
  kernels.push_back(groupKernel("const vec4 law = " + literal(view.law) + ", corner = " + literal(view.corner) +
                                ", pixels = " + literal(view.pixels) + ", forward = " + literal(view.forward) +
                                ";\nconst vec2 interval = vec2(0.25, 0.5);\n"));
  using check::GlslTarget;
  const std::pair<const char*, GlslTarget> dialects[] = {
      {"430", GlslTarget::validate}, {"430", GlslTarget::openGl},      {"450", GlslTarget::openGl},    {"450", GlslTarget::vulkan},
      {"460", GlslTarget::vulkan},   {"310 es", GlslTarget::validate}, {"310 es", GlslTarget::vulkan}, {"320 es", GlslTarget::vulkan}};
  for (const auto& [version, target] : dialects)
    for (const std::string& kernel : kernels) {
      check::GlslSource source(kernel);
      source.version = version;
      const check::GlslResult result = check::compileGlsl(check::GlslStage::compute, source, target);
      ASSERT_TRUE(result.isFine) << version << "\n" << result.log;
      if (target != GlslTarget::validate) {
        EXPECT_EQ(check::validateSpirv(result.spirv, target), "") << version;
      }
    }
}

// The whole of it on the GPU: two reductions and one invocation, and the buffer is the block that shaders read. Every sample that may be
// shadowed is found in its partition's map; empty slices are gone; an empty view has none.
void makeOnTheGpu(const std::string& version, bool isAll) {
  Random random(95);
  int which = 0;
  for (Frame frame : views(isAll)) {
    frame.shadowMap.depth = kDepthKinds[++which % 3];
    frame.worldSpace = which % 2 == 0;
    frame.camera.shadowDistance = 60.0;
    constexpr int kWidth = 65, kHeight = 33;
    std::vector<float> depths = depthsOf(frame.camera, kWidth, kHeight, random, which == 5);
    if (which % 4 == 0)  // a gap: nothing at middle depths
      for (float& d : depths)
        if (const double z = viewDepthAt(frame.camera, static_cast<double>(d)); d == d && z > 3.0 && z < 35.0) d = depths[0];
    glm::dmat3 lsFromView;
    SdsmSetup setup;
    ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
    ASSERT_EQ(sdsmSetup(frame, setup), Status::ok);
    const SampleView view = sampleView(frame.camera, kWidth, kHeight, lsFromView);
    const auto place = solve(frame, {.split = {}, .fit = FitMode::slice});
    ASSERT_EQ(place->partitionCount, 4);
    std::vector<GLuint> programs;
    for (const std::string& kernel : wholeKernels(setup, view)) programs.push_back(buildProgram(version, {{GL_COMPUTE_SHADER, kernel}}));
    const GLuint texture = floatTexture(kWidth, kHeight, GL_R32F, GL_RED, depths.data());
    struct Casters {
      glm::vec4 boxes[2 * kBoxes];
      std::uint32_t counts[4], draws[4 * 5 * kBoxes];
    };
    const auto casters = std::make_unique<Casters>();
    for (int i = 0; i < kBoxes; ++i) {
      const glm::vec3 at = glm::vec3(random.direction() * random.logUniform(1.0, 200.0));
      const auto size = static_cast<float>(random.logUniform(0.01, 20.0));
      casters->boxes[2 * i] = glm::vec4(at - size, 0.0f);
      casters->boxes[2 * i + 1] = glm::vec4(at + size, 0.0f);
    }
    GLuint buffers[5] = {};
    gl::GenBuffers(5, buffers);
    const std::vector<std::uint32_t> zeros(20, 0u);
    gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[0]);
    gl::BufferData(GL_SHADER_STORAGE_BUFFER, 80, zeros.data(), GL_DYNAMIC_DRAW);
    gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[1]);
    gl::BufferData(GL_SHADER_STORAGE_BUFFER, sizeof(GnomonBlock), nullptr, GL_DYNAMIC_DRAW);
    gl::BindBuffer(GL_UNIFORM_BUFFER, buffers[2]);
    gl::BufferData(GL_UNIFORM_BUFFER, sizeof(GnomonBlock), &place->block, GL_STATIC_DRAW);
    gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffers[0]);
    gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffers[1]);
    gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffers[2]);
    gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[3]);
    gl::BufferData(GL_SHADER_STORAGE_BUFFER, 64 * 16 + 16, nullptr, GL_DYNAMIC_DRAW);
    gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[4]);
    gl::BufferData(GL_SHADER_STORAGE_BUFFER, sizeof(Casters), casters.get(), GL_DYNAMIC_DRAW);
    gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, buffers[3]);
    gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, buffers[4]);
    const glm::uvec2 groups[] = {
        {(kWidth + 15) / 16, (kHeight + 15) / 16}, {(kWidth + 15) / 16, (kHeight + 15) / 16}, {1, 1}, {kBoxes / 32, 4}};
    for (std::size_t pass = 0; pass < programs.size(); ++pass) {
      gl::UseProgram(programs[pass]);
      gl::DispatchCompute(groups[pass].x, groups[pass].y, 1);
      gl::MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_UNIFORM_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    }
    auto made = std::make_unique<GnomonBlock>();
    readBuffer(buffers[1], sizeof(GnomonBlock), made.get());
    readBuffer(buffers[4], sizeof(Casters), casters.get());
    gl::DeleteBuffers(5, buffers);
    gl::DeleteTextures(1, &texture);
    for (const GLuint each : programs) gl::DeleteProgram(each);
    ASSERT_EQ(gl::GetError(), static_cast<GLenum>(GL_NO_ERROR));

    // Which boxes cast: those with a corner on the inner side of each of the map's sides.
    for (unsigned m = 0; m < 4; ++m) {
      std::uint32_t passed = 0;
      for (unsigned b = 0; b < kBoxes; ++b) {
        bool isIn = m < made->info.x, isClose = false;
        for (int side = 0; side < 4 && m < made->info.x; ++side) {
          const glm::dmat4 clip(made->partitions[m].clipFromWorld);
          double most = -kInfinity;
          for (int corner = 0; corner < 8; ++corner) {
            const glm::vec4 *least = &casters->boxes[2 * b], *greatest = least + 1;
            const glm::dvec4 q = clip * glm::dvec4((corner & 1 ? greatest : least)->x, (corner & 2 ? greatest : least)->y,
                                                   (corner & 4 ? greatest : least)->z, 1.0);
            most = std::max(most, q.w + (side % 2 ? -1.0 : 1.0) * q[side / 2]);
          }
          isIn = isIn && most >= 0.0;
          isClose = isClose || std::abs(most) < 1e-3;  // float32 decides
        }
        const std::uint32_t instances = casters->draws[5 * (kBoxes * m + b) + 1];
        passed += instances;
        EXPECT_TRUE(isClose || instances == (isIn ? 1u : 0u)) << m << " " << b;
      }
      EXPECT_EQ(casters->counts[m], passed);
    }

    if (which == 5) {
      EXPECT_EQ(made->info.x, 0u);
      EXPECT_EQ(selectByViewDepth(*made, 1.0f), -1);
      continue;
    }
    EXPECT_LE(made->info.x, 4u);
    if (which % 4 != 0) {
      EXPECT_EQ(made->info.x, 4u);
    }
    int samples = 0;
    for (int p = 0; p < kWidth * kHeight; ++p) {
      const float d = depths[static_cast<std::size_t>(p)];
      if (!(frame.camera.depth == DepthConvention::reversedZeroToOne ? d > 0.0f && d <= 1.0f : d >= 0.0f && d < 1.0f)) continue;
      const double z = viewDepthAt(frame.camera, static_cast<double>(d));
      if (z > 60.0 * (1.0 - 1e-6)) continue;
      ++samples;
      const glm::dvec3 world =
          frame.camera.positionWs + viewPoint(frame.camera, (p % kWidth + 0.5) / kWidth, (p / kWidth + 0.5) / kHeight, z) - place->originWs;
      const int index = selectByViewDepth(*made, static_cast<float>(viewDepth(*made, world)));
      ASSERT_GE(index, 0) << which << " " << z;
      ASSERT_LT(index, static_cast<int>(made->info.x)) << which << " " << z;
      const glm::dvec4 bounds(made->partitions[index].uvBounds);
      const glm::dvec4 at = glm::dmat4(made->partitions[index].atlasFromWorld) * glm::dvec4(world, 1.0);  // w is 1
      ASSERT_TRUE(at.x >= bounds.x - 1e-6 && at.x <= bounds.z + 1e-6 && at.y >= bounds.y - 1e-6 && at.y <= bounds.w + 1e-6 && at.z >= 0.0 &&
                  at.z <= 1.0)
          << which << " " << z << " " << at.x << " " << at.y << " " << at.z;
    }
    EXPECT_GT(samples, 500);
  }
}

TEST(SdsmReduction, BlockIsMadeOnTheGpu) {
  for (const bool isEs : {false, true}) {
    const auto context = isEs ? createContext(Backend::egl, 3, 1, Profile::es) : createContext(defaultBackend(), 4, 5);
    gl::load(*context);
    makeOnTheGpu(isEs ? "310 es" : "450", !isEs);
  }
}

}  // namespace
}  // namespace gnomon::test
