#include "gnomon/split.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

// A stretch of the region that consecutive slices share without leaving out a gap.
struct Stretch {
  DepthSpan span;
  int count;
};

// Covers the spans with slices of one length (logarithm of the ratio, or difference), skipping the gaps between slices.
// Returns how many slices that takes, writing the stretches where asked; stops counting past `most`.
int cover(const Region& region, const double* near, const double* far, double step, int most, Stretch* stretches,
          int* stretchCount) noexcept {
  int slices = 0, made = 0;
  double reached = -kInfinity;  // measure covered so far
  for (int i = 0; i < region.spanCount && slices <= most; ++i) {
    if (far[i] <= reached) {  // the slice before holds this whole span
      if (made > 0 && stretches) stretches[made - 1].span.far = region.spans[i].far;
      continue;
    }
    const bool isFresh = near[i] > reached;  // a slice begins after a gap
    const double from = isFresh ? near[i] : reached;
    int needed = static_cast<int>(std::min(most + 1.0, std::ceil((far[i] - from) / step)));  // 0 / 0 counts as too many
    needed = std::max(needed, isFresh ? 1 : 0);
    slices += needed;
    reached = from + needed * step;
    if (!stretches) continue;
    if (isFresh)
      stretches[made++] = {region.spans[i], needed};
    else {
      stretches[made - 1].span.far = region.spans[i].far;
      stretches[made - 1].count += needed;
    }
  }
  if (stretchCount) *stretchCount = made;
  return slices;
}

// The stretches that `count` slices cover with the least greatest ratio (perspective) or length (orthographic).
int findStretches(const Region& region, int count, Stretch* stretches) noexcept {
  if (region.spanCount == 1) {
    stretches[0] = {region.spans[0], count};
    return 1;
  }
  double near[kMaxSpans] = {}, far[kMaxSpans] = {};
  for (int i = 0; i < region.spanCount; ++i) {
    const bool isPerspective = region.camera.projection == Projection::perspective;
    near[i] = isPerspective ? std::log(region.spans[i].near) : region.spans[i].near;
    far[i] = isPerspective ? std::log(region.spans[i].far) : region.spans[i].far;
  }
  constexpr double kSlack = 1.0 + 1e-9;  // so that rounding cannot ask for one slice more
  double tooShort = 0.0, enough = (far[region.spanCount - 1] - near[0]) / count * kSlack;
  constexpr int kHalvings = 48;  // to double precision of the whole range
  for (int i = 0; i < kHalvings; ++i) {
    const double step = (tooShort + enough) / 2.0;
    (cover(region, near, far, step, count, nullptr, nullptr) <= count ? enough : tooShort) = step;
  }
  int stretchCount = 0;
  int spare = count - cover(region, near, far, enough, count, stretches, &stretchCount);
  const auto length = [&](const Stretch& s) {
    return (region.camera.projection == Projection::perspective ? std::log(s.span.far / s.span.near) : s.span.far - s.span.near) / s.count;
  };
  for (; spare > 0; --spare)  // maps that the greatest slice has no use for go to the next greatest
    ++std::max_element(stretches, stretches + stretchCount, [&](const Stretch& a, const Stretch& b) {
        return length(a) < length(b);
      })->count;
  if (spare == 0) return stretchCount;
  stretches[0] = {{region.spans[0].near, region.spans[region.spanCount - 1].far}, count};  // spans within rounding of a point
  return 1;
}

// Trims a slice to the spans inside it and appends it. False where it holds nothing.
// A slice that meets a span only in the depth where the next slice begins leaves that depth to it.
bool append(const Region& region, DepthSpan slice, bool isLast, Splits& splits) noexcept {
  double near = kInfinity, far = -kInfinity;
  for (int i = 0; i < region.spanCount; ++i) {
    const double from = std::max(region.spans[i].near, slice.near), to = std::min(region.spans[i].far, slice.far);
    if (!(from <= to) || (from == slice.far && !isLast && from != slice.near)) continue;
    if (to == slice.near && splits.count > 0 && splits.slices[splits.count - 1].far == to) continue;  // the slice before is closed there
    near = std::min(near, from);
    far = std::max(far, to);
  }
  if (!(near <= far)) return false;
  if (splits.count > 0 && near < splits.slices[splits.count - 1].far) near = splits.slices[splits.count - 1].far;
  splits.slices[splits.count++] = {near, far};
  return true;
}

// The n-th root, by square roots as far as they go: pow costs more than two.
double nthRoot(double x, int n) noexcept {
  for (; n % 2 == 0; n /= 2) x = std::sqrt(x);
  return n == 1 ? x : std::pow(x, 1.0 / n);
}

}  // namespace

