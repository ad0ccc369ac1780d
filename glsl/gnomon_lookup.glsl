// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: from a world point and a partition to lit or shadowed: atlas position, bias by the texel's size at the point,
//              comparison through your hook, 3x3 and tent filters, fade at the shadow distance, debug views.
// use:         float gnomonCompare(int map, vec2 uv, float layer, float depth) { ... }   // yours; 1 lit, 0 shadowed
//              float lit = gnomonShadow(gnomon, 0, index, world, normal);
//              lit = mix(1.0, lit, gnomonFade(gnomon, gnomonViewDepth(gnomon, world)));
// hook:        gnomonCompare is declared here and defined by you, anywhere in the shader. map: the number you gave to
//              gnomonShadow, so that one shader can hold two lights. uv, layer: where in the texture. depth: the receiver's stored
//              depth, bias included: lit where depth <= texel (>= for a reversed shadow map).
// world:       world - origin, as everywhere. normal: unit, geometric, on the side that is seen.
// Nothing here declares a texture, a sampler or a binding; no derivative is taken.
// cost:        gnomonShadow: one comparison, a matrix product, three cross products
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_LOOKUP_GLSL
#define GNOMON_LOOKUP_GLSL

#include "gnomon_block.glsl"

float gnomonCompare(int map, vec2 uv, float layer, float depth);

// Atlas uv (xy) and stored depth (z) of a point in partition index >= 0; w: 1 within a texel of its map, else 0.
// Depth outside the map's range is clamped to it: beyond it whatever the map holds still casts.
vec4 gnomonAtlas(GnomonBlock block, int index, vec3 world) {
  vec4 q = block.partitions[index].atlasFromWorld * vec4(world, 1.0);
  vec3 p = q.xyz / q.w;
  vec4 bounds = block.partitions[index].uvBounds;
  vec2 texel = block.atlas.zw;
  bool inside = q.w > 0.0 && all(greaterThanEqual(p.xy, bounds.xy - texel)) && all(lessThanEqual(p.xy, bounds.zw + texel));
  return vec4(p.xy, clamp(p.z, 0.0, 1.0), inside ? 1.0 : 0.0);
}

// The edges of the texel at a point, as vectors in the light plane, world units: columns s and t of the inverse Jacobian.
void gnomonTexelEdges(GnomonBlock block, int index, vec3 world, out vec3 edgeS, out vec3 edgeT) {
  mat4 m = block.partitions[index].atlasFromWorld;
  vec4 q = m * vec4(world, 1.0);
  vec3 rowW = vec3(m[0].w, m[1].w, m[2].w);
  vec3 s = (vec3(m[0].x, m[1].x, m[2].x) - rowW * (q.x / q.w)) * (block.atlas.x / q.w);
  vec3 t = (vec3(m[0].y, m[1].y, m[2].y) - rowW * (q.y / q.w)) * (block.atlas.y / q.w);
  vec3 light = block.lightDirection.xyz;
  vec3 across = cross(t, light);
  float scale = 1.0 / dot(s, across);
  edgeS = across * scale;
  edgeT = cross(light, s) * scale;
}

// The point moved along its normal, so that a plane through it does not shadow itself although each texel holds one depth
// for its whole area. reach: half the width of the filter, in texels (0.5: a single texel).
vec3 gnomonBias(GnomonBlock block, int index, vec3 world, vec3 normal, float reach) {
  vec3 edgeS, edgeT;
  gnomonTexelEdges(block, index, world, edgeS, edgeT);
  // The plane's depth varies by |n . edge| / |n . light| over an edge; height h along n is worth h / |n . light| of depth.
  float height = block.bias.x * reach * (abs(dot(normal, edgeS)) + abs(dot(normal, edgeT)));
  return world + normal * (height + block.bias.y * sqrt(max(dot(edgeS, edgeS), dot(edgeT, edgeT))));
}

float gnomonImplTap(GnomonBlock block, int map, int index, vec2 uv, float depth) {
  vec4 bounds = block.partitions[index].uvBounds;
  vec2 inset = 0.5 * block.atlas.zw;
  return gnomonCompare(map, clamp(uv, bounds.xy + inset, bounds.zw - inset), block.partitions[index].layer.x, depth);
}

// 1 lit, 0 shadowed, from one texel. index < 0, or a point outside the partition's map, is lit.
float gnomonShadow(GnomonBlock block, int map, int index, vec3 world, vec3 normal) {
  if (index < 0) return 1.0;
  vec4 p = gnomonAtlas(block, index, gnomonBias(block, index, world, normal, 0.5));
  return p.w > 0.0 ? gnomonImplTap(block, map, index, p.xy, p.z) : 1.0;
}

// Mean of 3x3 texels. Margin::filter 1 keeps every tap inside the map.
float gnomonShadow3x3(GnomonBlock block, int map, int index, vec3 world, vec3 normal) {
  if (index < 0) return 1.0;
  vec4 p = gnomonAtlas(block, index, gnomonBias(block, index, world, normal, 1.5));
  if (!(p.w > 0.0)) return 1.0;
  float sum = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) sum += gnomonImplTap(block, map, index, p.xy + vec2(float(x), float(y)) * block.atlas.zw, p.z);
  return sum / 9.0;
}

// Tent of half width 2 texels around the point: 4x4 texels, smooth as the point moves. Margin::filter 2 keeps every tap inside.
float gnomonShadowTent(GnomonBlock block, int map, int index, vec3 world, vec3 normal) {
  if (index < 0) return 1.0;
  vec4 p = gnomonAtlas(block, index, gnomonBias(block, index, world, normal, 2.0));
  if (!(p.w > 0.0)) return 1.0;
  vec2 texel = p.xy * block.atlas.xy - 0.5;
  vec2 corner = floor(texel), f = texel - corner;
  vec4 weightX = vec4(1.0 - f.x, 2.0 - f.x, 1.0 + f.x, f.x), weightY = vec4(1.0 - f.y, 2.0 - f.y, 1.0 + f.y, f.y);
  float sum = 0.0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      sum += weightX[x] * weightY[y] * gnomonImplTap(block, map, index, (corner + vec2(float(x) - 0.5, float(y) - 0.5)) * block.atlas.zw, p.z);
  return sum / 16.0;
}

// 1 while shadows are whole, falling to 0 at the end of the shadowed depth range and beyond; 1 everywhere without a fade.
float gnomonFade(GnomonBlock block, float viewDepth) {
  return block.depthRule.w > 0.0 ? clamp((block.depthRule.z - viewDepth) * block.depthRule.w, 0.0, 1.0) : 1.0;
}

// Debug view: a colour for each partition, grey for none.
vec3 gnomonTint(int index) {
  if (index < 0) return vec3(0.5);
  float hue = fract(float(index) * 0.381966 + 0.02) * 6.0;
  vec3 wheel = clamp(abs(mod(vec3(hue, hue + 4.0, hue + 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);
  return mix(vec3(1.0), wheel, 0.65);
}

// Debug view: 1 on a texel's border (its outer twentieth), 0 inside.
float gnomonGrid(GnomonBlock block, int index, vec3 world) {
  if (index < 0) return 0.0;
  vec2 inTexel = abs(fract(gnomonAtlas(block, index, world).xy * block.atlas.xy) - 0.5);
  return max(inTexel.x, inTexel.y) > 0.45 ? 1.0 : 0.0;
}

#endif
