// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: what a depth buffer says of what the view samples [Lauritzen 2010]: nearest and farthest, a histogram, where on the light plane.
//              Everything is a maximum of vec4s (lower ends negated), by tiles of 16 x 16 in fragment shaders, by workgroups in compute
//              shaders. Background, NaN and values that are no depth count as nothing.
// use:         fragment, level by level until one texel is left; the first level's VALUE is gnomonExtremes(...) or gnomonBoundsOf(...) of the
//              depth at the pixel, those after it read the level before (32-bit float targets):
//                vec4 all; GNOMON_REDUCE_TILE(all, ivec2(gl_FragCoord.xy), size, VALUE)
//              compute, 16 x 16 to a group, each with the maximum of many pixels, into a buffer of zeros:
//                shared vec4 scratch[256]; uint at = gl_LocalInvocationIndex;
//                GNOMON_REDUCE_GROUP(scratch, at, value) if (at == 0u) GNOMON_JOIN(extremes, scratch[0])
//              histogram: GNOMON_FIND_BIN of a depth by edges of windowEdges(); count in shared memory, then in the buffer
// view:        GnomonSampleView is what gnomon::sampleView() fills, as uniforms
// cost:        a pass over the depth buffer for each reduction; by groups the barriers too, so let an invocation take 8 x 8 pixels, 16 apart
// needs:       #version 330 core or 300 es; the group and join macros a compute shader (430, 310 es)
#ifndef GNOMON_SAMPLES_GLSL
#define GNOMON_SAMPLES_GLSL

#include "gnomon_block.glsl"

struct GnomonSampleView {
  vec4 law;      // x, y: 1 / near, 1 / far, or near, far if orthographic; z: -1 for reversed depth, else 1; w: 1 perspective, 0 orthographic
  vec4 corner;   // xy: light-plane position of the image's corner x = y = 0, per unit of view depth if w is 1; zw: 0
  vec4 pixels;   // xy, zw: what a pixel to the right, and one up, adds to it
  vec4 forward;  // xy: what a unit of view depth adds; zw: 0
};

const vec4 gnomonNothing = vec4(-3e38);  // less than any

bool gnomonIsSample(vec4 law, float depth) { return law.z < 0.0 ? depth > 0.0 && depth <= 1.0 : depth >= 0.0 && depth < 1.0; }

// x: least depth value, negated; y: greatest. Their maximum over the image is exact.
vec4 gnomonExtremes(vec4 law, float depth) { return gnomonIsSample(law, depth) ? vec4(-depth, depth, 0.0, 0.0) : gnomonNothing; }

// View depth of a depth value.
float gnomonSampleDepth(vec4 law, float depth) {
  float t = law.z < 0.0 ? 1.0 - depth : depth, u = law.z < 0.0 ? depth : 1.0 - depth;
  float z = law.x * u + law.y * t;
  return law.w > 0.0 ? 1.0 / z : z;
}

// Position on the light plane of a pixel's centre at a depth value.
vec2 gnomonSamplePosition(vec4 law, vec4 corner, vec4 pixels, vec4 forward, ivec2 pixel, float depth) {
  float z = gnomonSampleDepth(law, depth);
  vec2 at = corner.xy + pixels.xy * (float(pixel.x) + 0.5) + pixels.zw * (float(pixel.y) + 0.5);
  return law.w > 0.0 ? (at + forward.xy) * z : at + forward.xy * z;
}

// xy: least position, negated; zw: greatest; nothing outside the depth values from interval.x to interval.y.
vec4 gnomonBoundsOf(vec4 law, vec2 position, float depth, vec2 interval) {
  return gnomonIsSample(law, depth) && depth >= interval.x && depth <= interval.y ? vec4(-position, position) : gnomonNothing;
}

// Whether a bin of a histogram that begins at `edge` begins at or before a depth value: what a binary search of the edges asks.
bool gnomonHasBegun(vec4 law, float edge, float depth) { return law.z * edge <= law.z * depth; }

// bin: an int; EDGE(i): the depth value at which bin i of `bins` begins. Depths before the first edge fall into bin 0.
#define GNOMON_FIND_BIN(bin, law, depth, bins, EDGE) { bin = 0; for (int left_ = bins; left_ > 1;) { int half_ = left_ / 2; if (gnomonHasBegun(law, EDGE(bin + half_), depth)) bin += half_; left_ -= half_; } }

// all: a vec4; tile: which; size: of the level that is reduced; VALUE(pixel): of one of its pixels.
#define GNOMON_REDUCE_TILE(all, tile, size, VALUE) { all = gnomonNothing; ivec2 from_ = (tile) * 16, to_ = min(from_ + 16, size); for (int y_ = from_.y; y_ < to_.y; ++y_) for (int x_ = from_.x; x_ < to_.x; ++x_) all = max(all, VALUE(ivec2(x_, y_))); }

// scratch: a shared vec4[256]; at: gl_LocalInvocationIndex, a variable; leaves the maximum over a group of 256 in scratch[0].
#define GNOMON_REDUCE_GROUP(scratch, at, value) { scratch[at] = value; barrier(); for (uint step_ = 128u; step_ > 0u; step_ /= 2u) { if (at < step_) scratch[at] = max(scratch[at], scratch[at + step_]); barrier(); } }

// target: a uvec4 of a buffer, of zeros before the first: of the maxima so far.
#define GNOMON_JOIN(target, value) { uvec4 ordered_ = gnomonOrdered(value); atomicMax(target.x, ordered_.x); atomicMax(target.y, ordered_.y); atomicMax(target.z, ordered_.z); atomicMax(target.w, ordered_.w); }

// Floats as integers of the same order, all above 0; and back, where 0 is nothing.
uint gnomonImplOrdered(float x) { uint bits = floatBitsToUint(x); return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u; }
float gnomonImplUnordered(uint x) { return x == 0u ? -3e38 : uintBitsToFloat((x & 0x80000000u) != 0u ? x & 0x7fffffffu : ~x); }
uvec4 gnomonOrdered(vec4 x) { return uvec4(gnomonImplOrdered(x.x), gnomonImplOrdered(x.y), gnomonImplOrdered(x.z), gnomonImplOrdered(x.w)); }
vec4 gnomonUnordered(uvec4 x) { return vec4(gnomonImplUnordered(x.x), gnomonImplUnordered(x.y), gnomonImplUnordered(x.z), gnomonImplUnordered(x.w)); }

#endif
