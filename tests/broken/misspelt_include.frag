#version 330 core
#include "gnomon_lokup.glsl"
out vec4 colour;
void main() { colour = vec4(1.0); }
