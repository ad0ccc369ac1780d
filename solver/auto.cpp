#include "gnomon/auto.h"

#include "gnomon/atlas.h"
#include "gnomon/error.h"
#include "gnomon/face.h"
#include "gnomon/frame.h"
#include "gnomon/maps.h"
#include "gnomon/rows.h"
#include "numeric.h"

namespace gnomon {
namespace {

constexpr int kRoughTrials = 12;  // shapes tried from a like map's: a few per cent above a search everywhere
constexpr int kHeldTrials = 8;  // from the map of the frame before: a round of the search, so that it follows the view
constexpr int kFineTrials = 24;  // from the map before's in the same choice: a per cent

// The texels that maps take for error e: area / e^2 + edge / e + fixed.
struct Demand {
  double area = 0.0, edge = 0.0, fixed = 0.0;

  [[nodiscard]] double texels(double error) const noexcept { return (area / error + edge) / error + fixed; }
  // The error that so many texels give; infinite where there are too few for any.
  [[nodiscard]] double error(double texels) const noexcept {
    const double left = texels - fixed;
    return left > 0.0 ? 2.0 * area / (std::sqrt(edge * edge + 4.0 * area * left) - edge) : kInfinity;
  }
};

// A choice with its maps fitted.
struct Fitted {
  AutoCandidate candidate;
  Demand demand;
  Splits splits;
  bool byViewDepth = false;
  MapFits maps;
};

// Sides in texels are what the map needs over the error, the margins, and what rounding to whole texels may take.
Demand demandOf(const Frame& frame, const Fitted& fitted, double rounding, int& mapCount) noexcept {
  const double extra = 2.0 * (frame.margin.filter + frame.margin.normalOffset) + rounding;
  Demand demand;
  double widest = 0.0;
  mapCount = 0;
  for (int i = 0; i < fitted.splits.count; ++i) {
    const MapFit& fit = fitted.maps.fits[i];
    if (fitted.maps.footprints[i].count == 0) continue;
    const glm::dvec2 room = 2.0 * frame.margin.motion[mapCount++] * unitsPerWorld(fit) / fit.size;
    const glm::dvec2 side = glm::dvec2(std::sqrt(fit.needed * fit.aspect), std::sqrt(fit.needed / fit.aspect)) * (1.0 + room);
    demand.area += side.x * side.y;
    demand.edge += (side.x + side.y) * extra;
    demand.fixed += extra * extra;
    widest = std::max({widest, side.x, side.y});
  }
  if (frame.shadowMap.layout == MapLayout::atlas) return demand;
  return {fitted.splits.count * widest * widest, fitted.splits.count * 2.0 * widest * extra, fitted.splits.count * extra * extra};
}

// Compares choices and keeps the best one's maps.
class Chooser {
 public:
  Chooser(const Frame& frame, const Region& region, const LightSpace& light, const AutoSettings& settings, AutoReport& report) noexcept
      : frame_(frame), region_(region), light_(light), settings_(settings), report_(report) {
    area_ = limitTexels(region, light);
    limit_ = frame.samples ? 0.0 : area_;  // what is sampled may need less
    if (region.camera.projection == Projection::perspective)
      grown_ = std::log(region.spans[region.spanCount - 1].far / region.spans[0].near);
    canWarp_ = region.bounds.empty() && region.pixelSlope > 0.0;
  }

  // All that may be spent, and what of it an atlas is known to hold.
  double texels = 0.0, usable = 0.0;

  [[nodiscard]] Fitted& best() noexcept { return fitted_[best_]; }
  [[nodiscard]] bool hasBest() const noexcept { return fitted_[best_].candidate.choice.count > 0; }
  // False where this frame cannot be served as the choice says: nothing of it is warped, or its sides have no rows.
  [[nodiscard]] bool canTake(const AutoChoice& choice) const noexcept {
    return canWarp_ || (choice.layout == AutoLayout::slices && choice.warp == Warp::none);
  }
  // What the budget has for so many maps, and the largest texture.
  [[nodiscard]] double budgetOf(int count) const noexcept {
    const auto sideOf = [](int most) { return static_cast<double>(most > 0 ? most : kMaxTextureSide); };
    const double width = sideOf(frame_.budget.atlas.x), height = sideOf(frame_.budget.atlas.y), layer = std::min(width, height);
    return std::min(texelsPerMap(frame_.budget, count) * count,
                    frame_.shadowMap.layout == MapLayout::atlas ? width * height : count * layer * layer);
  }
  [[nodiscard]] double texelsForTarget() const noexcept { return texelsForTarget_; }

