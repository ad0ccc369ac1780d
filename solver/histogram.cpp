#include "gnomon/histogram.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

struct Directions {
  int count = 0;
  glm::dvec2 axes[kMaxFitAxes];  // unit

  void add(const glm::dvec2& v) noexcept {
    constexpr double kParallel = 1e-9;  // sine: along or across an axis that is there already
    const double squared = glm::dot(v, v);
    if (!(squared > 0.0) || count == kMaxFitAxes) return;
    const glm::dvec2 axis = v / std::sqrt(squared);
    for (int i = 0; i < count; ++i)
      if (std::abs(cross2(axes[i], axis)) < kParallel || std::abs(glm::dot(axes[i], axis)) < kParallel) return;
    axes[count++] = axis;
  }
};

glm::dvec2 cornerRay(const Region& region, const LightSpace& light, int corner) noexcept {
  const Camera& camera = region.camera;
  const double x = (corner & 1) ? camera.right : -camera.left, y = (corner & 2) ? camera.up : -camera.down;
  return glm::dvec2(light.lsFromView * glm::dvec4(x, y, 1.0, 0.0));
}

// Edges of any slice of the view: of a whole one, every axis that its least rectangle may take.
void addViewEdges(const Region& region, const LightSpace& light, Directions& directions) noexcept {
  directions.add(glm::dvec2(light.lsFromView[0]));
  directions.add(glm::dvec2(light.lsFromView[1]));
  if (region.camera.projection != Projection::perspective) return directions.add(glm::dvec2(light.lsFromView[2]));
  for (int corner = 0; corner < 4; ++corner) directions.add(cornerRay(region, light, corner));
}

// sqrt(area) of the least rectangle around a view's slice from depth 1 to each power of the bins' ratio, and whether the costs are Monge.
void tabulateWhole(const Region& region, const LightSpace& light, double ratio, int count, SampleBins& bins) noexcept {
  Directions directions;
  addViewEdges(region, light, directions);
  glm::dvec2 rays[4];
  for (int corner = 0; corner < 4; ++corner) rays[corner] = cornerRay(region, light, corner);
  // Along an axis the slice reaches from its least to its greatest ray, each at depth 1 or at the far end: linear in that.
  struct Reach {
    double base, slope;
  };
  Reach along[kMaxFitAxes][2];
  for (int a = 0; a < directions.count; ++a)
    for (int across = 0; across < 2; ++across) {
      const glm::dvec2 axis = across ? glm::dvec2(-directions.axes[a].y, directions.axes[a].x) : directions.axes[a];
      double least = kInfinity, most = -kInfinity;
      for (const glm::dvec2& ray : rays) {
        least = std::min(least, glm::dot(axis, ray));
        most = std::max(most, glm::dot(axis, ray));
      }
      along[a][across] = {std::min(most, 0.0) - std::max(least, 0.0), std::max(most, 0.0) - std::min(least, 0.0)};
    }
  double far = 1.0;
  bins.side[0] = 0.0;
  for (int span = 1; span <= count; ++span) {
    far *= ratio;
    double least = kInfinity;
    for (int a = 0; a < directions.count; ++a) {
      const auto side = [&](const Reach& reach) { return std::max(reach.base + reach.slope * far, region.pixelSlope); };
      least = std::min(least, side(along[a][0]) * side(along[a][1]));
    }
    bins.side[span] = std::sqrt(least);
  }
  // X(i, j) = near_i^p side^p [j - i] is Monge where each adjacent four are; times an additive measure it stays so, as it falls inwards.
  constexpr double kRounding = 1.0 + 1e-12;
  bins.isMonge = bins.isSquareMonge = true;
  const double square = ratio * ratio;
  for (int span = 2; span < count; ++span) {
    const double *s = bins.side + span, a = s[-1], b = s[0], c = s[1];
    bins.isMonge = bins.isMonge && (1.0 + ratio) * b <= (c + ratio * a) * kRounding;
    bins.isSquareMonge = bins.isSquareMonge && (1.0 + square) * b * b <= (c * c + square * a * a) * kRounding;
  }
}

