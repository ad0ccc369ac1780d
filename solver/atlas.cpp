#include "gnomon/atlas.h"

#include "numeric.h"

namespace gnomon {
namespace {

// The side of a map that the margins leave one texel of.
double leastSide(double margin) noexcept { return std::ceil(2.0 * margin) + 1.0; }

// Whole texels for one map of `texels` texels whose inside, `margin` texels from each edge, has the fit's aspect. isLong: where a side
// should be longer than it may.
glm::ivec2 viewportSize(const MapFit& fit, double texels, double margin, const glm::ivec2& most, bool& isLong) noexcept {
  if (fit.aspect == 1.0) {
    const int side = static_cast<int>(std::sqrt(texels)), longest = std::min(most.x, most.y);
    isLong |= side > longest;
    return glm::ivec2(std::clamp(side, 1, longest));
  }
  // (aspect h + 2 m)(h + 2 m) = texels for the inner height h
  const double aspect = std::clamp(fit.aspect, 1.0 / texels, texels);
  const double least = leastSide(margin), twice = 2.0 * margin, middle = twice * (1.0 + aspect);
  const double inner = (std::sqrt(std::max(middle * middle + 4.0 * aspect * (texels - twice * twice), 0.0)) - middle) / (2.0 * aspect);
  const double wanted = std::max(aspect * inner, 0.0) + twice;
  const double widest = std::min(std::max(texels / least, 1.0), static_cast<double>(most.x));  // leaves the height its least side
  const int width = static_cast<int>(std::clamp(wanted + 0.5, std::min(least, widest), widest)), height = static_cast<int>(texels / width);
  isLong |= wanted > most.x || height > most.y;
  return {width, std::clamp(height, 1, most.y)};
}

// A map with its border.
struct Bordered {
  int width, height;
  int map;
};

// Shelves of the given width, at least the widest cell's, tallest cell first. Calls visit(cell, x, y) for each. Returns the height used.
template <class Visit>
int shelve(const Bordered* cells, int count, int width, Visit&& visit) noexcept {
  int x = 0, y = 0, next = 0;  // the next shelf is as high as the first of this one
  for (int i = 0; i < count; ++i) {
    if (x + cells[i].width > width || i == 0) {
      x = 0;
      y = next;
      next += cells[i].height;
    }
    visit(cells[i], x, y);
    x += cells[i].width;
  }
  return next;
}

// The smallest atlas within the limits; false where none holds the maps.
bool place(const glm::ivec2* sizes, int count, int border, const glm::ivec2& most, Atlas& atlas) noexcept {
  Bordered cells[kMaxPartitions];
  int widest = 0;
  std::int64_t filled = 0;
  for (int i = 0; i < count; ++i) {  // insertion sort by falling height
    const Bordered cell{sizes[i].x + 2 * border, sizes[i].y + 2 * border, i};
    int j = i;
    for (; j > 0 && cells[j - 1].height < cell.height; --j) cells[j] = cells[j - 1];
    cells[j] = cell;
    widest = std::max(widest, cell.width);
    filled += static_cast<std::int64_t>(cell.width) * cell.height;
  }
  std::int64_t leastArea = -1;
  int bestWidth = 0, bestHeight = 0;
  for (int last = 0, sum = 0; last < count; ++last) {  // as wide as the tallest maps side by side
    sum += cells[last].width;
    const int width = std::max(sum, widest);
    if (width > most.x) break;
    if (leastArea == filled && width >= std::max(bestWidth, bestHeight)) break;  // nothing is empty, and wider ones are no squarer
    const int height = shelve(cells, count, width, [](const Bordered&, int, int) {});
    if (height > most.y) continue;
    const std::int64_t area = static_cast<std::int64_t>(width) * height;
    if (leastArea >= 0 && (area > leastArea || (area == leastArea && std::max(width, height) >= std::max(bestWidth, bestHeight)))) continue;
    leastArea = area;
    bestWidth = width;
    bestHeight = height;
  }
  if (leastArea < 0) return false;
  shelve(cells, count, bestWidth,
         [&](const Bordered& cell, int x, int y) { atlas.viewports[cell.map] = glm::ivec4(x + border, y + border, sizes[cell.map]); });
  atlas.size = {bestWidth, bestHeight};
  atlas.layers = 1;
  return true;
}

}  // namespace

double texelsPerMap(const Budget& budget, int count) noexcept {
  constexpr double kMost = static_cast<double>(kMaxTextureSide) * kMaxTextureSide;  // no map has more
  return budget.texels > 0.0 ? std::clamp(std::floor(budget.texels / count), 1.0, kMost)
                             : static_cast<double>(budget.resolution) * budget.resolution;
}

glm::ivec2 atlasLimit(const Budget& budget) noexcept {
  const auto limit = [](int side) { return side > 0 ? side : kMaxTextureSide; };
  return {limit(budget.atlas.x), limit(budget.atlas.y)};
}

Status packAtlas(const Frame& frame, const MapFit* fits, const double* shares, int count, Atlas& atlas) noexcept {
  const int border = frame.margin.border;
  const double margin = frame.margin.filter + frame.margin.normalOffset;
  const glm::ivec2 most = atlasLimit(frame.budget), mostMap = most - 2 * border;
  if (mostMap.x < 1 || mostMap.y < 1) return Status::budgetAtlas;
  if (!(leastSide(margin) <= std::min(mostMap.x, mostMap.y))) return Status::marginTexels;
  atlas.reduced = false;
  if (frame.shadowMap.layout == MapLayout::layers) {
    const int served = shares ? static_cast<int>(count - std::count(shares, shares + count, 0.0)) : count;
    const double texels = texelsPerMap(frame.budget, served);
    const int side = std::min({static_cast<int>(std::sqrt(texels)), mostMap.x, mostMap.y});
    atlas.reduced = side < static_cast<int>(std::sqrt(texels));
    for (int i = 0; i < count; ++i) atlas.viewports[i] = {border, border, side, side};
    atlas.size = glm::ivec2(side + 2 * border);
    atlas.layers = count;
    return Status::ok;
  }
  const double texels = texelsPerMap(frame.budget, count);
  // Shares below what the margins need are raised to it, all others give way: a map that needs no texel to speak of must not refuse the
  // frame.
  double wanted[kMaxPartitions], sum = 0.0;
  const double side = leastSide(margin);
  for (int i = 0; shares && i < count; ++i) {
    wanted[i] = std::max(shares[i], side * side / (texels * count));
    sum += wanted[i];
  }
  glm::ivec2 sizes[kMaxPartitions];
  // Over budget every map gives way alike.
  constexpr double kStep = 0.95;
  for (double scaled = texels;; scaled *= kStep) {
    bool isLeast = true, isLong = false;
    for (int i = 0; i < count; ++i) {
      if (!shares && i > 0 && fits[i].aspect == fits[i - 1].aspect) {
        sizes[i] = sizes[i - 1];
        continue;
      }
      sizes[i] =
          viewportSize(fits[i], std::max(shares ? std::max(scaled * count * wanted[i] / sum, std::min(side * side, scaled)) : scaled, 1.0),
                       margin, mostMap, isLong);
      isLeast &= sizes[i].x == 1 && sizes[i].y == 1;
    }
    atlas.reduced = isLong || scaled < texels;
    if (place(sizes, count, border, most, atlas)) return Status::ok;
    if (isLeast) return Status::budgetAtlas;
  }
}

}  // namespace gnomon