  void forgetBest() noexcept { fitted_[best_].candidate = {}; }
  void forget() noexcept {
    forgetBest();
    report_.count = 0;
    report_.chosen = report_.runnerUp = -1;
    texelsForTarget_ = kInfinity;
  }

  // True where a is the better answer.
  [[nodiscard]] bool isBetter(const AutoCandidate& a, const AutoCandidate& b) const noexcept {
    if (a.isMet != b.isMet) return a.isMet;
    return valueOf(a) < valueOf(b);
  }
  [[nodiscard]] double valueOf(const AutoCandidate& candidate) const noexcept {
    return settings_.hasTarget && candidate.isMet ? candidate.cost : candidate.error;
  }

  // How far it is from the least that the view needs: what a light that turns changes though the cost stays.
  [[nodiscard]] double overLimit(const AutoCandidate& candidate) const noexcept {
    return area_ > 0.0 ? candidate.neededTexels / area_ : 0.0;
  }

  // Fits a choice. hints: for each slice, or null: the first map's warp is searched for everywhere. What has no map is never met.
  AutoCandidate consider(const AutoChoice& choice, const WarpHint* hints) noexcept {
    Fitted& made = fitted_[1 - best_];
    AutoCandidate& candidate = made.candidate;
    candidate = {.choice = choice, .error = kInfinity, .cost = kInfinity};
    if (!makeSplits(choice, made.splits)) return candidate;
    made.byViewDepth = needsViewDepth(region_, made.splits);
    const MapSettings making{
        .fit = FitMode::tight, .warp = {.warp = choice.warp}, .shares = Shares::error, .hints = hints, .chained = kFineTrials};
    fitMaps(frame_, region_, light_, made.splits, making, made.byViewDepth, made.maps);
    made.demand = demandOf(frame_, made, 0.0, candidate.maps);
    if (candidate.maps == 0) return candidate;
    candidate.neededTexels = made.maps.neededTexels;
    int fits = 0;
    for (int i = 0; i < made.splits.count; ++i) fits += made.maps.footprints[i].count > 0 && made.maps.footprints[i].like == i;
    const double target = frame_.budget.targetError, forTarget = made.demand.texels(target);
    texelsForTarget_ = std::min(texelsForTarget_, forTarget);
    candidate.isMet = !settings_.hasTarget || forTarget <= usable;
    candidate.texels = settings_.hasTarget && candidate.isMet ? forTarget : texels;
    candidate.error = settings_.hasTarget && candidate.isMet ? target : made.demand.error(texels);
    candidate.cost = costOf(candidate.maps, fits, choice.warp, candidate.texels);
    record(candidate);
    if (hasBest() && !isBetter(candidate, best().candidate)) return candidate;
    best_ = 1 - best_;
    return candidate;
  }

  // Compares all choices that have hope.
  void chooseAll() noexcept {
    const int most = frame_.budget.partitions;
    const Warp warp = canWarp_ ? Warp::least : Warp::none;
    int count = guessCount();
    AutoCandidate at = consider({AutoLayout::slices, count, warp}, nullptr);
    const auto move = [&](int to) {
      if (to < 1 || to > most || isHopeless(to, leastNeed(to))) return false;
      const AutoCandidate found = considerRoughly({AutoLayout::slices, to, warp});
      if (!isBetter(found, at)) return false;
      at = found;
      count = to;
      return true;
    };
    const int guessed = count;
    while (move(count - 1)) {
    }
    while (count >= guessed && move(count + 1)) {
    }
    if (count > 2) (void)move(1);  // of a cut view one map may need less than any few
    if (!canWarp_) return;
    if (count != guessed) (void)consider({AutoLayout::slices, count, warp}, nullptr);
    // Where nothing but the error counts, rows and faces may use all maps though slices do not.
    const int wedges = best().candidate.isMet && settings_.hasTarget ? count : most;
    considerWedges(AutoLayout::rows, wedges, leastNeed(wedges));
    considerWedges(AutoLayout::faces, wedges, facesNeed(wedges));
    if (settings_.hasTarget)  // without a search: little, but all that a small scene costs
      (void)consider({AutoLayout::slices, count, Warp::lispsm}, nullptr);
    if (settings_.hasTarget && !best().candidate.isMet && best().candidate.choice.warp == Warp::least)
      considerThoroughly(best().candidate.choice, best());
  }

  // Says what was chosen, what came next, and what the target would take where it is missed.
  void report() noexcept {
    for (int i = 0; i < report_.count; ++i) {
      if (report_.candidates[i].choice == best().candidate.choice)
        report_.chosen = i;
      else if (report_.runnerUp < 0 || isBetter(report_.candidates[i], report_.candidates[report_.runnerUp]))
        report_.runnerUp = i;
    }
  }

