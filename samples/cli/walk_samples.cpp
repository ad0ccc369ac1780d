#include "walk_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "gnomon/camera.h"
#include "gnomon/pssm.h"
#include "gnomon/sdsm.h"
#include "job.h"
#include "text.h"

namespace gnomon::cli {
namespace {

constexpr int kWidth = 640, kHeight = 360, kResolution = 512;
constexpr double kNear = 0.1, kFar = 200.0;
constexpr double kHysteresis = 0.5;
constexpr std::uint8_t kNoMap = 255;

// t: from 0 to 1. From a tenth to nine tenths of the longer side, at a fifth of the height, looking ahead and to both sides.
Frame frameAt(const Box& bounds, const glm::dvec3& lightDirectionWs, double t) {
  const glm::dvec3 size = bounds.maxWs - bounds.minWs, middle = (bounds.minWs + bounds.maxWs) / 2.0;
  const bool isAlongX = size.x >= size.z;
  const glm::dvec3 ahead = isAlongX ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0), up(0.0, 1.0, 0.0),
                   side = glm::cross(ahead, up);
  const double yaw = 0.8 * std::sin(4.0 * std::numbers::pi * t), pitch = 0.1 * std::sin(6.0 * std::numbers::pi * t) - 0.05;
  glm::dvec3 eye = middle + ahead * ((0.8 * t - 0.4) * std::max(size.x, size.z));
  eye.y = bounds.minWs.y + 0.2 * size.y;
  Frame frame;
  frame.camera = perspective(eye, (ahead * std::cos(yaw) + side * std::sin(yaw)) * std::cos(pitch) + up * std::sin(pitch), up,
                             std::numbers::pi / 3.0, static_cast<double>(kWidth) / kHeight, kNear, kFar);
  frame.light.directionWs = lightDirectionWs;
  frame.image = {kWidth, kHeight};
  frame.scene.receivers = {&bounds, 1};
  frame.budget = {.partitions = 4, .resolution = kResolution};
  return frame;
}

struct Way {
  std::string name;
  std::function<Status(const Frame&, const Samples&, SdsmState&, Solution&)> solve;  // frame: without samples
};

Way splits(const std::string& name, double lambda, FitMode fit, bool byBounds) {
  return {name, [=](const Frame& frame, const Samples& samples, SdsmState&, Solution& solution) {
            const Samples anywhere{.near = frame.camera.near, .far = frame.camera.far, .bounds = samples.bounds};
            Frame given = frame;
            if (byBounds) given.samples = &anywhere;
            return solvePssm(given, {.split = {.scheme = SplitScheme::practical, .lambda = lambda}, .fit = fit}, solution);
          }};
}

Way sampled(const std::string& name, const SdsmSettings& settings) {
  return {name, [=](const Frame& frame, const Samples& samples, SdsmState& state, Solution& solution) {
            Frame given = frame;
            given.samples = &samples;
            return solveSdsm(given, settings, state, solution);
          }};
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2.0;
}

using Points = std::vector<glm::dvec2>;

// Counter-clockwise.  (Andrew's monotone chain)
Points hullOf(Points points) {
  std::sort(points.begin(), points.end(), [](const glm::dvec2& a, const glm::dvec2& b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  const std::size_t count = points.size();
  if (count < 3) return points;
  Points hull;
  const auto extend = [&](const glm::dvec2& p, std::size_t least) {
    const auto turn = [&](const glm::dvec2& a, const glm::dvec2& b) { return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x); };
    while (hull.size() >= least && !(turn(hull[hull.size() - 2], hull.back()) > 0.0)) hull.pop_back();
    hull.push_back(p);
  };
  for (std::size_t i = 0; i < count; ++i) extend(points[i], 2);
  const std::size_t lower = hull.size();
  for (std::size_t i = count - 1; i-- > 0;) extend(points[i], lower + 1);
  hull.pop_back();
  return hull;
}

// Areas: of the least rectangle around a hull, turned freely, which has a side along one of its edges; of the hull itself.
glm::dvec2 areasOf(const Points& hull) {
  double rectangle = hull.size() < 3 ? 0.0 : kInfinity, twice = 0.0;
  for (std::size_t i = 0; i < hull.size() && hull.size() >= 3; ++i) {
    const glm::dvec2 from = hull[i], to = hull[(i + 1) % hull.size()], axis = glm::normalize(to - from);
    glm::dvec2 least(kInfinity), most(-kInfinity);
    for (const glm::dvec2& p : hull) {
      const glm::dvec2 at(glm::dot(axis, p), axis.x * p.y - axis.y * p.x);
      least = glm::min(least, at);
      most = glm::max(most, at);
    }
    rectangle = std::min(rectangle, (most.x - least.x) * (most.y - least.y));
    twice += from.x * to.y - from.y * to.x;
  }
  return {rectangle, twice / 2.0};
}

// What no maps of a slice each, without warps, get below in predicted error over these pixels, wherever the slices end: x, where each is the
// least rectangle around its samples; y, any linear map, whose texels cover the samples' hull and have a side of at least the root of their
// area. Samples go into parts in order of depth; a slice's end lies in one part at most, which counts nothing: a lower bound.
glm::dvec2 leastOfAnySlices(const Frame& frame, const offscreen::Picture& picture) {
  constexpr std::size_t kParts = 256;
  struct Sample {
    double depth;
    glm::dvec2 ls;
  };
  glm::dmat3 lsFromView;
  require(lightForSamples(frame, lsFromView));
  const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs), right = glm::normalize(glm::cross(forward, frame.camera.upWs));
  const glm::dmat3 viewFromWorld = glm::transpose(glm::dmat3(right, glm::cross(right, forward), forward));
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < picture.counted.size(); ++i) {
    if (!picture.counted[i] || picture.image.index[i] == kNoMap) continue;
    const float* at = &picture.image.position[3 * i];  // from the eye
    const glm::dvec3 vs = viewFromWorld * glm::dvec3(at[0], at[1], at[2]);
    samples.push_back({vs.z, glm::dvec2(lsFromView * vs)});
  }
  if (samples.empty()) return glm::dvec2(0.0);
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) { return a.depth < b.depth; });
  Points hulls[kParts];
  double before[kParts + 1] = {};  // sum of 1 / w_i
  for (std::size_t part = 0; part < kParts; ++part) {
    before[part + 1] = before[part];
    for (std::size_t i = part * samples.size() / kParts; i < (part + 1) * samples.size() / kParts; ++i) {
      hulls[part].push_back(samples[i].ls);
      before[part + 1] += 1.0 / pixelWidth(frame.camera, frame.image, samples[i].depth);
    }
    hulls[part] = hullOf(std::move(hulls[part]));
  }
  // Of parts 0 to j by k + 1 slices.
  std::vector<std::array<glm::dvec2, kParts>> least(static_cast<std::size_t>(frame.budget.partitions));
  for (auto& each : least) each.fill(glm::dvec2(kInfinity));
  std::vector<std::array<glm::dvec2, kParts>> costs(kParts);  // of parts i to j in a slice
  for (std::size_t i = 0; i < kParts; ++i) {
    Points hull;
    for (std::size_t j = i; j < kParts; ++j) {
      hull.insert(hull.end(), hulls[j].begin(), hulls[j].end());
      hull = hullOf(std::move(hull));
      costs[i][j] = glm::sqrt(areasOf(hull)) * ((before[j + 1] - before[i]) / kResolution);
    }
  }
  for (std::size_t k = 0; k < least.size(); ++k)
    for (std::size_t j = 0; j < kParts; ++j) {
      least[k][j] = costs[0][j];
      for (std::size_t i = 1; k > 0 && i <= j + 1; ++i) {  // part i - 1 counts nothing
        const glm::dvec2 others = i > 1 ? least[k - 1][i - 2] : glm::dvec2(0.0), own = i <= j ? costs[i][j] : glm::dvec2(0.0);
        least[k][j] = glm::min(least[k][j], others + own);
      }
    }
  return least.back()[kParts - 1] / static_cast<double>(samples.size());
}

