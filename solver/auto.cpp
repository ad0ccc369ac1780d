#include "gnomon/auto.h"

#include <utility>

#include "gnomon/atlas.h"
#include "gnomon/error.h"
#include "gnomon/face.h"
#include "gnomon/frame.h"
#include "gnomon/maps.h"
#include "gnomon/rows.h"
#include "numeric.h"

namespace gnomon {
namespace {

// Shapes tried for each map beside the rectangle, its sides and a like map's shape: what is like it is seldom a per cent from the least.
constexpr int kSliceTrials = 2;  // from the slice before, or the slice at its place in another count
constexpr int kWedgeTrials = 6;  // from its named warp, which is less like it
constexpr int kFew = 4;  // maps, whose searches take little
constexpr int kMany = 8;  // more fitted by themselves leave no time to search for those of two layouts
constexpr int kUnlike = 3;  // so few slices have ratios of their own, and little to search
constexpr int kEverywhere = 36;  // or so, where there is none
constexpr int kFineTrials = 12;  // from its own
constexpr int kHeldTrials = 0;  // from the map of the frame before, taken as it is
constexpr double kMostWork = 420.0;  // a choice may take, in shapes tried: some 105 us
constexpr double kNear = 1.03;  // of a target, so that a little more may meet it

// The texels that maps take for error e: area / e^2 + edge / e + fixed, and none suffice for less than the least, where a side is as long
// as the atlas.
struct Demand {
  double area = 0.0, edge = 0.0, fixed = 0.0, least = 0.0;

  [[nodiscard]] double texels(double error) const noexcept { return error < least ? kInfinity : (area / error + edge) / error + fixed; }
  // Of maps that need so many times fewer texels.
  [[nodiscard]] Demand over(double gain) const noexcept { return {area / gain, edge / std::sqrt(gain), fixed, least / std::sqrt(gain)}; }
  // The error that so many texels give; infinite where there are too few for any.
  [[nodiscard]] double error(double texels) const noexcept {
    const double left = texels - fixed;
    return left > 0.0 ? std::max(2.0 * area / (std::sqrt(edge * edge + 4.0 * area * left) - edge), least) : kInfinity;
  }
};

// What has no maps.
constexpr AutoCandidate kNone{.choice = {}, .error = kInfinity, .cost = kInfinity};

// A choice with its maps fitted.
struct Fitted {
  AutoCandidate candidate;
  Demand demand;
  Splits splits;
  int fits = 0;  // maps that are not copies
  MapFits maps;
};

// What a map's error asks of its sides beside that: the margins.
double marginTexels(const Frame& frame) noexcept { return 2.0 * (frame.margin.filter + frame.margin.normalOffset); }

// A map's sides in texels for error 1, with room for its motion.
glm::dvec2 neededSides(const MapFit& fit, double motion) noexcept {
  const glm::dvec2 room = 2.0 * motion * unitsPerWorld(fit) / fit.size;
  return glm::dvec2(std::sqrt(fit.needed * fit.aspect), std::sqrt(fit.needed / fit.aspect)) * (1.0 + room);
}

// Sides in texels are what the map needs over the error, the margins, and what rounding to whole texels may take.
Demand demandOf(const Frame& frame, const Fitted& fitted, double rounding, int& mapCount) noexcept {
  const double extra = marginTexels(frame) + rounding;
  const glm::dvec2 most = glm::dvec2(atlasLimit(frame.budget)) - (2.0 * frame.margin.border + extra);
  Demand demand;
  double widest = 0.0;
  mapCount = 0;
  for (int i = 0; i < fitted.splits.count; ++i) {
    if (fitted.maps.footprints[i].count == 0) continue;
    const glm::dvec2 side = neededSides(fitted.maps.fits[i], frame.margin.motion[mapCount++]);
    demand.area += side.x * side.y;
    demand.edge += (side.x + side.y) * extra;
    demand.fixed += extra * extra;
    demand.least = std::max({demand.least, side.x / most.x, side.y / most.y});
    widest = std::max({widest, side.x, side.y});
  }
  if (frame.shadowMap.layout == MapLayout::atlas) return demand;
  return {mapCount * widest * widest, mapCount * 2.0 * widest * extra, mapCount * extra * extra, widest / std::min(most.x, most.y)};
}

// The error of maps of whole texels.
double errorOf(const Frame& frame, const Fitted& fitted, const Atlas& atlas) noexcept {
  double error = 0.0;
  for (int i = 0, m = 0; i < fitted.splits.count; ++i) {
    if (fitted.maps.footprints[i].count == 0) continue;
    const glm::dvec2 side = neededSides(fitted.maps.fits[i], frame.margin.motion[m++]);
    const glm::dvec2 inner = glm::dvec2(atlas.viewports[i].z, atlas.viewports[i].w) - marginTexels(frame);
    error = std::max({error, side.x / inner.x, side.y / inner.y});
  }
  return error;
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
    isCut_ = !frame.scene.receivers.empty() || !frame.scene.planes.empty();
    canPart_ = region.bounds.empty();
    canWarp_ = canPart_ && region.pixelSlope > 0.0;
  }

