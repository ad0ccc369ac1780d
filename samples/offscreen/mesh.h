// A triangle mesh in world space, in scene units.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <glm/vec3.hpp>

namespace gnomon::offscreen {

struct Mesh {
  std::string name;
  std::vector<glm::vec3> positionsWs;
  std::vector<std::uint32_t> indices;  // three per triangle
  glm::dvec3 min{0.0};
  glm::dvec3 max{0.0};
};

}  // namespace gnomon::offscreen
