// Blending at seams: mixed and dithered.
#include "parity.h"

namespace gnomon::test {
namespace {

const char* const kMapIsLit = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return layer * 0.25; }\n";

// A lookup in map i answers i / 4: the mixed result over depth has no step, and is i / 4 where one map serves alone.
TEST_P(Parity, BlendMixesWithoutASeam) {
  Gpu gpu(GetParam());
  for (const bool byWindow : {false, true}) {
    Frame frame = usualFrame();
    frame.margin.blend = 0.2;
    frame.shadowMap.layout = MapLayout::layers;
    const auto solution = solve(frame);
    ASSERT_EQ(solution->partitionCount, 4);
    std::vector<glm::vec4> points;
    std::vector<double> depths;
    for (int k = 0; k <= 4000; ++k) {
      const double z = 0.1 * std::pow(1000.0, k / 4000.0 * 0.9999);
      depths.push_back(z);
      const double window = 100.0 / 99.9 * (1.0 - 0.1 / z);
      points.emplace_back(glm::vec3(viewPoint(frame.camera, 0.3, 0.6, z)), static_cast<float>(window));
    }
    for (int i = 0; i + 1 < 4; ++i)  // at the seams, where rounding decides who serves
      for (int k = -20; k <= 20; ++k) {
        const double z = solution->partitions[i].far * (1.0 + k * 1e-7);
        depths.push_back(z);
        points.emplace_back(glm::vec3(viewPoint(frame.camera, 0.3, 0.6, z)), static_cast<float>(100.0 / 99.9 * (1.0 - 0.1 / z)));
      }
    const std::string select =
        byWindow ? "gnomonSelectWindow(gnomon, point.w)" : "gnomonSelectView(gnomon, gnomonViewDepth(gnomon, world))";
    const auto out = gpu.run("index = " + select + R"(;
  float weight = gnomonBlendWeight(gnomon, index, gnomonViewDepth(gnomon, world));
  float lit = gnomonShadow(gnomon, 0, index, world, vec3(0.0));
  if (weight > 0.0) lit = mix(lit, gnomonShadow(gnomon, 0, index + 1, world, vec3(0.0)), weight);
  result = vec4(lit, weight, float(index), 0.0);
)",
                             solution->block, points, kMapIsLit);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double z = depths[k];
      int index = 0;
      while (index + 1 < 4 && solution->partitions[index + 1].near <= z) ++index;
      const double band = 0.2 * (solution->partitions[index].far - solution->partitions[index].near);
      const double share = index + 1 < 4 ? std::clamp(1.0 - (solution->partitions[index].far - z) / band, 0.0, 1.0) : 0.0;
      const double want = 0.25 * (index + share);
      ASSERT_NEAR(out[k].x, want, 1e-4) << "view depth " << z << " byWindow " << byWindow;
    }
  }
}

// Dithering: as many picks of the next map as the weight says, over any patch of pixels.
TEST_P(Parity, BlendDithersByTheWeight) {
  Gpu gpu(GetParam());
  const auto solution = solve(usualFrame());
  for (const float weight : {0.0f, 0.1f, 0.25f, 0.5f, 0.9f, 1.0f}) {
    const std::vector<glm::vec4> points(512 * 64, glm::vec4(weight, 0, 0, 2));
    const auto out = gpu.run("result = vec4(float(gnomonBlendDither(index, point.x, gl_FragCoord.xy)));\n", solution->block, points);
    for (int patch = 0; patch < 16; ++patch) {  // 32 x 64 pixels each
      double next = 0.0;
      for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 32; ++x) {
          const float index = out[static_cast<std::size_t>(y * 512 + patch * 32 + x)].x;
          ASSERT_TRUE(index == 2.0f || index == 3.0f);
          next += index == 3.0f;
        }
      EXPECT_NEAR(next / (32.0 * 64.0), weight, 0.02) << weight;
    }
  }
}

}  // namespace
}  // namespace gnomon::test
