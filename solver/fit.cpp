#include "gnomon/fit.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The width of the widest part of a view slice: any rotation of it fits a square of this side.
double sliceDiameter(const Region& region, const DepthSpan& slab) noexcept {
  const Camera& camera = region.camera;
  const bool isPerspective = camera.projection == Projection::perspective;
  glm::dvec3 corners[8];
  for (int i = 0; i < 8; ++i) {
    const double z = (i & 4) ? slab.far : slab.near, k = isPerspective ? z : 1.0;
    corners[i] = {((i & 1) ? camera.right : -camera.left) * k, ((i & 2) ? camera.up : -camera.down) * k, z};
  }
  double squared = 0.0;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) squared = std::max(squared, glm::dot(corners[i] - corners[j], corners[i] - corners[j]));
  return std::sqrt(squared);
}

struct Bounds {
  glm::dvec2 least, most;  // along an axis and across it
};

Bounds boundsAlong(const Footprint& footprint, const glm::dvec2& axis) noexcept {
  const Pair x = {axis.x, -axis.y}, y = {axis.y, axis.x};
  Pair least = x * footprint.hull[0].x + y * footprint.hull[0].y, most = least;
  for (int i = 1; i < footprint.count; ++i) {
    const Pair p = x * footprint.hull[i].x + y * footprint.hull[i].y;
    least = lesser(least, p);
    most = greater(most, p);
  }
  return {{least[0], least[1]}, {most[0], most[1]}};
}

// The rectangle along an axis; no side shorter than a pixel.
void fitAlong(const Footprint& footprint, glm::dvec2 axis, double pixel, MapFit& fit) noexcept {
  fit.s = glm::dvec3(axis, 0.0);
  fit.t = {-axis.y, axis.x, 0.0};
  const auto [least, most] = boundsAlong(footprint, axis);
  fit.size = {std::max(most.x - least.x, pixel), std::max(most.y - least.y, pixel)};
  fit.least = (least + most - fit.size) / 2.0;
}

// The rectangle of least area: it has a side on an edge of the hull (rotating calipers' theorem).
void fitLeast(const Footprint& footprint, double pixel, MapFit& fit) noexcept {
  constexpr double kLess = 1.0 - 1e-12;  // the first of edges that rounding alone tells apart: a frustum's near and far sides
  double leastArea = kInfinity;
  const glm::dvec2* hull = footprint.hull;
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2 edge = hull[i + 1 < footprint.count ? i + 1 : 0] - hull[i];
    const double squared = edge.x * edge.x + edge.y * edge.y;
    if (!(squared > 0.0)) continue;
    const Bounds bounds = boundsAlong(footprint, edge);  // in lengths of the edge
    const glm::dvec2 extent = bounds.most - bounds.least;
    if (!(extent.x * extent.y < leastArea * squared)) continue;
    const double perLength = 1.0 / std::sqrt(squared);
    const glm::dvec2 axis = edge * perLength, span = extent * perLength, size(std::max(span.x, pixel), std::max(span.y, pixel));
    if (!(size.x * size.y < leastArea)) continue;
    leastArea = size.x * size.y * kLess;
    fit.s = glm::dvec3(axis, 0.0);
    fit.t = {-axis.y, axis.x, 0.0};
    fit.size = size;
    fit.least = bounds.least * perLength - (size - span) / 2.0;
  }
}

}  // namespace

Status makeLightSpace(const DirectionalLight& light, const Region& region, FitMode mode, LightSpace& out) noexcept {
  const glm::dvec3 z = unit(light.directionWs);
  if (!isFinite(light.directionWs) || !(glm::dot(z, z) > 0.0)) return Status::lightDirection;
  const glm::dvec3 zVs = z * region.worldFromView;
  out.directionWs = z;
  out.directionVs = zVs;
  // x, y and z are right, up and forward of one who looks along the light: y = x cross z in a right-handed world.
  glm::dvec3 x;
  if (mode == FitMode::stable || mode == FitMode::doubled) {
    x = planeAxis(z);
  } else if (mode == FitMode::tight) {
    x = region.worldFromView * unit(glm::cross(zVs, leastAxis(zVs)));
  } else {
    constexpr double kAlongView = 0.9;  // beyond this cosine the projected view direction says little: the camera's up serves
    const glm::dvec3 along = region.worldFromView[std::abs(zVs.z) < kAlongView ? 2 : 1];
    x = unit(glm::cross(z, along));
  }
  const glm::dvec3 y = glm::cross(x, z);
  const glm::dmat3 lsFromWorld = glm::transpose(glm::dmat3(x, y, z));
  out.lsFromWorld = glm::dmat4(lsFromWorld);
  out.lsFromView = glm::dmat4(lsFromWorld * region.worldFromView);
  return Status::ok;
}

