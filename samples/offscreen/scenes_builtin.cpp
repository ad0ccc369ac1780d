#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <glm/geometric.hpp>

#include "gnomon/camera.h"
#include "scene.h"
#include "shapes.h"

namespace gnomon::offscreen {
namespace {

struct Entry {
  const char* name;
  BuiltIn (*make)();
};
constexpr std::array<Entry, 4> kScenes{{{"colonnade", makeColonnade}, {"relief", makeRelief}, {"city", makeCity}, {"hall", makeHall}}};

}  // namespace

std::vector<std::string> builtInNames() {
  std::vector<std::string> names;
  for (const Entry& entry : kScenes) names.emplace_back(entry.name);
  return names;
}

BuiltIn makeBuiltIn(const std::string& name) {
  std::string known;
  for (const Entry& entry : kScenes) {
    if (name == entry.name) return entry.make();
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw std::runtime_error(name + ": no such built-in scene; there are " + known);
}

gnomon::Camera builtInCamera(const Mesh& mesh, const glm::dvec3& eyeWs, const glm::dvec3& targetWs, double farthest) {
  constexpr double kFovY = std::numbers::pi / 3.0;  // radians
  gnomon::Camera camera = gnomon::perspective(eyeWs, targetWs - eyeWs, glm::dvec3(0.0, 1.0, 0.0), kFovY, 16.0 / 9.0, 1.0, 2.0);
  const DepthRange range = depthInView(mesh, camera);
  camera.near = 0.8 * range.nearest;
  camera.far = 1.05 * (farthest > 0.0 ? std::min(farthest, range.farthest) : range.farthest);
  return camera;
}

}  // namespace gnomon::offscreen