// What each way's maps say of a walk's frames. Medians over the walk.
std::string compare(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const Box& bounds, const glm::dvec3& lightDirectionWs,
                    int frames) {
  constexpr FitMode kTight = FitMode::tight;
  const std::vector<Way> ways = {
      splits("splits 0.5", 0.5, kTight, false),
      splits("splits 0.8", 0.8, kTight, false),
      splits("splits 1", 1.0, kTight, false),
      sampled("slices by samples", {.bounds = false}),
      splits("maps by samples 0.5", 0.5, kTight, true),
      splits("maps by samples 0.8", 0.8, kTight, true),
      splits("maps by samples 1", 1.0, kTight, true),
      sampled("both", {}),
      sampled("both, optimal mean", {.scheme = SdsmScheme::optimal, .norm = SampleNorm::mean}),
      sampled("both, hysteresis", {.hysteresis = kHysteresis}),
      sampled("both, quantise", {.quantise = true}),
  };
  constexpr std::size_t kFixed = 3;  // the first ones know nothing of samples
  struct Tally {
    std::vector<double> error, wrong, triangles, ms;
  };
  std::vector<Tally> tallies(ways.size());
  std::vector<double> leastRectangles, leastMaps;
  offscreen::RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  const auto solution = std::make_unique<Solution>();
  for (int step = 0; step < frames; ++step) {
    const Frame frame = frameAt(bounds, lightDirectionWs, (step + 0.5) / frames);
    const offscreen::ViewSamples view(renderer, frame, kWidth, kHeight);
    if (!(view.samples.near <= view.samples.far)) continue;
    for (std::size_t i = 0; i < ways.size(); ++i) {
      SdsmState state;
      require(ways[i].solve(frame, view.samples, state, *solution));
      const offscreen::Picture picture = offscreen::makePicture(renderer, tracer, frame, *solution, options);
      if (picture.predicted.served == 0) break;  // nothing that is seen faces the light
      tallies[i].error.push_back(picture.predicted.mean);
      tallies[i].wrong.push_back(100.0 * picture.wrong.share());
      tallies[i].triangles.push_back(static_cast<double>(picture.image.shadowTriangles));
      tallies[i].ms.push_back(picture.image.frameMs);
      if (i > 0) continue;
      const glm::dvec2 bound = leastOfAnySlices(frame, picture);
      leastRectangles.push_back(bound.x);
      leastMaps.push_back(bound.y);
    }
  }
  if (tallies[0].error.empty()) return "nothing that is seen there faces the light\n";
  std::size_t best = 0;
  for (std::size_t i = 1; i < kFixed; ++i)
    if (median(tallies[i].error) < median(tallies[best].error)) best = i;
  std::string table = line("%-22s %7s %8s %8s %10s %8s %10s\n", "", "error", "of best", "wrong %", "triangles", "of best", "frame time");
  for (std::size_t i = 0; i < ways.size(); ++i) {
    const auto ratio = [&](std::vector<double> Tally::*member) { return median(tallies[i].*member) / median(tallies[best].*member); };
    table += line("%-22s %7.2f %8.2f %8.3f %10.0f %8.2f %10.2f\n", ways[i].name.c_str(), median(tallies[i].error), ratio(&Tally::error),
                  median(tallies[i].wrong), median(tallies[i].triangles), ratio(&Tally::triangles), ratio(&Tally::ms));
  }
  for (const auto& [name, values] : {std::pair("no rectangles below", leastRectangles), std::pair("no maps below", leastMaps)})
    table += line("%-22s %7.2f %8.2f\n", name, median(values), median(values) / median(tallies[best].error));
  return table;
}

