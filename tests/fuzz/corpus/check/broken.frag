#version 450
#include "gnomon_lloyd.glsl"
void main() { undefined(gnomon; }
