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
  const double perDeterminant = 1.0 / determinant;
  return {std::sqrt(tt) * perDeterminant, std::sqrt(ss) * perDeterminant, std::sqrt((ss + tt + root) / 2.0) * perDeterminant};
}

TexelError certify(const TexelError& size, double pixelWidthAtNear) noexcept {
  constexpr double kInflation = 1.0 + 1e-6;
  const double scale = kInflation / pixelWidthAtNear;
  return {size.s * scale, size.t * scale, size.extent * scale};
}

TexelError certify(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs,
                   const Served& served) noexcept {
  // The emitted rows in light space (from the eye), in texels.
  const glm::dmat3 lsFromWorld(light.lsFromWorld);
  const glm::dmat4 m(clipFromWorld);
  const auto row = [&](int r) {
    const glm::dvec3 ws(m[0][r], m[1][r], m[2][r]);
    return glm::dvec4(lsFromWorld * ws, m[3][r] + glm::dot(ws, eyeMinusOriginWs));
  };
  const glm::dvec4 s = row(0) * (viewport.z / 2.0), t = row(1) * (viewport.w / 2.0), wRow = row(3);
  // A texel's edges at a point are w a / D and w b / D, turned by a right angle, with the vectors a = w grad t - t grad w and
  // b = w grad s - s grad w, which are affine in the point like w and w_i, and D constant. Every point served is a mean of the
  // vertices, sum of c_i v_i, and w a = sum over i, j of c_i c_j (w_i a_j + w_j a_i) / 2 while w_i = sum of c_i c_j (pixel_i + pixel_j) / 2:
  // so the greatest |w_i a_j + w_j a_i| / (pixel_i + pixel_j) over all pairs bounds |w a| / w_i everywhere (Bernstein's form). i = j are
  // the vertices themselves, and where w grows no faster than pixels they are the greatest.
  glm::dvec2 a[kMaxHull], b[kMaxHull];
  double w[kMaxHull], determinant = kInfinity;
  for (int i = 0; i < served.count; ++i) {
    const glm::dvec4 p(served.points[i], 1.0);
    w[i] = glm::dot(wRow, p);
    a[i] = w[i] * glm::dvec2(t) - glm::dot(t, p) * glm::dvec2(wRow);
    b[i] = w[i] * glm::dvec2(s) - glm::dot(s, p) * glm::dvec2(wRow);
    determinant = std::min(determinant, std::abs(b[i].x * a[i].y - b[i].y * a[i].x) / w[i]);
    if (!(w[i] > 0.0)) determinant = 0.0;
  }
  if (!(determinant > 0.0 && served.count > 0)) return {kInfinity, kInfinity, kInfinity};
  TexelError squared;
  for (int i = 0; i < served.count; ++i)
    for (int j = i; j < served.count; ++j) {
      const glm::dvec2 edgeS = w[i] * a[j] + w[j] * a[i], edgeT = w[i] * b[j] + w[j] * b[i];
      const double pixels = served.pixels[i] + served.pixels[j], scale = 1.0 / (pixels * pixels);
      const double ss = glm::dot(edgeS, edgeS), tt = glm::dot(edgeT, edgeT), st = glm::dot(edgeS, edgeT);
      squared.s = std::max(squared.s, ss * scale);
      squared.t = std::max(squared.t, tt * scale);
      if (!((ss + tt) * scale > squared.extent)) continue;  // its largest singular value is no larger than that
      squared.extent = std::max(squared.extent, (ss + tt + std::sqrt((ss - tt) * (ss - tt) + 4.0 * st * st)) / 2.0 * scale);
    }
  constexpr double kInflation = 1.0 + 1e-6;
  const double scale = kInflation / determinant;
  return {std::sqrt(squared.s) * scale, std::sqrt(squared.t) * scale, std::sqrt(squared.extent) * scale};
}

double limitTexels(const Frame& frame) noexcept {
  const Camera& camera = frame.camera;
  if (camera.projection != Projection::perspective || camera.left != camera.right || camera.down != camera.up) return 0.0;
  if (!frame.scene.receivers.empty() || !frame.scene.planes.empty() || !frame.cornersWs.empty() || frame.samples) return 0.0;
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
