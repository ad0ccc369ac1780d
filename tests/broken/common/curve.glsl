vec3 curve(vec3 x) {
  vec3 y = x * x
  return y;
}
