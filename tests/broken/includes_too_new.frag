#version 130
#include "gnomon.glsl"
out vec4 colour;
void main() { colour = vec4(gnomonTint(0), 1.0); }
