#include "truth.h"

#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

namespace gnomon::offscreen {
namespace {

Mesh meshOf(std::vector<glm::vec3> positions, std::vector<std::uint32_t> indices) {
  Mesh mesh{"test", std::move(positions), std::move(indices), glm::dvec3(std::numeric_limits<double>::infinity()), {}};
  mesh.max = -mesh.min;
  for (const glm::vec3& p : mesh.positionsWs) {
    mesh.min = glm::min(mesh.min, glm::dvec3(p));
    mesh.max = glm::max(mesh.max, glm::dvec3(p));
  }
  return mesh;
}

// A plane y = 0 over [-10, 10] squared and a box over [-1, 1] x [2, 3] x [-1, 1], all moved by an offset.
Mesh boxOverPlane(const glm::vec3& offset) {
  std::vector<glm::vec3> p{{-10, 0, -10}, {10, 0, -10}, {10, 0, 10}, {-10, 0, 10}};
  for (int i = 0; i < 8; ++i) p.emplace_back((i & 1) ? 1 : -1, (i & 2) ? 3 : 2, (i & 4) ? 1 : -1);
  for (glm::vec3& v : p) v += offset;
  std::vector<std::uint32_t> indices{0, 2, 1, 0, 3, 2};
  const std::array<std::array<std::uint32_t, 4>, 6> faces{
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& f : faces) {
    for (const std::size_t k : {0u, 1u, 2u, 0u, 2u, 3u}) indices.push_back(4 + f[k]);
  }
  return meshOf(p, indices);
}

std::uint8_t litAt(const Tracer& tracer, const glm::dvec3& point, const glm::dvec3& normal, const glm::dvec3& origin,
                   const glm::dvec3& camera, const glm::dvec3& forward, const glm::dvec3& light) {
  const glm::vec3 p(point - origin), n(normal);
  return tracer.lit({p.x, p.y, p.z}, {n.x, n.y, n.z}, {1}, origin, forward, camera, light)[0];
}

TEST(TruthTest, RefusesBrokenInput) {
  EXPECT_THROW(Tracer(meshOf({{0, 0, 0}}, {})), std::runtime_error);
  EXPECT_THROW(Tracer(meshOf({{0, 0, 0}, {1, 0, 0}}, {0, 1})), std::runtime_error);
  EXPECT_THROW(Tracer(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 3})), std::runtime_error);
  const Tracer tracer(boxOverPlane({0, 0, 0}));
  const std::vector<float> one(3, 0.0f), two(6, 0.0f);
  const glm::dvec3 v(0, 0, -1), zero(0.0);
  EXPECT_THROW((void)tracer.lit(two, one, {1}, zero, v, zero, v), std::runtime_error);
  EXPECT_THROW((void)tracer.lit(one, two, {1}, zero, v, zero, v), std::runtime_error);
  EXPECT_THROW((void)tracer.lit(one, one, {1}, zero, zero, zero, v), std::runtime_error);
  EXPECT_THROW((void)tracer.lit(one, one, {1}, zero, v, zero, zero), std::runtime_error);
  EXPECT_NO_THROW((void)tracer.lit(one, one, {1}, zero, v, zero, v));
}

TEST(TruthTest, NothingStaysNothing) {
  const Tracer tracer(boxOverPlane({0, 0, 0}));
  const std::vector<float> two(6, 0.0f);
  const std::vector<std::uint8_t> lit = tracer.lit(two, {0, 1, 0, 0, 1, 0}, {0, 1}, {0, 0, 0}, {0, 0, -1}, {0, 5, 8}, {0, -1, 0});
  EXPECT_EQ(lit, (std::vector<std::uint8_t>{kNothing, kShadowed}));  // the origin lies under the box
}

// The light travels along (1, -2, 0): from a height h it reaches the ground h / 2 farther along x. The box's shadow runs from
// its lower left edge, -1 + 2/2 = 0, to its upper right edge, 1 + 3/2 = 2.5, where the lower one is at 2 and the upper left
// one at 0.5; in z from -1 to 1.
TEST(TruthTest, ShadowOfABoxByHand) {
  for (const glm::vec3& offset : {glm::vec3(0, 0, 0), glm::vec3(1e6f, -1e6f, 1e6f)}) {
    const Tracer tracer(boxOverPlane(offset));
    const glm::dvec3 o(offset), camera = o + glm::dvec3(0, 6, 9), forward(0, -0.5, -1), light(1, -2, 0), up(0, 1, 0);
    const auto onGround = [&](double x, double z) { return litAt(tracer, o + glm::dvec3(x, 0, z), up, camera, camera, forward, light); };
    // The offset is 1e-4 of a depth of about 10, 1e-3 along y: it moves the shadow's ends by 5e-4 at most.
    const double step = 1e-3;
    for (const double z : {-0.99, 0.0, 0.3, 0.99}) {
      EXPECT_EQ(onGround(0.0 - step, z), kLit);
      EXPECT_EQ(onGround(0.0 + step, z), kShadowed);
      EXPECT_EQ(onGround(1.3, z), kShadowed);
      EXPECT_EQ(onGround(2.5 - step, z), kShadowed);
      EXPECT_EQ(onGround(2.5 + step, z), kLit);
    }
    for (const double x : {0.2, 1.0, 2.3}) {
      EXPECT_EQ(onGround(x, 1.0 - step), kShadowed);
      EXPECT_EQ(onGround(x, 1.0 + step), kLit);
      EXPECT_EQ(onGround(x, -1.0 - step), kLit);
    }
    // On the box: its top is lit, its underside and the face away from the light are not.
    EXPECT_EQ(litAt(tracer, o + glm::dvec3(0.2, 3, 0.1), up, camera, camera, forward, light), kLit);
    EXPECT_EQ(litAt(tracer, o + glm::dvec3(0.2, 2, 0.1), -up, camera, camera, forward, light), kShadowed);
    EXPECT_EQ(litAt(tracer, o + glm::dvec3(1, 2.5, 0.1), {1, 0, 0}, camera, camera, forward, light), kShadowed);
    EXPECT_EQ(litAt(tracer, o + glm::dvec3(-1, 2.5, 0.1), {-1, 0, 0}, camera, camera, forward, light), kLit);
  }
}

