// warp: a projective map of the light plane for each slice, denser where pixels are narrower.
//
// Based on: [Lloyd 2006, sec. 4] with the errata. A frame of length D along an axis of the light plane; W0 <= W1 the least pixel widths
// at its two ends; r = W1 / W0; the projection's centre lies n' = D / (r^p - 1) before it: p = 0 none, 1/2 LiSPSM, 1 PSM, in between by
// eta [eq. 11 with alpha = r]; TSM puts the point of width sqrt(W0 W1) on the 80 % line. For an overhead light these are the paper's
// n + sqrt(f n) and n; as r -> 1 every warp fades to the plain fit.
//   least   the fewest texels over all four parameters of a projective map, two-point ("diamond") maps included
// Differences from the paper: W0 and W1 are taken so that they change continuously with the light (see solver/warp.cpp); where the
// least rectangle needs fewer texels it is taken instead; TSM never warps past PSM.
// Shader part: none.
// Test: tests/warp_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/footprint.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

struct WarpSettings {
  Warp warp = Warp::none;
  double eta = 0.0;  // with Warp::eta: -1 none, 0 LiSPSM, 1 PSM [-1, 1]
};

// Errors: warpEta; value: what was refused.
[[nodiscard]] Status validate(const WarpSettings& settings, double& value) noexcept;

// A projective map of the light plane. With U and v the coordinates along the axis at angle phi and across it, U from 0 to L on
// the footprint and v = 0 on the line through the eye, d = (e^kappa - 1) / L:
//   w = 1 + d U    s = (U + tau v) / w    t = (v + sigma U) / w
struct WarpShape {
  double phi, kappa, sigma, tau;
};

// Where the search of the least warp may begin, besides the rectangle and its sides, instead of everywhere: the shape of a map that is much
// like this one.
struct WarpHint {
  WarpShape shape;  // its kappa for each unit of log(widest pixel / narrowest)
  int trials;  // shapes tried from the best of them; 0: none, the shape is taken as it is
  bool isThorough = false;  // everywhere, and from it as well
};

// Replaces the rectangle that `fit` holds by a warped map, where that needs fewer texels. axis: along which named warps run (unit,
// light plane; zero: none). Returns the shape taken.
WarpShape warpFit(const WarpSettings& settings, const LightSpace& light, const Footprint& footprint, const Served& served,
                  const glm::dvec2& axis, MapFit& fit, const WarpHint* hint = nullptr) noexcept;

// n' / n of a warp with parameter eta for pixel widths of ratio alpha >= 1; infinite for eta = -1 or alpha = 1.  [Lloyd 2006, eq. 11
// corrected]
[[nodiscard]] double warpDistance(double eta, double alpha) noexcept;

// The inverse: eta of a distance >= 1 in units of n.
[[nodiscard]] double warpEta(double distance, double alpha) noexcept;

// The greatest errors along x and z, M_x and M_z, of one map over a whole view under an overhead light, with f / n = alpha and every
// resolution 1: Lloyd's widths. halfFovTangent: tan(theta); distance: n' / n.  [Lloyd 2006, eq. 9 and 10 corrected]
[[nodiscard]] glm::dvec2 overheadErrors(double alpha, double halfFovTangent, double distance) noexcept;

}  // namespace gnomon
