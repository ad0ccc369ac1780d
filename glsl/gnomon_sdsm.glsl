// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: sample distribution shadow maps on the GPU [Lauritzen 2010]: from the extremes of the depth values to equal-ratio splits, and
//              from each slice's bounds to its partition, as the solver writes it: nothing is read back. Reductions: gnomon_samples.glsl.
// use:         1. reduce gnomonExtremes() over the depth buffer
//              2. near, far of the view: vec2 range = gnomonShadowedRange(setup, law, extremes); slice i of count: gnomonSlice(law, range, i, count);
//                 reduce gnomonBoundsOf() over the depth buffer for each, interval gnomonSliceDepths(law, slice)
//              3. one invocation: GNOMON_FINISH(made, place, setup, law, extremes, bounds, count) writes the block `made` of a buffer, which the
//                 host then binds to gnomonUniforms. place: the block of any solve of the frame with as many partitions, in square viewports:
//                 FitMode::slice or layers. bounds: an array of uvec4 as GNOMON_JOIN leaves it. Everything else gnomon::sdsmSetup() gives.
//              4. indirect draws: GNOMON_FINISH_CULL in the same invocation, then GNOMON_CULL_BOX for each box and map
//              samples/offscreen/sampled_maps.cpp is all of it, both reductions and the draw
// cost:        one invocation; a reduction for the extremes, one for each slice's bounds
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_SDSM_GLSL
#define GNOMON_SDSM_GLSL

#include "gnomon_samples.glsl"

struct GnomonSdsmSetup {
  vec4 lsX;    // the light plane's axes and the row of clip depth, for world - origin
  vec4 lsY;
  vec4 clipZ;
  vec4 rays;   // x: distance from the eye over view depth at the view's corners, 1 if orthographic; y: rounding of a position, over its
               // distance from the eye; z: width of a pixel over view depth, w: the same width at depth 0
  vec4 depth;  // x, y: view depths that may be shadowed; z: rounding of a depth value; w: world units of latency, and of
               // rounding where the origin is not the eye
  vec4 style;  // x: 1, or -1 for ClipStyle::direct3d's v; y: 1, or -1 for ClipStyle::vulkan's clip y; z: texels of margin; w: 1 where clip depth runs from -1
};

// Nearest and farthest view depth of the maxima of gnomonExtremes().
vec2 gnomonSampledRange(vec4 law, vec4 extremes) {
  if (extremes.y < 0.0) return vec2(3e38, -3e38);
  float a = gnomonSampleDepth(law, -extremes.x), b = gnomonSampleDepth(law, extremes.y);
  return vec2(min(a, b), max(a, b));
}

// The same of what may be shadowed.
vec2 gnomonShadowedRange(GnomonSdsmSetup setup, vec4 law, vec4 extremes) {
  vec2 range = gnomonSampledRange(law, extremes);
  return vec2(max(range.x, setup.depth.x), min(range.y, setup.depth.y));
}

// The count-th root of x >= 1. pow() may be off in its last bits, by a lot on some devices: one Newton step mends it. y: what is left, relative.
vec2 gnomonImplRoot(float x, int count) {
  float root = pow(x, 1.0 / float(count));
  for (int i = 0; i < 2; ++i) {
    float power = 1.0;
    for (int k = 0; k < count; ++k) power *= root;
    float rest = (x - power) / (power * float(count));
    if (i == 1) return vec2(root, rest);
    root += root * rest;
  }
  return vec2(root, 0.0);
}

// Plane i of count + 1: from the nearer end, so that few factors are multiplied.
float gnomonPlane(vec4 law, vec2 range, int i, int count) {
  if (i <= 0) return range.x;
  if (i >= count) return range.y;
  if (law.w == 0.0) return range.x + (range.y - range.x) * (float(i) / float(count));
  vec2 root = gnomonImplRoot(range.y / range.x, count);
  bool isNear = 2 * i <= count;
  int steps = isNear ? i : count - i;
  float power = 1.0;
  for (int k = 0; k < steps; ++k) power *= root.x;
  power += power * root.y * float(steps);
  return isNear ? range.x * power : range.y / power;
}

// Near and far view depth of a slice.
vec2 gnomonSlice(vec4 law, vec2 range, int i, int count) { return vec2(gnomonPlane(law, range, i, count), gnomonPlane(law, range, i + 1, count)); }

