// parity: what the shaders' answers are compared with, in double and by other formulas than the library's, and the views they are tried on.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "gpu.h"
#include "support.h"

namespace gnomon::test {

// Window depth of a view depth in the closed forms of the errata to [Zhang 2006, sec. 3.6].
[[nodiscard]] double windowReference(const Camera& camera, double z);

[[nodiscard]] double floatStep(double x);

// The partition that serves a depth, in double: intervals are half-open where the next one begins.
inline constexpr int kMayDiffer = -2;  // too close to an end: rounding may decide
[[nodiscard]] int servedAtWindow(const Frame& frame, const Solution& solution, double windowDepth);
[[nodiscard]] int servedAtView(const Frame& frame, const Solution& solution, double z);

struct Setting {
  std::string name;
  Frame frame;
  PssmSettings settings;
};

// Five views by three camera depths by 1, 4 and 16 maps; the map's depth, the fit, the clip style and the light turn so that every
// pair of them meets. gapped: receivers of the last view.
[[nodiscard]] std::vector<Setting> allSettings(const std::vector<Box>& gapped);

// Points that the partitions serve, taken in turn by chance; w: the partition.
[[nodiscard]] std::vector<glm::vec4> pointsInMaps(Random& random, const Frame& frame, const Solution& solution, int count);

// Where a map's own matrix, viewport and clip style put a point: texels of the atlas, rows from v = 0, and stored depth.
[[nodiscard]] glm::dvec3 texelReference(const Frame& frame, const Partition& map, const glm::dvec3& world);

// World vectors in the light plane that move the lookup by one texel along s and along t: central differences, in double.
[[nodiscard]] std::array<glm::dvec3, 2> measuredEdges(const Frame& frame, const Solution& solution, int k, const glm::dvec3& world);
[[nodiscard]] std::array<glm::dvec3, 2> measuredEdges(const glm::dvec3& light, const std::function<glm::dvec2(const glm::dvec3&)>& texelAt,
                                                      const glm::dvec3& world, double step);

class Parity : public ::testing::TestWithParam<Dialect> {
 protected:
  const std::vector<Box> gapped_{{{-3, -3, -9}, {3, 3, -2}}, {{-90, -90, -400}, {90, 90, -200}}};
};

}  // namespace gnomon::test
