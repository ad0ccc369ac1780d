#version 330 core
#define GNOMON_COMPARE(uv, layer, depth) 1.0
#include "gnomon.glsl"
in vec3 position;
in vec3 normal;
out vec4 colour;
void main() { colour = vec4(gnomonPssmLit(gnomon, position, normal, gl_FragCoord.z)); }
