// maps: the stages that every method shares, before it chooses its slices (region, light space) and after: footprint -> fit -> warp ->
// atlas -> block.
//
// Shader part: none.
// Test: tests/maps_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/split.h"
#include "gnomon/types.h"
#include "gnomon/warp.h"

namespace GNOMON_EXPORT gnomon {

// How the budget's texels are shared between maps.
enum class Shares : std::uint8_t {
  equal,
  error,  // so that every map ends with the same error  [Lloyd 2006, eq. 13 and 14 generalised]
};

// A rectangle of the light plane, in the light space of the solve: coordinates along an axis, which is unit, and across it.
struct LightRectangle {
  glm::dvec2 axis, least, size;
};

struct MapSettings {
  FitMode fit = FitMode::tight;
  WarpSettings warp;  // of tight fits
  const LightRectangle* rectangles = nullptr;  // for each slice, instead of the least one; doubled: along (1, 0); null: none
  const Footprint* whole = nullptr;  // the region's, which rows are cut from; null: each column's own is made
  Shares shares = Shares::equal;
  const WarpHint* hints = nullptr;  // where the search of each slice's least warp begins; null: everywhere
  double most = kInfinity;  // texels: fitting stops once the sum will exceed this; neededTexels is then a lower bound
  double gain = kInfinity;  // for maps that are fitted again: how many times fewer texels than before those still to come may need
  int chained = 0;  // where > 0, each slice's search but the first begins with the map before's and tries so many shapes beside it
};

// What every method begins with: checks the frame and the splits, makes region and light space, sets Solution::originWs. Errors: those of
// validate() for frame and splits, of makeRegion and of makeLightSpace; the solution then says what was refused.
[[nodiscard]] Status beginSolve(const Frame& frame, const SplitSettings& splitting, FitMode fit, Region& region, LightSpace& light,
                                Solution& solution) noexcept;

// What every slice's map looks like before it has a place.
struct MapFits {
  Footprint footprints[kMaxPartitions];
  Served served[kMaxPartitions];  // filled where hasServed
  MapFit fits[kMaxPartitions];
  WarpShape shapes[kMaxPartitions];  // filled where slices are warped
  double pixels[kMaxPartitions];  // the least w_i that each serves
  double neededTexels = 0.0;  // of all fits
  bool hasServed = false;
  bool byViewDepth = false;  // shaders select by view depth (needsViewDepth)
};

// A slice's map as the hint for one that is much like it.
[[nodiscard]] WarpHint hintOf(const MapFits& maps, int slice, int trials) noexcept;

// The first half: what a method may compare before it chooses.
void fitMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
             bool byViewDepth, MapFits& maps) noexcept;

// The same with another warp, of slices that fitMaps has looked at with one.
void refitMaps(const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings, MapFits& maps) noexcept;

// Shares::error: of all texels, for each slice's map, summing to 1. False where nothing needs any.
[[nodiscard]] bool shareTexels(const Frame& frame, const Splits& splits, const MapFits& maps, double* shares) noexcept;

// The second half: places them all and writes the partitions, their errors and the block. Slices that hold nothing get no map, but keep
// their place in the atlas. maps: what fitMaps made of the same splits and settings; grows to the viewports. Solution::originWs is read.
// Errors: marginTexels, budgetAtlas, worldSpacePrecision, stableWorldSpace, floatRange.
[[nodiscard]] Status placeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits,
                               const MapSettings& settings, MapFits& maps, Solution& solution) noexcept;

// Both, one after the other.
[[nodiscard]] Status makeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits,
                              const MapSettings& settings, Solution& solution) noexcept;

}  // namespace gnomon
