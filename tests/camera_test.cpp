#include "support.h"

#include <glm/gtc/matrix_transform.hpp>

namespace gnomon::test {
namespace {

constexpr ImageSize kImage{1920.0, 1080.0};

// An angle in degrees has a tangent too, of some other view.
TEST(Camera, RefusesAnglesThatAreNone) {
  Frame frame = usualFrame();
  for (const double fovY : {45.0, 90.0, 7.0, 3.1416, 0.0, -1.0}) {
    frame.camera = perspective({0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}, fovY, 1.0, 0.1, 100.0);
    EXPECT_EQ(solve(frame)->status, Status::cameraTangents) << fovY;
  }
}

TEST(Camera, RefusesBadMatrices) {
  Camera camera;
  const glm::dmat4 view = glm::lookAt(glm::dvec3(1, 2, 3), glm::dvec3(4, 1, 0), glm::dvec3(0, 1, 0)),
                   projection = glm::perspectiveRH_NO(1.0, 1.5, 0.1, 100.0);
  const auto from = [&](const glm::dmat4& v, const glm::dmat4& p, DepthConvention depth = DepthConvention::negativeOneToOne) {
    return cameraFromMatrices(v, p, depth, kImage, {0, 0}, camera);
  };
  // A view that scales.
  EXPECT_EQ(from(glm::scale(view, glm::dvec3(2.0)), projection), Status::cameraViewMatrix);
  // A view that shears.
  glm::dmat4 sheared = view;
  sheared[1] += 0.3 * sheared[0];
  EXPECT_EQ(from(sheared, projection), Status::cameraViewMatrix);
  // NaN in either.
  glm::dmat4 nan = view;
  nan[3][1] = std::nan("");
  EXPECT_EQ(from(nan, projection), Status::cameraViewMatrix);
  glm::dmat4 nanProjection = projection;
  nanProjection[0][0] = std::nan("");
  EXPECT_EQ(from(view, nanProjection), Status::cameraProjectionMatrix);
  // No projection at all, a singular one, and one in another depth convention.
  EXPECT_EQ(from(view, glm::dmat4(0.0)), Status::cameraProjectionMatrix);
  EXPECT_EQ(from(view, projection, DepthConvention::reversedZeroToOne), Status::cameraProjectionMatrix);
  EXPECT_EQ(cameraFromMatrices(view, projection, DepthConvention::negativeOneToOne, {0.0, 1080.0}, {0, 0}, camera), Status::imageSize);
  // The valid one.
  EXPECT_EQ(from(view, projection), Status::ok);
}

struct FromMatrices {
  DepthConvention depth;
  bool leftHanded, isOrthographic;
};

class CameraMatrices : public ::testing::TestWithParam<FromMatrices> {};

// GLM builds the matrices: the engine's side of the bargain.
TEST_P(CameraMatrices, GiveBackWhatGlmWasGiven) {
  const auto [depth, leftHanded, isOrthographic] = GetParam();
  const glm::dvec3 eye(10.0, -4.0, 7.0), target(3.0, -6.0, 1.0), up(0.1, 1.0, 0.2);
  const double near = 0.25, far = 400.0, left = -0.7, right = 0.9, bottom = -0.5, top = 0.4;  // at view depth 1
  const glm::dmat4 view = leftHanded ? glm::lookAtLH(eye, target, up) : glm::lookAtRH(eye, target, up);
  glm::dmat4 projection;
  const double n = depth == DepthConvention::reversedZeroToOne ? far : near, f = depth == DepthConvention::reversedZeroToOne ? near : far;
  if (isOrthographic) {
    if (depth == DepthConvention::negativeOneToOne)
      projection = leftHanded ? glm::orthoLH_NO(left, right, bottom, top, n, f) : glm::orthoRH_NO(left, right, bottom, top, n, f);
    else
      projection = leftHanded ? glm::orthoLH_ZO(left, right, bottom, top, n, f) : glm::orthoRH_ZO(left, right, bottom, top, n, f);
  } else {
    // glm::frustum scales by its near argument, which is the far plane for reversed depth.
    double l = left * n, r = right * n, b = bottom * n, t = top * n;
    if (leftHanded) {  // GLM 0.9.9.8 has the sign of the off-centre terms of frustumLH wrong: a mirrored request gives the right matrix
      std::swap(l, r);
      std::swap(b, t);
      l = -l, r = -r, b = -b, t = -t;
    }
    if (depth == DepthConvention::negativeOneToOne)
      projection = leftHanded ? glm::frustumLH_NO(l, r, b, t, n, f) : glm::frustumRH_NO(l, r, b, t, n, f);
    else
      projection = leftHanded ? glm::frustumLH_ZO(l, r, b, t, n, f) : glm::frustumRH_ZO(l, r, b, t, n, f);
  }
  Camera camera;
  ASSERT_EQ(cameraFromMatrices(view, projection, depth, kImage, {0, 0}, camera), Status::ok);
  EXPECT_NEAR(glm::length(camera.positionWs - eye), 0.0, 1e-12);
  EXPECT_NEAR(glm::length(glm::normalize(camera.forwardWs) - glm::normalize(target - eye)), 0.0, 1e-12);
  EXPECT_NEAR(camera.near, near, 1e-9);
  EXPECT_NEAR(camera.far, far, 1e-6);
  EXPECT_NEAR(camera.down, -bottom, 1e-12);
  EXPECT_NEAR(camera.up, top, 1e-12);
  // lookAtLH's x axis is up x forward: the engine's right is our left.
  EXPECT_NEAR(camera.left, leftHanded ? right : -left, 1e-12);
  EXPECT_NEAR(camera.right, leftHanded ? -left : right, 1e-12);
  EXPECT_EQ(camera.projection, isOrthographic ? Projection::orthographic : Projection::perspective);
  EXPECT_EQ(camera.depth, depth);
  // A corner of the far plane lies where the matrices put it.
  const glm::dvec3 corner = camera.positionWs + viewPoint(camera, leftHanded ? 0.0 : 1.0, 1.0, far);
  const glm::dvec4 clip = projection * view * glm::dvec4(corner, 1.0);
  EXPECT_NEAR(clip.x / clip.w, 1.0, 1e-9);
  EXPECT_NEAR(clip.y / clip.w, 1.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    All, CameraMatrices,
    ::testing::Values(FromMatrices{DepthConvention::negativeOneToOne, false, false}, FromMatrices{DepthConvention::zeroToOne, false, false},
                      FromMatrices{DepthConvention::reversedZeroToOne, false, false},
                      FromMatrices{DepthConvention::negativeOneToOne, true, false}, FromMatrices{DepthConvention::zeroToOne, true, false},
                      FromMatrices{DepthConvention::reversedZeroToOne, true, false},
                      FromMatrices{DepthConvention::negativeOneToOne, false, true}, FromMatrices{DepthConvention::zeroToOne, false, true},
                      FromMatrices{DepthConvention::reversedZeroToOne, false, true}, FromMatrices{DepthConvention::zeroToOne, true, true},
                      FromMatrices{DepthConvention::reversedZeroToOne, true, true}));

TEST(Camera, KnowsAnInfiniteProjection) {
  const glm::dmat4 view = glm::lookAt(glm::dvec3(0, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  Camera camera;
  ASSERT_EQ(cameraFromMatrices(view, glm::infinitePerspective(1.0, 1.5, 0.1), DepthConvention::negativeOneToOne, kImage, {0, 0}, camera),
            Status::ok);
  EXPECT_EQ(camera.far, kInfinity);
  EXPECT_NEAR(camera.near, 0.1, 1e-12);
  // Reversed: clip z = near, w = -z.
  glm::dmat4 reversed(0.0);
  reversed[0][0] = reversed[1][1] = 1.0;
  reversed[2][3] = -1.0;
  reversed[3][2] = 0.1;
  ASSERT_EQ(cameraFromMatrices(view, reversed, DepthConvention::reversedZeroToOne, kImage, {0, 0}, camera), Status::ok);
  EXPECT_EQ(camera.far, kInfinity);
  EXPECT_NEAR(camera.near, 0.1, 1e-12);
}

TEST(Camera, TakesSubPixelJitterOut) {
  const glm::dmat4 view = glm::lookAt(glm::dvec3(0, 0, 0), glm::dvec3(1, 0, -1), glm::dvec3(0, 1, 0));
  const glm::dmat4 still = glm::perspectiveRH_ZO(1.0, 16.0 / 9.0, 0.1, 100.0);
  for (const double pixels : {-0.49, 0.1, 0.5}) {
    glm::dmat4 jittered = still;
    jittered[2][0] += 2.0 * pixels / kImage.width;
    jittered[2][1] -= 2.0 * pixels / kImage.height;
    Camera camera;
    ASSERT_EQ(cameraFromMatrices(view, jittered, DepthConvention::zeroToOne, kImage, {0, 0}, camera), Status::ok);
    EXPECT_NEAR(camera.right, std::tan(0.5) * 16.0 / 9.0, 1e-12);
    EXPECT_EQ(camera.left, camera.right);
    EXPECT_EQ(camera.down, camera.up);
  }
  // A truly off-centre projection keeps its centre, and gives up the jitter it is told of.
  glm::dmat4 offCentre = still;
  offCentre[2][0] += 0.2;
  Camera plain, told;
  ASSERT_EQ(cameraFromMatrices(view, offCentre, DepthConvention::zeroToOne, kImage, {0, 0}, plain), Status::ok);
  EXPECT_NEAR(plain.right - plain.left, 2.0 * 0.2 * std::tan(0.5) * 16.0 / 9.0, 1e-12);
  const glm::dvec2 jitter(0.4 / kImage.width, -0.3 / kImage.height);
  // clip x += jitter w with w = -z: the third column loses it.
  offCentre[2][0] -= jitter.x;
  offCentre[2][1] -= jitter.y;
  ASSERT_EQ(cameraFromMatrices(view, offCentre, DepthConvention::zeroToOne, kImage, jitter, told), Status::ok);
  EXPECT_NEAR(told.left, plain.left, 1e-12);
  EXPECT_NEAR(told.up, plain.up, 1e-12);
}

TEST(Camera, WindowDepthIsTheProjectionsOwn) {
  // GLM's matrices are the reference: ndc z of points at several depths.
  const double near = 0.1, far = 1000.0;
  Camera camera;
  camera.near = near;
  camera.far = far;
  const auto ndc = [](const glm::dmat4& projection, double z) {
    const glm::dvec4 clip = projection * glm::dvec4(0.0, 0.0, -z, 1.0);
    return clip.z / clip.w;
  };
  for (const double z : {0.1, 0.3, 1.0, 40.0, 999.0, 1000.0}) {
    camera.projection = Projection::perspective;
    camera.far = far;
    camera.depth = DepthConvention::negativeOneToOne;
    EXPECT_NEAR(windowDepth(camera, z), 0.5 + 0.5 * ndc(glm::perspectiveRH_NO(1.0, 1.0, near, far), z), 1e-12);
    camera.depth = DepthConvention::zeroToOne;
    EXPECT_NEAR(windowDepth(camera, z), ndc(glm::perspectiveRH_ZO(1.0, 1.0, near, far), z), 1e-12);
    camera.depth = DepthConvention::reversedZeroToOne;
    EXPECT_NEAR(windowDepth(camera, z), ndc(glm::perspectiveRH_ZO(1.0, 1.0, far, near), z), 1e-12);
    camera.far = kInfinity;
    EXPECT_DOUBLE_EQ(windowDepth(camera, z), 0.1 / z);
    camera.depth = DepthConvention::zeroToOne;
    EXPECT_NEAR(windowDepth(camera, z), 1.0 - 0.1 / z, 1e-15);
    camera.projection = Projection::orthographic;
    camera.far = far;
    EXPECT_NEAR(windowDepth(camera, z), ndc(glm::orthoRH_ZO(-1.0, 1.0, -1.0, 1.0, near, far), z), 1e-12);
    camera.depth = DepthConvention::reversedZeroToOne;
    EXPECT_NEAR(windowDepth(camera, z), ndc(glm::orthoRH_ZO(-1.0, 1.0, -1.0, 1.0, far, near), z), 1e-12);
  }
}

// No product of near and far on the way leaves double's range.
TEST(Camera, WindowDepthOfAnyRange) {
  Camera camera;
  camera.near = 1e-15;
  camera.far = 1e300;
  for (const DepthConvention depth : {DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne}) {
    camera.depth = depth;
    const double atNear = depth == DepthConvention::reversedZeroToOne ? 1.0 : 0.0;
    EXPECT_EQ(windowDepth(camera, camera.near), atNear);
    EXPECT_EQ(windowDepth(camera, camera.far), 1.0 - atNear);
    EXPECT_DOUBLE_EQ(windowDepth(camera, 0.1), std::abs(1.0 - atNear - 1e-14));  // n / z of the way back from the far plane
  }
}

// Two depths apart by the quantum have different float32 values, whatever the rounding.
TEST(Camera, QuantumIsEnoughToTellDepthsApart) {
  Random random(7);
  for (int i = 0; i < 20000; ++i) {
    Camera camera;
    camera.near = random.logUniform(1e-3, 10.0);
    camera.far = camera.near * random.logUniform(2.0, 1e6);
    camera.depth = static_cast<DepthConvention>(random.index(3));
    camera.projection = random.index(4) == 0 ? Projection::orthographic : Projection::perspective;
    const double z = random.logUniform(camera.near, camera.far), other = z + depthQuantum(camera, z);
    EXPECT_NE(static_cast<float>(windowDepth(camera, z)), static_cast<float>(windowDepth(camera, other)))
        << camera.near << " " << camera.far << " " << z;
  }
}

// n = 0.1, z = 1000, 24 bits: 0.6 world units. (Printed in the errata of [Zhang 2006, sec. 3.6].)
TEST(Camera, QuantumOfTheErratasExample) {
  Camera camera;
  camera.near = 0.1;
  camera.far = 1e9;
  EXPECT_GT(depthQuantum(camera, 1000.0), 0.59);
  EXPECT_LT(depthQuantum(camera, 1000.0), 5.0);
}

}  // namespace
}  // namespace gnomon::test
