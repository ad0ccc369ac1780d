#version 330 core
#include "gnomon.glsl"
#include "lighting.glsl"
out vec4 colour;
void main() { colour = vec4(light()); }
