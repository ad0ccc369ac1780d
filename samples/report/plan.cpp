#include "plan.h"

#include <algorithm>

namespace gnomon::report {
namespace {

using cli::Json;

constexpr double square(double side) { return side * side; }

std::vector<Variant> sweepRows(bool quick) {
  std::vector<Variant> rows{
      {.label = "PSSM", .method = "pssm", .pictured = true},
      {.label = "PSSM, λ = 0.5", .method = "pssm", .settings = {{"split", "practical"}, {"lambda", 0.5}}},
      {.label = "PSSM, stable", .method = "pssm", .settings = {{"fit", "stable"}}, .pictured = true},
      {.label = "PSSM, 8 maps", .method = "pssm", .partitions = 8},
      {.label = "one map", .method = "single", .settings = {{"warp", "none"}}, .partitions = 1},
      {.label = "one warped map", .method = "single", .partitions = 1, .pictured = true},
      {.label = "two warped slices", .method = "lloyd", .settings = {{"scheme", "zp+w"}, {"warp", "least"}}, .partitions = 2},
      {.label = "LiSPSM slices", .method = "lloyd", .settings = {{"scheme", "zp+w"}, {"warp", "lispsm"}}},
      {.label = "faces in rows, 8 maps", .method = "lloyd", .settings = {{"scheme", "fp+zp+w"}, {"warp", "lispsm"}}, .partitions = 8},
      {.label = "best", .method = "lloyd", .settings = {{"scheme", "best"}}, .pictured = true},
      {.label = "best, 8 maps", .method = "lloyd", .settings = {{"scheme", "best"}}, .partitions = 8},
      {.label = "LSPSM, 8 maps", .method = "lspsm", .partitions = 8, .pictured = true},
      {.label = "LSPSM by error, 8 maps", .method = "lspsm", .settings = {{"rows", "error"}, {"warp", "least"}}, .partitions = 8},
      {.label = "SDSM", .method = "sdsm", .samples = true},
      {.label = "SDSM, optimal",
       .method = "sdsm",
       .settings = {{"scheme", "optimal"}, {"norm", "mean"}},
       .samples = true,
       .pictured = true},
      {.label = "auto", .method = "auto", .partitions = 8, .pictured = true},
  };
  if (quick) std::erase_if(rows, [](const Variant& row) { return !row.pictured && row.label != "one map"; });
  return rows;
}

Variant slices(const char* label, int maps, double side) {
  return {.label = label, .method = "pssm", .partitions = maps, .texels = maps * square(side)};
}

Variant single(const char* label, const char* warp, double side) {
  return {.label = label, .method = "single", .settings = {{"warp", warp}}, .partitions = 1, .texels = square(side)};
}

}  // namespace

std::vector<Study> studies(const std::vector<std::string>& methods, bool quick) {
  Study sweep{.name = kSweep,
              .title = "speed against error",
              .texels = {4.0 * square(256.0), 4.0 * square(512.0), 4.0 * square(1024.0)},
              .isPath = true,
              .variants = sweepRows(quick)};
  if (quick) {
    sweep.texels = {4.0 * square(512.0)};
    sweep.allViews = false;
  }
  std::vector<Study> all{std::move(sweep)};
  if (!quick) {
    all.push_back({.name = "zhang-table-1",
                   .title = "[Zhang 2006] Table 1",
                   .allViews = false,
                   .variants = {single("TSM, 1024²", "tsm", 1024.0), slices("PSSM(2; 512²)", 2, 512.0), slices("PSSM(3; 512²)", 3, 512.0),
                                slices("PSSM(4; 512²)", 4, 512.0)}});
    all.push_back(
        {.name = "zhang-figure-8e",
         .title = "[Zhang 2006] Fig. 8(e), dueling",
         .light = "dueling",
         .variants = {single("SSM, 2048²", "none", 2048.0), single("PSM, 2048²", "psm", 2048.0), single("LiSPSM, 2048²", "lispsm", 2048.0),
                      single("TSM, 2048²", "tsm", 2048.0), slices("PSSM(2; 1024²)", 2, 1024.0), slices("PSSM(3; 1024²)", 3, 1024.0),
                      slices("PSSM(4; 1024²)", 4, 1024.0)}});
    all.push_back({.name = "lloyd-figure-1",
                   .title = "[Lloyd 2006] Fig. 1",
                   .width = 800,
                   .height = 800,
                   .allViews = false,
                   .variants = {single("W, 2K × 2K", "lispsm", 2048.0),
                                single("W, 4K × 4K", "lispsm", 4096.0),
                                {.label = "ZP4+W, 2K × 2K in all",
                                 .method = "lloyd",
                                 .settings = {{"scheme", "zp+w"}, {"warp", "lispsm"}},
                                 .texels = square(2048.0)}}});
    all.push_back(
        {.name = "lauritzen-frame-time",
         .title = "[Lauritzen 2010] frame times",
         .allViews = false,
         .variants = {slices("PSSM", 4, 1024.0), {.label = "SDSM", .method = "sdsm", .texels = 4.0 * square(1024.0), .samples = true}}});
    all.push_back(
        {.name = "tang-table-1",
         .title = "[Tang 2017] Table 1",
         .width = 720,
         .height = 540,
         .allViews = false,
         .variants = {slices("8 slices", 8, 1024.0),
                      {.label = "LSPSM, ζ = 0.25",
                       .method = "lspsm",
                       .settings = {{"zeta", 0.25}, {"sigma", 0.5}, {"max_rows", 4}, {"max_columns", 2}},
                       .partitions = 8,
                       .texels = 8.0 * square(1024.0)},
                      {.label = "SDSM, 8 slices", .method = "sdsm", .partitions = 8, .texels = 8.0 * square(1024.0), .samples = true}}});
  }
  for (Study& study : all) {
    if (study.texels.empty()) study.texels = {0.0};
    std::erase_if(study.variants, [&](const Variant& variant) {
      const auto has = [&](const auto& list, auto&& name) {
        return std::any_of(list.begin(), list.end(), [&](const auto& each) { return name(each) == variant.method; });
      };
      const bool isKnown = has(cli::methods(), [](const cli::Method& method) { return method.name; });
      return !isKnown || (!methods.empty() && !has(methods, [](const std::string& name) { return name; }));
    });
  }
  std::erase_if(all, [](const Study& study) { return study.variants.size() < 2; });
  return all;
}

}  // namespace gnomon::report