void fitSlice(const Region& region, const Footprint& footprint, FitMode mode, double pixel, MapFit& fit) noexcept {
  const double side = mode == FitMode::stable ? std::max(sliceDiameter(region, footprint.padded), pixel) : pixel;
  fit.s = {1.0, 0.0, 0.0};
  fit.t = {0.0, 1.0, 0.0};
  fit.w = {0.0, 0.0, 1.0};
  fit.least = glm::dvec2(0.0);
  fit.size = glm::dvec2(side);
  fit.stretch = glm::dvec2(1.0);
  fit.isWarped = false;
  fit.needed = 0.0;
  fit.aspect = 1.0;
  fit.depthNear = fit.depthCentre = footprint.depthNear;
  fit.depthFar = footprint.depthFar;
  fit.depthLost = 0.0;
  if (footprint.count == 0) return;
  if (mode != FitMode::tight || footprint.count < 2) {  // a point has no edge
    fitAlong(footprint, {1.0, 0.0}, pixel, fit);
    if (mode == FitMode::stable) fit.size = glm::dvec2(side);
  } else {
    fitLeast(footprint, pixel, fit);
    if (fit.size.x < fit.size.y) fitAlong(footprint, glm::dvec2(fit.t), pixel, fit);  // lying rectangles shelve better
  }
  fit.needed = fit.size.x * fit.size.y / (pixel * pixel);
  if (mode == FitMode::tight) fit.aspect = fit.size.x / fit.size.y;
}

void copyFit(const MapFit& fit, const Footprint& footprint, MapFit& copy) noexcept {
  copy = fit;
  if (fit.isWarped) {
    copy.s.z *= footprint.scale;
    copy.t.z *= footprint.scale;
    copy.w = {fit.w.x / footprint.scale, fit.w.y / footprint.scale, fit.w.z};
    const double low = footprint.apart * std::sqrt(copy.w.x * copy.w.x + copy.w.y * copy.w.y), raise = 1.0 / (1.0 - low);
    copy.s *= raise;  // the same map, w >= 1 on all that it must hold
    copy.t *= raise;
    copy.w *= raise;
    copy.depthCentre = std::clamp(fit.depthCentre * footprint.scale, footprint.depthNear, footprint.depthFar);
  }
  const glm::dvec2 room = footprint.apart * unitsPerWorld(copy);
  copy.least = fit.least * footprint.scale - room;
  copy.size = fit.size * footprint.scale + 2.0 * room;
  copy.depthNear = footprint.depthNear;
  copy.depthFar = footprint.depthFar;
}

glm::dvec2 unitsPerWorld(const MapFit& fit) noexcept {
  if (!fit.isWarped) return glm::dvec2(1.0);
  const auto slope = [](const glm::dvec3& row) { return std::sqrt(row.x * row.x + row.y * row.y); };
  return glm::dvec2(slope(fit.s), slope(fit.t)) + glm::max(glm::abs(fit.least), glm::abs(fit.least + fit.size)) * slope(fit.w);  // w >= 1
}