// What parts of the region reach on the light plane; -infinity where there is nothing. isThere: null, or whether there is something.
void measureReach(const Region& region, const LightSpace& light, const Directions& directions, const DepthSpan* slabs, int count,
                  float (*reach)[4][kMaxFitAxes], bool* isThere) noexcept {
  constexpr float kNowhere = -std::numeric_limits<float>::infinity();
  Footprint footprints[kMaxPartitions];
  Splits splits;
  for (int from = 0; from < count; from += kMaxPartitions) {
    splits.count = std::min(kMaxPartitions, count - from);
    std::copy_n(slabs + from, splits.count, splits.slices);
    makeFootprints(region, light, splits, {}, true, false, footprints, nullptr);
    for (int i = 0; i < splits.count; ++i) {
      float(*to)[kMaxFitAxes] = reach[from + i];
      std::fill_n(&to[0][0], 4 * kMaxFitAxes, kNowhere);
      if (isThere) isThere[from + i] = footprints[i].count > 0;
      if (!(splits.slices[i].near <= splits.slices[i].far)) continue;
      for (int a = 0; a < kMaxFitAxes; ++a) {
        const glm::dvec2 axis = directions.axes[std::min(a, directions.count - 1)];
        for (int v = 0; v < footprints[i].count; ++v) {
          const auto s = static_cast<float>(glm::dot(axis, footprints[i].hull[v])),
                     t = static_cast<float>(cross2(axis, footprints[i].hull[v]));
          to[0][a] = std::max(to[0][a], -s);
          to[1][a] = std::max(to[1][a], s);
          to[2][a] = std::max(to[2][a], -t);
          to[3][a] = std::max(to[3][a], t);
        }
      }
    }
  }
}

// What each bin and each gap reaches, along axes of the region's own outline and a fan between them. Bins that hold nothing go.
void measureBins(const Region& region, const LightSpace& light, SampleBins& bins) noexcept {
  if (bins.count == 0) return;
  Directions directions;
  addViewEdges(region, light, directions);
  Footprint outline;
  Splits all;
  all.count = 1;
  all.slices[0] = {bins.near[0], bins.far[bins.count - 1]};
  makeFootprints(region, light, all, {}, true, false, &outline, nullptr);
  constexpr int kFan = 3;  // axes kept for an even fan
  for (int i = 0; i < outline.count && directions.count < kMaxFitAxes - kFan; ++i)
    directions.add(outline.hull[i + 1 < outline.count ? i + 1 : 0] - outline.hull[i]);
  constexpr double kQuarter = 1.5707963267948966;
  for (int free = kMaxFitAxes - directions.count, i = 0; i < free; ++i)
    directions.add({std::cos(kQuarter * i / free), std::sin(kQuarter * i / free)});

  DepthSpan slabs[kMaxBins];
  bool isThere[kMaxBins];
  for (int b = 0; b < bins.count; ++b) slabs[b] = {bins.near[b], bins.far[b]};
  measureReach(region, light, directions, slabs, bins.count, bins.reach, isThere);
  int kept = 0;
  for (int b = 0; b < bins.count; ++b) {
    if (!isThere[b]) continue;
    bins.near[kept] = bins.near[b];
    bins.far[kept] = bins.far[b];
    bins.worst[kept] = bins.worst[b];
    bins.samples[kept] = bins.samples[b];
    bins.place[kept] = bins.place[b];
    if (kept != b) std::copy_n(&bins.reach[b][0][0], 4 * kMaxFitAxes, &bins.reach[kept][0][0]);
    ++kept;
  }
  bins.count = kept;
  for (int b = 0; b + 1 < bins.count; ++b) {
    const bool isGap = bins.place[b + 1] > bins.place[b] + 1;
    slabs[b] = isGap ? DepthSpan{bins.far[b], bins.near[b + 1]} : DepthSpan{1.0, 0.0};
  }
  measureReach(region, light, directions, slabs, bins.count - 1, bins.onward, nullptr);
  for (int b = 0; b + 1 < bins.count; ++b)
    for (int r = 0; r < 4; ++r)
      for (int a = 0; a < kMaxFitAxes; ++a) bins.onward[b][r][a] = std::max(bins.onward[b][r][a], bins.reach[b][r][a]);
}

// The reach of a run of bins that grows one by one.
struct Run {
  float reach[4][kMaxFitAxes];

