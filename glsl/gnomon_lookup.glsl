// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: from a world point and a partition to lit or shadowed: atlas position, bias by the texel's size at the point,
//              comparison through your hook, 3x3 and tent filters, fade at the shadow distance, debug views.
// use:         float gnomonCompare(int map, vec2 uv, float layer, float depth) { ... }   // yours; 1 lit, 0 shadowed
//              float lit = gnomonShadow(gnomon, 0, index, world, normal);
//              lit = mix(1.0, lit, gnomonFade(gnomon, gnomonViewDepth(gnomon, world)));
// hook:        gnomonCompare is declared here and defined by you, anywhere in the shader. map: the number you gave to
//              gnomonShadow, so that one shader can hold two lights. uv, layer: where in the texture. depth: the receiver's stored
//              depth, bias included: lit where depth <= texel (>= for a reversed shadow map). Every shader that includes this file
//              defines it, called or not: some linkers (Mesa) ask.
// world:       world - origin, as everywhere. normal: unit, geometric, on the side that is seen.
// Nothing here declares a texture, a sampler or a binding; no derivative is taken.
// cost:        gnomonShadow: one comparison, two matrix products, two cross products, one partition read by index; `make cost` measures it
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_LOOKUP_GLSL
#define GNOMON_LOOKUP_GLSL

#include "gnomon_block.glsl"

float gnomonCompare(int map, vec2 uv, float layer, float depth);

// Atlas uv (xy) and stored depth (z) of a point in partition index >= 0; w: 1 within a texel of its map, else 0.
// Depth outside the map's range is clamped to it: beyond it whatever the map holds still casts.
//   vec4 gnomonAtlas(GnomonBlock block, int index, vec3 world)
vec4 gnomonImplAtlas(GnomonPartition served, vec4 atlas, vec3 world) {
  vec4 q = served.atlasFromWorld * vec4(world, 1.0);
  vec3 p = q.xyz / q.w;
  bool inside = q.w > 0.0 && all(greaterThanEqual(p.xy, served.uvBounds.xy - atlas.zw)) && all(lessThanEqual(p.xy, served.uvBounds.zw + atlas.zw));
  return vec4(p.xy, clamp(p.z, 0.0, 1.0), inside ? 1.0 : 0.0);
}
#define gnomonAtlas(block, index, world) gnomonImplAtlas(block.partitions[index], block.atlas, world)

// The edges of the texel at a point, as vectors in the light plane, world units: columns s and t of the inverse Jacobian.
//   void gnomonTexelEdges(GnomonBlock block, int index, vec3 world, out vec3 edgeS, out vec3 edgeT)
void gnomonImplTexelEdges(mat4 m, vec4 atlas, vec4 light, vec3 world, out vec3 edgeS, out vec3 edgeT) {
  vec4 q = m * vec4(world, 1.0);
  vec2 p = q.xy / q.w, perW = atlas.xy / q.w;
  vec3 rowW = vec3(m[0].w, m[1].w, m[2].w);
  vec3 s = (vec3(m[0].x, m[1].x, m[2].x) - rowW * p.x) * perW.x;
  vec3 t = (vec3(m[0].y, m[1].y, m[2].y) - rowW * p.y) * perW.y;
  vec3 across = cross(t, light.xyz);
  float scale = 1.0 / dot(s, across);
  edgeS = across * scale;
  edgeT = cross(light.xyz, s) * scale;
}
#define gnomonTexelEdges(block, index, world, edgeS, edgeT) gnomonImplTexelEdges(block.partitions[index].atlasFromWorld, block.atlas, block.lightDirection, world, edgeS, edgeT)

// The point moved along its normal, so that a plane through it does not shadow itself although each texel holds one depth
// for its whole area. reach: half the width of the filter, in texels (0.5: a single texel).
//   vec3 gnomonBias(GnomonBlock block, int index, vec3 world, vec3 normal, float reach)
vec3 gnomonImplBias(mat4 m, vec4 atlas, vec4 light, vec4 bias, vec3 world, vec3 normal, float reach) {
  vec3 edgeS, edgeT;
  gnomonImplTexelEdges(m, atlas, light, world, edgeS, edgeT);
  // The plane's depth varies by n . edge / n . light over an edge, and a warped map's stored depth by its own w besides:
  // `stored` is that depth's gradient. Height h along n is worth h / |n . light| of depth.
  vec4 q = m * vec4(world, 1.0);
  vec3 stored = vec3(m[0].z, m[1].z, m[2].z) - vec3(m[0].w, m[1].w, m[2].w) * (q.z / q.w);
  vec3 tilt = normal - stored * (dot(normal, light.xyz) / dot(stored, light.xyz));
  float height = bias.x * reach * (abs(dot(tilt, edgeS)) + abs(dot(tilt, edgeT)));
  return world + normal * (height + bias.y * sqrt(max(dot(edgeS, edgeS), dot(edgeT, edgeT))));
}
#define gnomonBias(block, index, world, normal, reach) gnomonImplBias(block.partitions[index].atlasFromWorld, block.atlas, block.lightDirection, block.bias, world, normal, reach)

