// Where there is no shadow: faded, outside every map, refused, cleared.
#include <cstddef>
#include <cstring>

#include "parity.h"

namespace gnomon::test {
namespace {

TEST_P(Parity, FadeAndOutside) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.camera.shadowDistance = 50.1;
  frame.fade = 0.2;  // from 40.1 to 50.1
  const auto solution = solve(frame);
  std::vector<glm::vec4> points;
  for (const float z : {-1.0f, 0.1f, 40.0f, 40.1f, 42.6f, 45.1f, 50.0f, 50.1f, 60.0f}) points.emplace_back(z, 0.0f, 0.0f, 0.0f);
  const auto fades = gpu.run("  result = vec4(gnomonFade(gnomon, point.x));\n", solution->block, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(fades[i].x, std::clamp((50.1 - points[i].x) / 10.0, 0.0, 1.0), 1e-5) << points[i].x;
  // Far to the side of the first map: outside, lit.
  const auto outside =
      gpu.run("  result = vec4(gnomonAtlas(gnomon, 0, world).w, gnomonShadow(gnomon, 0, 0, world, vec3(0.0, 1.0, 0.0)), 0.0, 0.0);\n",
              solution->block, {{1000.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 900.0f, 0.0f}});
  for (const glm::vec4& each : outside) {
    EXPECT_EQ(each.x, 0.0f);
    EXPECT_EQ(each.y, 1.0f);
  }
}

// A refused solve's block: nothing served, all lit, nothing that is not finite.
TEST_P(Parity, ARefusedBlockIsLit) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.camera.near = std::nan("");
  const auto solution = solve(frame);
  ASSERT_NE(solution->status, Status::ok);
  std::vector<glm::vec4> points;
  Random random(95);
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.01, 1e6)), static_cast<float>(random.uniform()));
  const auto results = gpu.run(
      "  int at = gnomonSelect(gnomon, point.w, world);\n  result = vec4(at, gnomonShadow(gnomon, 0, at, world, vec3(0.0, 1.0, 0.0)), "
      "gnomonFade(gnomon, gnomonViewDepth(gnomon, world)), "
      "gnomonSelectView(gnomon, gnomonViewDepth(gnomon, world)));\n",
      solution->block, points);
  for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(-1.0f, 1.0f, 1.0f, -1.0f));
}

// Index -1 reads no partition: the memory before the array is laid out so that a map there would cover everything.
TEST_P(Parity, NoPartitionReadsNothing) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  clearBlock(block);
  block.lightDirection = {0.0f, -1.0f, 0.0f, 0.0f};
  const std::ptrdiff_t before =
      static_cast<std::ptrdiff_t>(offsetof(GnomonBlock, partitions)) - static_cast<std::ptrdiff_t>(sizeof(GnomonPartition));
  const auto put = [&](std::size_t offset, const std::vector<float>& values) {
    std::memcpy(reinterpret_cast<std::byte*>(&block) + before + static_cast<std::ptrdiff_t>(offset), values.data(),
                values.size() * sizeof(float));
  };
  put(offsetof(GnomonPartition, atlasFromWorld), {1e-3f, 0, 0, 0, 0, 0, 1e-3f, 0, 0, 1e-3f, 0, 0, 0.5f, 0.5f, 0.5f, 1.0f});
  put(offsetof(GnomonPartition, uvBounds), {0.0f, 0.0f, 1.0f, 1.0f});
  const std::vector<glm::vec4> points{{0.0f, 0.0f, 0.0f, -1.0f}, {1.0f, 2.0f, 3.0f, -1.0f}};
  const std::string dark = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 0.0; }\n";
  const auto results = gpu.run(
      "  vec3 up = vec3(0.0, 1.0, 0.0);\n  result = vec4(gnomonShadow(gnomon, 0, index, world, up), gnomonShadow3x3(gnomon, 0, index, "
      "world, up), "
      "gnomonShadowTent(gnomon, 0, index, world, up), 1.0);\n",
      block, points, dark);
  for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(1.0f));
}

// A cleared block over memory that is not a number: what its partitions hold is never used.
TEST_P(Parity, AClearedBlockIsLitWhateverItHeld) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  std::fill_n(reinterpret_cast<float*>(&block), sizeof block / sizeof(float), std::nanf(""));
  clearBlock(block);
  std::vector<glm::vec4> points;
  Random random(99);
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.01, 1e6)), static_cast<float>(random.uniform()));
  points.emplace_back(0.0f, 0.0f, 0.0f, std::numeric_limits<float>::infinity());
  points.emplace_back(0.0f, 0.0f, 0.0f, std::nanf(""));
  for (const std::string shadow : {"gnomonShadow", "gnomonShadow3x3", "gnomonShadowTent"}) {
    const auto results = gpu.run(
        "  int at = gnomonSelect(gnomon, point.w, world);\n  float z = gnomonViewDepth(gnomon, world);\n  result = vec4(at, mix(1.0, " +
            shadow +
            "(gnomon, 0, at, world, vec3(0.0, 1.0, 0.0)), gnomonFade(gnomon, z)), gnomonFade(gnomon, z), gnomonSelectView(gnomon, z));\n",
        block, points);
    for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(-1.0f, 1.0f, 1.0f, -1.0f));
  }
}

}  // namespace
}  // namespace gnomon::test
