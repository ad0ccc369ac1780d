#include "gnomon/lloyd.h"

#include "gnomon/atlas.h"
#include "gnomon/frame.h"
#include "gnomon/rows.h"
#include "numeric.h"

namespace gnomon {
namespace {

bool hasFaces(LloydScheme scheme) noexcept { return scheme == LloydScheme::fpw || scheme == LloydScheme::fpzpw; }

// What `best` chooses among: the schemes, and rows of the light plane in columns.
struct Choice {
  LloydScheme scheme;
  int count;
  int columns = 0;  // of rows; 0: not rows
  bool isMinimax = false;
};

// The partitions of one choice, at most its count, for maps that are made so.
Status splitByChoice(const Frame& frame, const Region& region, const LightSpace& light, const LloydSettings& settings,
                     const MapSettings& making, const Choice& choice, Splits& splits, double& refused, std::uint32_t& warnings) noexcept {
  const int count = choice.count;
  if (hasFaces(choice.scheme)) {
    splitFaces(region, light, settings.nearFace, count, choice.scheme == LloydScheme::fpzpw, splits);
    if (splits.count > 0 || region.spanCount == 0) return Status::ok;
    warnings |= static_cast<std::uint32_t>(Warning::facesMissing);
    splits = {};
  }
  if (choice.scheme == LloydScheme::w) return split(region, {}, 1, splits, refused);
  if (!settings.minimax && !choice.isMinimax) return split(region, settings.split, count, splits, refused);
  splitMinimax(frame, region, light, making, count, splits);
  return Status::ok;
}

// Leaves in `solution`, begun, the choice that needs the fewest texels once it is made: a certificate and what float32 takes for its
// rounding are part of them, and more than the fits know. False where nothing can be made, or nothing is to be shadowed.
bool makeBest(const Frame& frame, const Region& region, const LightSpace& light, const LloydSettings& settings, const MapSettings& making,
              int most, Solution& solution) noexcept {
  MapSettings roughly = making, searching = making, plain = making;
  plain.warp = {};
  roughly.warp.warp = Warp::lispsm;
  Splits splits;
  MapFits maps;
  MapFit rough[kMaxPartitions];
  RowPlane plane;
  RowLayout rows;
  Solution tried;
  double least = kInfinity;
  bool areAlike = false;
  double gains[static_cast<int>(LloydScheme::best) + 1];  // of the least warp over LiSPSM, at least, by scheme; rows are those of `best`
  std::fill(std::begin(gains), std::end(gains), kInfinity);
  const auto consider = [&](const Choice& choice) {  // returns what it needs roughly
    double refused = 0.0;
    std::uint32_t warnings = 0;
    splits = {};
    if (choice.columns > 0) {
      (void)splitRows(region, light, plane, {.rule = RowRule::error, .maxColumns = choice.columns}, choice.count, splits, rows);
    } else if (splitByChoice(frame, region, light, settings, choice.isMinimax ? plain : making, choice, splits, refused, warnings) !=
                   Status::ok ||
               warnings != 0) {
      splits.count = 0;
    }
    if (splits.count == 0) return kInfinity;
    // A named warp says at a tenth of the price what has no hope: what won by the least warp did not need more than this by LiSPSM, times
    // the least so far, nor gain this over what another of its scheme gained, but in 2 of 33 000 views of 1 to 16 maps, whole or cut. Faces
    // and what a box has cut are seldom along LiSPSM's axis.
    constexpr double kHopeless = 3.5, kHopelessAlike = 1.4, kHopelessRows = 1.2, kHopelessKin = 1.6;
    double& gain = gains[static_cast<int>(choice.scheme)];
    const double mostGain = choice.columns > 0                     ? kHopelessRows
                            : areAlike && !hasFaces(choice.scheme) ? kHopelessAlike
                                                                   : kHopeless,
                 hopeless = std::min(mostGain, kHopelessKin * gain);
    fitMaps(frame, region, light, splits, roughly, needsViewDepth(region, splits), maps);
    const double roughTexels = maps.neededTexels;
    if (!(roughTexels < hopeless * least)) return roughTexels;
    std::copy_n(maps.fits, splits.count, rough);
    searching.most = least;
    searching.gain = hopeless;
    refitMaps(region, light, splits, searching, maps);
    gain = std::min(gain, roughTexels / maps.neededTexels);
    const auto make = [&](const MapSettings& by) {
      if (!(maps.neededTexels < least)) return;  // what is made never needs less
      clear(tried);
      tried.originWs = solution.originWs;
      if (placeMaps(frame, region, light, splits, by, maps, tried) != Status::ok || !(tried.neededTexels < least)) return;
      least = tried.neededTexels;
      solution = tried;
    };
    make(making);
    std::copy_n(rough, splits.count, maps.fits);
    maps.neededTexels = roughTexels;
    make(roughly);
    return roughTexels;
  };
  double before = consider({LloydScheme::zpw, most});
  areAlike = splits.count > 0 && maps.footprints[splits.count - 1].like == 0;
  if (settings.rows) {  // early: of a view that a box has cut they mostly win, and what is to beat leaves less to search
    makeRowPlane(region, light, plane);
    roughly.whole = searching.whole = &plane.whole;
    // Columns part what lies side by side, which the whole of a view does not.
    constexpr int kMostColumns = 4;
    const int mostColumns = areAlike ? 1 : std::min(kMostColumns, most);
    for (int columns = 1; columns <= mostColumns; ++columns) (void)consider({LloydScheme::best, most, columns});
  }
  // Of a whole view, whose slices are alike, more z-partitions need fewer texels until overlap outweighs, and more rows of faces too.
  // minimax knows by itself when fewer need less.
  for (int count = settings.minimax ? 0 : most - 1; count >= 1; --count) {
    const double texels = consider({LloydScheme::zpw, count});
    if (areAlike && !(texels < before)) break;
    before = texels;
  }
  if (!areAlike) (void)consider({LloydScheme::fpw, most});
  // Gaps between a few receivers are worth a search; one has none, and of hundreds it would take milliseconds.
  if (const std::size_t boxes = region.receivers.size(); boxes > 1 && boxes <= kMaxKeptCells)
    (void)consider({LloydScheme::zpw, most, 0, true});
  (void)consider({LloydScheme::fpzpw, most});
  return least < kInfinity;
}

// k ((f/n)^(1/k) - 1) / (2 tan theta): what self-similar slices leave of the depth range.
double selfSimilar(double alpha, double halfFovTangent, int k) noexcept {
  return k * std::expm1(std::log(alpha) / k) / (2.0 * halfFovTangent);
}

}  // namespace

double storageOverheadZp(double alpha, double halfFovTangent, int k) noexcept {
  return std::exp(std::log(alpha) / k) * selfSimilar(alpha, halfFovTangent, k);
}
double storageOverheadZpW(double alpha, double halfFovTangent, int k) noexcept { return selfSimilar(alpha, halfFovTangent, k); }
double storageOverheadOptimal(double alpha, double halfFovTangent) noexcept { return std::log(alpha) / (2.0 * halfFovTangent); }
double storageBehindZp(double alpha, int k) noexcept { return k * std::exp(2.0 * std::log(alpha) / k); }
double storageBehindFpZpW(double alpha, int k) noexcept { return 4.0 * selfSimilar(alpha, 1.0, k) + 1.0; }

Status solveLloyd(const Frame& frame, const LloydSettings& settings, Solution& solution) noexcept {
  Region region;
  LightSpace light;
  if (beginSolve(frame, settings.split, FitMode::tight, region, light, solution) != Status::ok) return solution.status;
  double& value = solution.refusedValue;
  if (const Status status = validate(settings.warp, value); status != Status::ok) return refuse(solution, status);

  MapSettings making{.fit = FitMode::tight, .warp = settings.warp, .shares = settings.shares};
  const bool isBest = settings.scheme == LloydScheme::best;
  if (settings.scheme == LloydScheme::zp) making.warp = {};
  if (isBest) making.warp = {.warp = Warp::least};
  const int most = settings.split.count > 0 ? settings.split.count : frame.budget.partitions;
  if (isBest) {
    Frame all = frame;  // fewer maps of an atlas than the budget allows may spend its texels, too; layers have the side they were made with
    if (all.budget.texels == 0.0 && frame.shadowMap.layout == MapLayout::atlas) all.budget.texels = texelsPerMap(frame.budget, most) * most;
    if (makeBest(all, region, light, settings, making, most, solution)) return Status::ok;
  }
  for (int count = settings.split.automatic && !isBest ? 1 : most;; ++count) {
    clear(solution);
    const Choice choice{isBest ? LloydScheme::zpw : settings.scheme, count};
    Splits splits;
    std::uint32_t warnings = 0;
    if (const Status status = splitByChoice(frame, region, light, settings, making, choice, splits, value, warnings); status != Status::ok)
      return refuse(solution, status);
    if (const Status status = makeMaps(frame, region, light, splits, making, solution); status != Status::ok)
      return refuse(solution, status);
    solution.warnings |= warnings;
    if (!settings.split.automatic || isBest || solution.maxError <= frame.budget.targetError) return Status::ok;
    if (count < frame.budget.partitions && settings.split.scheme != SplitScheme::explicitDepths) continue;
    solution.warnings |= static_cast<std::uint32_t>(Warning::targetMissed);
    return Status::ok;
  }
}

}  // namespace gnomon
