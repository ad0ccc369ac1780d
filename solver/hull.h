// hull: convex polygons of the light plane, counter-clockwise, of at most kMaxHull vertices. Private to solver/.
#pragma once

#include <algorithm>
#include <cmath>

#include "gnomon/footprint.h"
#include "numeric.h"

namespace gnomon {

// Convex hull of the points' x and y, counter-clockwise; returns its vertices' number.  (Andrew's monotone chain)
inline int makeHull(const glm::dvec3* points, int count, glm::dvec2* hull) noexcept {
  glm::dvec2 sorted[kMaxHull];
  for (int i = 0; i < count; ++i) {
    const glm::dvec2 p(points[i]);
    int j = i;
    for (; j > 0 && (p.x < sorted[j - 1].x || (p.x <= sorted[j - 1].x && p.y < sorted[j - 1].y)); --j) sorted[j] = sorted[j - 1];
    sorted[j] = p;
  }
  glm::dvec2 chain[2 * kMaxHull];  // points below come and go on the way back
  int size = 0;
  // From the last vertex: exact for points that rounding alone tells apart, whose turn would be any otherwise.
  const auto turnTo = [&](const glm::dvec2& p, int least) {
    while (size >= least && !(cross2(chain[size - 1] - chain[size - 2], p - chain[size - 1]) > 0.0)) --size;
  };
  for (int i = 0; i < count; ++i) {
    turnTo(sorted[i], 2);
    chain[size++] = sorted[i];
  }
  const int lower = size;
  for (int i = count - 2; i > 0; --i) {
    turnTo(sorted[i], lower + 1);
    chain[size++] = sorted[i];
  }
  if (count > 1) turnTo(sorted[0], lower + 1);  // where the chain began
  if (size == 2 && chain[0] == chain[1]) size = 1;
  size = std::min(size, kMaxHull);
  std::copy_n(chain, size, hull);
  return size;
}

// Makes a convex polygon of at most `most` vertices around one of more: edge by edge, the neighbours of an edge are extended until they
// meet, first where that is least far. By area the short end of a thin polygon would come early, and its apex lie anywhere.
inline int simplifyHull(glm::dvec2* hull, int count, int most) noexcept {
  for (; count > most; --count) {
    const auto vertex = [&](int i) -> glm::dvec2& { return hull[i < count ? i : i - count]; };
    int best = 0;
    double least = kInfinity;  // squared
    glm::dvec2 apex = hull[0];
    for (int i = 0; i < count; ++i) {
      const glm::dvec2 before = vertex(i) - vertex(i + count - 1), edge = vertex(i + 1) - vertex(i), after = vertex(i + 2) - vertex(i + 1);
      const double turn = cross2(before, after);
      if (!(turn > 0.0)) continue;  // they never meet
      const glm::dvec2 onward = before * (cross2(edge, after) / turn), back = after * (cross2(before, edge) / turn);
      const double far = std::max(glm::dot(onward, onward), glm::dot(back, back));
      if (!(far < least)) continue;
      best = i;
      least = far;
      apex = vertex(i) + onward;
    }
    if (!(least < kInfinity)) return count;
    vertex(best) = apex;
    const int gone = best + 1 < count ? best + 1 : 0;
    std::copy(hull + gone + 1, hull + count, hull + gone);
  }
  return count;
}

// Cuts a convex polygon along a line: what lies at dot(normal, p) >= offset stays, what lies at <= is written to `before`. Returns the
// number of its vertices. A part without room for its vertices is all of it.  [Sutherland and Hodgman 1974]
inline int cutHull(glm::dvec2* hull, int& count, const glm::dvec2& normal, double offset, glm::dvec2* before) noexcept {
  glm::dvec2 kept[2 * kMaxHull], gone[2 * kMaxHull];
  int keptCount = 0, goneCount = 0;
  double atQ = count > 0 ? glm::dot(normal, hull[0]) - offset : 0.0;
  for (int i = 0; i < count; ++i) {
    const glm::dvec2 &p = hull[i], &q = hull[i + 1 < count ? i + 1 : 0];
    const double atP = atQ;
    atQ = glm::dot(normal, q) - offset;
    if (atP >= 0.0) kept[keptCount++] = p;
    if (atP <= 0.0) gone[goneCount++] = p;
    if (!((atP < 0.0 && atQ > 0.0) || (atP > 0.0 && atQ < 0.0))) continue;
    // From the nearer: the farther may be all rounding there.
    const bool isNearP = std::abs(atP) < std::abs(atQ);
    kept[keptCount++] = gone[goneCount++] = isNearP ? p + (q - p) * (atP / (atP - atQ)) : q + (p - q) * (atQ / (atQ - atP));
  }
  const bool isRoom = goneCount <= kMaxHull;
  if (!isRoom) goneCount = count;
  std::copy_n(isRoom ? gone : hull, goneCount, before);
  if (keptCount > kMaxHull) return goneCount;
  std::copy_n(kept, keptCount, hull);
  count = keptCount;
  return goneCount;
}

}  // namespace gnomon
