// A copy from before the first release: no bias, eight maps.
#ifndef GNOMON_BLOCK_GLSL
#define GNOMON_BLOCK_GLSL

#define GNOMON_LAYOUT_VERSION 0
#define GNOMON_FLAG_VIEW_DEPTH 1u

struct GnomonPartition {
  mat4 clipFromWorld;
  mat4 atlasFromWorld;
  vec4 viewport;
  vec4 uvBounds;
  vec4 interval;
  vec4 layer;
};

struct GnomonBlock {
  uvec4 info;
  vec4 atlas;
  vec4 origin;
  vec4 lightDirection;
  vec4 viewPlane;
  vec4 depthRule;
  vec4 windowStart[2];
  vec4 viewStart[2];
  GnomonPartition partitions[8];
};

layout(std140) uniform gnomonUniforms { GnomonBlock gnomon; };

#endif
