// face: the view volume's sides, as the light sees them, each a wedge of the light plane that can be split into rows.
//
// Based on: [Lloyd 2006, sec. 5.1 and 5.2] with the errata: light rays that go with the view (l . v >= 0) are narrowest where they enter
// the view volume, so the sides with N . l < 0 are used; against it (l . v < 0) those with N . l > 0, where they leave it. A side's wedge
// lies between the planes through its two edges and the light; its rows are cut where rays meet the side at the view depths n (f/n)^(i/k).
// Differences from the paper: any frustum, cut regions (each side's rows span what the region fills of it); no side that holds nothing.
// Shader part: glsl/gnomon_lloyd.glsl selects by the planes.
// Test: tests/face_test.cpp
#pragma once

#include "gnomon/footprint.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class NearFace : std::uint8_t {
  own,  // the near plane gets a map
  stretched,  // it is shared among the sides' first rows
};

// Splits the region into at most `most` wedges: for each side that holds something the same number of rows. splits.count is 0 where
// there are no sides to use (orthographic views), or where `most` is less than one map for each of them, and one for NearFace::own.
void splitFaces(const Region& region, const LightSpace& light, NearFace nearFace, int most, bool inRows, Splits& splits) noexcept;

}  // namespace gnomon
