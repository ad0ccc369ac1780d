// gnomon 0.1 - shadow-map partitions. MIT licence. https://opensource.org/licenses/MIT
//
// description: the uniform block that gnomon's solver fills and its shaders read. This one text is compiled as GLSL and as
//              C++: only mat4, vec4, uvec4, arrays and structs of them, so that std140 and C++ agree.
// use:         #include it (or any other gnomon_*.glsl, which do); upload Solution::block; bind it to block gnomonUniforms.
// calls:       what takes a GnomonBlock is a macro that hands members of it to a function, under the signature in its comment: passed
//              by value, a block of 3 KB stays a copy in SPIR-V where a partition is read by index. Arguments may be evaluated more
//              than once; block is the name of a uniform.
// options:     GNOMON_MAX_PARTITIONS  maps a shader can hold, 1 to 16 (default 16); the array is last, so a smaller one is a prefix
//              GNOMON_BINDING         binding of the uniform block, GLSL 420 / ES 310 and later (default: none, the host binds by name)
//              GNOMON_NO_UNIFORM      define it to declare your own blocks, one for each light:
//                                     layout(std140) uniform Sun { GnomonBlock sun; };
// needs:       #version 330 core to 460, 300 es to 320 es, or Vulkan GLSL. Positions and depths need 32 bits, so this file says
//              precision highp float and int: in ES they are the default from here on; a host that wants less for its own code says
//              so after its includes and its hook.
//
// Spaces: "world" below is world - origin (the camera's position unless the solver was asked for world space).
#ifndef GNOMON_BLOCK_GLSL
#define GNOMON_BLOCK_GLSL

#ifndef GNOMON_MAX_PARTITIONS
#define GNOMON_MAX_PARTITIONS 16
#endif
#define GNOMON_LAYOUT_VERSION 3

#ifndef __cplusplus
precision highp float;  // no effect but in ES
precision highp int;
#endif

#define GNOMON_FLAG_VIEW_DEPTH 1u   // window depth cannot tell the splits apart: select by view depth
#define GNOMON_FLAG_DEPTH_CLAMP 2u  // casters before the depth range must be clamped onto it

struct GnomonPartition {
  mat4 clipFromWorld;   // draw with it
  mat4 atlasFromWorld;  // look up with it: xy atlas uv, z stored depth (0 to 1), after division by w
  vec4 viewport;        // x, y, width, height, in texels of the atlas; rows counted from v = 0
  vec4 uvBounds;        // least u, least v, greatest u, greatest v of the viewport
  vec4 interval;        // xy: view depth served; zw: window depth times depthRule.x served; padded where no partition adjoins
  vec4 layer;           // x: layer of an array texture, 0 in an atlas; y: view depth from which the next partition's map serves
                        // too, z: 1 / the length of that band, 0 where there is none; w: 0
  vec4 axis;            // what gnomon_lloyd.glsl selects along: dot(xyz, p) + w of a world point p; view depth where no faces are used
  vec4 left;            // half-spaces served, dot(xyz, p) + w >= 0: sides of a face's wedge; (0, 0, 0, 1) where there is none
  vec4 right;
  vec4 range;           // xy: served along axis, half-open; zw: 0
};

struct GnomonBlock {
  uvec4 info;            // count of partitions, GNOMON_FLAG bits, layout version, layers
  vec4 atlas;            // width, height, 1/width, 1/height, in texels
  vec4 origin;           // xyz: origin rounded to float32; w: 0
  vec4 originRest;       // xyz: origin - float32(origin); w: 0
  vec4 lightDirection;   // xyz: unit, world, from the light to the scene; w: 0
  vec4 viewPlane;        // view depth of a world point p: dot(xyz, p) + w
  vec4 depthRule;        // x: +1, or -1 for reversed depth; y: view depth where shadows begin to fade; z: where they end; w: 1/(z - y), or 0
  vec4 bias;             // x: slope, y: constant (C++ struct Bias); zw: 0
  vec4 windowStart[4];   // window depth times depthRule.x at which partition 4 i + j begins; 3e38 where there is none
  vec4 viewStart[4];     // the same in view depth
  vec4 rowAlong;         // rows of the light plane: a world point p lies along at dot(xyz, p) + w
  vec4 rowAcross;        // and across at dot(xyz, p) + w
  vec4 rowRule;          // x: count of rows less 1; y, z, w: row i starts where log2(y along + z) w is i; w < 0: the rows follow no rule
  uvec4 rowCells;        // byte j of component i: the partition of cell 4 i + j, 255 none; cells row by row
  vec4 rowStart[4];      // along, where row 4 i + j starts; 3e38 where there is none
  vec4 rows[16];         // x: across, where row i's first column would begin; y: columns per unit; z: rowStart; w: first cell + last column / 32
  GnomonPartition partitions[GNOMON_MAX_PARTITIONS];
};

#ifndef __cplusplus
// A point's position in partition i before division by w: xy atlas uv, z stored depth. Linear in the point, so the vertex stage may compute
// it for gnomonPick4 or gnomonMaskCoordinate; give it gnomonBias(...) of the point there, and the fragment stage need not know the normal.
//   vec4 gnomonVertexPosition(GnomonBlock block, int i, vec3 world)
#define gnomonVertexPosition(block, i, world) (block.partitions[i].atlasFromWorld * vec4(world, 1.0))

#ifndef GNOMON_NO_UNIFORM
#ifdef GNOMON_BINDING
layout(std140, binding = GNOMON_BINDING) uniform gnomonUniforms { GnomonBlock gnomon; };
#else
layout(std140) uniform gnomonUniforms { GnomonBlock gnomon; };
#endif
#endif
#endif

#endif