  // The fewest maps, more than the budget has, with which slices meet the target; 0: none up to kMaxPartitions. A budget by resolution
  // grows with them.
  [[nodiscard]] int mapsForTarget() noexcept {
    for (int count = frame_.budget.partitions + 1; count <= kMaxPartitions; ++count) {
      usable = budgetOf(count);
      if (considerRoughly({AutoLayout::slices, count, canWarp_ ? Warp::least : Warp::none}).isMet) return count;
    }
    return 0;
  }

 private:
  static double square(double x) noexcept { return x * x; }

  [[nodiscard]] double costOf(int maps, int fits, Warp warp, double texelCount) const noexcept {
    const DeviceProfile& profile = settings_.profile;
    return maps * profile.pass + texelCount * profile.texel + fits * (profile.fit + (warp == Warp::least ? profile.search : 0.0));
  }

  // True where no choice of so many maps can be better than the best: the limit's texels alone cost more.
  [[nodiscard]] bool isHopeless(int maps, double needed) const noexcept {
    if (!hasBest()) return false;
    const AutoCandidate& found = fitted_[best_].candidate;
    if (!settings_.hasTarget || !found.isMet) return Demand{needed}.error(texels) >= found.error;
    return costOf(maps, 1, Warp::none, needed / square(frame_.budget.targetError)) >= found.cost;
  }

  // Considers slices by the shapes of the best so far.
  AutoCandidate considerRoughly(const AutoChoice& choice) noexcept {
    const Fitted& known = best();
    constexpr int kUnlike = 2;  // so few slices have ratios of their own, and little to search
    if (choice.count <= kUnlike || choice.warp != Warp::least || known.candidate.choice.warp != Warp::least ||
        known.candidate.choice.layout != choice.layout)
      return consider(choice, nullptr);
    WarpHint hints[kMaxPartitions];
    for (int i = 0; i < choice.count; ++i)
      hints[i] = hintOf(known.maps, known.maps.footprints[i * known.splits.count / choice.count].like, kRoughTrials);
    return consider(choice, hints);
  }

  // Of the least texels that any map needs, what so many slices or rows of one ratio leave where they are warped.  [Lloyd 2006, eq. 18
  // over the least]. 1 for orthographic views.
  [[nodiscard]] double shareOfLimit(int count) const noexcept { return grown_ > 0.0 ? count * std::expm1(grown_ / count) / grown_ : 1.0; }

  // Texels that no choice of so many maps does without: the formula is exact for a light overhead; of others none was found below 0.8 of it
  // in thousands of views, whole and cut, from four maps on none below it. 0 where the limit is unknown.
  [[nodiscard]] double leastNeed(int count) const noexcept {
    constexpr double kLeast = 0.8;
    return kLeast * limit_ * shareOfLimit(count);
  }

  // The same of faces: each side in use has its rows, and one map is the near plane's.
  [[nodiscard]] double facesNeed(int count) const noexcept {
    const Camera& camera = region_.camera;
    const glm::dvec3 l = light_.directionVs * (light_.directionVs.z < 0.0 ? -1.0 : 1.0);
    const int sides = (l.x < camera.right * l.z) + (-l.x < camera.left * l.z) + (l.y < camera.up * l.z) + (-l.y < camera.down * l.z);
    return leastNeed(std::max((count - 1 + sides - 1) / std::max(sides, 1), 1));
  }

  // As many slices as cost least if they need what views do on average.
  [[nodiscard]] int guessCount() const noexcept {
    constexpr double kUsual = 1.5;
    const int most = frame_.budget.partitions;
    const double target = frame_.budget.targetError;
    if (!settings_.hasTarget) return most;
    int best = most;
    double least = kInfinity;
    for (int count = most; count >= 1; --count) {
      const double forTarget = kUsual * area_ * shareOfLimit(count) / square(target);
      if (!(forTarget <= usable)) break;
      if (const double cost = costOf(count, 1, Warp::none, forTarget); cost < least) {
        least = cost;
        best = count;
      }
    }
    return best;
  }

  // Rows or faces, as many as the best slices, where they have hope: they need at least `needed`.
  void considerWedges(AutoLayout layout, int count, double needed) noexcept {
    if (isHopeless(count, needed)) return;
    // A named warp says at a third of the price what has no hope.
    constexpr double kHopeless = 1.5;  // times the texels: for wedges the least of all warps seldom gains more over LiSPSM
    const AutoCandidate rough = consider({layout, count, Warp::lispsm}, nullptr);
    if (rough.maps == 0 || isHopeless(rough.maps, rough.neededTexels / kHopeless)) return;
    considerThoroughly({layout, count, Warp::least}, best().candidate.choice == rough.choice ? best() : fitted_[1 - best_]);
  }

