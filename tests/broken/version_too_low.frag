#version 330 core
#include "gnomon.glsl"
in vec3 world;
in vec3 normal;
out vec4 colour;
uniform sampler2DArray maps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  vec4 texels = textureGather(maps, vec3(uv, layer));
  return dot(vec4(0.25), step(vec4(depth), texels));
}
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  colour = vec4(gnomonShadow(gnomon, 0, index, world, normal));
}
