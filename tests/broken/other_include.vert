#version 330 core
#include "gnomon.glsl"
in vec3 world;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 1.0; }
void main() { gl_Position = gnomonCastPosition(gnomon, 0, world); }
