#version 450
// A fragment shader that calls every function of the includes: what the build translates to HLSL and MSL, and what the tests compile in
// every dialect.
#extension GL_GOOGLE_include_directive : enable
#define GNOMON_BINDING 0
#include "gnomon.glsl"
#include "gnomon_cast.glsl"
layout(binding = 1) uniform sampler2DArrayShadow shadowMaps;
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 normal;
layout(location = 0) out vec4 colour;

float gnomonCompare(int map, vec2 uv, float layer, float depth) { return texture(shadowMaps, vec4(uv, layer, depth)); }

void main() {
  GnomonBlock block = gnomon;
  float viewDepth = gnomonViewDepth(block, world);
  int index = gnomonSelect(block, gl_FragCoord.z, world);
  index = max(index, gnomonSelectView(block, viewDepth) + gnomonSelectWindow(block, gl_FragCoord.z));
  float lit = gnomonShadow(block, 0, index, world, normal) + gnomonShadow3x3(block, 0, index, world, normal) +
              gnomonShadowTent(block, 1, index, world, normal);
  vec4 position = gnomonCastAtlas(block, 0, world) + gnomonCastFlat(gnomonCastPosition(block, 0, world)) + gnomonCastClip(block, 0, world);
  float depth = gnomonCastDepth(gnomonCastWindowDepth(block, 0, world)) + float(gnomonCastLayer(block, 0));
  colour = position + vec4(gnomonTint(index) * mix(1.0, lit, gnomonFade(block, viewDepth)), gnomonGrid(block, index, world) + depth);
}
