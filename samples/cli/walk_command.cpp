#include "walk_command.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <numbers>

#include <glm/geometric.hpp>

#include "case.h"
#include "gnomon/camera.h"
#include "job.h"
#include "scene.h"
#include "text.h"
#include "walk_samples.h"

namespace gnomon::cli {
namespace {

// The letter's: 60 degrees across (its angles theta are those of 60 degrees across, not up), maps of 1024 x 1024 texels for 1440 x 1080 pixels, at most 4 rows of 2, eight parallel splits.
constexpr double kFovX = std::numbers::pi / 3.0, kWidth = 1440.0, kHeight = 1080.0;
constexpr int kResolution = 1024, kMost = 8;
constexpr RowSettings kLetter{.rule = RowRule::fitted, .zeta = 0.25, .sigma = 0.5, .maxRows = 4, .maxColumns = 2};
constexpr std::array<double, 9> kZetas{0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45};
constexpr double kDeepest = 1000.0;  // far over near at most
constexpr int kPictureEvery = 24, kBins = 18;  // of 5 degrees

struct Scene {
  std::string name;
  offscreen::Mesh mesh;
  offscreen::View start;
};

// Forward and back, then round on the spot while stepping aside; the light turns once and rises and falls twice.
Frame frameAt(const Scene& scene, const Box& bounds, double t) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  const Camera& start = scene.start.cam;
  const glm::dvec3 up(0.0, 1.0, 0.0), flat = glm::normalize(glm::dvec3(start.forwardWs.x, 0.0, start.forwardWs.z));
  const double yaw = t < 0.5 ? 0.0 : (2.0 * t - 1.0) * kTurn, stride = 0.1 * (start.far - start.near);
  const glm::dvec3 side = glm::cross(flat, up), forward = glm::normalize(start.forwardWs);
  const glm::dvec3 ahead = flat * std::cos(yaw) + side * std::sin(yaw);
  Frame frame;
  frame.camera = perspective(start.positionWs + flat * (stride * std::sin(2.0 * kTurn * t)) * (t < 0.5 ? 1.0 : 0.0) +
                                 side * (0.2 * stride * std::sin(kTurn * t)) * (t < 0.5 ? 0.0 : 1.0),
                             ahead * std::sqrt(1.0 - forward.y * forward.y) + up * forward.y, up,
                             2.0 * std::atan(std::tan(kFovX / 2.0) * kHeight / kWidth), kWidth / kHeight, start.far / kDeepest, start.far);
  // The letter refines the view volume to what is in it; the ends move less than what they leave out.
  const offscreen::DepthRange range = offscreen::depthInView(scene.mesh, frame.camera);
  if (range.nearest < range.farthest) {
    frame.camera.near = std::max(0.8 * range.nearest, start.far / kDeepest);
    frame.camera.far = std::min(1.05 * range.farthest, start.far);
  }
  const double height = 0.75 + 0.5 * std::sin(2.0 * kTurn * t), azimuth = kTurn * t + 0.6;  // radians above the horizon: 14 to 72 degrees
  frame.light.directionWs = {std::cos(azimuth) * std::cos(height), -std::sin(height), std::sin(azimuth) * std::cos(height)};
  frame.image = {kWidth, kHeight};
  frame.scene.receivers = {&bounds, 1};
  frame.budget = {.partitions = kMost, .resolution = kResolution};
  return frame;
}

double texelsOf(const Solution& solution) {
  double texels = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i)
    texels += static_cast<double>(solution.partitions[i].viewport.z) * solution.partitions[i].viewport.w;
  return texels;
}

// What the steps of one scene say.
struct Tally {
  std::array<double, kZetas.size()> maps{};
  std::array<int, kBins> theta{};
  int steps = 0, refused = 0, pictures = 0;
  double pictureMaps = 0.0, rowsMs = 0.0, splitsMs = 0.0, sampledMs = 0.0;
  std::array<double, 4> wrong{};  // rows and columns, rows, splits, best: of as many passes and texels
};

void countMaps(const Frame& frame, Solution& solution, Tally& tally) {
  for (std::size_t i = 0; i < kZetas.size(); ++i) {
    LspsmSettings settings{.rows = kLetter};
    settings.rows.zeta = kZetas[i];
    RowLayout layout;
    require(solveLspsm(frame, settings, solution, &layout));
    if (solution.partitionCount == 0) return;  // nothing is in view
    tally.steps += i == 0;
    tally.maps[i] += solution.partitionCount;
    if (settings.rows.zeta != kLetter.zeta) continue;
    const double degrees = std::atan(layout.shape.tangent) * 180.0 / std::numbers::pi;
    ++tally.theta[static_cast<std::size_t>(std::min(static_cast<int>(degrees / (90.0 / kBins)), kBins - 1))];
    settings.rows.rule = RowRule::paper;
    tally.refused += solveLspsm(frame, settings, solution) == Status::rowsReach;
  }
}

