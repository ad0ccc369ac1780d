// scene: what this sample draws: generated scenes with their cameras and lights, or a user's glTF.
//
// World units are metres, y is up. The generated scenes are the same on every run; each is made to have shadow edges at
// every distance, because that is where a partitioning earns its texels.
// Shader part: none.
// Test: tests/scene_test.cpp
#pragma once

#include <string>
#include <vector>

#include <glm/vec3.hpp>

#include "gnomon/types.h"
#include "mesh.h"

namespace gnomon::offscreen {

// One picture: a camera and a light, each with a name that is unique in its scene ("avenue", "steep").
struct View {
  std::string camera, light;
  gnomon::Camera cam;
  glm::dvec3 lightDirectionWs;  // from the light to the scene, unit length
};

struct BuiltIn {
  Mesh mesh;
  std::vector<View> views;  // 60 degrees vertical, 16:9
};

// colonnade, relief, city, hall.
[[nodiscard]] std::vector<std::string> builtInNames();

// Throws std::runtime_error, with the names there are, for any other.
[[nodiscard]] BuiltIn makeBuiltIn(const std::string& name);

// Every triangle of a .glb (or .gltf) in world space: all meshes of its scene, node transforms applied in double precision, any index
// type or none, winding kept outward under mirroring. Points, lines, strips and fans are left out, materials and
// animation ignored. Throws std::runtime_error with one line that starts with the path: no such file, not glTF, no triangles, non-finite
// positions, accessors that point outside their buffers, sparse or compressed positions.
[[nodiscard]] Mesh loadGlb(const std::string& path);

// Two views of any mesh: all of it, from three quarters above, 60 degrees vertically, under a steep and a low light.
// aspect: width over height, > 0. Throws std::runtime_error for a mesh without extent.
[[nodiscard]] std::vector<View> framedViews(const Mesh& mesh, double aspect);

// Two views from inside: an eye that stands in the middle of the shorter horizontal side, a quarter along the longer, and looks along it
// over the highest geometry below, under the same lights, low first. None where nothing is in view.
[[nodiscard]] std::vector<View> standingViews(const Mesh& mesh, double aspect);

struct DepthRange {
  double nearest = 0.0, farthest = 0.0;  // view depths; nearest > farthest where nothing is inside
};

// The view depths of the geometry inside a camera's four side planes, its own near and far apart; what hides what is ignored.
[[nodiscard]] DepthRange depthInView(const Mesh& mesh, const gnomon::Camera& camera);

}  // namespace gnomon::offscreen