  // All that may be spent, and what of it an atlas is known to hold.
  double texels = 0.0, usable = 0.0;
  AutoChoice held;  // considered with the shapes of the frame before alone

  [[nodiscard]] Fitted& best() noexcept { return fitted_[best_]; }
  // What was fitted last.
  [[nodiscard]] const Fitted& last() const noexcept { return fitted_[last_]; }
  [[nodiscard]] bool hasBest() const noexcept { return fitted_[best_].candidate.choice.count > 0; }
  // False where this frame is not served as the choice says: all of it is warped or nothing, and only slices know where samples lie.
  [[nodiscard]] bool canTake(const AutoChoice& choice) const noexcept {
    return (canPart_ || choice.layout == AutoLayout::slices) && canWarp_ == (choice.warp != Warp::none);
  }
  // What the budget has for so many maps, and the largest texture.
  [[nodiscard]] double budgetOf(int count) const noexcept {
    const glm::dvec2 limit(atlasLimit(frame_.budget));
    const double layer = std::min(limit.x, limit.y);
    return std::min(texelsPerMap(frame_.budget, count) * count,
                    frame_.shadowMap.layout == MapLayout::atlas ? limit.x * limit.y : count * layer * layer);
  }
  [[nodiscard]] double texelsForTarget() const noexcept { return texelsForTarget_; }

  void forgetBest() noexcept { fitted_[best_].candidate = {}; }

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

  // Fits a choice. hints: for each slice, or null: of the least warps the first is searched for everywhere. What has no map is never met.
  AutoCandidate consider(const AutoChoice& choice, const WarpHint* hints) noexcept {
    if (choice == held) held = {};
    last_ = 1 - best_;
    Fitted& made = fitted_[last_];
    AutoCandidate& candidate = made.candidate;
    candidate = kNone;
    candidate.choice = choice;
    if (!makeSplits(choice, made.splits)) return candidate;
    const MapSettings making{.fit = FitMode::tight,
                             .warp = {.warp = choice.warp},
                             .whole = hasPlane_ ? &plane_.whole : nullptr,
                             .shares = Shares::error,
                             .hints = hints,
                             .chained = choice.count <= kFew ? kFineTrials : kSliceTrials};
    fitMaps(frame_, region_, light_, made.splits, making, needsViewDepth(region_, made.splits), made.maps);
    made.demand = demandOf(frame_, made, 0.0, candidate.maps);
    if (candidate.maps == 0) return candidate;
    candidate.neededTexels = made.maps.neededTexels;
    made.fits = 0;
    for (int i = 0; i < made.splits.count; ++i) made.fits += made.maps.footprints[i].count > 0 && made.maps.footprints[i].like == i;
    const bool isSearched = choice.warp == Warp::least;
    work_ += made.fits * workOf(!isSearched ? 0 : !hints ? kSliceTrials : hints[0].isThorough ? kEverywhere : hints[0].trials);
    if (isSearched && !hints) work_ += kEverywhere;
    weigh(made.demand, made.fits, candidate);
    texelsForTarget_ = std::min(texelsForTarget_, made.demand.texels(frame_.budget.targetError));
    record(made);
    if (hasBest() && !isBetter(candidate, best().candidate)) return candidate;
    best_ = 1 - best_;
    return candidate;
  }

