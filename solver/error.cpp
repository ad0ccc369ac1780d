#include "gnomon/error.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {

TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs) noexcept {
  // Rows of the Jacobian: texels per world unit along s and t. Clip x and y run over 2 in width and height texels.
  const glm::dvec3 s = glm::dvec3(clipFromWorld[0][0], clipFromWorld[1][0], clipFromWorld[2][0]) * (viewport.z / 2.0);
  const glm::dvec3 t = glm::dvec3(clipFromWorld[0][1], clipFromWorld[1][1], clipFromWorld[2][1]) * (viewport.w / 2.0);
  const glm::dvec3 sFlat = glm::cross(s, directionWs), tFlat = glm::cross(t, directionWs);  // lengths on the light plane
  const double determinant = std::abs(glm::dot(glm::cross(s, t), directionWs));
  if (!(determinant > 0.0)) return {kInfinity, kInfinity, kInfinity};
  // Edges of the parallelogram that the inverse Jacobian maps a texel to, and its largest singular value:
  // sigma_max of the Jacobian over the determinant. sigma_max^2 = (S + T + sqrt((S - T)^2 + 4 (s.t)^2)) / 2, S and T the squared lengths.
  const double ss = glm::dot(sFlat, sFlat), tt = glm::dot(tFlat, tFlat);
  const double st = glm::dot(sFlat, tFlat), root = std::sqrt((ss - tt) * (ss - tt) + 4.0 * st * st);
  return {std::sqrt(tt) / determinant, std::sqrt(ss) / determinant, std::sqrt((ss + tt + root) / 2.0) / determinant};
}

TexelError certify(const TexelError& size, double pixelWidthAtNear) noexcept {
  constexpr double kInflation = 1.0 + 1e-6;
  const double scale = kInflation / pixelWidthAtNear;
  return {size.s * scale, size.t * scale, size.extent * scale};
}

double limitTexels(const Frame& frame) noexcept {
  const Camera& camera = frame.camera;
  if (camera.projection != Projection::perspective || camera.left != camera.right || camera.down != camera.up) return 0.0;
  if (!frame.scene.receivers.empty() || !frame.scene.planes.empty() || !frame.cornersWs.empty()) return 0.0;
  const double far = shadowFar(camera);
  if (!(far > camera.near)) return 0.0;
  const glm::dvec3 forward = unit(camera.forwardWs), right = unit(glm::cross(forward, unit(camera.upWs))), up = glm::cross(right, forward);
  const glm::dvec3 light = unit(frame.light.directionWs);
  const glm::dvec3 l(glm::dot(light, right), glm::dot(light, up), glm::dot(light, forward));
  const double t = camera.up, a = camera.right / camera.up, length = std::log(far / camera.near);
  // a |l_z| for the cap, and ln R / 2t for each side plane that light rays enter first.
  double sum = a * std::abs(l.z);
  const double sign = l.z >= 0.0 ? 1.0 : -1.0;
  const glm::dvec4 sides[4] = {{1.0, 0.0, -a * t, 1.0}, {-1.0, 0.0, -a * t, 1.0}, {0.0, 1.0, -t, a}, {0.0, -1.0, -t, a}};
  for (const glm::dvec4& side : sides) {
    const double facing = glm::dot(glm::dvec3(side), l);
    if (facing * sign < 0.0) sum += std::abs(facing) * side.w * length / (2.0 * t);
  }
  return sum * frame.image.height * frame.image.height;
}

}  // namespace gnomon
