#version 330 core
#include "gnomon.glsl"
in vec3 world;
in vec3 normal;
out vec4 colour;
uniform sampler2DArray maps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= texture(maps, vec3(uv, layer)).r ? 1.0 : 0.0; }
float gnomonFade(GnomonBlock block, float viewDepth) { return 1.0; }
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  colour = vec4(gnomonShadow(gnomon, 0, index, world, normal));
}