  // True where the target is missed by little.
  [[nodiscard]] bool isNear() const noexcept {
    const AutoCandidate& found = fitted_[best_].candidate;
    return settings_.hasTarget && hasBest() && !found.isMet && found.error < kNear * frame_.budget.targetError;
  }

  // Compares what the time did not suffice for as well.
  void chooseMore() noexcept {
    mostWork_ = kInfinity;
    chooseAll();
  }

  // Compares all choices that have hope.
  void chooseAll() noexcept {
    const int most = frame_.budget.partitions;
    int count = guessCount();
    // Named warps say which of the two should be searched first: not always the slices.
    if (isCut_ && canWarp_ && count > kMany) considerWedges(AutoLayout::rows, count);
    AutoCandidate at = considerSlices(count);
    const auto move = [&](int to) {
      if (to < 1 || to > most) return false;
      // Fewer seldom need less: then not without a search either. The search waits for what rows and faces come to.
      if (to < count && (!settings_.hasTarget || !at.isMet)) {
        if (!(considerNamed(to).error < considerNamed(count).error)) return false;
        count = to;
        return true;
      }
      const AutoCandidate found = considerSlices(to);
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
    if (isCut_ && count > 2) (void)move(1);  // one map may need less than any few
    if (!canPart_) return;
    // Where nothing but the error counts, rows and faces may use all maps though slices do not.
    const int wedges = best().candidate.isMet && settings_.hasTarget ? std::max(count, 2) : most;
    considerWedges(AutoLayout::rows, wedges);
    if (frame_.scene.receivers.size() > 1)  // columns part what lies side by side
      considerWedges(AutoLayout::columns, std::min(wedges + wedges % 2, most - most % 2));
    considerWedges(AutoLayout::faces, wedges);
    if (!canWarp_ || !hasBest()) return;
    if ((!settings_.hasTarget || !at.isMet) && count < guessed) (void)considerSlices(count);
    const AutoCandidate& found = best().candidate;
    const AutoChoice searched{found.choice.layout, found.choice.count, Warp::least};
    if (!settings_.hasTarget || !found.isMet) {
      if ((!settings_.hasTarget || isNear()) && canAfford(best().fits, kFineTrials))
        (void)considerFrom(searched, best(), kFineTrials, best().fits <= kFew && canAfford(best().fits, kEverywhere));
    } else if (found.choice == searched && searched.layout == AutoLayout::slices && count != guessed &&
               canAfford(best().fits, kFineTrials + kEverywhere / best().fits)) {
      (void)consider(searched, nullptr);  // its shapes were found from the guess's, which may be unlike
    }
  }

  // Weighs all that was compared anew, as fewer texels are usable, and fits what is the best of it now.
  void weighAgain() noexcept {
    int first = 0;
    for (int i = 0; i < report_.count; ++i) {
      weigh(demands_[i], fits_[i], report_.candidates[i]);
      if (isBetter(report_.candidates[i], report_.candidates[first])) first = i;
    }
    const AutoChoice choice = report_.candidates[first].choice;
    if (choice == best().candidate.choice) {
      best().candidate = report_.candidates[first];
      return;
    }
    forgetBest();
    if (choice.layout == AutoLayout::slices || choice.warp != Warp::least) {
      (void)consider(choice, nullptr);
    } else {
      (void)consider({choice.layout, choice.count, Warp::lispsm}, nullptr);
      (void)considerFrom(choice, best(), kWedgeTrials);
    }
  }

  // Says what was chosen, what came next, and what the target would take where it is missed.
  void report() noexcept {
    report_.chosen = report_.runnerUp = -1;
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
      if (considerLike({AutoLayout::slices, count, canWarp_ ? Warp::least : Warp::none}).isMet) return count;
    }
    return 0;
  }