  void start(const float (&bin)[4][kMaxFitAxes]) noexcept { std::copy_n(&bin[0][0], 4 * kMaxFitAxes, &reach[0][0]); }
  void add(const float (&part)[4][kMaxFitAxes]) noexcept {
    for (int r = 0; r < 4; ++r)
      for (int a = 0; a < kMaxFitAxes; ++a) reach[r][a] = part[r][a] > reach[r][a] ? part[r][a] : reach[r][a];
  }
  // The bin behind the run.
  void extend(const SampleBins& bins, int bin) noexcept {
    add(bins.onward[bin - 1]);
    add(bins.reach[bin]);
  }
  double side(double pixel) const noexcept {
    const auto least = static_cast<float>(pixel);
    float area[kMaxFitAxes];
    for (int a = 0; a < kMaxFitAxes; ++a) {
      const float s = reach[0][a] + reach[1][a], t = reach[2][a] + reach[3][a];
      area[a] = (s > least ? s : least) * (t > least ? t : least);
    }
    return std::sqrt(static_cast<double>(*std::min_element(area, area + kMaxFitAxes)));
  }
};

double wholeSide(const SampleBins& bins, int first, int last) noexcept {
  return bins.near[first] * bins.side[bins.place[last] - bins.place[first] + 1];
}

// What bins first to last add to the norm under a map of this side. worst: the greatest of theirs.
double addCost(const SampleBins& bins, SampleNorm norm, int first, int last, double side, double worst) noexcept {
  if (norm == SampleNorm::max) return side * worst;
  if (norm == SampleNorm::mean) return side * (bins.sum[last + 1] - bins.sum[first]);
  return side * side * (bins.squares[last + 1] - bins.squares[first]);
}

double combine(SampleNorm norm, double a, double b) noexcept { return norm == SampleNorm::max ? std::max(a, b) : a + b; }

double toError(const SampleBins& bins, SampleNorm norm, double cost) noexcept {
  const double samples = bins.samples[bins.count];
  if (norm == SampleNorm::max) return cost;
  return norm == SampleNorm::mean ? cost / samples : std::sqrt(cost / samples);
}

// The programme: least[k][j] of bins 0 to j by k + 1 slices, the last of which begins at from[k][j].
struct Programme {
  Programme(const SampleBins& bins_, SampleNorm norm_, int layers_) noexcept : bins(bins_), norm(norm_), layers(layers_) {}

  const SampleBins& bins;
  SampleNorm norm;
  int layers;
  double least[kMaxPartitions][kMaxBins];
  std::uint8_t from[kMaxPartitions][kMaxBins];
  static_assert(kMaxBins <= 256);

  // Of a whole view, whose bins have one weight or whose norm needs no greatest one.
  double cost(int first, int last) const noexcept {
    return addCost(bins, norm, first, last, wholeSide(bins, first, last), bins.worst[first]);
  }

  void fill() noexcept {
    for (int j = 0; j < bins.count; ++j) {
      least[0][j] = cost(0, j);
      from[0][j] = 0;
    }
  }

  // Of all slices together only the whole is asked for.
  int firstRow(int k) const noexcept { return k + 1 < layers ? k : bins.count - 1; }

  // max: least[k - 1][i - 1] rises with i, the cost of [i, j] falls: the best is where they cross.
  void sweep() noexcept {
    fill();
    for (int k = 1; k < layers; ++k)
      for (int j = firstRow(k), crossing = k; j < bins.count; ++j) {
        while (crossing < j && least[k - 1][crossing - 1] < cost(crossing, j)) ++crossing;  // it only moves on as j grows
        const double here = std::max(least[k - 1][crossing - 1], cost(crossing, j));
        const double before = crossing > k ? std::max(least[k - 1][crossing - 2], cost(crossing - 1, j)) : kInfinity;
        least[k][j] = std::min(here, before);
        from[k][j] = static_cast<std::uint8_t>(before < here ? crossing - 1 : crossing);
      }
  }

  // Monge costs: the best begin of the last slice never falls as j grows.
  void divide(int k, int low, int high, int fromLow, int fromHigh) noexcept {
    if (low > high) return;
    const int j = (low + high) / 2;
    double best = kInfinity;
    int at = fromLow;
    for (int i = fromLow; i <= std::min(fromHigh, j); ++i) {
      const double value = least[k - 1][i - 1] + cost(i, j);
      if (value < best) best = value, at = i;
    }
    least[k][j] = best;
    from[k][j] = static_cast<std::uint8_t>(at);
    divide(k, low, j - 1, fromLow, at);
    divide(k, j + 1, high, at, fromHigh);
  }

