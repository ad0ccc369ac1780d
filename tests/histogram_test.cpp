#include <algorithm>
#include <functional>

#include "support.h"

#include "allocations.h"
#include "gnomon/fit.h"
#include "gnomon/frame.h"
#include "gnomon/histogram.h"

namespace gnomon::test {
namespace {

constexpr SampleNorm kNorms[] = {SampleNorm::max, SampleNorm::mean, SampleNorm::meanSquare};

// A frame with samples, and what the solver's stages make of it.
struct Sampled {
  Frame frame = usualFrame();
  Samples samples;
  std::vector<std::uint32_t> histogram;
  std::vector<double> weights;
  Region region;
  LightSpace light;
  SampleBins bins;

  void make() {
    samples.histogram = histogram;
    samples.weights = weights;
    frame.samples = &samples;
    int index = -1;
    double value = 0.0;
    ASSERT_EQ(makeRegion(frame, region, index, value), Status::ok);
    ASSERT_EQ(makeLightSpace(frame.light, region, FitMode::doubled, light), Status::ok);
    makeBins(frame, region, light, bins);
  }
};

std::unique_ptr<Sampled> randomSetup(Random& random, int most) {
  auto setup = std::make_unique<Sampled>();
  setup->samples.near = random.logUniform(0.1, 10.0);
  setup->samples.far = setup->samples.near * random.logUniform(1.001, 900.0 / setup->samples.near);
  setup->frame.camera.far = 1000.0;
  setup->frame.light.directionWs = random.direction();
  setup->histogram.resize(static_cast<std::size_t>(1 + random.index(most)));
  const int kind = random.index(5);
  for (std::size_t i = 0; i < setup->histogram.size(); ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(setup->histogram.size());
    std::uint32_t& count = setup->histogram[i];
    if (kind == 0) count = static_cast<std::uint32_t>(random.index(100));  // everywhere
    if (kind == 1) count = random.index(4) == 0 ? static_cast<std::uint32_t>(random.logUniform(1.0, 1e6)) : 0u;  // few, unlike
    if (kind == 2) count = share < 0.1 ? 1u : share > 0.9 ? 100000u : 0u;  // a few near, a wall far away
    if (kind == 3) count = random.index(20) == 0 ? 1000000u : 1u;  // spikes
    if (kind == 4) count = static_cast<std::uint32_t>(1e6 * std::pow(share, 8.0));  // crowded far end
  }
  return setup;
}

// The plain fit's area by the stages that make a map of the slice, in double: no table, no axes chosen beforehand.
double plainSide(const Sampled& setup, double near, double far) {
  Splits slice;
  slice.count = 1;
  slice.slices[0] = {near, far};
  Footprint footprint;
  makeFootprints(setup.region, setup.light, slice, {}, true, false, &footprint, nullptr);
  MapFit fit;
  fitSlice(setup.region, footprint, FitMode::tight, pixelAt(setup.frame, near), fit);
  return std::sqrt(fit.size.x * fit.size.y);
}

// The norm of the error, sample by sample.
double referenceError(const Sampled& setup, SampleNorm norm, const std::vector<int>& first) {
  const SampleBins& bins = setup.bins;
  double sum = 0.0, samples = 0.0, worst = 0.0;
  for (std::size_t s = 0; s < first.size(); ++s) {
    const int end = s + 1 < first.size() ? first[s + 1] : bins.count;
    const double side = plainSide(setup, bins.near[first[s]], bins.far[end - 1]);
    for (int b = first[s]; b < end; ++b) {
      const auto place = static_cast<std::size_t>(bins.place[b]);
      const double weight = setup.weights.empty() ? 1.0 : setup.weights[place];
      const double error = weight * side / pixelAt(setup.frame, bins.near[b]), count = setup.histogram[place];
      worst = std::max(worst, error);
      sum += count * (norm == SampleNorm::mean ? error : error * error);
      samples += count;
    }
  }
  return norm == SampleNorm::max ? worst : norm == SampleNorm::mean ? sum / samples : std::sqrt(sum / samples);
}

// Every way to cut the bins into at most `most` slices.
void forEachCut(int bins, int most, const std::function<void(const std::vector<int>&)>& visit) {
  std::vector<int> first{0};
  const std::function<void()> extend = [&] {
    visit(first);
    if (static_cast<int>(first.size()) == most) return;
    for (int b = first.back() + 1; b < bins; ++b) {
      first.push_back(b);
      extend();
      first.pop_back();
    }
  };
  extend();
}

std::vector<int> optimal(const Sampled& setup, SampleNorm norm, int most, double target = 0.0) {
  std::vector<int> first(kMaxPartitions);
  first.resize(static_cast<std::size_t>(splitOptimally(setup.bins, norm, most, target, first.data(), nullptr)));
  return first;
}

double errorOf(const Sampled& setup, SampleNorm norm, const std::vector<int>& first) {
  return sampledError(setup.bins, norm, first.data(), static_cast<int>(first.size()));
}

// Planes of another scheme, moved to bin edges.
std::vector<int> atPlanes(const Sampled& setup, const std::vector<double>& planes) {
  std::vector<int> first{0};
  for (const double plane : planes) {
    int b = 0;
    while (b < setup.bins.count && std::sqrt(setup.bins.near[b] * setup.bins.far[b]) < plane) ++b;
    if (b > first.back() && b < setup.bins.count) first.push_back(b);
  }
  return first;
}

std::vector<int> logarithmic(const Sampled& setup, int most) {
  std::vector<double> planes;
  const double near = setup.bins.near[0], far = setup.bins.far[setup.bins.count - 1];
  for (int i = 1; i < most; ++i) planes.push_back(near * std::pow(far / near, static_cast<double>(i) / most));
  return atPlanes(setup, planes);
}

std::vector<int> adaptive(const Sampled& setup, int most) {
  Splits splits;
  double refused = 0.0;
  EXPECT_EQ(split(setup.region, {}, most, splits, refused), Status::ok);
  std::vector<double> planes;
  for (int i = 1; i < splits.count; ++i) planes.push_back(splits.slices[i].near);
  return atPlanes(setup, planes);
}

std::vector<int> kmeans(const Sampled& setup, int most) {
  std::vector<int> first(kMaxPartitions);
  first.resize(static_cast<std::size_t>(splitByMeans(setup.bins, most, first.data())));
  return first;
}

// The tabulated cost of a whole view's slices is what their plain fits cost; sums are what samples one by one give.
TEST(Histogram, ErrorsAreThoseOfPlainFits) {
  Random random(61);
  for (int k = 0; k < 200; ++k) {
    const auto setup = randomSetup(random, 64);
    if (k % 3 == 0)
      for (std::size_t i = 0; i < setup->histogram.size(); ++i) setup->weights.push_back(random.uniform(0.5, 2.0));
    const glm::dvec4 floor(0.0, 1.0, 0.0, 0.0);
    if (k % 2 == 0) setup->frame.scene.planes = {&floor, 1};
    setup->make();
    if (setup->bins.count == 0) continue;
    const std::vector<int> first = kmeans(*setup, 1 + random.index(6));
    for (const SampleNorm norm : kNorms) {
      const double ratio = errorOf(*setup, norm, first) / referenceError(*setup, norm, first);
      // With a cut region the axes are chosen beforehand: never under the least rectangle, and near it.
      EXPECT_GE(ratio, 1.0 - 1e-4) << k;
      EXPECT_LE(ratio, setup->bins.isWhole ? 1.0 + 1e-4 : 1.15) << k;
    }
  }
}

// No cut into whole bins is better: all of them tried, costs from plain fits (whole views) or from the bins (cut ones).
TEST(Histogram, OptimalEqualsBruteForce) {
  Random random(62);
  int fast = 0;
  for (int k = 0; k < 400; ++k) {
    const auto setup = randomSetup(random, 11);
    if (k % 3 == 0)
      for (std::size_t i = 0; i < setup->histogram.size(); ++i) setup->weights.push_back(random.uniform(0.0, 2.0));
    const Box box{{-50.0, -1.0, -50.0}, {60.0, 1.0, 70.0}};
    if (k % 4 == 0) setup->frame.scene.receivers = {&box, 1};
    setup->make();
    if (setup->bins.count == 0) continue;
    fast += setup->bins.isSquareMonge && setup->bins.isWhole;
    const int most = 1 + random.index(5);
    for (const SampleNorm norm : kNorms) {
      double least = kInfinity;
      forEachCut(setup->bins.count, most, [&](const std::vector<int>& first) {
        least = std::min(least, setup->bins.isWhole ? referenceError(*setup, norm, first) : errorOf(*setup, norm, first));
      });
      const std::vector<int> found = optimal(*setup, norm, most);
      EXPECT_LE(static_cast<int>(found.size()), most);
      EXPECT_NEAR(errorOf(*setup, norm, found) / least, 1.0, setup->bins.isWhole ? 2e-4 : 1e-6) << k << " " << static_cast<int>(norm);
    }
  }
  EXPECT_GT(fast, 20);  // the fast path was tried
}

// Over 10 000 histograms, even and adversarial, never worse in its own norm than any other scheme.
TEST(Histogram, OptimalIsNeverWorse) {
  Random random(63);
  int bisected = 0, divided = 0, searched = 0;
  for (int k = 0; k < 10000; ++k) {
    const auto setup = randomSetup(random, k % 100 == 0 ? 256 : 40);
    setup->make();
    if (setup->bins.count == 0) continue;
    const int most = 1 + random.index(8);
    const SampleNorm norm = kNorms[k % 3];
    const double best = errorOf(*setup, norm, optimal(*setup, norm, most));
    bisected += norm == SampleNorm::max;
    divided += (norm == SampleNorm::mean && setup->bins.isMonge) || (norm == SampleNorm::meanSquare && setup->bins.isSquareMonge);
    searched += (norm == SampleNorm::mean && !setup->bins.isMonge) || (norm == SampleNorm::meanSquare && !setup->bins.isSquareMonge);
    for (const auto& scheme : {logarithmic, adaptive, kmeans})
      ASSERT_LE(best, errorOf(*setup, norm, scheme(*setup, most)) * (1.0 + 1e-12)) << k << " " << static_cast<int>(norm);
  }
  EXPECT_GT(bisected, 1000);
  EXPECT_GT(divided, 100);
  EXPECT_GT(searched, 100);
}

// Equal ratios are the optimum of the greatest error where every depth is sampled: the closed form of [Zhang 2006, eq. 4].
TEST(Histogram, MaximumOverAllDepthsIsLogarithmic) {
  Sampled setup;
  setup.histogram.assign(240, 1u);
  setup.samples.near = 0.5;
  setup.samples.far = 80.0;
  setup.make();
  for (const int most : {2, 3, 4, 6}) {
    const std::vector<int> first = optimal(setup, SampleNorm::max, most);
    ASSERT_EQ(static_cast<int>(first.size()), most);
    for (int i = 0; i < most; ++i) EXPECT_EQ(first[static_cast<std::size_t>(i)], 240 / most * i);
  }
}

// Glass jaws [Lauritzen 2010]: a wall of samples far away draws every cluster, and what is near the eye is left with one map.
TEST(Histogram, KMeansHasGlassJawsAndOptimalHasNone) {
  Sampled setup;
  setup.samples.near = 0.2;
  setup.samples.far = 90.0;
  setup.histogram.assign(256, 2u);
  for (std::size_t i = 200; i < 256; ++i) setup.histogram[i] = 1000000u;
  setup.make();
  const double even = errorOf(setup, SampleNorm::max, logarithmic(setup, 4)), far = errorOf(setup, SampleNorm::max, kmeans(setup, 4));
  EXPECT_GT(far, 4.0 * even);
  EXPECT_LE(errorOf(setup, SampleNorm::max, optimal(setup, SampleNorm::max, 4)), even);
  // Nor is it the best on average.
  for (const SampleNorm norm : {SampleNorm::mean, SampleNorm::meanSquare})
    EXPECT_LT(errorOf(setup, norm, optimal(setup, norm, 4)), errorOf(setup, norm, kmeans(setup, 4)));
}

// The fewest slices under a target, by the errors of each count.
TEST(Histogram, FindsTheFewestUnderATarget) {
  Random random(64);
  for (int k = 0; k < 100; ++k) {
    const auto setup = randomSetup(random, 100);
    setup->make();
    if (setup->bins.count == 0) continue;
    const SampleNorm norm = kNorms[k % 3];
    std::vector<double> errors;
    for (int most = 1; most <= 8; ++most) {
      errors.push_back(errorOf(*setup, norm, optimal(*setup, norm, most)));
      EXPECT_LE(errors.back(), errors[errors.size() > 1 ? errors.size() - 2 : 0] * (1.0 + 1e-12));
    }
    for (const double target : {errors[0] * 0.5, errors[3], errors[7] * 0.5}) {
      std::size_t fewest = 0;
      while (fewest < 7 && errors[fewest] > target * (1.0 + 1e-9)) ++fewest;
      const std::size_t found = optimal(*setup, norm, 8, target * (1.0 + 1e-9)).size();
      EXPECT_EQ(found, std::min(fewest + 1, static_cast<std::size_t>(setup->bins.count))) << k;
    }
  }
}

// A weight draws slices to its bins, as samples do.
TEST(Histogram, WeightsCount) {
  Sampled setup;
  setup.samples.near = 0.2;
  setup.samples.far = 90.0;
  setup.histogram.assign(128, 1u);
  setup.make();
  const std::vector<int> even = optimal(setup, SampleNorm::max, 4);
  setup.weights.assign(128, 1.0);
  for (std::size_t i = 100; i < 110; ++i) setup.weights[i] = 8.0;
  setup.make();
  const std::vector<int> drawn = optimal(setup, SampleNorm::max, 4);
  EXPECT_LT(errorOf(setup, SampleNorm::max, drawn), errorOf(setup, SampleNorm::max, even));
}

// Finer histograms are joined, coarser or none at all are read; a single bin and nothing too.
TEST(Histogram, AnyNumberOfBins) {
  for (const std::size_t bins : {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{255}, std::size_t{257}, std::size_t{5000}}) {
    Sampled setup;
    setup.samples.near = 0.2;
    setup.samples.far = 90.0;
    setup.histogram.assign(bins, 3u);
    setup.make();
    ASSERT_GT(setup.bins.count, 0);
    ASSERT_LE(setup.bins.count, kMaxBins);
    EXPECT_EQ(setup.bins.near[0], 0.2);
    EXPECT_NEAR(setup.bins.far[setup.bins.count - 1], 90.0, 1e-9);
    for (int b = 1; b < setup.bins.count; ++b) EXPECT_NEAR(setup.bins.near[b] / setup.bins.far[b - 1], 1.0, 1e-12);
    EXPECT_NEAR(sampledError(setup.bins, SampleNorm::max, std::vector<int>{0}.data(), 1),
                plainSide(setup, 0.2, 90.0) / pixelAt(setup.frame, 0.2), 0.03 * plainSide(setup, 0.2, 90.0) / pixelAt(setup.frame, 0.2));
  }
  Sampled nothing;
  nothing.samples.near = 1.0;
  nothing.samples.far = 2.0;
  nothing.histogram.assign(8, 0u);
  nothing.make();
  EXPECT_EQ(nothing.bins.count, 0);
  EXPECT_TRUE(optimal(nothing, SampleNorm::mean, 4).empty());
  EXPECT_TRUE(kmeans(nothing, 4).empty());
}

TEST(Histogram, AllocatesNothing) {
  Random random(65);
  const auto setup = randomSetup(random, 256);
  setup->make();
  int first[kMaxPartitions];
  const auto before = allocationCount();
  makeBins(setup->frame, setup->region, setup->light, setup->bins);
  for (const SampleNorm norm : kNorms) (void)splitOptimally(setup->bins, norm, 4, 0.0, first, nullptr);
  (void)splitByMeans(setup->bins, 4, first);
  EXPECT_EQ(allocationCount(), before);
}

}  // namespace
}  // namespace gnomon::test