 private:
  static double square(double x) noexcept { return x * x; }

  [[nodiscard]] double costOf(int maps, int fits, Warp warp, double texelCount) const noexcept {
    const DeviceProfile& profile = settings_.profile;
    return maps * profile.pass + texelCount * profile.texel + fits * (profile.fit + (warp == Warp::least ? profile.search : 0.0));
  }

  // What a choice comes to.
  void weigh(const Demand& demand, int fits, AutoCandidate& candidate) noexcept {
    const double target = frame_.budget.targetError, forTarget = demand.texels(target);
    candidate.isMet = !settings_.hasTarget || forTarget <= usable;
    candidate.texels = settings_.hasTarget && candidate.isMet ? forTarget : texels;
    candidate.error = settings_.hasTarget && candidate.isMet ? target : demand.error(texels);
    candidate.cost = costOf(candidate.maps, fits, candidate.choice.warp, candidate.texels);
  }

  // Work, in shapes tried for a map: to fit one by itself, and its search where it begins with that of a like one.
  static double workOf(int trials) noexcept {
    constexpr double kFit = 4.0, kSides = 7.0;
    return trials > 0 ? kFit + kSides + trials : kFit;
  }
  // False where so many fits would take the choice past its time, or the report is full: what has not been compared by then is not.
  [[nodiscard]] bool canAfford(int fits, int trials) const noexcept {
    return !hasBest() || (work_ + fits * workOf(trials) <= mostWork_ && report_.count < kMaxCandidates);
  }

  // True where no choice of so many maps, of which so many are fitted by themselves, can be better than the best: what it takes at least
  // costs more.
  [[nodiscard]] bool isHopeless(int maps, int fits, Warp warp, const Demand& least) const noexcept {
    if (!hasBest()) return false;
    const AutoCandidate& found = fitted_[best_].candidate;
    if (!settings_.hasTarget || !found.isMet) return least.error(texels) >= found.error;
    return costOf(maps, fits, warp, least.texels(frame_.budget.targetError)) >= found.cost;
  }

  // Considers slices without a search, which is little, but all that a small scene costs; then with one, where that has hope.
  AutoCandidate considerSlices(int count) noexcept {
    const AutoCandidate found = considerNamed(count);
    if (!canWarp_ || found.maps == 0) return found;
    const AutoChoice choice{AutoLayout::slices, count, Warp::least};
    const int at = find(found.choice);
    if (!wasSearched(choice) && (isHopeless(count, fits_[at], Warp::least, {leastNeed(count)}) || !canAfford(fits_[at], kSliceTrials)))
      return found;
    const AutoCandidate searched = wasSearched(choice) ? report_.candidates[find(choice)] : considerLike(choice);
    return isBetter(searched, found) ? searched : found;
  }

  // The warp of what is not searched.
  [[nodiscard]] Warp namedWarp() const noexcept { return canWarp_ ? Warp::lispsm : Warp::none; }

  // Considers slices without a search.
  AutoCandidate considerNamed(int count) noexcept {
    const AutoChoice choice{AutoLayout::slices, count, namedWarp()};
    const int at = find(choice);
    if (at == report_.count && canAfford(count, 0) && !isHopeless(count, 1, Warp::none, {leastNeed(count)}))
      (void)consider(choice, nullptr);
    return at < report_.count ? report_.candidates[at] : kNone;
  }