  // Any costs: a run that grows towards the eye costs ever more, so it may stop where it alone costs as much as the best so far.
  void search() noexcept {
    Run whole, run;
    double worstOfAll = 0.0;
    for (int j = 0; j < bins.count; ++j) {
      worstOfAll = std::max(worstOfAll, bins.worst[j]);
      double worst = 0.0;
      if (!bins.isWhole) {
        if (j == 0)
          whole.start(bins.reach[0]);
        else
          whole.extend(bins, j);
      }
      const double pixel = bins.near[0] * bins.pixelSlope + bins.pixelBase;
      least[0][j] = addCost(bins, norm, 0, j, bins.isWhole ? wholeSide(bins, 0, j) : whole.side(pixel), worstOfAll);
      from[0][j] = 0;
      const int most = std::min(j + 1 < bins.count ? layers - 2 : layers - 1, j);
      for (int k = 1; k <= most; ++k) least[k][j] = kInfinity;
      for (int i = j; i >= 1 && most >= 1; --i) {
        worst = std::max(worst, bins.worst[i]);
        double side;
        if (bins.isWhole) {
          side = wholeSide(bins, i, j);
        } else {
          if (i == j)
            run.start(bins.reach[i]);
          else
            run.add(bins.onward[i]);
          side = run.side(bins.near[i] * bins.pixelSlope + bins.pixelBase);
        }
        const double own = addCost(bins, norm, i, j, side, worst);
        for (int k = 1; k <= std::min(most, i); ++k) {
          const double value = combine(norm, least[k - 1][i - 1], own);
          if (!(value < least[k][j])) continue;
          least[k][j] = value;
          from[k][j] = static_cast<std::uint8_t>(i);
        }
        if (own > least[1][j]) break;  // more slices cost no more: least[1] is the greatest
      }
    }
  }
};

bool isWholeView(const Frame& frame, const Region& region) noexcept {
  return frame.camera.projection == Projection::perspective && frame.scene.receivers.empty() && frame.scene.planes.empty() &&
         frame.cornersWs.empty() && region.bounds.empty();
}

}  // namespace

void makeBins(const Frame& frame, const Region& region, const LightSpace& light, SampleBins& bins) noexcept {
  const Samples& samples = *frame.samples;
  bins.count = 0;
  bins.samples[0] = bins.sum[0] = bins.squares[0] = 0.0;
  const int given = static_cast<int>(samples.histogram.size());
  const int joined = std::max((given + kMaxBins - 1) / kMaxBins, 1), places = given > 0 ? (given + joined - 1) / joined : kMaxBins;
  DepthSpan all{samples.near, samples.far};
  if (given == 0 && region.spanCount > 0) {  // over what is shadowed alone: no ratio leads on from the eye
    const double least = region.spans[0].near, most = region.spans[region.spanCount - 1].far;
    all = {std::clamp(samples.near, least, most), std::clamp(samples.far, least, most)};
  }
  const bool isRatio = all.near > 0.0;
  const double length = given > 0 ? static_cast<double>(given) / joined : places;  // in places
  const double ratio = isRatio ? std::pow(all.far / all.near, 1.0 / length) : 1.0, step = (all.far - all.near) / places;
  bins.joined = joined;
  int span = 0;
  double end = all.near;
  for (int place = 0; place < places; ++place) {
    const double near = end, far = place + 1 == places ? all.far : isRatio ? near * ratio : near + step;
    end = far;
    double amount = given > 0 ? 0.0 : 1.0, weight = given > 0 ? 0.0 : 1.0;
    for (int i = place * joined; i < std::min((place + 1) * joined, given); ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (samples.histogram[at] == 0) continue;
      amount += samples.histogram[at];
      weight = std::max(weight, samples.weights.empty() ? 1.0 : samples.weights[at]);
    }
    if (amount == 0.0) continue;
    while (span < region.spanCount && region.spans[span].far < near) ++span;
    if (span == region.spanCount) break;
    if (region.spans[span].near > far) continue;
    const int b = bins.count++;
    bins.near[b] = near;
    bins.far[b] = far;
    bins.place[b] = place;
    bins.samples[b] = amount;
    bins.worst[b] = weight / (near * region.pixelSlope + region.pixelBase);
  }
  bins.isWhole = isWholeView(frame, region);
  bins.pixelSlope = region.pixelSlope;
  bins.pixelBase = region.pixelBase;
  if (bins.isWhole)
    tabulateWhole(region, light, ratio, places, bins);
  else
    measureBins(region, light, bins);
  bins.samples[bins.count] = 0.0;  // behind the last
  double amount = bins.samples[0];
  bins.samples[0] = 0.0;
  for (int b = 0; b < bins.count; ++b) {
    const double next = bins.samples[b + 1];
    bins.samples[b + 1] = bins.samples[b] + amount;
    bins.sum[b + 1] = bins.sum[b] + amount * bins.worst[b];
    bins.squares[b + 1] = bins.squares[b] + amount * bins.worst[b] * bins.worst[b];
    amount = next;
  }
}

