#version 330 core
#include "gnomon.glsl"
in vec3 world;
in vec3 normal;
out vec4 colour;
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  colour = vec4(gnomonShadow(gnomon, 0, index, world, normal));
}