// How often the same points change between lit and shadowed while the camera steps and turns a little: the maps are the moving camera's, the
// points those that a camera at rest sees.
std::string flicker(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const Box& bounds, const glm::dvec3& lightDirectionWs,
                    int frames) {
  std::vector<Way> ways = {
      splits("splits 0.8, tight", 0.8, FitMode::tight, false),
      splits("splits 0.8, stable", 0.8, FitMode::stable, false),
      sampled("both", {}),
      sampled("both, hysteresis", {.hysteresis = kHysteresis}),
      sampled("both, quantise", {.quantise = true}),
  };
  const Frame centre = frameAt(bounds, lightDirectionWs, 0.3);
  Frame rest = centre;  // a part of what the moving camera always sees
  for (double* side : {&rest.camera.left, &rest.camera.right, &rest.camera.down, &rest.camera.up}) *side *= 0.5;
  offscreen::RenderOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.selectByViewDepth = true;  // of the moving camera
  options.time = false;
  std::vector<SdsmState> states(ways.size());
  std::vector<offscreen::RenderOutput> before(ways.size());
  std::vector<double> flips(ways.size());
  std::size_t edges = 0;
  const auto solution = std::make_unique<Solution>();
  for (int step = 0; step < frames; ++step) {
    const double t = static_cast<double>(step) / (frames - 1), yaw = 0.05 * std::sin(2.0 * std::numbers::pi * t);
    Frame moving = centre;
    const glm::dvec3 forward = glm::normalize(centre.camera.forwardWs), side = glm::cross(forward, centre.camera.upWs);
    moving.camera.positionWs += side * (0.02 * step) - forward * 0.5;
    moving.camera.forwardWs = forward * std::cos(yaw) + side * std::sin(yaw);
    const offscreen::ViewSamples view(renderer, moving, kWidth, kHeight);
    if (!(view.samples.near <= view.samples.far)) return "";
    for (std::size_t i = 0; i < ways.size(); ++i) {
      require(ways[i].solve(moving, view.samples, states[i], *solution));
      if (edges == 0) {
        const offscreen::Picture picture = offscreen::makePicture(renderer, tracer, rest, *solution, options);
        edges = picture.wrong.edge;
      }
      offscreen::RenderOutput now = renderer.render(rest, *solution, options);
      for (std::size_t p = 0; p < before[i].lit.size(); ++p)
        flips[i] += now.lit[p] != before[i].lit[p] && now.index[p] != kNoMap && before[i].index[p] != kNoMap;
      before[i] = std::move(now);
    }
  }
  if (edges == 0) return "";  // nothing that could flip is seen
  std::string table = line("%-22s %7s\n", "", "flips of each 100 pixels at a true edge, a frame");
  for (std::size_t i = 0; i < ways.size(); ++i)
    table += line("%-22s %7.2f\n", ways[i].name.c_str(), 100.0 * flips[i] / ((frames - 1) * static_cast<double>(edges)));
  return table;
}

}  // namespace

std::string walkSamples(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const Box& bounds,
                        const glm::dvec3& lightDirectionWs, int steps) {
  return compare(renderer, tracer, bounds, lightDirectionWs, std::max(steps / 8, 1)) +
         flicker(renderer, tracer, bounds, lightDirectionWs, std::max(steps / 4, 2));
}

}  // namespace gnomon::cli
