// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: which parallel split serves a fragment. Based on [Zhang 2006, eq. 8], corrected to f/(f-n) (1 - n/C), in the three
//              depth conventions, infinite and orthographic projections included. Intervals are half-open; the answer is an
//              index, or -1 where nothing needs a shadow (before, between or after the partitions).
// use:         int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
//              gnomonSelectWindow where the depth buffer is at hand, gnomonSelectView for a pass without one.
// cost:        four vector comparisons, no loop, no branch
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_PSSM_GLSL
#define GNOMON_PSSM_GLSL

#include "gnomon_block.glsl"

// Starts never fall, so the partitions that have begun are the first ones: count them.
int gnomonImplSelect(vec4 starts[4], float depth) {
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

// The index where it is one of this shader's partitions and has not ended, else -1. end: that partition's.
int gnomonImplServed(int index, float depth, float end) { return index >= 0 && index < GNOMON_MAX_PARTITIONS && depth <= end ? index : -1; }

// windowDepth: gl_FragCoord.z, or a texel of the camera's depth buffer, 0 to 1.
int gnomonSelectWindow(GnomonBlock block, float windowDepth) {
  float depth = windowDepth * block.depthRule.x;
  int index = gnomonImplSelect(block.windowStart, depth);
  return gnomonImplServed(index, depth, block.partitions[clamp(index, 0, GNOMON_MAX_PARTITIONS - 1)].interval.w);
}

// viewDepth: distance along the view direction (gnomonViewDepth).
int gnomonSelectView(GnomonBlock block, float viewDepth) {
  int index = gnomonImplSelect(block.viewStart, viewDepth);
  return gnomonImplServed(index, viewDepth, block.partitions[clamp(index, 0, GNOMON_MAX_PARTITIONS - 1)].interval.y);
}

// View depth of a point. world: world - origin.
float gnomonViewDepth(GnomonBlock block, vec3 world) { return dot(block.viewPlane.xyz, world) + block.viewPlane.w; }

// By window depth unless the camera's depth buffer cannot tell the splits apart.
int gnomonSelect(GnomonBlock block, float windowDepth, vec3 world) {
  if ((block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u) return gnomonSelectView(block, gnomonViewDepth(block, world));
  return gnomonSelectWindow(block, windowDepth);
}

#endif