bool needsViewDepth(const Region& region, const Splits& splits) noexcept {
  if (splits.isWedged) return false;
  constexpr double kLeastSteps = 8.0;  // depth values that a slice must hold for its padding to stay small
  for (int i = 0; i < splits.count; ++i) {
    const DepthSpan& slice = splits.slices[i];
    if (splits.count > 1 && slice.far > slice.near && depthQuantum(region.camera, slice.far) * kLeastSteps > slice.far - slice.near)
      return true;
  }
  return false;
}

void padSlices(const Region& region, const Splits& splits, const Margin& margin, bool byViewDepth, DepthSpan* padded) noexcept {
  if (splits.isWedged) {
    std::copy_n(splits.slices, splits.count, padded);
    return;
  }
  const Camera camera = region.camera;  // a copy, which `padded` cannot overlap: what is the same for all depths is found once
  const auto quantum = [&](double z) { return std::max(viewQuantum(camera, z), byViewDepth ? 0.0 : depthQuantum(camera, z)); };
  double atFar = 0.0;
  for (int i = 0; i < splits.count; ++i) {
    const DepthSpan& slice = splits.slices[i];
    const bool hasBefore = i > 0 && splits.slices[i - 1].far == slice.near;
    double near = slice.near - (hasBefore ? atFar : quantum(slice.near));
    if (hasBefore) near -= margin.blend * (slice.near - splits.slices[i - 1].near);
    atFar = quantum(slice.far);
    padded[i] = {std::max(near, region.near), std::min(slice.far + atFar, region.far)};
  }
}

Status validate(const SplitSettings& settings, const Budget& budget, double& value, int& index) noexcept {
  index = -1;
  value = settings.lambda;
  if (!(settings.lambda >= 0.0 && settings.lambda <= 1.0)) return Status::splitLambda;
  value = settings.bias;
  if (!(settings.bias >= 0.0 && std::isfinite(settings.bias))) return Status::splitBias;
  value = settings.count;
  if (settings.count < 0 || settings.count > budget.partitions) return Status::splitCount;
  if (settings.scheme != SplitScheme::explicitDepths) return Status::ok;
  for (std::size_t i = 0; i < settings.depths.size(); ++i) {
    index = static_cast<int>(i);
    value = settings.depths[i];
    if (!std::isfinite(value) || (i > 0 && !(value > settings.depths[i - 1])) || index + 1 >= budget.partitions)
      return Status::splitExplicit;
  }
  index = -1;
  return Status::ok;
}

Status split(const Region& region, const SplitSettings& settings, int count, Splits& splits, double& refused) noexcept {
  splits.count = 0;
  if (region.spanCount == 0) return Status::ok;
  if (settings.scheme == SplitScheme::explicitDepths) {
    double from = region.near;
    for (std::size_t i = 0; i <= settings.depths.size(); ++i) {
      const double to = i < settings.depths.size() ? std::min(settings.depths[i], region.far) : region.far;
      if (to > from) append(region, {from, to}, !(to < region.far), splits);
      from = std::max(from, to);
    }
    return Status::ok;
  }
  const bool isPerspective = region.camera.projection == Projection::perspective;
  Stretch stretches[kMaxSpans];
  const int stretchCount = findStretches(region, count, stretches);
  for (int s = 0; s < stretchCount; ++s) {
    const Stretch& stretch = stretches[s];
    const double near = stretch.span.near, far = stretch.span.far;
    const bool isUniform = settings.scheme == SplitScheme::uniform || !isPerspective;
    const double ratio = isUniform ? 1.0 : nthRoot(far / near, stretch.count);
    const bool isPractical = settings.scheme == SplitScheme::practical && isPerspective;
    double from = near, logarithmic = near;
    for (int i = 1; i <= stretch.count; ++i) {
      const bool isLast = i == stretch.count;
      const auto uniform = [&] { return near + (far - near) * (static_cast<double>(i) / stretch.count); };  // [Zhang 2006, eq. 5]
      logarithmic *= ratio;  // [Zhang 2006, eq. 4]
      double to = isUniform ? uniform() : logarithmic;
      if (isPractical) to = settings.lambda * logarithmic + (1.0 - settings.lambda) * uniform() + settings.bias;  // [eq. 7 corrected]
      if (isLast) to = far;
      // Only a bias can break the order; elsewhere planes that rounding puts together leave nothing between them.
      if (!isLast && isPractical && settings.bias > 0.0 && !(to > from && to < far)) {
        refused = settings.bias;
        return Status::splitBiasOrder;
      }
      if (to > from || (isLast && from == near)) append(region, {from, to}, isLast, splits);
      from = to;
    }
  }
  return Status::ok;
}

}  // namespace gnomon
