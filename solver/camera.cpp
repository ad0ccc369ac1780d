#include "gnomon/camera.h"

#include <limits>
#include <numbers>

#include "numeric.h"

namespace gnomon {
namespace {

Camera make(const glm::dvec3& positionWs, const glm::dvec3& forwardWs, const glm::dvec3& upWs, Projection projection, double halfHeight,
            double aspect, double near, double far) noexcept {
  Camera camera;
  camera.positionWs = positionWs;
  camera.forwardWs = forwardWs;
  camera.upWs = upWs;
  camera.projection = projection;
  camera.left = camera.right = halfHeight * aspect;
  camera.down = camera.up = halfHeight;
  camera.near = near;
  camera.far = far;
  return camera;
}

}  // namespace

Camera perspective(const glm::dvec3& positionWs, const glm::dvec3& forwardWs, const glm::dvec3& upWs, double fovY, double aspect,
                   double near, double far) noexcept {
  const bool isAngle = fovY > 0.0 && fovY < std::numbers::pi;  // degrees would make some other view
  const double halfHeight = isAngle ? std::tan(fovY / 2.0) : std::numeric_limits<double>::quiet_NaN();
  return make(positionWs, forwardWs, upWs, Projection::perspective, halfHeight, aspect, near, far);
}

Camera orthographic(const glm::dvec3& positionWs, const glm::dvec3& forwardWs, const glm::dvec3& upWs, double height, double aspect,
                    double near, double far) noexcept {
  return make(positionWs, forwardWs, upWs, Projection::orthographic, height / 2.0, aspect, near, far);
}

Status cameraFromMatrices(const glm::dmat4& viewFromWorld, const glm::dmat4& clipFromView, DepthConvention depth, const ImageSize& image,
                          const glm::dvec2& jitterNdc, Camera& camera) noexcept {
  constexpr double kRigid = 1e-3;  // relative; float32 engines reach 1e-6
  if (!(image.width > 0.0 && image.height > 0.0)) return Status::imageSize;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) {
      if (!std::isfinite(viewFromWorld[c][r])) return Status::cameraViewMatrix;
      if (!std::isfinite(clipFromView[c][r])) return Status::cameraProjectionMatrix;
    }
  const glm::dmat3 rotation(viewFromWorld);
  const glm::dmat3 rows = glm::transpose(rotation);
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(viewFromWorld[i][3]) <= kRigid) || !(std::abs(glm::dot(rows[i], rows[i]) - 1.0) <= kRigid))
      return Status::cameraViewMatrix;
    if (!(std::abs(glm::dot(rows[i], rows[(i + 1) % 3])) <= kRigid)) return Status::cameraViewMatrix;
  }
  if (!(std::abs(viewFromWorld[3][3] - 1.0) <= kRigid)) return Status::cameraViewMatrix;

  // Rows of the projection: x (a 0 c tx), y (0 b d ty), z (0 0 e g), w (0 0 +-1 0) or (0 0 0 1).
  const glm::dmat4& p = clipFromView;
  const double a = p[0][0], b = p[1][1], e = p[2][2], g = p[3][2], w = p[2][3];
  const bool isPerspective = p[3][3] == 0.0;
  const double scale = isPerspective ? std::abs(w) : p[3][3];  // a projection times any number is the same projection
  if (!(scale > 0.0) || a == 0.0 || b == 0.0 || p[1][0] != 0.0 || p[0][1] != 0.0 || p[0][2] != 0.0 || p[1][2] != 0.0 || p[0][3] != 0.0 ||
      p[1][3] != 0.0 || (isPerspective && (p[3][0] != 0.0 || p[3][1] != 0.0)) ||
      (!isPerspective && (w != 0.0 || p[2][0] != 0.0 || p[2][1] != 0.0)))
    return Status::cameraProjectionMatrix;

  const bool isReversed = depth == DepthConvention::reversedZeroToOne;
  // sigma: +1 where view space looks along its +z, -1 along -z. Depth Z = sigma z.
  const double sigma = isPerspective ? (w > 0.0 ? 1.0 : -1.0) : ((e > 0.0) != isReversed ? 1.0 : -1.0);
  const double nearNdc = depth == DepthConvention::negativeOneToOne ? -1.0 : (isReversed ? 1.0 : 0.0);
  const double farNdc = isReversed ? 0.0 : 1.0;
  // ndc z = es + g/Z (perspective) or es Z + g (orthographic)
  const double es = e * sigma / scale, gs = g / scale;
  Camera out;
  if (isPerspective) {
    out.near = gs / (nearNdc - es);
    out.far = gs / (farNdc - es);
    if (!(out.far > 0.0)) out.far = kInfinity;  // es at or a rounding past the limit of an infinite projection
  } else {
    out.near = (nearNdc - gs) / es;
    out.far = (farNdc - gs) / es;
  }
  if (!std::isfinite(out.near) || (isPerspective && !(out.near > 0.0)) || !(out.far > out.near)) return Status::cameraProjectionMatrix;

  // Off-centre of the two axes in normalised device units, jitter taken out.
  glm::dvec2 centre = isPerspective ? glm::dvec2(p[2][0], p[2][1]) * sigma / scale : glm::dvec2(p[3][0], p[3][1]) / scale;
  if (!std::isfinite(jitterNdc.x) || !std::isfinite(jitterNdc.y)) return Status::cameraProjectionMatrix;
  centre -= jitterNdc;
  if (std::abs(centre.x) < 2.0 / image.width && std::abs(centre.y) < 2.0 / image.height) centre = glm::dvec2(0.0);
  const double halfX = std::abs(scale / a), halfY = std::abs(scale / b);
  const double shiftX = centre.x * (scale / a), shiftY = centre.y * (scale / b);
  out.left = halfX + shiftX;
  out.right = halfX - shiftX;
  out.down = halfY + shiftY;
  out.up = halfY - shiftY;

  const glm::dvec3 right = unit(rows[0]), up = unit(rows[1]);
  out.forwardWs = unit(rows[2]) * sigma;
  out.upWs = up;
  // A mirrored view has its right hand where forward x up is left.
  if (glm::dot(glm::cross(out.forwardWs, up), right) < 0.0) std::swap(out.left, out.right);
  out.positionWs = -(glm::inverse(rotation) * glm::dvec3(viewFromWorld[3]));
  out.projection = isPerspective ? Projection::perspective : Projection::orthographic;
  out.depth = depth;
  out.shadowDistance = camera.shadowDistance;
  camera = out;
  return Status::ok;
}

