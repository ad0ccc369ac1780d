#include "profile.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "result.h"
#include "scene.h"
#include "summary.h"

namespace gnomon::report {
namespace {

using offscreen::View;

constexpr int kSolves = 201, kRenders = 3;

void solveOrThrow(Status status) {
  if (status != Status::ok) throw std::runtime_error(std::string("profile: ") + statusRule(status));
}

}  // namespace

Weights fitWeights(const std::vector<Timing>& timings) {
  double pp = 0.0, pt = 0.0, tt = 0.0, p = 0.0, t = 0.0;
  for (const Timing& each : timings) {
    const double passes = each.passes / each.ns, texels = each.texels / each.ns;  // shares of the time: slow renders weigh no more
    pp += passes * passes;
    pt += passes * texels;
    tt += texels * texels;
    p += passes;
    t += texels;
  }
  const double determinant = pp * tt - pt * pt;
  if (determinant > 0.0) {
    const Weights both{(p * tt - t * pt) / determinant, (t * pp - p * pt) / determinant};
    if (both.pass >= 0.0 && both.texel >= 0.0) return both;
  }
  // On the border of what is allowed: the one that explains more alone.
  if (!(tt > 0.0) || (pp > 0.0 && p * p * tt > t * t * pp)) return {pp > 0.0 ? p / pp : 0.0, 0.0};
  return {0.0, t / tt};
}

cli::Json profileOf(offscreen::Renderer& renderer) {
  std::vector<Timing> timings;
  std::vector<double> fits, searches;
  const auto solution = std::make_unique<Solution>();
  for (const std::string& name : offscreen::builtInNames()) {
    const offscreen::BuiltIn scene = offscreen::makeBuiltIn(name);
    renderer.load(scene.mesh);
    const Box bounds{scene.mesh.min, scene.mesh.max};
    const View& view = scene.views.front();
    Frame frame;
    frame.camera = view.cam;
    frame.light.directionWs = view.lightDirectionWs;
    frame.scene.receivers = {&bounds, 1};

    cli::Case one = cli::methodCase("single");
    one.frame = frame;
    const double search = cli::timedSolve(one, kSolves, *solution);
    solveOrThrow(solution->status);
    one.lloyd.warp.warp = Warp::none;
    fits.push_back(cli::timedSolve(one, kSolves, *solution));
    searches.push_back(std::max(0.0, search - fits.back()));

    for (const int maps : {1, 2, 4, 8})
      for (const int side : {256, 512, 1024, 2048}) {
        frame.budget = {.partitions = maps, .resolution = side};
        PssmSettings settings;
        settings.split.count = maps;
        solveOrThrow(solvePssm(frame, settings, *solution));
        double texels = 0.0;
        for (int i = 0; i < solution->partitionCount; ++i)
          texels += static_cast<double>(solution->partitions[i].viewport.z) * solution->partitions[i].viewport.w;
        std::vector<double> ns;
        for (int i = 0; i < kRenders; ++i)
          ns.push_back(1e6 * renderer.render(frame, *solution, {.width = 160, .height = 90, .time = i == 0, .pictures = false}).shadowMs);
        timings.push_back({static_cast<double>(solution->partitionCount), texels, median(ns)});
      }
  }
  const Weights weights = fitWeights(timings);
  return {{"device", renderer.device()},
          {"method",
           {{"name", "auto"},
            {"pass_ns", weights.pass},
            {"texel_ns", weights.texel},
            {"fit_ns", median(fits)},
            {"search_ns", median(searches)}}}};
}

}  // namespace gnomon::report
