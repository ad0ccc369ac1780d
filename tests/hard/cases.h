// hard: views, lights and scenes where shadow code is known to fail, in named families, and every method on them. A case is a seed; a family that
// it belongs to is named in `families`, so that a failure says what it is about. What is expected of every one is the same: finite numbers that
// cover what they claim as sharply as predicted, or a refusal with a reason (tests/hard_test.cpp).
//
// family                 what is hard about it                               what it has broken ("here": in this solver, mended)
// scaled                 a world of 1e-9 to 1e9 of the usual size            bevy: texels rounded in world units; here: lengths past float32's range
// moved                  an eye 1e4 to 1e9 from the origin                   godot#29690, filament#7241, PlayCanvas; here: snapped maps short of a texel
// axis-forward, axis-up  the view, or its up, exactly along an axis          MJP's samples: a fixed up vector
// up-along-forward       up within 1e-6 to 1e-2 of forward                   here: view axes that were not orthogonal
// light                  along, against, 1e-15 to 1e-3 beside an axis        webgpu-samples#353: light straight down, no shadow; MJP's samples: NaN
// thin                   far over near of 1.0001 to 1.1
// deep                   far over near of 1e4 to 1e9                         ogre#1321: reversed depth
// aspect                 0.05 to 20                                          here: a point in a view 43 times wider than high was cut away
// fov                    0.5 to 5 and 120 to 175 degrees
// orthographic           near before, at and behind the eye                  godot#58332, bevy#7797, playcanvas#7932
// off-axis               a tangent of zero, negative, thrice the other       godot#123399: asymmetric frusta lost
// infinite-far           an infinite far plane, a shadow distance            godot#95944, Babylon.js#14343; here: reversed infinite depth
// shadow-distance        the view ends before its far plane, or after it     bgfx: the last cascade ends at 621 of 2000
// eyes                   two canted cameras, enclosed by eight corners
// receivers              few, flat, points, lines, behind the eye,           here: nine boxes in a row took 55 times the texels of the same box whole
//                        enclosing it, touching a plane, hundreds
// planes                 half-spaces of any length, up to forty
// casters                huge, tiny, around everything                       bevy#8645, godot#89702; here: receivers outside a warp's depth range
// one-map, sixteen       the least and the most maps                         CascadedShadowMaps11: index -1
// one-texel, texels,     a texel a map, any total, any atlas                 here: more texels than any texture has, past int's range
//   odd-atlas
// margins, blend,        any                                                 o3de#7183, Babylon.js#7394: gaps between maps; here: a margin past
//   motion, image                                                            int's range
// world-space            matrices that take world positions                  here: a warp's w rounded as if it did not move
// poison                 a field zero, subnormal, huge, infinite or NaN      ogre#1519, filament#6293, Falcor: NaN
#pragma once

#include "support.h"

#include <cstdlib>
#include <string>

namespace gnomon::test {

// A frame and all that it points to.
struct HardCase {
  Frame frame;
  std::vector<Box> receivers, casters;
  std::vector<glm::dvec4> planes;
  Samples samples;
  std::vector<std::uint32_t> histogram;
  std::vector<double> weights;
  std::vector<SampleBounds> bounds;
  std::vector<glm::dvec3> cloud;  // what was sampled, relative to the eye
  std::vector<Camera> eyes;  // whose views the corners enclose
  glm::dvec3 cornersWs[8];
  double near = 0.0, far = 0.0;  // of what is shadowed
  bool isPoisoned = false;
  bool isFromDepths = false;  // samples are depth values: shaders compare those, so that a quantum is not known
  bool mayBeSnapped = false;  // a snapped map needs two texels a side
  std::string families;
  bool is(Random& random, int oneIn, const char* family) {
    if (random.index(oneIn) != 0) return false;
    families += std::string(" ") + family;
    return true;
  }
};

void makeHardCase(Random& random, bool isSampled, HardCase& c);

// Points a frame at what its case holds, after a change of that.
void attach(HardCase& c);

// A method under settings drawn by chance, which it puts into words.
struct HardMethod {
  const char* name;
  bool isSampled;  // wants samples in its cases
  std::string (*solve)(HardCase& c, Random& random, Solution& solution);
};
inline constexpr int kHardMethodCount = 6;
extern const HardMethod kHardMethods[kHardMethodCount];

// Unrelated streams: the generator's own increment would give the same one, shifted.
inline Random hardRandom(std::uint64_t seed) { return Random(seed * 0xd6e8feb86659fd93ULL); }

// Of all that a solution says, to the bit.
[[nodiscard]] std::uint64_t hashOf(const Solution& solution);

}  // namespace gnomon::test
