// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: which parallel split serves a fragment. Based on [Zhang 2006, eq. 8], corrected to f/(f-n) (1 - n/C), in the three
//              depth conventions, infinite and orthographic projections included. Intervals are half-open; the answer is an
//              index, or -1 where nothing needs a shadow (before, between or after the partitions).
//              Slices only: faces and rows (lloyd, lspsm and auto may make them) are found by gnomonSelectMask of gnomon_lloyd.glsl.
// use:         int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
//              gnomonSelectWindow where the depth buffer is at hand, gnomonSelectView for a pass without one.
// cost:        a vector comparison for each four of GNOMON_MAX_PARTITIONS, one read by index; no loop
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_PSSM_GLSL
#define GNOMON_PSSM_GLSL

#include "gnomon_block.glsl"

// Starts never fall, so the partitions that have begun are the first ones: count them.
int gnomonImplBegun(vec4 starts[4], float depth) {
  vec4 begun = step(starts[0], vec4(depth));
#if GNOMON_MAX_PARTITIONS > 4
  begun += step(starts[1], vec4(depth));
#endif
#if GNOMON_MAX_PARTITIONS > 8
  begun += step(starts[2], vec4(depth));
#endif
#if GNOMON_MAX_PARTITIONS > 12
  begun += step(starts[3], vec4(depth));
#endif
  return int(dot(begun, vec4(1.0))) - 1;
}

// The last partition that has begun, where it is one of this shader's and has not ended, else -1. end: that partition's.
int gnomonImplServed(vec4 starts[4], float depth, float end) {
  int index = gnomonImplBegun(starts, depth);
  return index >= 0 && index < GNOMON_MAX_PARTITIONS && depth <= end ? index : -1;
}

#define GNOMON_IMPL_LAST(starts, depth) clamp(gnomonImplBegun(starts, depth), 0, GNOMON_MAX_PARTITIONS - 1)

// View depth of a point. world: world - origin.
//   float gnomonViewDepth(GnomonBlock block, vec3 world)
float gnomonImplViewDepth(vec4 viewPlane, vec3 world) { return dot(viewPlane.xyz, world) + viewPlane.w; }
#define gnomonViewDepth(block, world) gnomonImplViewDepth(block.viewPlane, world)

// windowDepth: gl_FragCoord.z, or a texel of the camera's depth buffer, 0 to 1.
//   int gnomonSelectWindow(GnomonBlock block, float windowDepth)
#define GNOMON_IMPL_WINDOW(block, depth) gnomonImplServed(block.windowStart, depth, block.partitions[GNOMON_IMPL_LAST(block.windowStart, depth)].interval.w)
#define gnomonSelectWindow(block, windowDepth) GNOMON_IMPL_WINDOW(block, ((windowDepth) * block.depthRule.x))

// viewDepth: distance along the view direction (gnomonViewDepth).
//   int gnomonSelectView(GnomonBlock block, float viewDepth)
#define gnomonSelectView(block, viewDepth) gnomonImplServed(block.viewStart, viewDepth, block.partitions[GNOMON_IMPL_LAST(block.viewStart, viewDepth)].interval.y)

// The cheapest path, for at most four partitions: their positions come from the vertex stage (gnomonVertexPosition of 0 to 3, as varyings), the
// fragment picks one by window depth: a lookup costs no more than with one map. xy: atlas uv, z: stored depth, w: the partition, -1 before
// the first. Slices' maps have no perspective, so nothing is divided; ends are not looked at: past the last slice, and in gaps between
// receivers, the slice before answers.
//   vec4 gnomonPick4(GnomonBlock block, float windowDepth, vec4 at0, vec4 at1, vec4 at2, vec4 at3)
vec4 gnomonImplPick4(vec4 starts, float depth, vec4 at0, vec4 at1, vec4 at2, vec4 at3) {
  vec4 begun = step(starts, vec4(depth));
  vec4 p = begun.w > 0.0 ? at3 : begun.z > 0.0 ? at2 : begun.y > 0.0 ? at1 : at0;
  return vec4(p.xyz, dot(begun, vec4(1.0)) - 1.0);
}
#define gnomonPick4(block, windowDepth, at0, at1, at2, at3) gnomonImplPick4(block.windowStart[0], (windowDepth) * block.depthRule.x, at0, at1, at2, at3)

// By window depth unless the camera's depth buffer cannot tell the splits apart.
//   int gnomonSelect(GnomonBlock block, float windowDepth, vec3 world)
#define gnomonSelect(block, windowDepth, world) ((block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u ? gnomonSelectView(block, gnomonViewDepth(block, world)) : gnomonSelectWindow(block, windowDepth))

#endif
