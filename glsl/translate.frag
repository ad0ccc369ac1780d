#version 450
// A fragment shader that calls every function of the includes: what the build translates to HLSL and MSL, and what the tests compile in
// every dialect.
#extension GL_GOOGLE_include_directive : enable
#define GNOMON_BINDING 0
#include "gnomon.glsl"
#include "gnomon_cast.glsl"
#include "gnomon_sdsm.glsl"
layout(binding = 1) uniform highp sampler2DArrayShadow shadowMaps;
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 normal;
layout(location = 0) out vec4 colour;

float gnomonCompare(int map, vec2 uv, float layer, float depth) { return texture(shadowMaps, vec4(uv, layer, depth)); }

vec4 levelAt(ivec2 pixel) { return vec4(pixel, pixel); }

void main() {
  float viewDepth = gnomonViewDepth(gnomon, world);
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  index = max(index, gnomonSelectView(gnomon, viewDepth) + gnomonSelectWindow(gnomon, gl_FragCoord.z));
  index = gnomonBlendDither(index, gnomonBlendWeight(gnomon, index, viewDepth), gl_FragCoord.xy) + gnomonSelectMask(gnomon, world) + gnomonSelectCell(gnomon, world) + gnomonSearchCell(gnomon, world);
  vec4 masked = gnomonMaskCoordinate(gnomonMask4(gnomon, 4, world), gnomonVertexPosition(gnomon, 0, world), world.xyzx, world.yyzx, world.zyzx);
  masked += gnomonPick4(gnomon, gl_FragCoord.z, masked, world.xyzx, world.yyzx, world.zyzx);
  float lit = masked.x + gnomonShadow(gnomon, 0, index, world, normal) + gnomonShadow3x3(gnomon, 0, index, world, normal) +
              gnomonShadowTent(gnomon, 1, index, world, normal);
  vec3 edgeS, edgeT;
  gnomonTexelEdges(gnomon, 0, world, edgeS, edgeT);
  lit += gnomonAtlas(gnomon, 0, gnomonBias(gnomon, 0, world, normal, 0.5)).z + dot(edgeS, edgeT);
  vec4 position = gnomonCastAtlas(gnomon, 0, world) + gnomonCastFlat(gnomonCastPosition(gnomon, 0, world)) + gnomonCastClip(gnomon, 0, world);
  float depth = gnomonCastDepth(gnomonCastWindowDepth(gnomon, 0, world)) + float(gnomonCastLayer(gnomon, 0));
  vec4 law = vec4(viewDepth, 0.0, 1.0, 1.0), extremes = gnomonExtremes(law, gl_FragCoord.z), all;
  vec4 value = gnomonBoundsOf(law, gnomonSamplePosition(law, law, extremes, masked, ivec2(index), gl_FragCoord.z), gl_FragCoord.z, gnomonSliceDepths(law, gnomonSlice(law, max(gnomonSampledRange(law, extremes), gnomonShadowedRange(GnomonSdsmSetup(law, law, law, law, law, law), law, extremes)), index, 4)));
  GNOMON_REDUCE_TILE(all, ivec2(gl_FragCoord.xy), ivec2(100), levelAt)
  all = max(all, value);
  GnomonSdsmSetup setup = GnomonSdsmSetup(all, masked, extremes, law, all, masked);
  GnomonPartition made = gnomonFitSlice(setup, law, gnomon.partitions[0], gnomon.viewPlane, world.xy, world.yz, gnomonUnordered(gnomonOrdered(all)));
  position += made.clipFromWorld[0] + gnomonCullPlane(made.clipFromWorld, index) + made.interval;
  if (gnomonIsSample(law, viewDepth) && gnomonHasBegun(law, world.x, world.y) && gnomonMayCast(made.atlasFromWorld, world, normal) && gnomonReaches(gnomonCullPlane(made.atlasFromWorld, 0), world, normal))
    depth += gnomonSampleDepth(law, viewDepth) + gnomonWindowDepth(law, gnomonPlane(law, world.xy, index, 4));
  int bin;
  GNOMON_FIND_BIN(bin, law, gl_FragCoord.z, 8, float)
  depth += float(bin);
  colour = position + vec4(gnomonTint(index) * mix(1.0, lit, gnomonFade(gnomon, viewDepth)), gnomonGrid(gnomon, index, world) + depth);
}