// gl_FragCoord.z at a view depth.
float gnomonWindowDepth(vec4 law, float viewDepth) {
  float t = law.w > 0.0 ? (law.x - 1.0 / viewDepth) / (law.x - law.y) : (viewDepth - law.x) / (law.y - law.x);
  float u = law.w > 0.0 ? (1.0 / viewDepth - law.y) / (law.x - law.y) : (law.y - viewDepth) / (law.y - law.x);
  return law.z < 0.0 ? u : t;
}

const float gnomonImplViewRounding = 4e-6;   // relative, of a slice's end (four units in the last place) and of the samples' view depths: 32 units
const float gnomonImplDepthRounding = 1e-6;  // of a depth value near 1, from gnomonWindowDepth and from rasterization: 8 units in the last place
const float gnomonImplSteps = 4.0;           // roundings that add up: of gnomonViewDepth's products, of gnomonWindowDepth's operations

// The depth values of a slice, with what float32 depth cannot tell from its ends: for gnomonBoundsOf().
vec2 gnomonSliceDepths(vec4 law, vec2 slice) {
  vec2 ends = slice + gnomonImplViewRounding * vec2(-abs(slice.x), abs(slice.y));
  float a = gnomonWindowDepth(law, ends.x), b = gnomonWindowDepth(law, ends.y), least = min(a, b), most = max(a, b);
  float room = law.z < 0.0 ? gnomonImplDepthRounding * most : gnomonImplDepthRounding;
  return vec2(least - room, most + room);
}

// How far view depths may lie apart and still share a depth value.
float gnomonImplQuantum(vec4 law, vec4 depth, float viewDepth) {
  if (law.w == 0.0) return depth.z * (law.y - law.x);
  float rounding = law.z < 0.0 ? depth.z * (gnomonWindowDepth(law, viewDepth) + law.y / (law.x - law.y)) : depth.z;
  return rounding * viewDepth * viewDepth * (law.x - law.y);
}

// A slice's partition. bounds: the maxima of gnomonBoundsOf(); joined: 1 where a partition adjoins at the near end (x), at the far end (y).
GnomonPartition gnomonFitSlice(GnomonSdsmSetup setup, vec4 law, GnomonPartition place, vec4 viewPlane, vec2 slice, vec2 joined, vec4 bounds) {
  GnomonPartition map = place;
  float quantum = max(gnomonImplQuantum(law, setup.depth, slice.y), gnomonImplSteps * setup.rays.y * slice.y);
  float reach = (abs(slice.y) + quantum) * setup.rays.x;
  float room = setup.depth.w + quantum * setup.rays.x + setup.rays.y * reach;
  vec2 least = -bounds.xy - room, most = bounds.zw + room;
  vec2 pixel = vec2(setup.rays.z * slice.x + setup.rays.w), size = max(most - least, pixel), texels = place.viewport.zw;
  least = 0.5 * (least + most - size);
  vec2 texel = size / max(texels - 2.0 * setup.style.z, vec2(1.0));
  least -= setup.style.z * texel;
  size = texel * texels;
  vec4 x = setup.lsX * (2.0 / size.x), y = setup.lsY * (2.0 / size.y);
  x.w -= least.x * (2.0 / size.x) + 1.0;
  y.w -= least.y * (2.0 / size.y) + 1.0;
  vec4 w = vec4(0.0, 0.0, 0.0, 1.0), z = setup.clipZ;
  map.clipFromWorld = transpose(mat4(x, setup.style.y * y, z, w));
  vec2 extent = place.uvBounds.zw - place.uvBounds.xy;
  vec4 u = (0.5 * x + 0.5 * w) * extent.x + w * place.uvBounds.x;
  vec4 v = (0.5 * setup.style.x * setup.style.y * y + 0.5 * w) * extent.y + w * place.uvBounds.y;
  map.atlasFromWorld = transpose(mat4(u, v, setup.style.w > 0.0 ? 0.5 * (z + w) : z, w));
  float viewNear = slice.x - (joined.x > 0.0 ? 0.0 : quantum), viewFar = slice.y + (joined.y > 0.0 ? 0.0 : quantum);
  float sign = law.z, pad = gnomonImplSteps * setup.depth.z;
  float windowNear = sign * gnomonWindowDepth(law, slice.x) - (joined.x > 0.0 ? 0.0 : pad), windowFar = sign * gnomonWindowDepth(law, slice.y) + (joined.y > 0.0 ? 0.0 : pad);
  map.interval = vec4(viewNear, viewFar, windowNear, windowFar);
  map.layer = vec4(place.layer.x, slice.y, 0.0, 0.0);
  map.axis = viewPlane;
  map.left = vec4(0.0, 0.0, 0.0, 1.0);
  map.right = vec4(0.0, 0.0, 0.0, 1.0);
  map.range = vec4(viewNear, viewFar, 0.0, 0.0);
  return map;
}

