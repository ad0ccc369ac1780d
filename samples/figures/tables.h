// tables: the figures of [Lloyd 2006] as rows of numbers, from the matrices that a solve emits and, where one exists, from the closed form.
//
// Emitted values are Lloyd's widths, by differentiating the partition's float matrix at the vertices of what it serves: the width of a texel
// along a line of constant t, and the spacing of such lines. The library's own predictions are texel edges, which are longer by 1 / cos of
// the shear (include/gnomon/error.h); columns that hold them are named "edges".
// Views are square, at the origin, resolutions 1; theta is half the angle of view.
// Shader part: none.
// Test: tests/figures_test.cpp
#pragma once

#include <string>
#include <vector>

#include "gnomon/gnomon.h"

namespace gnomon::figures {

// Rows of numbers under named columns; NaN where there is no value.
struct Table {
  std::string name;  // of the file, without its extension
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
};

// Text with a line of names; NaN as an empty field.
[[nodiscard]] std::string csv(const Table& table);

// Widths of a texel of a map at a point (position - Solution::originWs), world units: x on a line of constant t, z between two such lines.
// t is the direction that the map is warped along, or of the view where it is not warped.
[[nodiscard]] glm::dvec2 lloydWidths(const Frame& frame, const Partition& map, const glm::dvec3& fromOrigin);

// M_x and M_z of a map over what it serves, with resolutions 1: texels are counted across the part served, not across the viewport, which
// is a little larger. Perspective views without receivers.
[[nodiscard]] glm::dvec2 lloydErrors(const Frame& frame, const Solution& solution, const Partition& map);

// S: the sum of M_x M_z over the maps.  [Lloyd 2006, eq. 12]
[[nodiscard]] double lloydStorage(const Frame& frame, const Solution& solution);

// A square view with far / near = alpha and near 1, looking along -z, y up, under a light of that direction (from the light to the scene).
[[nodiscard]] Frame squareView(double alpha, double halfFovTangent, const glm::dvec3& lightWs, int maps);

// One solve. Throws std::runtime_error where it is refused or a face partition is missing.
void solve(const Frame& frame, LloydScheme scheme, const WarpSettings& warp, Solution& solution);

// The storage factor of faces under light from behind with that many maps: the near plane's, and rows dealt evenly to the four
// sides, what is left one each. storageBehindFpZpW is the case where nothing is left. maps >= 5.
[[nodiscard]] double storageBehindFaces(double alpha, int maps);

[[nodiscard]] Table errorAlongView();  // Fig. 5: f/n = 20, theta = 30 degrees
[[nodiscard]] Table errorAgainstWarp();  // Fig. 6: f/n = 100
[[nodiscard]] Table storageOverLights();  // Fig. 7: f/n = 1000; x and y: the light's place in the disc, overhead at 0, behind at x = -1
[[nodiscard]] Table storageAgainstSlices();  // Fig. 10: f/n = 1000
[[nodiscard]] Table storageAgainstMaps();  // Fig. 12: f/n = 1000
[[nodiscard]] Table facesAgainstSlices();  // Fig. 13: the f/n below which faces need fewer texels than slices
[[nodiscard]] Table worstOverLights(double stepDegrees);  // sec. 5.3: the worst of all lights over light from behind
[[nodiscard]] Table warpsAgainstLight();  // sec. 4.3 and its retraction: f/n = 100, light turned from overhead to behind

}  // namespace gnomon::figures
