// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: the mask lookup of [Lloyd 2006, sec. 6.3], half-open: which partition serves a point, by comparisons alone, whether
//              partitions are slices of view depth, faces of the view volume or rows of those. Serves every method's partitions.
// use:         int index = gnomonSelectMask(gnomon, world);
//              or the paper's form for four partitions, positions from the vertex stage: out vec4 at0 = gnomonVertexPosition(gnomon, 0, world);
//              and so on to at3, and vec4 p = gnomonMaskCoordinate(gnomonMask4(gnomon, 0, world), at0, at1, at2, at3); uv = p.xy / p.w
// world:       world - origin
// cost:        three dot products and a comparison for each partition, in fours as far as the block has partitions; no loop
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_LLOYD_GLSL
#define GNOMON_LLOYD_GLSL

#include "gnomon_block.glsl"

float gnomonImplMask(vec4 axis, vec2 range, vec4 left, vec4 right, bool isHeld, vec3 world) {
  vec4 p = vec4(world, 1.0);
  float along = dot(axis, p);
  return isHeld && along >= range.x && along < range.y && dot(left, p) >= 0.0 && dot(right, p) >= 0.0 ? 1.0 : 0.0;
}

// The first partition that a mask names, or -1.
int gnomonImplFirst(vec4 mask0, vec4 mask4, vec4 mask8, vec4 mask12) {
  vec4 mask = mask0;
  int first = 0;
  if (mask == vec4(0.0)) { mask = mask4; first = 4; }
  if (mask == vec4(0.0)) { mask = mask8; first = 8; }
  if (mask == vec4(0.0)) { mask = mask12; first = 12; }
  return mask.x > 0.0 ? first : mask.y > 0.0 ? first + 1 : mask.z > 0.0 ? first + 2 : mask.w > 0.0 ? first + 3 : -1;
}

#define GNOMON_IMPL_HELD(i) ((i) < GNOMON_MAX_PARTITIONS ? (i) : GNOMON_MAX_PARTITIONS - 1)
#define GNOMON_IMPL_MASK(block, i, world) gnomonImplMask(block.partitions[GNOMON_IMPL_HELD(i)].axis, block.partitions[GNOMON_IMPL_HELD(i)].range.xy, block.partitions[GNOMON_IMPL_HELD(i)].left, block.partitions[GNOMON_IMPL_HELD(i)].right, (i) < GNOMON_MAX_PARTITIONS && uint(i) < block.info.x, world)

// 1 for each of the partitions first to first + 3 that serves the point, else 0.
//   vec4 gnomonMask4(GnomonBlock block, int first, vec3 world)
#define gnomonMask4(block, first, world) vec4(GNOMON_IMPL_MASK(block, first, world), GNOMON_IMPL_MASK(block, (first) + 1, world), GNOMON_IMPL_MASK(block, (first) + 2, world), GNOMON_IMPL_MASK(block, (first) + 3, world))

#define GNOMON_IMPL_MASK4(block, first, world) (block.info.x > uint(first) ? gnomonMask4(block, first, world) : vec4(0.0))
#if GNOMON_MAX_PARTITIONS > 4
#define GNOMON_IMPL_MASK_FROM_4(block, world) GNOMON_IMPL_MASK4(block, 4, world)
#else
#define GNOMON_IMPL_MASK_FROM_4(block, world) vec4(0.0)
#endif
#if GNOMON_MAX_PARTITIONS > 8
#define GNOMON_IMPL_MASK_FROM_8(block, world) GNOMON_IMPL_MASK4(block, 8, world)
#else
#define GNOMON_IMPL_MASK_FROM_8(block, world) vec4(0.0)
#endif
#if GNOMON_MAX_PARTITIONS > 12
#define GNOMON_IMPL_MASK_FROM_12(block, world) GNOMON_IMPL_MASK4(block, 12, world)
#else
#define GNOMON_IMPL_MASK_FROM_12(block, world) vec4(0.0)
#endif

// The first partition that serves a point, or -1.
//   int gnomonSelectMask(GnomonBlock block, vec3 world)
#define gnomonSelectMask(block, world) gnomonImplFirst(GNOMON_IMPL_MASK4(block, 0, world), GNOMON_IMPL_MASK_FROM_4(block, world), GNOMON_IMPL_MASK_FROM_8(block, world), GNOMON_IMPL_MASK_FROM_12(block, world))

// The position in the first partition that the mask names; zero where it names none.
vec4 gnomonMaskCoordinate(vec4 mask, vec4 at0, vec4 at1, vec4 at2, vec4 at3) {
  return mask.x > 0.0 ? at0 : mask.y * at1 + (1.0 - mask.y) * (mask.z * at2 + (1.0 - mask.z) * mask.w * at3);
}

#endif