// Writes a block from the maxima of the whole view and of each of `count` slices (1 to GNOMON_MAX_PARTITIONS). Empty slices vanish; selection is
// by view depth.
#define GNOMON_FINISH(made, place, setup, law, extremes, bounds, count) { made.atlas = place.atlas; made.origin = place.origin; made.originRest = place.originRest; made.lightDirection = place.lightDirection; made.viewPlane = place.viewPlane; made.depthRule = place.depthRule; made.bias = place.bias; for (int i_ = 0; i_ < 4; ++i_) { made.windowStart[i_] = vec4(3e38); made.viewStart[i_] = vec4(3e38); made.rowStart[i_] = place.rowStart[i_]; } made.rowAlong = place.rowAlong; made.rowAcross = place.rowAcross; made.rowRule = place.rowRule; made.rowCells = place.rowCells; for (int r_ = 0; r_ < 16; ++r_) made.rows[r_] = place.rows[r_]; vec2 range_ = gnomonShadowedRange(setup, law, extremes); int made_ = 0; for (int i_ = 0; i_ < (count) && range_.x <= range_.y; ++i_) { if (bounds[i_].x == 0u) continue; vec2 joined_ = vec2(i_ > 0 && bounds[max(i_ - 1, 0)].x != 0u ? 1.0 : 0.0, i_ + 1 < (count) && bounds[min(i_ + 1, (count) - 1)].x != 0u ? 1.0 : 0.0); made.partitions[made_] = gnomonFitSlice(setup, law, place.partitions[i_], place.viewPlane, gnomonSlice(law, range_, i_, count), joined_, gnomonUnordered(bounds[i_])); made.viewStart[made_ / 4][made_ % 4] = made.partitions[made_].interval.x; made.windowStart[made_ / 4][made_ % 4] = made.partitions[made_].interval.z; ++made_; } made.info = uvec4(uint(made_), place.info.y | GNOMON_FLAG_VIEW_DEPTH, place.info.z, place.info.w); }

// Half-spaces of a partition's map, dot(xyz, world - origin) + w >= 0, with which an indirect draw's kernel tests boxes: its sides, i = 0 to
// 3. Lengths are not unit.
vec4 gnomonCullPlane(mat4 clipFromWorld, int i) {
  mat4 rows = transpose(clipFromWorld);
  return i == 0 ? rows[3] + rows[0] : i == 1 ? rows[3] - rows[0] : i == 2 ? rows[3] + rows[1] : rows[3] - rows[1];
}

// Whether a box, given by its least and greatest corner minus the origin, reaches into a half-space.
bool gnomonReaches(vec4 plane, vec3 least, vec3 greatest) { return dot(plane.xyz, mix(least, greatest, step(vec3(0.0), plane.xyz))) + plane.w >= 0.0; }

// Whether such a box may cast into the map: count it for the draw if so.
bool gnomonMayCast(mat4 clipFromWorld, vec3 least, vec3 greatest) {
  bool isIn = true;
  for (int i = 0; i < 4; ++i) isIn = isIn && gnomonReaches(gnomonCullPlane(clipFromWorld, i), least, greatest);
  return isIn;
}

// The same for a kernel that does not read the block. planes: a buffer's array of 4 * GNOMON_MAX_PARTITIONS vec4s; maps: its uint, the number of
// partitions. Written behind GNOMON_FINISH, by the same invocation. Nothing reaches into the planes of partitions that there are not.
#define GNOMON_FINISH_CULL(planes, maps, made) { maps = made.info.x; for (int i_ = 0; i_ < 4 * GNOMON_MAX_PARTITIONS; ++i_) planes[i_] = i_ / 4 < int(made.info.x) ? gnomonCullPlane(made.partitions[i_ / 4].clipFromWorld, i_ % 4) : vec4(0.0, 0.0, 0.0, -1.0); }

// isIn: a bool. Of a box and a map: an indirect draw's instance count is 1 if so, else 0; or, where draws are counted, count and append.
#define GNOMON_CULL_BOX(isIn, planes, map, least, greatest) { isIn = true; for (int i_ = 0; i_ < 4; ++i_) isIn = isIn && gnomonReaches(planes[4 * (map) + i_], least, greatest); }

#endif