  // Considers slices by the shapes of those searched before.
  AutoCandidate considerLike(const AutoChoice& choice) noexcept {
    WarpHint hints[kMaxPartitions];
    for (int i = 0; i < choice.count && searched_ > 0; ++i) hints[i] = slices_[i * searched_ / choice.count];
    const AutoCandidate found = consider(choice, choice.count > kUnlike && searched_ > 0 && choice.warp == Warp::least ? hints : nullptr);
    if (found.maps == 0 || choice.warp != Warp::least) return found;
    searched_ = last().splits.count;
    for (int i = 0; i < searched_; ++i) slices_[i] = hintOf(last().maps, last().maps.footprints[i].like, kSliceTrials);
    return found;
  }

  // Of the least texels that any map needs, what so many slices or rows of one ratio leave where they are warped.  [Lloyd 2006, eq. 18
  // over the least]. 1 for orthographic views.
  [[nodiscard]] double shareOfLimit(int count) const noexcept { return grown_ > 0.0 ? count * std::expm1(grown_ / count) / grown_ : 1.0; }

  // Texels that no choice of so many maps does without: the formula is exact for a light overhead; of others none was found below 0.8 of it
  // in thousands of views, from four maps on none below it, but where a box or two fill one map or two. 0 where the limit is unknown.
  [[nodiscard]] double leastNeed(int count) const noexcept {
    constexpr double kLeast = 0.8;
    constexpr int kOneOrTwo = 2;
    return limit_ * (isCut_ && count <= kOneOrTwo ? 1.0 : std::max(kLeast * shareOfLimit(count), 1.0));
  }

