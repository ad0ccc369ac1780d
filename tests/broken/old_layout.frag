#version 330 core
#include "old_layout/gnomon_block.glsl"
in vec3 world;
out vec4 colour;
void main() { colour = vec4(dot(gnomon.viewPlane.xyz, world) + gnomon.viewPlane.w); }