// A ray starts 1e-4 of the view depth above the surface. A sheet 5e-3 above the ground hides the light from
// points at depths below 50, and lies under the ray's start beyond. View depth counts along the view direction, not along the ray.
TEST(TruthTest, OffsetIsATenThousandthOfViewDepth) {
  const Mesh mesh = meshOf({{-500, 0, -500},
                            {500, 0, -500},
                            {500, 0, 500},
                            {-500, 0, 500},
                            {-500, 5e-3f, -500},
                            {500, 5e-3f, -500},
                            {500, 5e-3f, 500},
                            {-500, 5e-3f, 500}},
                           {0, 2, 1, 0, 3, 2, 4, 6, 5, 4, 7, 6});
  const Tracer tracer(mesh);
  const glm::dvec3 camera(0, 30, 0), forward(0, 0, -7), light(0.1, -1, 0.2), up(0, 1, 0);
  for (const double aside : {0.0, 40.0}) {
    EXPECT_EQ(litAt(tracer, {aside, 0, -49}, 3.0 * up, camera, camera, forward, light), kShadowed);
    EXPECT_EQ(litAt(tracer, {aside, 0, -51}, 3.0 * up, camera, camera, forward, light), kLit);
  }
}

// A scene 200 km wide has float32 positions 8 mm apart: rounded, a start 0.2 mm above the ground would often fall below it.
TEST(TruthTest, AWidePlaneDoesNotShadowItself) {
  std::vector<glm::vec3> corners{{-1e5f, 0, -1e5f}, {1e5f, 700, -1e5f}, {1e5f, 1500, 1e5f}, {-1e5f, 800, 1e5f}};
  const Tracer tracer(meshOf(corners, {0, 2, 1, 0, 3, 2}));
  const glm::dvec3 a(corners[0]), u = glm::dvec3(corners[1]) - a, v = glm::dvec3(corners[3]) - a;
  const glm::dvec3 up = glm::normalize(glm::cross(v, u));
  std::vector<float> position, normal;
  const glm::dvec3 camera = a + 0.37 * u + 0.61 * v + 1.7 * up;
  for (int i = 0; i < 4000; ++i) {
    const glm::dvec3 p = a + (0.37 + 2e-5 * std::cos(i * 1.7)) * u + (0.61 + 2e-5 * std::sin(i * 2.3)) * v - camera;
    for (int k = 0; k < 3; ++k) {
      position.push_back(static_cast<float>(p[k]));
      normal.push_back(static_cast<float>(up[k]));
    }
  }
  const std::vector<std::uint8_t> lit =
      tracer.lit(position, normal, std::vector<std::uint8_t>(4000, 1), camera, glm::normalize(u + v) - 0.5 * up, camera, {0.3, -0.5, 0.2});
  for (std::size_t i = 0; i < lit.size(); ++i) ASSERT_EQ(lit[i], kLit) << i;
}

TEST(TruthTest, TrianglesAreTwoSidedAndManyPixelsAgreeWithOne) {
  const Mesh up = meshOf({{-1, 2, -1}, {3, 2, -1}, {-1, 2, 3}}, {0, 1, 2}), down = meshOf({{-1, 2, -1}, {3, 2, -1}, {-1, 2, 3}}, {0, 2, 1});
  for (const Mesh& mesh : {up, down}) {
    const Tracer tracer(mesh);
    constexpr std::size_t kCount = 20000;  // several chunks
    std::vector<float> position, normal;
    std::vector<std::uint8_t> expected;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double x = -2.0 + 6.0 * static_cast<double>(i % 141) / 140.5, z = -2.0 + 6.0 * static_cast<double>(i / 141) / 141.3;
      position.insert(position.end(), {static_cast<float>(x), 0.0f, static_cast<float>(z)});
      normal.insert(normal.end(), {0.0f, 1.0f, 0.0f});
      expected.push_back(x > -1 && z > -1 && x + z < 2 ? kShadowed : kLit);  // straight down: the triangle's own outline
    }
    EXPECT_EQ(tracer.lit(position, normal, std::vector<std::uint8_t>(kCount, 1), {0, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, -1, 0}), expected);
  }
}

}  // namespace
}  // namespace gnomon::offscreen