void enclose(std::span<const Camera> cameras, const Camera& axis, glm::dvec3 (&cornersWs)[8]) noexcept {
  const glm::dmat3 worldFromView = viewAxes(axis.forwardWs, axis.upWs);
  const std::size_t count = 8 * cameras.size();
  const auto corner = [&](std::size_t i) {  // in the view space of `axis`
    const Camera& camera = cameras[i / 8];
    const double z = (i & 4) ? shadowFar(camera) : camera.near, k = camera.projection == Projection::perspective ? z : 1.0;
    const glm::dvec3 own(((i & 1) ? camera.right : -camera.left) * k, ((i & 2) ? camera.up : -camera.down) * k, z);
    return (viewAxes(camera.forwardWs, camera.upWs) * own + (camera.positionWs - axis.positionWs)) * worldFromView;
  };
  double near = kInfinity, far = -kInfinity;
  for (std::size_t i = 0; i < count; ++i) {
    near = std::min(near, corner(i).z);
    far = std::max(far, corner(i).z);
  }
  const double middle = (near + far) / 2.0;
  for (int side = 0; side < 4; ++side) {  // left, right, down, up
    const int across = side / 2;
    const double sign = side % 2 ? -1.0 : 1.0;  // as if each were the left side
    double least = kInfinity, slope = 0.0, offset = kInfinity;
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j < count; ++j) {
        const glm::dvec3 p = corner(i), q = corner(j);
        if (!(p.z <= middle && q.z > middle)) continue;
        const double perDepth = sign * (q[across] - p[across]) / (q.z - p.z), x = sign * p[across] + perDepth * (middle - p.z);
        if (x < least) {  // the hull's edge half-way in depth
          least = x;
          slope = perDepth;
        }
      }
    for (std::size_t i = 0; i < count; ++i) offset = std::min(offset, sign * corner(i)[across] - slope * corner(i).z);
    for (int i = 0; i < 8; ++i)
      if ((i >> across & 1) == side % 2) cornersWs[i][across] = sign * (offset + slope * ((i & 4) ? far : near));
  }
  for (int i = 0; i < 8; ++i) {
    cornersWs[i].z = (i & 4) ? far : near;
    cornersWs[i] = worldFromView * cornersWs[i] + axis.positionWs;
  }
}

Status validate(const Camera& camera, double& value) noexcept {
  const bool isPerspective = camera.projection == Projection::perspective;
  const auto refuse = [&](const glm::dvec3& v, Status status) {
    value = firstBad(v, 0.0);
    return status;
  };
  if (!isFinite(camera.positionWs)) return refuse(camera.positionWs, Status::cameraPosition);
  const glm::dvec3 forward = unit(camera.forwardWs), up = unit(camera.upWs);
  if (!(glm::dot(forward, forward) > 0.0)) return refuse(camera.forwardWs, Status::cameraForward);
  // Below this the right vector is rounding noise; it is far under what any engine means by an up vector.
  constexpr double kParallel = 1e-12;
  const glm::dvec3 side = glm::cross(forward, up);
  if (!(glm::dot(side, side) > kParallel * kParallel)) return refuse(camera.upWs, Status::cameraUp);
  value = camera.near;
  if (!std::isfinite(camera.near) || (isPerspective && !(camera.near > 0.0))) return Status::cameraNear;
  value = camera.far;
  if (!(camera.far > camera.near)) return Status::cameraFar;
  value = camera.shadowDistance;
  if (!(camera.shadowDistance == camera.shadowDistance)) return Status::cameraShadowDistance;
  value = camera.far;
  if (!std::isfinite(camera.far) && !(isPerspective && std::isfinite(camera.shadowDistance))) return Status::cameraInfiniteFar;
  for (const double side1 : {camera.left, camera.right, camera.down, camera.up})
    if (value = side1; !std::isfinite(side1)) return Status::cameraTangents;
  if (value = camera.left + camera.right; !(value > 0.0)) return Status::cameraTangents;
  if (value = camera.down + camera.up; !(value > 0.0)) return Status::cameraTangents;
  return Status::ok;
}

double viewDepthAt(const Camera& camera, double windowDepth) noexcept {
  const double n = camera.near, f = camera.far, d = windowDepth;
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne;
  const double fromNear = isReversed ? 1.0 - d : d, fromFar = isReversed ? d : 1.0 - d;  // d itself: reversed depth is fine near 0
  if (camera.projection == Projection::orthographic) return n * fromFar + f * fromNear;
  return 1.0 / (fromFar / n + fromNear / f);  // 1 / z is linear in window depth
}

}  // namespace gnomon
