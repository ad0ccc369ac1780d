// lloyd: warping, z-partitions and face partitions, alone and combined, judged by the texels they need.
//
// Based on: [Lloyd 2006]; a composition of region -> split or face -> footprint -> fit -> warp -> atlas -> block.
// Differences from the paper: any camera, light and cut region; every warp of gnomon/warp.h; `best` compares the schemes, minimax splits
// where there are two to sixteen receivers, and rows by error of the light plane [Tang 2017], in up to four columns where the view is cut.
// Shader part: glsl/gnomon_lloyd.glsl
// Test: tests/lloyd_test.cpp
#pragma once

#include "gnomon/face.h"
#include "gnomon/maps.h"
#include "gnomon/minimax.h"
#include "gnomon/split.h"
#include "gnomon/types.h"
#include "gnomon/warp.h"

namespace GNOMON_EXPORT gnomon {

enum class LloydScheme : std::uint8_t {
  w,  // one warped map
  zp,  // z-partitions, not warped
  zpw,  // z-partitions, each warped
  fpw,  // face partitions, each warped
  fpzpw,  // face partitions in rows, each warped
  // Whichever of them needs the fewest texels, with any count of maps that the budget allows: by Warp::least, or LiSPSM where that is less.
  // Fewer maps spend the texels of all (but layers, whose side is the resolution).
  best,
};

struct LloydSettings {
  LloydScheme scheme = LloydScheme::zpw;
  SplitSettings split = {};  // of z-partitions
  bool minimax = false;  // z-partitions by what their maps need (gnomon/minimax.h): of split, count and automatic alone are then read
  WarpSettings warp{.warp = Warp::lispsm, .eta = 0.0};  // zp has none, best takes its own
  Shares shares = Shares::error;
  NearFace nearFace = NearFace::own;
  bool rows = true;  // best may choose rows of the light plane (gnomon/rows.h)
};

// Partitions for one directional light. No heap, no globals, no exceptions. Views that have no faces to use, or fewer maps allowed than
// faces, get z-partitions instead and the warning facesMissing. On any refusal the answer has no partitions and its block reads as lit.
// Returns solution.status.
Status solveLloyd(const Frame& frame, const LloydSettings& settings, Solution& solution) noexcept;

// Storage factors for f / n = alpha and k slices, in closed form: light overhead without and with warps (at eta >= 0), the least any
// parameterization reaches, and light from behind with slices and with faces in k rows (theta = 45 degrees).
[[nodiscard]] double storageOverheadZp(double alpha, double halfFovTangent, int k) noexcept;  // [Lloyd 2006, eq. 17]
[[nodiscard]] double storageOverheadZpW(double alpha, double halfFovTangent, int k) noexcept;  // [Lloyd 2006, eq. 18]
[[nodiscard]] double storageOverheadOptimal(double alpha, double halfFovTangent) noexcept;  // [Lloyd 2006, sec. 5.3]
[[nodiscard]] double storageBehindZp(double alpha, int k) noexcept;  // [Lloyd 2006, eq. 20]
[[nodiscard]] double storageBehindFpZpW(double alpha, int k) noexcept;  // [Lloyd 2006, eq. 21]

}  // namespace gnomon
