#include "gnomon/lspsm.h"

#include "gnomon/frame.h"
#include "gnomon/maps.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The rows and columns, or the slices, that need the fewest texels.
void findLeast(const Frame& frame, const Region& region, const LightSpace& light, const RowPlane& plane, const LspsmSettings& settings,
               const MapSettings& making, Splits& splits, RowLayout& layout) noexcept {
  MapFits maps;
  double least = kInfinity;
  const auto consider = [&](const Splits& made, const RowLayout& rows) {
    fitMaps(frame, region, light, made, making, needsViewDepth(region, made), maps);
    if (!(maps.neededTexels < least)) return;
    least = maps.neededTexels;
    splits = made;
    layout = rows;
  };
  RowSettings rowing = settings.rows;
  const int mostColumns = std::min(settings.rows.maxColumns, frame.budget.partitions);
  for (rowing.maxColumns = 1; rowing.maxColumns <= mostColumns; ++rowing.maxColumns) {
    Splits made;
    RowLayout rows;
    if (splitRows(region, light, plane, rowing, frame.budget.partitions, made, rows) == Status::ok && made.count > 0) consider(made, rows);
  }
  Splits slices;
  double refused = 0.0;
  if (split(region, {}, frame.budget.partitions, slices, refused) == Status::ok && slices.count > 0) consider(slices, {});
}

}  // namespace

Status solveLspsm(const Frame& frame, const LspsmSettings& settings, Solution& solution, RowLayout* layout) noexcept {
  Region region;
  LightSpace light;
  RowLayout made;
  if (layout) *layout = made;
  if (beginSolve(frame, {}, FitMode::tight, region, light, solution) != Status::ok) return solution.status;
  if (const Status status = validate(settings.rows, solution.refusedValue); status != Status::ok) return refuse(solution, status);
  if (const Status status = validate(settings.warp, solution.refusedValue); status != Status::ok) return refuse(solution, status);

  const bool isPaper = settings.rows.rule == RowRule::paper, isByError = settings.rows.rule == RowRule::error;
  RowPlane plane;
  makeRowPlane(region, light, plane);
  const MapSettings making{
      .fit = FitMode::tight, .warp = settings.warp, .whole = &plane.whole, .shares = isPaper ? Shares::equal : Shares::error};
  Splits splits;
  if (isByError) {
    findLeast(frame, region, light, plane, settings, making, splits, made);
  } else if (const Status status = splitRows(region, light, plane, settings.rows, frame.budget.partitions, splits, made);
             status != Status::ok) {
    solution.refusedValue = std::min(settings.rows.maxRows, frame.budget.partitions);
    return refuse(solution, status);
  }
  if (const Status status = makeMaps(frame, region, light, splits, making, solution); status != Status::ok) return refuse(solution, status);
  constexpr double kRounding = 1.0 + 1e-9;
  if (!isByError && made.waste > settings.rows.zeta * kRounding) solution.warnings |= static_cast<std::uint32_t>(Warning::rowsWaste);
  if (layout) *layout = made;
  return Status::ok;
}

}  // namespace gnomon