double sampledError(const SampleBins& bins, SampleNorm norm, const int* first, int count) noexcept {
  double cost = 0.0;
  for (int s = 0; s < count; ++s) {
    const int from = first[s], to = (s + 1 < count ? first[s + 1] : bins.count) - 1;
    if (from > to) continue;
    double worst = bins.worst[from];
    Run run;
    if (!bins.isWhole) run.start(bins.reach[from]);
    for (int b = from + 1; b <= to; ++b) {
      worst = std::max(worst, bins.worst[b]);
      if (!bins.isWhole) run.extend(bins, b);
    }
    const double side = bins.isWhole ? wholeSide(bins, from, to) : run.side(bins.near[from] * bins.pixelSlope + bins.pixelBase);
    cost = combine(norm, cost, addCost(bins, norm, from, to, side, worst));
  }
  return bins.count > 0 ? toError(bins, norm, cost) : 0.0;
}

int splitOptimally(const SampleBins& bins, SampleNorm norm, int most, double target, int* first, double* errors) noexcept {
  const int layers = std::min(most, bins.count);
  if (layers == 0) return 0;
  Programme programme(bins, norm, layers);
  bool isEven = true;  // worst falls with depth: the first of a run has the greatest
  for (int b = 1; b < bins.count; ++b) isEven = isEven && bins.worst[b] <= bins.worst[b - 1];
  if (bins.isWhole && norm == SampleNorm::max && isEven) {
    programme.sweep();
  } else if (bins.isWhole && (norm == SampleNorm::mean ? bins.isMonge : norm == SampleNorm::meanSquare && bins.isSquareMonge)) {
    programme.fill();
    for (int k = 1; k < layers; ++k) programme.divide(k, programme.firstRow(k), bins.count - 1, k, bins.count - 1);
  } else {
    programme.search();
  }
  int count = layers;
  for (int k = layers - 1; k >= 0; --k) {
    const double error = toError(bins, norm, programme.least[k][bins.count - 1]);
    if (errors) errors[k] = error;
    if (error <= target) count = k + 1;
  }
  for (int k = count - 1, j = bins.count - 1; k >= 0; --k) {
    first[k] = programme.from[k][j];
    j = first[k] - 1;
  }
  return count;
}

int splitByMeans(const SampleBins& bins, int most, int* first) noexcept {
  if (bins.count == 0) return 0;
  // Places in the histogram are logarithms of depth but for a factor.
  double before[kMaxBins + 1];  // sum of samples times place
  before[0] = 0.0;
  for (int b = 0; b < bins.count; ++b) before[b + 1] = before[b] + (bins.samples[b + 1] - bins.samples[b]) * (bins.place[b] + 0.5);
  double means[kMaxPartitions];
  const int clusters = std::min(most, bins.count);
  for (int c = 0, b = 0; c < clusters; ++c) {
    const double share = bins.samples[bins.count] * (c + 0.5) / clusters;
    while (bins.samples[b + 1] < share) ++b;
    means[c] = bins.place[b] + (share - bins.samples[b]) / (bins.samples[b + 1] - bins.samples[b]);
  }
  int ends[kMaxPartitions + 1] = {};
  ends[clusters] = bins.count;
  constexpr int kIterations = 256;  // it stops long before, as a rule
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    bool isChanged = iteration == 0;
    for (int c = 1; c < clusters; ++c) {
      const double middle = (means[c - 1] + means[c]) / 2.0;
      int b = ends[c - 1];
      while (b < bins.count && bins.place[b] + 0.5 < middle) ++b;
      isChanged = isChanged || ends[c] != b;
      ends[c] = b;
    }
    if (!isChanged) break;
    for (int c = 0; c < clusters; ++c)
      if (ends[c + 1] > ends[c]) means[c] = (before[ends[c + 1]] - before[ends[c]]) / (bins.samples[ends[c + 1]] - bins.samples[ends[c]]);
  }
  int count = 0;
  for (int c = 0; c < clusters; ++c)
    if (ends[c + 1] > ends[c]) first[count++] = ends[c];
  return count;
}

}  // namespace gnomon
