#version 330 core
#include "gnomon.glsl"
#include "shadow_hook.glsl"

in vec3 world;  // position - camera position
in vec3 normal;
out vec4 colour;

void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  float lit = gnomonShadow(gnomon, 0, index, world, normal);
  colour = vec4(vec3(mix(1.0, lit, gnomonFade(gnomon, gnomonViewDepth(gnomon, world)))), 1.0);
}
