#version 330 core
#include "gnomon_cast.glsl"
layout(location = 0) in vec3 position;
uniform vec3 eye;
uniform int map;

void main() { gl_Position = gnomonCastPosition(gnomon, map, position - eye); }
