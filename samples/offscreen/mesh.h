// mesh: what every part of this sample draws, traces and judges: one triangle list in world space.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace gnomon::offscreen {

// Indices come in threes, each below positionsWs.size(). min and max bound the vertices that triangles use.
struct Mesh {
  std::string name;
  std::vector<glm::vec3> positionsWs;
  std::vector<std::uint32_t> indices;
  glm::dvec3 min, max;
};

}  // namespace gnomon::offscreen
