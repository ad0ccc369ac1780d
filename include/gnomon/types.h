// types: what goes into a solve and what comes out of it, and every reason a solve can be refused.
//
// Names carry spaces: ws world, vs view (x right, y up, z forward, origin at the eye), ls light (x and y in the
// light plane, z along the light), clip the shadow map's, atlas its texture. Matrices are destinationFromSource, column
// vectors, column-major. Positions are double; only the block is float.
// Shader part: none.
// Test: tests/types_test.cpp
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "gnomon/block.h"

namespace GNOMON_EXPORT gnomon {

inline constexpr int kMaxPartitions = GNOMON_MAX_PARTITIONS;
inline constexpr int kMaxCullPlanes = 32;
inline constexpr int kMaxTextureSide = 16384;  // texels; the least maximum that desktop GL 4.x drivers share
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Why a solve was refused. statusField() names the input, statusRule() says what it must be.
enum class Status : std::uint8_t {
  ok,
  cameraPosition,
  cameraForward,
  cameraUp,
  cameraNear,
  cameraFar,
  cameraInfiniteFar,
  cameraShadowDistance,
  cameraFovY,
  cameraAspect,
  cameraHeight,
  cameraTangents,
  cameraViewMatrix,
  cameraProjectionMatrix,
  corners,
  lightDirection,
  imageSize,
  receiverBox,
  casterBox,
  halfSpace,
  marginFilter,
  marginNormalOffset,
  marginBlend,
  marginBorder,
  marginMotion,
  marginTexels,
  fade,
  budgetPartitions,
  budgetResolution,
  budgetTexels,
  budgetAtlas,
  budgetTargetError,
  splitLambda,
  splitBias,
  splitBiasOrder,
  splitExplicit,
  splitCount,
  stableAutomatic,
  stableCorners,
  stableWorldSpace,
  warpEta,
  rowsZeta,
  rowsSigma,
  rowsMaxRows,
  rowsMaxColumns,
  rowsReach,
  samplesMissing,
  samplesNear,
  samplesFar,
  samplesHistogram,
  samplesWeights,
  samplesBounds,
  samplesLatency,
  sdsmHysteresis,
  autoPass,
  autoTexel,
  autoFit,
  autoSearch,
  autoHysteresis,
  biasSlope,
  biasConstant,
  worldSpacePrecision,
  floatRange,
};

// The input that a status is about, as CASE.json spells it ("camera.near"), and the rule it broke
// ("must be a finite number > 0"). Never null.
[[nodiscard]] const char* statusField(Status status) noexcept;
[[nodiscard]] const char* statusRule(Status status) noexcept;

// What still works but deserves a look: bits of Solution::warnings.
enum class Warning : std::uint32_t {
  worldSpacePrecision = 1u << 0,  // float32 world-space matrices lose over a tenth of a texel here
  viewDepthSelection = 1u << 1,  // the camera's depth buffer cannot tell neighbouring splits apart: select by view depth
  targetMissed = 1u << 2,  // the target error needs more maps or texels than the budget allows
  atlasReduced = 1u << 3,  // maps were scaled down alike to fit the atlas, or one would be longer than it
  regionSimplified = 1u << 4,  // more half-spaces cut the view than a cell can hold: the rest were ignored (maps cover more)
  facesMissing = 1u << 5,  // face partitions need more maps than allowed, or the view has no faces to use: z-partitions instead
  rowsWaste = 1u << 6,  // the rows allowed are too few for zeta: more of each is wasted
};
inline constexpr int kWarningCount = 7;
[[nodiscard]] const char* warningText(Warning warning) noexcept;

// A depth buffer's convention: normalised depth at near and far. Window depth (gl_FragCoord.z) is 0..1 for the first two.
enum class DepthConvention : std::uint8_t { negativeOneToOne, zeroToOne, reversedZeroToOne };

enum class Projection : std::uint8_t { perspective, orthographic };

// A camera. Right-handed world; right = forward x up. Helpers that fill it: gnomon/camera.h.
struct Camera {
  glm::dvec3 positionWs{0.0};
  glm::dvec3 forwardWs{0.0, 0.0, -1.0};  // any length
  glm::dvec3 upWs{0.0, 1.0, 0.0};  // any length, not along forward
  Projection projection = Projection::perspective;
  // Where the view volume ends left, right, down and up, positive outward: tangents of the half angles (perspective),
  // half extents in world units (orthographic). Each may be <= 0 (off-axis); left + right and down + up must be > 0.
  double left = 1.0, right = 1.0, down = 1.0, up = 1.0;
  double near = 0.1;  // view depth; > 0 for perspective, any finite number for orthographic
  double far = 1000.0;  // view depth > near; may be kInfinity for perspective, with a shadowDistance
  double shadowDistance = kInfinity;  // view depth beyond which nothing is shadowed; below near it leaves nothing
  DepthConvention depth = DepthConvention::negativeOneToOne;  // of the camera's own depth buffer (32-bit float)
};

struct DirectionalLight {
  glm::dvec3 directionWs{0.0, -1.0, 0.0};  // from the light to the scene, any length
};

struct ImageSize {
  double width = 1920.0, height = 1080.0;  // pixels, > 0
};

// Axis-aligned world box; flat ones and points are allowed, min <= max.
struct Box {
  glm::dvec3 minWs, maxWs;
};

// What the scene holds; every part may be empty. The arrays must live while the frame is used: keepMaps() and seamJump() read them after a
// solve.
struct Scene {
  std::span<const Box> receivers = {};  // what must be shadowed: their union; none: the whole view volume
  std::span<const Box> casters = {};  // what can cast; none: anything can, and depth is clamped
  std::span<const glm::dvec4> planes = {};  // half-spaces a x + b y + c z + d >= 0 that receivers keep to
};

// Where the samples of an interval of view depths lie on the light plane: light space of lightForSamples() (gnomon/samples.h).
// Samples whose depth the buffer cannot tell from an end's count on both sides of it: either may be selected.
struct SampleBounds {
  double near, far;  // view depths, near <= far
  glm::dvec2 least, most;  // least <= most
};

// What the view samples: nothing else needs shadow [Lauritzen 2010]. gnomon/samples.h reduces a depth buffer to it.
struct Samples {
  double near = kInfinity, far = -kInfinity;  // least and greatest view depth sampled; as they stand, nothing was
  std::span<const std::uint32_t> histogram =
      {};  // samples in bins of equal ratio over [near, far]; empty ones need no shadow; none: all may
  std::span<const double> weights = {};  // one for each bin: what an error there counts for optimal splits [>= 0]; none: 1
  std::span<const SampleBounds> bounds = {};  // depths that none of them holds are not sampled; none given: anywhere in view
  glm::dvec3 rightWs{0.0};  // right of the camera that bounds were taken from, any length; 0: the frame's
  // World units that the camera may have moved since they were taken; a turn by an angle (radians) adds that times the distance of the
  // farthest sample, whose view depth it changes by as much [>= 0]
  double latency = 0.0;
};

// Room around what must be shadowed.
struct Margin {
  double filter = 0.0;  // texels a filter reaches sideways [>= 0]
  // Texels that a receiver is moved sideways before it is looked up [>= 0]. The bias moves it 1.21 Bias::slope times the filter's reach
  // (0.5 without one, 1.5 of 3x3, 2 of the tent), and Bias::constant more, at most, where texels are square: room for that keeps each tap
  // inside.
  double normalOffset = 0.0;
  double blend = 0.0;  // share of a slice, at its far end, that the next map covers too [0, 1)
  int border = 0;  // texels kept free around each viewport in the atlas [0, 1024]
  double motion[kMaxPartitions] = {};  // for each map: world units of room on every side, so that it can be kept (gnomon/keep.h) [>= 0]
};

// How the shadow map's API lays out clip space and texture.
//   openGl:   y up, v = 0 at clip y = -1      vulkan: y down, v = 0 at clip y = -1      direct3d: y up, v = 0 at clip y = +1
enum class ClipStyle : std::uint8_t { openGl, vulkan, direct3d };

enum class MapLayout : std::uint8_t {
  atlas,  // rectangles of different sizes in one texture
  layers,  // one square layer of an array texture for each map
};

struct ShadowMap {
  DepthConvention depth = DepthConvention::zeroToOne;  // not the camera's
  ClipStyle style = ClipStyle::openGl;
  MapLayout layout = MapLayout::atlas;
};

// What may be spent. One of resolution and texels decides (texels where both are given).
struct Budget {
  int partitions = 4;  // maps [1, kMaxPartitions]
  int resolution = 2048;  // each allowed map has resolution x resolution texels, in any aspect [1, kMaxTextureSide]
  double texels = 0.0;  // total for all maps; 0: use resolution
  glm::ivec2 atlas{0, 0};  // largest atlas; 0: kMaxTextureSide
  double targetError = 1.0;  // texel edges per pixel width that `count = automatic` must reach [> 0]
};

// How far the shader moves a receiver along its geometric normal before it looks up.
struct Bias {
  double slope = 1.0;  // times the least that keeps a plane from shadowing itself, given the texel and the filter [>= 0]
  double constant = 0.03125;  // longest texel stretches, added: curved surfaces and rounding [>= 0]
};

// Everything that is the same for every method.
struct Frame {
  Camera camera;
  // A view volume that is not the camera's: eight points, bit 0 of the index right, bit 1 up, bit 2 far. Its six faces must be flat to 1e-4
  // of its size and its inside convex; none given: the camera's own. What lies outside the camera's near plane and shadow distance is left
  // out. The camera still gives the depth axis, the width of a pixel and the depth buffer that selects. See enclose() in gnomon/camera.h.
  std::span<const glm::dvec3> cornersWs = {};
  DirectionalLight light;
  ImageSize image;
  Scene scene;
  const Samples* samples = nullptr;  // what the view samples; null: all of it
  Margin margin;
  ShadowMap shadowMap;
  Budget budget;
  Bias bias;
  double fade = 0.0;  // share of the shadowed depth range, at its far end, over which shadows fade [0, 1]
  bool worldSpace = false;  // matrices take world positions instead of world - camera position (warned far from the origin)
};

// Certified maxima over the interval a partition serves, in pixel widths w_i (gnomon/error.h).
struct TexelError {
  double s = 0.0;  // texel edge along s over w_i
  double t = 0.0;  // texel edge along t over w_i
  double extent = 0.0;  // longest stretch of a texel over w_i
};

// Which warp a map has (gnomon/warp.h).
enum class Warp : std::uint8_t { none, lispsm, psm, tsm, eta, least };

inline constexpr int kMaxPartitionPlanes = 4;

// One shadow map.
struct Partition {
  double near = 0.0, far = 0.0;  // view depths served, half-open; closed where no partition begins at far
  glm::mat4 clipFromWorld{1.0f};  // takes world - Solution::originWs, unlike the planes below; the block holds these same floats
  glm::ivec4 viewport{0};  // x, y, width, height in texels; rows counted from v = 0
  int layer = 0;  // of an array texture; 0 in an atlas
  TexelError error;
  Warp warp = Warp::none;
  int planeCount = 0;
  glm::dvec4 planes[kMaxPartitionPlanes];  // absolute world half-spaces >= 0 served, beside the interval; none where depth alone decides
  int cullPlaneCount = 0;
  glm::dvec4 cullPlanes[kMaxCullPlanes];  // absolute world half-spaces >= 0, unit normals: together they hold every caster this map needs
};

struct Solution {
  Status status = Status::ok;
  int refusedIndex = -1;  // which box, plane or split; -1 where the field is not a list
  double refusedValue = 0.0;  // the value refused (the first bad component of a vector)
  std::uint32_t warnings = 0;  // bits of Warning
  glm::dvec3 originWs{0.0};  // what the matrices' input is relative to
  int partitionCount = 0;
  glm::ivec2 atlas{0, 0};  // texels; the size of a layer with MapLayout::layers
  int layers = 0;  // 1 for an atlas, 0 with nothing to shadow
  bool depthClamp = false;  // casters nearer to the light than the depth range must be clamped onto it
  double maxError = 0.0;  // largest of every partition's s and t
  double neededTexels = 0.0;  // sum of s t width height: texels for error 1 everywhere, shares free
  double storageFactor = 0.0;  // neededTexels over the image's pixels
  double limitTexels = 0.0;  // the least that any parameterization of one light plane needs (gnomon/error.h); 0 where unknown
  Partition partitions[kMaxPartitions];
  GnomonBlock block{};  // upload as is
};

}  // namespace gnomon
