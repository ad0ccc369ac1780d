// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: no visible seam where one partition ends and the next begins: how much of the next map to take at a depth, mixed (two
//              lookups, inside the band only) or dithered (one lookup everywhere).
// use:         float weight = gnomonBlendWeight(gnomon, index, gnomonViewDepth(gnomon, world));
//              mixed:    float lit = gnomonShadow(gnomon, 0, index, world, normal);
//                        if (weight > 0.0) lit = mix(lit, gnomonShadow(gnomon, 0, index + 1, world, normal), weight);
//              dithered: index = gnomonBlendDither(index, weight, gl_FragCoord.xy);   // then any lookup, tint or grid
// band:        the far end of a partition that the next map covers too: the solver's margin.blend, a share of the partition's depths.
//              None asked for, a gap behind the partition, or the last one: the weight is 0.
// cost:        mixed: a second lookup for the band's pixels; dithered: none, but noise of the band's width
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_BLEND_GLSL
#define GNOMON_BLEND_GLSL

#include "gnomon_block.glsl"

// Share of partition index + 1, 0 to 1, rising over the band; 0 where partition index serves alone and for index < 0.
// Selection by window depth and by view depth both meet it at a seam: 1 on one side, the next partition's own 0 on the other.
//   float gnomonBlendWeight(GnomonBlock block, int index, float viewDepth)
float gnomonImplBlendWeight(vec4 layer, int index, float viewDepth) {
  return index >= 0 && index + 1 < GNOMON_MAX_PARTITIONS ? clamp((viewDepth - layer.y) * layer.z, 0.0, 1.0) : 0.0;
}
#define gnomonBlendWeight(block, index, viewDepth) gnomonImplBlendWeight(block.partitions[clamp(index, 0, GNOMON_MAX_PARTITIONS - 1)].layer, index, viewDepth)

// Partition index, or the next one for `weight` of the pixels. pixel: gl_FragCoord.xy. Interleaved gradient noise [Jimenez 2014].
int gnomonBlendDither(int index, float weight, vec2 pixel) {
  return index + int(fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715)))) < weight);
}

#endif