  // As many slices as cost least if they need what views do on average.
  [[nodiscard]] int guessCount() const noexcept {
    constexpr double kUsual = 1.5;
    const int most = frame_.budget.partitions;
    const double target = frame_.budget.targetError;
    if (!settings_.hasTarget) return grown_ > 0.0 ? most : 1;
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

  // Considers rows or faces. Named warps say at a tenth of a search's price how many, where the target can be met, and what has no hope.
  void considerWedges(AutoLayout layout, int count) noexcept {
    const int one = layout == AutoLayout::columns ? 2 : 1;  // step from one number of maps to the next
    constexpr double kMostGain = 2.0;  // times the texels, what the least of all warps gains over LiSPSM: seldom more
    double gain = 1.1;  // usually
    const auto predict = [&](int maps, double by) {
      AutoCandidate found = kNone;
      if (maps < 2 || maps > frame_.budget.partitions || isHopeless(maps, 1, Warp::none, {leastNeed(maps)})) return found;
      const AutoChoice choice{layout, maps, namedWarp()};
      int at = find(choice);
      if (at == report_.count && canAfford(maps, 0)) (void)consider(choice, nullptr);
      if (at == report_.count) return found;
      found = report_.candidates[at];
      if (!canWarp_) return found;
      AutoCandidate searched = found;
      searched.choice.warp = Warp::least;
      weigh(demands_[at].over(by), fits_[at], searched);
      return isBetter(searched, found) ? searched : found;
    };
    const auto search = [&](int maps) {
      if (!canWarp_) return false;
      const AutoChoice named{layout, maps, Warp::lispsm}, choice{layout, maps, Warp::least};
      const int at = find(named);
      if (at == report_.count || wasSearched(choice) || !canAfford(fits_[at], kWedgeTrials) ||
          isHopeless(report_.candidates[at].maps, fits_[at], Warp::least, demands_[at].over(kMostGain)))
        return false;
      if (!(last().candidate.choice == named)) (void)consider(named, nullptr);
      const AutoCandidate found = considerFrom(choice, last(), kWedgeTrials);
      gain = report_.candidates[at].neededTexels / found.neededTexels;
      return found.choice == best().candidate.choice;
    };
    const auto climb = [&] {  // to the number of maps that is predicted to cost least
      AutoCandidate at = predict(count, gain);
      if (!settings_.hasTarget || !at.isMet) return;
      for (const int step : {-one, one})
        for (;;) {
          const AutoCandidate next = predict(count + step, gain);
          if (!isBetter(next, at)) break;
          at = next;
          count += step;
        }
    };
    do climb();
    while (search(count));
    if (settings_.hasTarget && best().candidate.isMet && !predict(count - one, gain).isMet && predict(count - one, kMostGain).isMet)
      (void)search(count - one);
  }

  // Searches for every map from that of a choice of as many.
  AutoCandidate considerFrom(const AutoChoice& choice, const Fitted& known, int trials, bool isThorough = false) noexcept {
    WarpHint hints[kMaxPartitions];
    for (int i = 0; i < known.splits.count; ++i) {
      hints[i] = hintOf(known.maps, known.maps.footprints[i].like, trials);
      hints[i].isThorough = isThorough;
    }
    return consider(choice, hints);
  }

  bool makeSplits(const AutoChoice& choice, Splits& splits) noexcept {
    splits.count = 0;
    splits.isWedged = false;
    splits.rows.count = 0;
    double refused = 0.0;
    switch (choice.layout) {
      case AutoLayout::slices: (void)split(region_, {}, choice.count, splits, refused); return splits.count > 0;
      case AutoLayout::faces: splitFaces(region_, light_, NearFace::own, choice.count, true, splits); break;
      case AutoLayout::rows:
      case AutoLayout::columns:
        if (!hasPlane_) makeRowPlane(region_, light_, plane_);
        hasPlane_ = true;
        RowLayout layout;
        (void)splitRows(region_, light_, plane_, {.rule = RowRule::error, .maxColumns = choice.layout == AutoLayout::columns ? 2 : 1},
                        choice.count, splits, layout);
        break;
    }
    return splits.isWedged && splits.count > 0;
  }

  void record(const Fitted& made) noexcept {
    const AutoCandidate& candidate = made.candidate;
    const int at = find(candidate.choice);
    if (at < report_.count ? !isBetter(candidate, report_.candidates[at]) : candidate.choice.count > frame_.budget.partitions) return;
    if (at == kMaxCandidates) return;
    report_.count = std::max(report_.count, at + 1);
    report_.candidates[at] = candidate;
    demands_[at] = made.demand;
    fits_[at] = made.fits;
  }
  // Its place in the report; past its end where it is not there.
  [[nodiscard]] int find(const AutoChoice& choice) const noexcept {
    int at = 0;
    while (at < report_.count && !(report_.candidates[at].choice == choice)) ++at;
    return at;
  }

  [[nodiscard]] bool wasSearched(const AutoChoice& choice) const noexcept { return !(choice == held) && find(choice) < report_.count; }

  const Frame& frame_;
  const Region& region_;
  const LightSpace& light_;
  const AutoSettings& settings_;
  AutoReport& report_;
  double limit_ = 0.0, area_ = 0.0;  // the least texels; of all that is in view, sampled or not
  double grown_ = 0.0;  // logarithm of the depths' ratio
  double texelsForTarget_ = kInfinity;
  bool canPart_ = false, canWarp_ = false, isCut_ = false;
  double work_ = 0.0, mostWork_ = kMostWork;
  int best_ = 0, last_ = 0;
  Fitted fitted_[2];
  WarpHint slices_[kMaxPartitions];  // shapes of the slices searched last
  int searched_ = 0;  // their number
  RowPlane plane_;  // of rows, found when they are first considered
  bool hasPlane_ = false;
  Demand demands_[kMaxCandidates];  // of the report's candidates
  int fits_[kMaxCandidates];
};

// The texels, at most `most`, with which maps meet the target though their sides are whole. rounding: texels of a side that this may take,
// 1 or more; grows to what it takes.
double texelsToMeet(const Frame& frame, const Fitted& fitted, double most, int& rounding) noexcept {
  constexpr int kMostRounding = 256;
  constexpr double kLess = 1.0 - 1e-4;  // room for float32's rounding
  double shares[kMaxPartitions];
  const bool isShared = shareTexels(frame, fitted.splits, fitted.maps, shares);
  Frame spent = frame;
  for (;; rounding *= 2) {
    int mapCount = 0;
    spent.budget.texels = std::min(demandOf(frame, fitted, rounding, mapCount).texels(frame.budget.targetError), most);
    if (rounding >= kMostRounding || spent.budget.texels >= most) return spent.budget.texels;
    Atlas atlas;
    if (packAtlas(spent, fitted.maps.fits, isShared ? shares : nullptr, fitted.splits.count, atlas) != Status::ok ||
        errorOf(frame, fitted, atlas) <= frame.budget.targetError * kLess)
      return spent.budget.texels;
  }
}

// Places the best choice's maps and writes them, with as many texels as meet the target.
Status writeBest(const Frame& frame, const Region& region, const LightSpace& light, bool hasTarget, double most, Fitted& fitted,
                 Solution& solution) noexcept {
  constexpr int kTries = 5;
  const double target = frame.budget.targetError;
  MapFit fits[kMaxPartitions];
  std::copy_n(fitted.maps.fits, fitted.splits.count, fits);
  const MapSettings making{.fit = FitMode::tight, .warp = {.warp = fitted.candidate.choice.warp}, .shares = Shares::error};
  int rounding = 1;
  Frame spent = frame;
  spent.budget.texels = hasTarget && fitted.candidate.isMet ? texelsToMeet(frame, fitted, most, rounding) : most;
  for (int i = 1;; ++i) {
    clear(solution);
    const Status status = placeMaps(spent, region, light, fitted.splits, making, fitted.maps, solution);
    std::copy_n(fits, fitted.splits.count, fitted.maps.fits);  // placing grows them
    if (status != Status::ok || solution.maxError <= target || i == kTries || spent.budget.texels >= most) return status;
    const double over = solution.maxError / target;  // float32 took more
    rounding *= 4;
    spent.budget.texels = std::clamp(texelsToMeet(frame, fitted, most, rounding), std::min(spent.budget.texels * over * over, most), most);
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
  std::fill_n(state.shapes, kMaxPartitions, AutoState::Shape{});
  for (int i = 0; i < fitted.splits.count; ++i) {
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
  const std::pair<Status, double> weights[] = {{Status::autoPass, profile.pass},
                                               {Status::autoTexel, profile.texel},
                                               {Status::autoFit, profile.fit},
                                               {Status::autoSearch, profile.search},
                                               {Status::autoHysteresis, settings.hysteresis}};
  for (const auto& [status, weight] : weights)
    if (value = weight; !(weight >= 0.0 && std::isfinite(weight))) return status;
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
    chooser.held = state.choice;
    constexpr double kSlack = 1.02;  // a target missed by little is missed still while the error has fallen by no more
    const double value = chooser.valueOf(held), most = 1.0 + settings.hysteresis;
    why.isKept = held.isMet == state.isMet && value <= state.value * most && value * most >= state.value &&
                 chooser.overLimit(held) <= state.overLimit * std::cbrt(most) &&
                 (held.isMet || held.error > target * most || held.error * kSlack >= state.value);
  }
  AutoState next = state;
  next.partitions = frame.budget.partitions;
  constexpr int kAttempts = 3;  // where the atlas cannot be filled, what it held is all there is
  for (int round = 1;; ++round) {
    if (!why.isKept) {
      if (round == 1)
        chooser.chooseAll();
      else
        chooser.weighAgain();
      if (chooser.isNear()) chooser.chooseMore();
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
    held = {};
    why.isKept = false;
  }
  if (settings.hasTarget && solution.maxError > target) {
    solution.warnings |= static_cast<std::uint32_t>(Warning::targetMissed);
    if (why.chosen >= 0) why.candidates[why.chosen].isMet = false;
    if (why.texelsForTarget <= chooser.texels) {  // rounding, or the atlas, took what was missing
      const double over = solution.maxError / target;
      why.texelsForTarget = chooser.texels * over * over;
    }
    if (report) why.mapsForTarget = chooser.mapsForTarget();
  }
  state = next;
  return solution.status;
}

}  // namespace gnomon