Status growToViewport(const Frame& frame, const Region& region, const LightSpace& light, const Footprint& footprint, FitMode mode,
                      const glm::ivec4& viewport, MapFit& fit, std::uint32_t& warnings) noexcept {
  const double margin = frame.margin.filter + frame.margin.normalOffset;
  const glm::dvec2 texels(viewport.z, viewport.w);
  const bool isStable = mode == FitMode::stable, isSnapped = isStable || mode == FitMode::doubled;
  const glm::dvec2 inner = texels - 2.0 * margin - (isSnapped ? 1.0 : 0.0);  // the snap takes one texel
  if (!(inner.x >= 1.0 && inner.y >= 1.0)) return Status::marginTexels;
  // World-space input is as large as the world position; its rounding is part of the map's.
  const double worldReach = frame.worldSpace ? footprint.reach + std::sqrt(glm::dot(region.eyeWs, region.eyeWs)) : 0.0;
  const double reach = std::max(footprint.reach, worldReach);
  glm::dvec2 rounding(kFloatRounding * reach);
  if (fit.isWarped) {
    const auto sizeOf = [&](const glm::dvec3& row) { return std::sqrt(row.x * row.x + row.y * row.y) * reach + std::abs(row.z); };
    const glm::dvec2 farthest = glm::max(glm::abs(fit.least), glm::abs(fit.least + fit.size));
    const double lostOfW = kFloatRounding * sizeOf(fit.w);  // at most, where w is 1
    if (!(lostOfW < 0.5)) return frame.worldSpace ? Status::worldSpacePrecision : Status::floatRange;
    rounding = (kFloatRounding * glm::dvec2(sizeOf(fit.s), sizeOf(fit.t)) + farthest * lostOfW) / (1.0 - lostOfW);
    fit.depthLost = lostOfW / (1.0 - lostOfW);  // stored depth is over w
  }
  if (region.unevenness > 0.0) rounding += region.unevenness * unitsPerWorld(fit);
  glm::dvec2 texel;
  if (isSnapped) {
    // Rounding by a bound that depends on the projection alone, so that the size does.
    glm::dvec2 size = fit.size + 2.0 * kFloatRounding * footprint.reach;
    texel = size / inner;
    if (!isStable) {
      const double base = pixelWidth(frame.camera, frame.image, frame.camera.near);
      for (int axis = 0; axis < 2; ++axis)
        texel[axis] = base * std::exp2(std::ceil(std::log2(texel[axis] * texels[axis] / base))) / texels[axis];
      size = texel * inner;
    }
    const glm::dvec2 eye(light.lsFromWorld * glm::dvec4(region.eyeWs, 0.0));  // the world origin's texel grid decides the phase
    const glm::dvec2 slack = (size - fit.size) / 2.0;
    // Too far from the origin for the grid to mean anything, the map still covers.
    const glm::dvec2 covering = fit.least - slack, snapped = glm::floor((eye + covering) / texel) * texel - eye;
    fit.least = glm::clamp(snapped, covering - texel, covering) - margin * texel;
  } else {
    fit.least -= rounding;
    fit.size += 2.0 * rounding;
    texel = fit.size / inner;
    fit.least -= margin * texel;
  }
  fit.size = texel * texels;
  const glm::dvec2 edge = texel * fit.stretch;
  const double room =
      kFloatRounding * reach + fit.depthLost * (fit.depthFar - fit.depthNear) + region.unevenness + margin * std::max(edge.x, edge.y);
  fit.depthNear -= room;
  fit.depthFar += room;
  const double thickness = fit.depthFar - fit.depthNear, leastThickness = std::min(edge.x, edge.y);
  if (!(thickness >= leastThickness)) {
    fit.depthNear -= (leastThickness - thickness) / 2.0;
    fit.depthFar += (leastThickness - thickness) / 2.0;
  }
  if (!frame.worldSpace) return Status::ok;
  constexpr double kTenth = 0.1;  // of a texel
  const glm::dvec2 lost = rounding / texel;
  if (std::max(lost.x, lost.y) / 4.0 > kTenth) {
    if (isSnapped) return Status::stableWorldSpace;
    warnings |= static_cast<std::uint32_t>(Warning::worldSpacePrecision);
    if (rounding.x * 4.0 > fit.size.x || rounding.y * 4.0 > fit.size.y) return Status::worldSpacePrecision;
  }
  return Status::ok;
}

void cropMatrix(const Frame& frame, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs, const MapFit& fit,
                glm::dmat4& clipFromWorld) noexcept {
  const double flip = frame.shadowMap.style == ClipStyle::vulkan ? -1.0 : 1.0;
  // Rows over (x, y, 1) of light space, clip x and y in pairs.
  const glm::dvec3 w = fit.w;
  const Pair scale = {2.0 / fit.size.x, 2.0 / fit.size.y * flip}, least = {fit.least.x, fit.least.y}, one = {1.0, flip};
  const Pair start = least * scale + one;
  const auto pair = [&](int i) { return Pair{fit.s[i], fit.t[i]} * scale - start * w[i]; };
  const Pair byX = pair(0), byY = pair(1), byOne = pair(2);
  // Depth over w: w is constant along a light ray, so depth stays linear there; w >= 1 keeps it in range, about any centre inside.
  const double centre = fit.isWarped ? fit.depthCentre : fit.depthNear;
  double perDepth = 1.0 / (fit.depthFar - fit.depthNear), byW = 0.0;
  if (frame.shadowMap.depth == DepthConvention::negativeOneToOne) perDepth *= 2.0, byW = -1.0;
  if (frame.shadowMap.depth == DepthConvention::reversedZeroToOne) perDepth *= -1.0, byW = 1.0;
  byW += (centre - fit.depthNear) * perDepth;
  for (int c = 0; c < 4; ++c) {  // from world - eye
    const glm::dvec4& ls = light.lsFromWorld[c];
    const Pair clip = byX * ls.x + byY * ls.y + byOne * ls.w;
    const double clipW = fit.isWarped ? w.x * ls.x + w.y * ls.y + w.z * ls.w : ls.w;
    clipFromWorld[c] = {clip[0], clip[1], (ls.z - ls.w * centre) * perDepth + clipW * byW, clipW};
  }
  if (eyeMinusOriginWs != glm::dvec3(0.0)) clipFromWorld[3] -= clipFromWorld * glm::dvec4(eyeMinusOriginWs, 0.0);  // w too
}

}  // namespace gnomon