void drawStep(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const Frame& frame, const std::string& folder, Tally& tally) {
  offscreen::RenderOptions options;
  options.width = static_cast<int>(kWidth);
  options.height = static_cast<int>(kHeight);
  const auto solution = std::make_unique<Solution>();
  require(solveLspsm(frame, {.rows = kLetter}, *solution));
  if (solution->partitionCount == 0) return;
  ++tally.pictures;
  tally.pictureMaps += solution->partitionCount;
  const offscreen::Picture rows = offscreen::makePicture(renderer, tracer, frame, *solution, options);
  offscreen::writePictures(rows, folder);
  tally.rowsMs += rows.image.frameMs;
  tally.wrong[0] += rows.wrong.share();
  Frame equal = frame;  // passes and texels
  equal.budget.partitions = solution->partitionCount;
  equal.budget.texels = texelsOf(*solution);

  require(solvePssm(frame, {}, *solution));
  tally.splitsMs += renderer.render(frame, *solution, options).frameMs;
  Frame sampled = frame;
  const offscreen::ViewSamples view(renderer, frame, options.width, options.height);
  sampled.samples = &view.samples;
  SdsmState state;
  require(solveSdsm(sampled, {}, state, *solution));
  tally.sampledMs += renderer.render(frame, *solution, options).frameMs;
  const auto judge = [&](std::size_t which, Status status) {
    require(status);
    tally.wrong[which] += offscreen::makePicture(renderer, tracer, equal, *solution, options).wrong.share();
  };
  options.time = false;
  LspsmSettings narrow{.rows = kLetter};
  narrow.rows.maxColumns = 1;
  judge(1, solveLspsm(equal, narrow, *solution));
  judge(2, solvePssm(equal, {}, *solution));
  judge(3, solveLloyd(equal, {.scheme = LloydScheme::best, .split = {}, .warp = {.warp = Warp::least}}, *solution));
}

Scene open(const std::string& file) {
  try {
    Scene scene{std::filesystem::path(file).stem().string(), offscreen::loadGlb(file), {}};
    scene.start = offscreen::framedViews(scene.mesh, kWidth / kHeight)[0];
    return scene;
  } catch (const std::runtime_error& error) {
    throw Refusal(error.what());
  }
}

}  // namespace

int walk(const std::vector<std::string>& files, const std::string& folder, int steps) {
  const int pictureEvery = std::min(kPictureEvery, steps);
  std::vector<Scene> scenes;
  for (const std::string& file : files) scenes.push_back(open(file));
  if (files.empty())
    for (const std::string& name : offscreen::builtInNames()) {
      offscreen::BuiltIn scene = offscreen::makeBuiltIn(name);
      scenes.push_back({name, std::move(scene.mesh), scene.views[0]});
    }
  std::filesystem::create_directories(folder);
  offscreen::Renderer renderer;
  std::cerr << "rendering on " << renderer.device() << "\n";
  std::string table = line(
      "%-12s %6s %8s %9s %9s %9s   wrong, %% of pixels that face the light, equal passes and texels:\n%-12s %6s %8s %9s %9s %9s   %8s %8s "
      "%8s %8s\n",
      "", "maps", "refused", "frame", "time, of", "time, of", "scene", "N", "paper", "ms", "8 splits", "8 sdsm", "lspsm", "1 column",
      "pssm", "best");
  std::string sampled;
  Tally all;
  for (const Scene& scene : scenes) {
    std::cerr << scene.name << "\n";
    const offscreen::Tracer tracer(scene.mesh);
    renderer.load(scene.mesh);
    const Box bounds{scene.mesh.min, scene.mesh.max};
    Tally tally;
    const auto solution = std::make_unique<Solution>();
    for (int step = 0; step < steps; ++step) {
      const Frame frame = frameAt(scene, bounds, static_cast<double>(step) / steps);
      countMaps(frame, *solution, tally);
      if (step % pictureEvery == pictureEvery / 2)
        drawStep(renderer, tracer, frame, folder + "/" + scene.name + "-" + std::to_string(step), tally);
    }
    const int counted = std::max(tally.steps, 1), drawn = std::max(tally.pictures, 1);  // where something is in view
    const auto share = [&](std::size_t which) { return 100.0 * tally.wrong[which] / drawn; };
    table += line("%-12s %6.2f %7.0f%% %9.1f %9.2f %9.2f   %8.2f %8.2f %8.2f %8.2f\n", scene.name.c_str(), tally.maps[4] / counted,
                  100.0 * tally.refused / counted, tally.rowsMs / drawn, tally.rowsMs / tally.splitsMs, tally.rowsMs / tally.sampledMs,
                  share(0), share(1), share(2), share(3));
    sampled +=
        "\n" + scene.name + ", walked through its middle\n" + walkSamples(renderer, tracer, bounds, scene.start.lightDirectionWs, steps);
    for (std::size_t i = 0; i < kZetas.size(); ++i) all.maps[i] += tally.maps[i];
    for (std::size_t i = 0; i < kBins; ++i) all.theta[i] += tally.theta[i];
    all.steps += tally.steps;
  }
  table += "\nzeta  ";
  for (const double zeta : kZetas) table += line(" %6.2f", zeta);
  table += "\nN     ";
  for (const double maps : all.maps) table += line(" %6.2f", maps / std::max(all.steps, 1));
  table += "\n\ntheta, degrees: share of the steps\n";
  for (int i = 0; i < kBins; ++i) {
    const int percent = 100 * all.theta[static_cast<std::size_t>(i)] / std::max(all.steps, 1);
    if (all.theta[static_cast<std::size_t>(i)] > 0)
      table += line("%2d to %2d %4d %% ", i * 90 / kBins, (i + 1) * 90 / kBins, percent) +
               std::string(static_cast<std::size_t>(percent), '#') + "\n";
  }
  table += sampled;
  std::ofstream file(folder + "/walk.txt");
  file << table;
  if (!file) throw std::runtime_error(folder + "/walk.txt: cannot be written");
  std::cout << table;
  return 0;
}

}  // namespace gnomon::cli
