// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: the draw side: where a caster goes in a partition's map. One pass for each map (viewport and scissor set by the
//              host), or all maps in one pass: by layer or viewport index, or in an atlas with clip distances.
// use:         one pass each:   gl_Position = gnomonCastPosition(gnomon, index, world);
//              one pass, array: the same with gl_Layer = gnomonCastLayer(gnomon, index)  (geometry stage, or the vertex stage where
//                               the device has ARB_shader_viewport_layer_array)
//              one pass, atlas: gl_Position = gnomonCastAtlas(gnomon, index, world); the whole atlas is the viewport, and
//                               vec4 d = gnomonCastClip(gnomon, index, world); gl_ClipDistance[0..3] = d.x, d.y, d.z, d.w;
//              depth clamp where the API has none: gl_Position = gnomonCastFlat(position) and, in the fragment stage,
//                               gl_FragDepth = gnomonCastDepth(depth) of the depth that gnomonCastWindowDepth gave the vertex
//                               (interpolate it noperspective, or smooth: w is constant on a flat map)
// needs:       what gnomon_block.glsl needs
#ifndef GNOMON_CAST_GLSL
#define GNOMON_CAST_GLSL

#include "gnomon_block.glsl"

// Clip position of a caster in its own map. world: world - origin. index: 0 to info.x - 1.
//   vec4 gnomonCastPosition(GnomonBlock block, int index, vec3 world)
#define gnomonCastPosition(block, index, world) (block.partitions[index].clipFromWorld * vec4(world, 1.0))

// Layer of an array texture.
//   int gnomonCastLayer(GnomonBlock block, int index)
#define gnomonCastLayer(block, index) int(block.partitions[index].layer.x)

// Clip position of a caster in the whole atlas (v = 0 at clip y = -1; negate y for ClipStyle::direct3d, where it is at +1).
//   vec4 gnomonCastAtlas(GnomonBlock block, int index, vec3 world)
vec4 gnomonImplCastAtlas(vec4 own, vec4 atlas) { return vec4(2.0 * atlas.xy - own.w, own.z, own.w); }
#define gnomonCastAtlas(block, index, world) gnomonImplCastAtlas(gnomonCastPosition(block, index, world), block.partitions[index].atlasFromWorld * vec4(world, 1.0))

// Distances to the four sides of the map, >= 0 inside: left, right, down, up.
//   vec4 gnomonCastClip(GnomonBlock block, int index, vec3 world)
vec4 gnomonImplCastClip(vec4 own) { return vec4(own.w + own.x, own.w - own.x, own.w + own.y, own.w - own.y); }
#define gnomonCastClip(block, index, world) gnomonImplCastClip(gnomonCastPosition(block, index, world))

// Depth clamp by fragment depth.
//   float gnomonCastWindowDepth(GnomonBlock block, int index, vec3 world)
float gnomonImplCastWindowDepth(vec4 atlas) { return atlas.z / atlas.w; }
#define gnomonCastWindowDepth(block, index, world) gnomonImplCastWindowDepth(block.partitions[index].atlasFromWorld * vec4(world, 1.0))
vec4 gnomonCastFlat(vec4 clip) { return vec4(clip.xy, 0.5 * clip.w, clip.w); }
float gnomonCastDepth(float windowDepth) { return clamp(windowDepth, 0.0, 1.0); }

#endif
