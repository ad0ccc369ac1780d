#version 300 es
precision highp float;
#include "gnomon_pssm.glsl"
out vec4 c;
void main() { c = vec4(float(gnomonIndexFromDepth(gnomon, 0.5))); }
