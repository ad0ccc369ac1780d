// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: the mask lookup of [Lloyd 2006, sec. 6.3], half-open: which partition serves a point, by comparisons alone, whether
//              partitions are slices of view depth, faces of the view volume or rows of those. Serves every method's partitions.
// use:         int index = gnomonSelectMask(gnomon, world);
//              or the paper's form, texture coordinates from the vertex stage: out vec4 at[4]; gnomonMaskVertex(gnomon, world, at);
//              vec4 p = gnomonMaskCoordinate(gnomonMask4(gnomon, 0, world), at[0], at[1], at[2], at[3]); uv = p.xy / p.w
// world:       world - origin
// cost:        gnomonMask4: twelve dot products, five vector comparisons, for four partitions; no loop, no branch
// needs:       #version 330 core
#ifndef GNOMON_LLOYD_GLSL
#define GNOMON_LLOYD_GLSL

#include "gnomon_block.glsl"

float gnomonImplMask(GnomonPartition part, bool isHeld, vec4 p) {
  float along = dot(part.axis, p);
  bool isServed = isHeld && along >= part.range.x && along < part.range.y && dot(part.left, p) >= 0.0 && dot(part.right, p) >= 0.0;
  return isServed ? 1.0 : 0.0;
}

// 1 for each of the partitions first to first + 3 that serves the point, else 0. first: 0, 4, 8 or 12.
vec4 gnomonMask4(GnomonBlock block, int first, vec3 world) {
  vec4 p = vec4(world, 1.0);
  int count = int(block.info.x) - first, last = GNOMON_MAX_PARTITIONS - 1;
  return vec4(gnomonImplMask(block.partitions[min(first, last)], 0 < count, p), gnomonImplMask(block.partitions[min(first + 1, last)], 1 < count, p),
              gnomonImplMask(block.partitions[min(first + 2, last)], 2 < count, p), gnomonImplMask(block.partitions[min(first + 3, last)], 3 < count, p));
}

// The first partition that serves a point, or -1.
int gnomonSelectMask(GnomonBlock block, vec3 world) {
  vec4 mask = gnomonMask4(block, 0, world);
  float found = mask.x > 0.0 ? 0.0 : mask.y > 0.0 ? 1.0 : mask.z > 0.0 ? 2.0 : mask.w > 0.0 ? 3.0 : -1.0;
#if GNOMON_MAX_PARTITIONS > 4
  if (found < 0.0) {
    mask = gnomonMask4(block, 4, world);
    found = mask.x > 0.0 ? 4.0 : mask.y > 0.0 ? 5.0 : mask.z > 0.0 ? 6.0 : mask.w > 0.0 ? 7.0 : -1.0;
  }
#endif
#if GNOMON_MAX_PARTITIONS > 8
  if (found < 0.0) {
    mask = gnomonMask4(block, 8, world);
    found = mask.x > 0.0 ? 8.0 : mask.y > 0.0 ? 9.0 : mask.z > 0.0 ? 10.0 : mask.w > 0.0 ? 11.0 : -1.0;
  }
#endif
#if GNOMON_MAX_PARTITIONS > 12
  if (found < 0.0) {
    mask = gnomonMask4(block, 12, world);
    found = mask.x > 0.0 ? 12.0 : mask.y > 0.0 ? 13.0 : mask.z > 0.0 ? 14.0 : mask.w > 0.0 ? 15.0 : -1.0;
  }
#endif
  return int(found);
}

// Vertex stage: a point's atlas positions in the first four partitions, to be interpolated (they are linear in the point).
void gnomonMaskVertex(GnomonBlock block, vec3 world, out vec4 at[4]) {
  vec4 p = vec4(world, 1.0);
  int last = GNOMON_MAX_PARTITIONS - 1;
  at[0] = block.partitions[0].atlasFromWorld * p;
  at[1] = block.partitions[min(1, last)].atlasFromWorld * p;
  at[2] = block.partitions[min(2, last)].atlasFromWorld * p;
  at[3] = block.partitions[min(3, last)].atlasFromWorld * p;
}

// Fragment stage: the position in the partition that serves the point, before division by w; zero where none does.
vec4 gnomonMaskCoordinate(vec4 mask, vec4 at0, vec4 at1, vec4 at2, vec4 at3) {
  vec4 first = mask * vec4(1.0, 1.0 - mask.x, (1.0 - mask.x) * (1.0 - mask.y), (1.0 - mask.x) * (1.0 - mask.y) * (1.0 - mask.z));
  return first.x * at0 + first.y * at1 + first.z * at2 + first.w * at3;
}

#endif
