#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 direction;
uniform mat4 clipFromWorld;
uniform vec3 eye;
out vec3 world;
out vec3 normal;

void main() {
  world = position - eye;
  normal = direction;
  gl_Position = clipFromWorld * vec4(world, 1.0);
}
