// truth: what a shadow should be, by tracing one ray from each visible point to the light.
//
// Based on: Embree 3. A ray starts at the point that the camera sees, moved along its geometric normal (towards the viewer)
// by kTruthOffset of its view depth, and runs to infinity against the light's direction. Triangles are two-sided.
// Embree works in float32 relative to the mesh's centre; every hit it reports is checked in double precision to lie in
// front of the ray's start, so that a small offset in a large scene does not shadow itself.
// Shader part: none.
// Test: tests/truth_test.cpp
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <glm/vec3.hpp>

#include "mesh.h"

namespace gnomon::offscreen {

inline constexpr double kTruthOffset = 1e-4;  // of the view depth

// What Tracer::lit answers for a pixel, and what a shadow map answers in lit.npy.
inline constexpr std::uint8_t kShadowed = 0;
inline constexpr std::uint8_t kLit = 1;
inline constexpr std::uint8_t kNothing = 2;

class Tracer {
 public:
  // Builds the tree; the mesh is not needed afterwards. Throws std::runtime_error where Embree fails or an index is out of range.
  explicit Tracer(const Mesh& mesh);
  ~Tracer();
  Tracer(Tracer&&) noexcept;
  Tracer& operator=(Tracer&&) noexcept;

  // kShadowed, kLit or kNothing for each pixel, on all processors.
  //   position            n x 3, world minus originWs
  //   normal              n x 3, geometric, towards the viewer, any length
  //   present             n, 0 where there is nothing
  //   forwardWs           the view direction, any length; view depth is measured along it from cameraWs
  //   lightDirectionWs    from the light to the scene, any length
  // Throws std::runtime_error where the sizes disagree.
  [[nodiscard]] std::vector<std::uint8_t> lit(const std::vector<float>& position, const std::vector<float>& normal,
                                              const std::vector<std::uint8_t>& present, const glm::dvec3& originWs,
                                              const glm::dvec3& forwardWs, const glm::dvec3& cameraWs,
                                              const glm::dvec3& lightDirectionWs) const;

 private:
  struct State;
  std::unique_ptr<State> impl;
};

}  // namespace gnomon::offscreen