  // Searches for every map everywhere, and from the maps of a choice of as many.
  void considerThoroughly(const AutoChoice& choice, const Fitted& known) noexcept {
    WarpHint hints[kMaxPartitions];
    for (int i = 0; i < known.splits.count; ++i) {
      hints[i] = hintOf(known.maps, known.maps.footprints[i].like, kFineTrials);
      hints[i].isThorough = true;
    }
    (void)consider(choice, hints);
  }

  bool makeSplits(const AutoChoice& choice, Splits& splits) noexcept {
    splits.count = 0;
    splits.isWedged = false;
    splits.rows.count = 0;
    double refused = 0.0;
    RowLayout layout;
    switch (choice.layout) {
      case AutoLayout::slices: (void)split(region_, {}, choice.count, splits, refused); return splits.count > 0;
      case AutoLayout::faces: splitFaces(region_, light_, NearFace::own, choice.count, true, splits); break;
      case AutoLayout::rows:
        (void)splitRows(region_, light_, {.rule = RowRule::error, .maxColumns = 1}, choice.count, splits, layout);
        break;
    }
    return splits.isWedged && splits.count > 0;
  }

  void record(const AutoCandidate& candidate) noexcept {
    for (int i = 0; i < report_.count; ++i)
      if (report_.candidates[i].choice == candidate.choice) {
        if (isBetter(candidate, report_.candidates[i])) report_.candidates[i] = candidate;
        return;
      }
    if (candidate.choice.count <= frame_.budget.partitions && report_.count < kMaxCandidates)
      report_.candidates[report_.count++] = candidate;
  }

  const Frame& frame_;
  const Region& region_;
  const LightSpace& light_;
  const AutoSettings& settings_;
  AutoReport& report_;
  double limit_ = 0.0, area_ = 0.0;  // the least texels; of all that is in view, sampled or not
  double grown_ = 0.0;  // logarithm of the depths' ratio
  double texelsForTarget_ = kInfinity;
  bool canWarp_ = false;
  int best_ = 0;
  Fitted fitted_[2];
};

// Places the best choice's maps and writes them, with as many texels as meet the target: whole texels may round past it.
Status writeBest(const Frame& frame, const Region& region, const LightSpace& light, bool hasTarget, double most, Fitted& fitted,
                 Solution& solution) noexcept {
  constexpr int kTries = 5;
  const double target = frame.budget.targetError;
  MapFit fits[kMaxPartitions];
  std::copy_n(fitted.maps.fits, fitted.splits.count, fits);
  const MapSettings making{.fit = FitMode::tight, .warp = {.warp = fitted.candidate.choice.warp}, .shares = Shares::error};
  Frame spent = frame;
  spent.budget.texels = hasTarget && fitted.candidate.isMet ? 0.0 : most;
  for (int i = 0;; ++i) {
    int mapCount = 0;
    if (spent.budget.texels < most)
      spent.budget.texels = std::clamp(demandOf(frame, fitted, 1 << i, mapCount).texels(target), spent.budget.texels, most);
    clear(solution);
    const Status status = placeMaps(spent, region, light, fitted.splits, making, fitted.maps, solution);
    if (status != Status::ok || solution.maxError <= target || i + 1 == kTries || spent.budget.texels >= most) return status;
    const double over = solution.maxError / target;  // more than rounding to whole texels where float32 takes its share
    spent.budget.texels = std::min(spent.budget.texels * over * over, most);
    std::copy_n(fits, fitted.splits.count, fitted.maps.fits);
  }
}

double spentTexels(const Solution& solution) noexcept {
  double sum = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i)
    sum += static_cast<double>(solution.partitions[i].viewport.z) * solution.partitions[i].viewport.w;
  return sum;
}

// The shapes that the next frame's search begins with, and back.
void remember(const LightSpace& light, const Fitted& fitted, AutoState& state) noexcept {
  const glm::dmat3 viewFromLs = glm::transpose(glm::dmat3(light.lsFromView));
  for (int i = 0; i < fitted.splits.count; ++i) {
    state.shapes[i] = {};
    if (fitted.candidate.choice.warp != Warp::least || !fitted.maps.hasServed) continue;
    const WarpShape shape = hintOf(fitted.maps, fitted.maps.footprints[i].like, 0).shape;
    state.shapes[i] = {viewFromLs * glm::dvec3(std::cos(shape.phi), std::sin(shape.phi), 0.0), shape.kappa, shape.sigma, shape.tau};
  }
}
void recall(const LightSpace& light, const AutoState& state, WarpHint* hints) noexcept {
  for (int i = 0; i < state.choice.count; ++i) {
    const AutoState::Shape& shape = state.shapes[i];
    const glm::dvec3 axis = glm::dmat3(light.lsFromView) * shape.axisVs;
    hints[i] = {{std::atan2(axis.y, axis.x), shape.kappaShare, shape.sigma, shape.tau}, kHeldTrials};
  }
}

}  // namespace

