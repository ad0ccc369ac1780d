#include "truth.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>

#include <embree3/rtcore.h>
#include <glm/geometric.hpp>

namespace gnomon::offscreen {
namespace {

// One ray as Embree hands it to the filter: the context must come first.
struct ExactRay {
  RTCIntersectContext context;
  glm::dvec3 start;  // relative to the mesh's centre
  glm::dvec3 direction;
};

struct Triangles {
  std::vector<glm::dvec3> vertices;  // relative to the mesh's centre
  std::vector<std::uint32_t> indices;
};

// Embree rounds the ray's start to float32, which can push it through the surface it left: keep only hits whose plane
// lies ahead of the exact start. The plane alone decides; whether the triangle is crossed Embree knows well enough.
void refuseHitsBehindStart(const RTCFilterFunctionNArguments* arguments) {
  if (arguments->N != 1 || arguments->valid[0] != -1) return;
  const auto& triangles = *static_cast<const Triangles*>(arguments->geometryUserPtr);
  const auto& ray = *reinterpret_cast<const ExactRay*>(arguments->context);
  const std::size_t first = std::size_t{3} * RTCHitN_primID(arguments->hit, 1, 0);
  const glm::dvec3& a = triangles.vertices[triangles.indices[first]];
  const glm::dvec3 normal =
      glm::cross(triangles.vertices[triangles.indices[first + 1]] - a, triangles.vertices[triangles.indices[first + 2]] - a);
  const double towards = glm::dot(normal, ray.direction);
  const double ahead = glm::dot(normal, a - ray.start);
  if (!(ahead * towards > 0.0)) arguments->valid[0] = 0;
}

glm::dvec3 unit(const glm::dvec3& v, const char* what) {
  const double length = glm::length(v);
  if (!(length > 0.0) || !std::isfinite(length))
    throw std::runtime_error(std::string("truth: ") + what + " must be a finite, non-zero vector");
  return v / length;
}

}  // namespace

struct Tracer::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Triangles triangles;
  glm::dvec3 centreWs{0.0};

  ~State() {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
};

Tracer::Tracer(const Mesh& mesh) : impl(std::make_unique<State>()) {
  State& state = *impl;
  if (mesh.indices.empty() || mesh.indices.size() % 3 != 0) throw std::runtime_error("truth: a mesh without whole triangles");
  for (const std::uint32_t index : mesh.indices) {
    if (index >= mesh.positionsWs.size()) throw std::runtime_error("truth: an index beyond the vertices");
  }
  state.centreWs = 0.5 * (mesh.min + mesh.max);
  state.triangles.indices = mesh.indices;
  state.triangles.vertices.reserve(mesh.positionsWs.size());
  for (const glm::vec3& position : mesh.positionsWs) state.triangles.vertices.push_back(glm::dvec3(position) - state.centreWs);

  state.device = rtcNewDevice(nullptr);
  if (!state.device) throw std::runtime_error("truth: Embree found no usable device");
  state.scene = rtcNewScene(state.device);
  rtcSetSceneFlags(state.scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(state.scene, RTC_BUILD_QUALITY_MEDIUM);
  const RTCGeometry geometry = rtcNewGeometry(state.device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), state.triangles.vertices.size()));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                      3 * sizeof(std::uint32_t), state.triangles.indices.size() / 3));
  if (vertices && indices) {
    for (const glm::dvec3& vertex : state.triangles.vertices) {
      *vertices++ = static_cast<float>(vertex.x);
      *vertices++ = static_cast<float>(vertex.y);
      *vertices++ = static_cast<float>(vertex.z);
    }
    std::copy(state.triangles.indices.begin(), state.triangles.indices.end(), indices);
    rtcSetGeometryUserData(geometry, &state.triangles);
    rtcSetGeometryOccludedFilterFunction(geometry, refuseHitsBehindStart);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state.scene, geometry);
    rtcCommitScene(state.scene);
  }
  rtcReleaseGeometry(geometry);
  if (rtcGetDeviceError(state.device) != RTC_ERROR_NONE) throw std::runtime_error("truth: Embree could not build the scene");
}

Tracer::~Tracer() = default;
Tracer::Tracer(Tracer&&) noexcept = default;
Tracer& Tracer::operator=(Tracer&&) noexcept = default;

std::vector<std::uint8_t> Tracer::lit(const std::vector<float>& position, const std::vector<float>& normal,
                                      const std::vector<std::uint8_t>& present, const glm::dvec3& originWs, const glm::dvec3& forwardWs,
                                      const glm::dvec3& cameraWs, const glm::dvec3& lightDirectionWs) const {
  const std::size_t count = present.size();
  if (position.size() != 3 * count || normal.size() != 3 * count)
    throw std::runtime_error("truth: positions, normals and presence of different sizes");
  const glm::dvec3 forward = unit(forwardWs, "the view direction");
  const glm::dvec3 toLight = -unit(lightDirectionWs, "the light direction");

  std::vector<std::uint8_t> answer(count, kNothing);
  constexpr std::size_t kChunk = 4096;  // pixels a thread takes at a time: small enough to balance, large enough not to contend
  std::atomic<std::size_t> next{0};
  const auto trace = [&] {
    ExactRay exact{};
    rtcInitIntersectContext(&exact.context);
    exact.direction = toLight;
    for (std::size_t begin = next.fetch_add(kChunk); begin < count; begin = next.fetch_add(kChunk)) {
      for (std::size_t i = begin; i < std::min(begin + kChunk, count); ++i) {
        if (present[i] == 0) continue;
        const glm::dvec3 pointWs = originWs + glm::dvec3(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
        const glm::dvec3 n(normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]);
        const double length = glm::length(n);
        const double depth = std::abs(glm::dot(pointWs - cameraWs, forward));  // an orthographic camera also sees depths below 0
        exact.start = pointWs - impl->centreWs + (length > 0.0 ? n * (kTruthOffset * depth / length) : glm::dvec3(0.0));
        RTCRay ray{};
        ray.org_x = static_cast<float>(exact.start.x);
        ray.org_y = static_cast<float>(exact.start.y);
        ray.org_z = static_cast<float>(exact.start.z);
        ray.dir_x = static_cast<float>(toLight.x);
        ray.dir_y = static_cast<float>(toLight.y);
        ray.dir_z = static_cast<float>(toLight.z);
        ray.tnear = 0.0f;
        ray.tfar = std::numeric_limits<float>::infinity();
        ray.mask = static_cast<unsigned>(-1);
        rtcOccluded1(impl->scene, &exact.context, &ray);
        answer[i] = ray.tfar < 0.0f ? kShadowed : kLit;  // Embree marks an occluded ray with tfar = -infinity
      }
    }
  };

  const unsigned threadCount = std::max(1u, std::thread::hardware_concurrency());
  std::vector<std::thread> threads;
  for (unsigned i = 1; i < threadCount; ++i) threads.emplace_back(trace);
  trace();
  for (std::thread& thread : threads) thread.join();
  return answer;
}

}  // namespace gnomon::offscreen
