#include "wrong.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <glm/geometric.hpp>

#include "truth.h"

namespace gnomon::offscreen {
namespace {

double ratio(std::size_t part, std::size_t whole) { return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole); }

void checkSizes(int width, int height, const std::vector<std::uint8_t>& answer, const std::vector<std::uint8_t>& truth,
                const std::vector<std::uint8_t>& counted) {
  const std::size_t pixels = width > 0 && height > 0 ? static_cast<std::size_t>(width) * static_cast<std::size_t>(height) : 0;
  if (pixels == 0 || answer.size() != pixels || truth.size() != pixels || counted.size() != pixels) {
    throw std::runtime_error("wrong: pictures of different sizes");
  }
}

std::size_t pixelAt(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

// Chebyshev distances to the nearest marked pixel: one sweep down and one up are exact for it. Beyond the picture where nothing is marked.
std::vector<int> distances(int width, int height, const std::vector<std::uint8_t>& marked) {
  std::vector<int> out(marked.size());
  std::transform(marked.begin(), marked.end(), out.begin(), [&](std::uint8_t m) { return m ? 0 : width + height; });
  const auto sweep = [&](int x, int y, int before) {  // before: the row and the column that are done
    int& here = out[pixelAt(width, x, y)];
    if (x + before >= 0 && x + before < width) here = std::min(here, out[pixelAt(width, x + before, y)] + 1);
    if (y + before < 0 || y + before >= height) return;
    for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width - 1); ++u) here = std::min(here, out[pixelAt(width, u, y + before)] + 1);
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) sweep(x, y, -1);
  for (int y = height; y-- > 0;)
    for (int x = width; x-- > 0;) sweep(x, y, 1);
  return out;
}

}  // namespace

double WrongPixels::share() const { return ratio(wrong, counted); }
double WrongPixels::perEdge() const { return ratio(wrong, edge); }
double WrongPixels::farShare() const { return ratio(wrongFar, wrong); }
double WrongPixels::shadowedShare() const { return ratio(shadowed, counted); }

std::vector<std::uint8_t> countedPixels(const std::vector<std::uint8_t>& truth, const std::vector<float>& normal,
                                        const glm::dvec3& lightDirectionWs) {
  if (normal.size() != 3 * truth.size()) throw std::runtime_error("wrong: pictures of different sizes");
  const double lightLength = glm::length(lightDirectionWs);
  std::vector<std::uint8_t> counted(truth.size(), 0);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (truth[i] == kNothing) continue;
    const glm::dvec3 n(normal[3 * i], normal[3 * i + 1], normal[3 * i + 2]);
    const double facing = -glm::dot(n, lightDirectionWs);
    counted[i] = facing > kLeastCosine * glm::length(n) * lightLength ? 1 : 0;
  }
  return counted;
}

std::vector<std::uint8_t> edgePixels(int width, int height, const std::vector<std::uint8_t>& truth,
                                     const std::vector<std::uint8_t>& counted) {
  checkSizes(width, height, truth, truth, counted);
  std::vector<std::uint8_t> edge(truth.size(), 0);
  const auto markIfEdge = [&](std::size_t a, std::size_t b) {
    if (counted[a] && counted[b] && truth[a] != truth[b]) edge[a] = edge[b] = 1;
  };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (x + 1 < width) markIfEdge(pixelAt(width, x, y), pixelAt(width, x + 1, y));
      if (y + 1 < height) markIfEdge(pixelAt(width, x, y), pixelAt(width, x, y + 1));
    }
  }
  return edge;
}

WrongPixels countWrong(int width, int height, const std::vector<std::uint8_t>& answer, const std::vector<std::uint8_t>& truth,
                       const std::vector<std::uint8_t>& counted) {
  checkSizes(width, height, answer, truth, counted);
  WrongPixels result;
  const std::vector<std::uint8_t> edge = edgePixels(width, height, truth, counted);

  const std::vector<int> distance = distances(width, height, edge);
  double sum = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t i = pixelAt(width, x, y);
      if (!counted[i]) continue;
      ++result.counted;
      result.edge += edge[i];
      result.shadowed += truth[i] == kShadowed ? 1 : 0;
      if (answer[i] == truth[i]) continue;
      ++result.wrong;
      ++(truth[i] == kShadowed ? result.falselyLit : result.falselyShadowed);
      ++(distance[i] <= 1 ? result.wrongNear : result.wrongFar);
      sum += distance[i];
    }
  }
  if (result.wrong > 0 && result.edge > 0) result.meanDistance = sum / static_cast<double>(result.wrong);
  return result;
}

std::vector<std::uint8_t> differencePicture(int width, int height, const std::vector<std::uint8_t>& answer,
                                            const std::vector<std::uint8_t>& truth, const std::vector<std::uint8_t>& counted) {
  checkSizes(width, height, answer, truth, counted);
  using Rgb = std::array<std::uint8_t, 3>;
  constexpr Rgb kBackground{16, 18, 22}, kDim{44, 47, 52}, kAgreeLit{200, 200, 200}, kAgreeShadow{96, 96, 96}, kFalseShadow{235, 50, 35},
      kFalseLight{45, 105, 250};
  std::vector<std::uint8_t> rgb;
  rgb.reserve(3 * truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const bool shadowed = truth[i] == kShadowed;
    const Rgb colour = truth[i] == kNothing    ? kBackground
                       : !counted[i]           ? kDim
                       : answer[i] == truth[i] ? (shadowed ? kAgreeShadow : kAgreeLit)
                       : shadowed              ? kFalseLight
                                               : kFalseShadow;
    rgb.insert(rgb.end(), colour.begin(), colour.end());
  }
  return rgb;
}

}  // namespace gnomon::offscreen
