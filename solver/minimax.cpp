#include "gnomon/minimax.h"

#include "numeric.h"

namespace gnomon {
namespace {

// Where one slice may end and the next begin: two depths where a gap between receivers lies there.
struct Joint {
  double end, start;
};

constexpr int kGrid = 24;  // steps across the region that are tried first, at least
constexpr int kRounds = 6;  // halvings of a step about the best
constexpr int kMaxJoints = 1 + kGrid + kMaxPartitions + kMaxSpans;
constexpr int kTried = 3;  // joints tried for each plane in a round

// In order, each once; the first begins the region and the last ends it.
struct Joints {
  int count = 2;
  Joint joints[kMaxJoints];
};

// The joint at a depth inside the region.
Joint jointAt(const Region& region, double depth) noexcept {
  for (int i = 0; i + 1 < region.spanCount; ++i)
    if (depth >= region.spans[i].far && depth <= region.spans[i + 1].near) return {region.spans[i].far, region.spans[i + 1].near};
  return {depth, depth};
}

void insert(Joints& list, const Joint& joint) noexcept {
  Joint* const last = list.joints + list.count - 1;
  if (!(joint.start > list.joints[0].start) || !(joint.end < last->end)) return;
  Joint* const place = std::lower_bound(list.joints + 1, last, joint, [](const Joint& a, const Joint& b) { return a.start < b.start; });
  if (place != last && place->start == joint.start) return;
  std::move_backward(place, last + 1, last + 2);
  *place = joint;
  ++list.count;
}

// The cheapest chain of at most `count` slices between joints no farther apart than `reach` places. Returns its joints. price: writes the
// costs of the slices from joint a to every one after it and before `end`, each after the slice from joint `before`, which is a where none
// is before it. Where the slice before decides what a slice must cover, each one follows the cheapest chain that ends there: not every
// chain is compared, but all that begin well.
template <typename Price, typename Sum>
Joints cheapestChain(const Joints& from, int count, int reach, bool isBlended, const Price& price, const Sum& sum) noexcept {
  const int last = from.count - 1;
  double least[kMaxPartitions + 1][kMaxJoints];
  int before[kMaxPartitions + 1][kMaxJoints] = {};
  for (int k = 0; k <= count; ++k) std::fill(least[k], least[k] + from.count, kInfinity);
  least[0][0] = 0.0;
  double costs[kMaxJoints];
  for (int a = 0; a < last; ++a) {
    const int end = std::min(a + reach, last) + 1;
    int priced = -1;  // after which joint
    for (int k = 1; k <= count; ++k) {
      if (!(least[k - 1][a] < kInfinity)) continue;
      if (const int after = isBlended && k > 1 ? before[k - 1][a] : a; after != priced) {
        price(after, a, end, costs);
        priced = after;
      }
      for (int b = a + 1; b < end; ++b)
        if (const double total = sum(least[k - 1][a], costs[b]); total < least[k][b]) {
          least[k][b] = total;
          before[k][b] = a;
        }
    }
  }
  int slices = 1;
  for (int k = 2; k <= count; ++k)
    if (least[k][last] < least[slices][last]) slices = k;
  Joints chain;
  chain.count = slices + 1;
  chain.joints[0] = from.joints[0];
  for (int k = slices, at = last; k > 0; --k) {
    chain.joints[k] = from.joints[at];
    at = before[k][at];
  }
  return chain;
}

}  // namespace

void splitMinimax(const Frame& frame, const Region& region, const LightSpace& light, const MapSettings& settings, int count,
                  Splits& splits) noexcept {
  splits.count = 0;
  splits.isWedged = false;
  if (region.spanCount == 0) return;
  const bool isPerspective = region.camera.projection == Projection::perspective;
  const double near = region.spans[0].near, far = region.spans[region.spanCount - 1].far;
  // Steps of the depth over near, so that a scaled world has the same.
  const auto depthOf = [&](double step) { return isPerspective ? near * std::exp(step) : step; };
  const auto stepOf = [&](double depth) { return isPerspective ? std::log(depth / near) : depth; };
  MapFits maps;
  const auto choose = [&](const Joints& from, int reach) {
    // As many at once as fit: the region's cells are cut and looked at once for all of them.
    const auto price = [&](int before, int a, int end, double* costs) {
      const int each = before != a ? 2 : 1;  // what a slice must cover depends on the one before it, which it is blended with
      for (int done = a + 1; done < end; done += kMaxPartitions / each) {
        Splits slices;
        for (int b = done; b < end && slices.count < kMaxPartitions; ++b) {
          if (each == 2) slices.slices[slices.count++] = {from.joints[before].start, from.joints[a].end};
          slices.slices[slices.count++] = {from.joints[a].start, from.joints[b].end};
        }
        fitMaps(frame, region, light, slices, settings, false, maps);
        for (int i = 0; i < slices.count / each; ++i) costs[done + i] = maps.fits[each * i + each - 1].needed;
      }
    };
    const bool isBlended = frame.margin.blend > 0.0;
    return settings.shares == Shares::equal
               ? cheapestChain(from, count, reach, isBlended, price, [](double a, double b) { return std::max(a, b); })
               : cheapestChain(from, count, reach, isBlended, price, [](double a, double b) { return a + b; });
  };

  const int steps = (kGrid + count - 1) / count * count;  // so that planes of equal ratio are among them
  double step = (stepOf(far) - stepOf(near)) / steps;
  Joints all;
  all.joints[0] = {near, near};
  all.joints[1] = {far, far};
  Joints tried = all;
  for (int i = 1; i < steps; ++i) insert(tried, jointAt(region, depthOf(stepOf(near) + i * step)));
  for (int i = 0; i + 1 < region.spanCount; ++i) insert(tried, {region.spans[i].far, region.spans[i + 1].near});
  Joints chain = choose(tried, tried.count);
  for (int round = 0; round < kRounds; ++round) {
    step /= 2.0;
    tried = all;
    for (int i = 1; i + 1 < chain.count; ++i) {
      insert(tried, chain.joints[i]);
      insert(tried, jointAt(region, depthOf(stepOf(chain.joints[i].end) - step)));
      insert(tried, jointAt(region, depthOf(stepOf(chain.joints[i].start) + step)));
    }
    chain = choose(tried, 2 * kTried - 1);
  }
  for (int i = 0; i + 1 < chain.count; ++i) splits.slices[splits.count++] = {chain.joints[i].start, chain.joints[i + 1].end};
}

}  // namespace gnomon