// Where a filter of that reach is centred: gnomonAtlas of the point, bias included; w: 0 for index < 0 too.
vec4 gnomonImplCentre(GnomonPartition served, vec4 atlas, vec4 light, vec4 bias, int index, vec3 world, vec3 normal, float reach) {
  vec4 p = gnomonImplAtlas(served, atlas, gnomonImplBias(served.atlasFromWorld, atlas, light, bias, world, normal, reach));
  return index < 0 ? vec4(0.0) : p;
}
#define GNOMON_IMPL_FILTER(filtered, block, map, index, world, normal, reach) filtered(block.partitions[max(index, 0)], block.atlas, map, gnomonImplCentre(block.partitions[max(index, 0)], block.atlas, block.lightDirection, block.bias, index, world, normal, reach))

float gnomonImplTap(GnomonPartition served, vec4 atlas, int map, vec2 uv, float depth) {
  vec2 inset = 0.5 * atlas.zw;
  return gnomonCompare(map, clamp(uv, served.uvBounds.xy + inset, served.uvBounds.zw - inset), served.layer.x, depth);
}

// 1 lit, 0 shadowed, from one texel. index < 0, or a point outside the partition's map, is lit.
//   float gnomonShadow(GnomonBlock block, int map, int index, vec3 world, vec3 normal)
float gnomonImplShadow(GnomonPartition served, vec4 atlas, int map, vec4 p) {
  return p.w > 0.0 ? gnomonImplTap(served, atlas, map, p.xy, p.z) : 1.0;
}
#define gnomonShadow(block, map, index, world, normal) GNOMON_IMPL_FILTER(gnomonImplShadow, block, map, index, world, normal, 0.5)

// Mean of 3x3 texels. Margin::filter 1 keeps every tap inside the map, with Margin::normalOffset for the bias.
//   float gnomonShadow3x3(GnomonBlock block, int map, int index, vec3 world, vec3 normal)
float gnomonImplShadow3x3(GnomonPartition served, vec4 atlas, int map, vec4 p) {
  if (!(p.w > 0.0)) return 1.0;
  float sum = 0.0;
  for (int y = -1; y <= 1; ++y)
    for (int x = -1; x <= 1; ++x) sum += gnomonImplTap(served, atlas, map, p.xy + vec2(float(x), float(y)) * atlas.zw, p.z);
  return sum / 9.0;
}
#define gnomonShadow3x3(block, map, index, world, normal) GNOMON_IMPL_FILTER(gnomonImplShadow3x3, block, map, index, world, normal, 1.5)

// Tent of half width 2 texels around the point: 4x4 texels, smooth as the point moves. Margin::filter 2 keeps every tap inside,
// with Margin::normalOffset for the bias.
//   float gnomonShadowTent(GnomonBlock block, int map, int index, vec3 world, vec3 normal)
float gnomonImplShadowTent(GnomonPartition served, vec4 atlas, int map, vec4 p) {
  if (!(p.w > 0.0)) return 1.0;
  vec2 texel = p.xy * atlas.xy - 0.5;
  vec2 corner = floor(texel), f = texel - corner;
  vec4 weightX = vec4(1.0 - f.x, 2.0 - f.x, 1.0 + f.x, f.x), weightY = vec4(1.0 - f.y, 2.0 - f.y, 1.0 + f.y, f.y);
  float sum = 0.0;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      sum += weightX[x] * weightY[y] * gnomonImplTap(served, atlas, map, (corner + vec2(float(x) - 0.5, float(y) - 0.5)) * atlas.zw, p.z);
  return sum / 16.0;
}
#define gnomonShadowTent(block, map, index, world, normal) GNOMON_IMPL_FILTER(gnomonImplShadowTent, block, map, index, world, normal, 2.0)

// 1 while shadows are whole, falling to 0 at the end of the shadowed depth range and beyond; 1 everywhere without a fade.
//   float gnomonFade(GnomonBlock block, float viewDepth)
float gnomonImplFade(vec4 depthRule, float viewDepth) {
  return depthRule.w > 0.0 ? clamp((depthRule.z - viewDepth) * depthRule.w, 0.0, 1.0) : 1.0;
}
#define gnomonFade(block, viewDepth) gnomonImplFade(block.depthRule, viewDepth)

// Debug view: a colour for each partition, grey for none.
vec3 gnomonTint(int index) {
  if (index < 0) return vec3(0.5);
  float hue = fract(float(index) * 0.381966 + 0.02) * 6.0;
  vec3 wheel = clamp(abs(mod(vec3(hue, hue + 4.0, hue + 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0);
  return mix(vec3(1.0), wheel, 0.65);
}

// Debug view: 1 on a texel's border (its outer twentieth), 0 inside.
//   float gnomonGrid(GnomonBlock block, int index, vec3 world)
float gnomonImplGrid(vec2 texel, int index) {
  vec2 inTexel = abs(fract(texel) - 0.5);
  return index >= 0 && max(inTexel.x, inTexel.y) > 0.45 ? 1.0 : 0.0;
}
#define gnomonGrid(block, index, world) gnomonImplGrid(gnomonAtlas(block, max(index, 0), world).xy * block.atlas.xy, index)

#endif
