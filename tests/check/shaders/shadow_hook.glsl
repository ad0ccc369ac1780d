uniform sampler2DArray shadowMaps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  return depth <= texture(shadowMaps, vec3(uv, layer)).r ? 1.0 : 0.0;
}
