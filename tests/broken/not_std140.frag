#version 330 core
#define GNOMON_NO_UNIFORM
#include "gnomon.glsl"
uniform Sun { GnomonBlock sun; };
in vec3 world;
in vec3 normal;
out vec4 colour;
uniform sampler2DArray maps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= texture(maps, vec3(uv, layer)).r ? 1.0 : 0.0; }
void main() { colour = vec4(gnomonShadow(sun, 0, gnomonSelect(sun, gl_FragCoord.z, world), world, normal)); }
