#version 450
#define GNOMON_BINDING 0
#include "gnomon.glsl"
layout(location = 0) in vec3 world;
in vec3 normal;
layout(location = 0) out vec4 colour;
layout(binding = 1) uniform sampler2DArray maps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= texture(maps, vec3(uv, layer)).r ? 1.0 : 0.0; }
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  colour = vec4(gnomonShadow(gnomon, 0, index, world, normal));
}