Status validate(const AutoSettings& settings, double& value) noexcept {
  const DeviceProfile& profile = settings.profile;
  for (const double weight : {profile.pass, profile.texel, profile.fit, profile.search, settings.hysteresis})
    if (value = weight; !(weight >= 0.0 && std::isfinite(weight))) return Status::autoWeights;
  return Status::ok;
}

Status solveAuto(const Frame& frame, const AutoSettings& settings, AutoState& state, Solution& solution, AutoReport* report) noexcept {
  AutoReport unread;
  AutoReport& why = report ? *report : unread;
  why = {};
  Region region;
  LightSpace light;
  if (beginSolve(frame, {}, FitMode::tight, region, light, solution) != Status::ok) return solution.status;
  if (const Status status = validate(settings, solution.refusedValue); status != Status::ok) return refuse(solution, status);
  if (region.spanCount == 0) {
    clearBlock(solution.block);
    return solution.status;
  }

  const double target = frame.budget.targetError;
  Chooser chooser(frame, region, light, settings, why);
  chooser.texels = chooser.usable = chooser.budgetOf(frame.budget.partitions);
  AutoCandidate held;
  WarpHint hints[kMaxPartitions];
  if (state.choice.count > 0 && state.partitions == frame.budget.partitions && chooser.canTake(state.choice)) {
    recall(light, state, hints);
    held = chooser.consider(state.choice, hints);
    const double value = chooser.valueOf(held), most = 1.0 + settings.hysteresis;
    why.isKept = held.isMet && state.isMet && value <= state.value * most && value * most >= state.value &&
                 chooser.overLimit(held) <= state.overLimit * most;
  }
  AutoState next = state;
  next.partitions = frame.budget.partitions;
  constexpr int kAttempts = 3;  // where the atlas cannot be filled, what it held is all there is
  for (int round = 1;; ++round) {
    if (!why.isKept) {
      chooser.chooseAll();
      const AutoCandidate best = chooser.best().candidate;
      if (best.maps == 0) {
        clearBlock(solution.block);
        return solution.status;
      }
      why.isKept =
          held.maps > 0 && best.isMet == held.isMet && chooser.valueOf(held) <= chooser.valueOf(best) * (1.0 + settings.hysteresis);
      next.value = chooser.valueOf(why.isKept ? held : best);
      next.isMet = best.isMet;
      next.overLimit = chooser.overLimit(why.isKept ? held : best);
      if (why.isKept && best.choice != held.choice) {
        chooser.forgetBest();
        (void)chooser.consider(held.choice, hints);
      }
    }
    Fitted& chosen = chooser.best();
    const AutoCandidate predicted = chosen.candidate;
    next.choice = predicted.choice;
    remember(light, chosen, next);
    chooser.report();
    if (const Status status = writeBest(frame, region, light, settings.hasTarget, chooser.texels, chosen, solution); status != Status::ok)
      return refuse(solution, status);
    if (!settings.hasTarget || solution.maxError <= target) {
      why.texelsForTarget = 0.0;
      break;
    }
    why.texelsForTarget = chooser.texelsForTarget();
    if (!predicted.isMet || round == kAttempts) break;
    constexpr double kLess = 1.0 - 1e-6;
    chooser.usable = predicted.texels * kLess;
    if ((solution.warnings & static_cast<std::uint32_t>(Warning::atlasReduced)) != 0)
      chooser.usable = std::min(chooser.usable, spentTexels(solution));
    chooser.forget();
    held = {};
    why.isKept = false;
  }
  if (settings.hasTarget && solution.maxError > target) {
    solution.warnings |= static_cast<std::uint32_t>(Warning::targetMissed);
    if (why.chosen >= 0) why.candidates[why.chosen].isMet = false;
    if (report) why.mapsForTarget = chooser.mapsForTarget();
  }
  state = next;
  return solution.status;
}

}  // namespace gnomon
