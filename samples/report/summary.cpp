#include "summary.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "plan.h"

namespace gnomon::report {
namespace {

using cli::Json;

// Where two records were drawn in turn.
std::string groupOf(const Json& record) {
  const Json& key = record["key"];
  std::string out;
  for (const char* member : {"study", "scene", "camera", "light", "group_texels"})
    if (key.contains(member)) out += key[member].dump() + " ";
  return out;
}

std::vector<double> ranks(const std::vector<double>& values) {
  std::vector<double> out(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    double below = 0.0, equal = 0.0;
    for (const double other : values) {
      below += other < values[i];
      equal += other == values[i];
    }
    out[i] = below + (equal - 1.0) / 2.0;
  }
  return out;
}

double value(const Json& record, const char* member) {
  const Json& at = record[member];
  if (at.is_array()) return at[0].get<double>();  // median and quartiles
  return at.is_number() ? at.get<double>() : std::nan("");
}

}  // namespace

std::string keyText(const Json& record) { return record["key"].dump(); }

void readRecords(const std::string& path, Records& records) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    const Json record = Json::parse(line, nullptr, false);
    if (record.is_object() && record.contains("key")) records.insert_or_assign(keyText(record), record);
  }
}

std::vector<const Json*> recordsOf(const Records& records, const std::string& study, const std::string& scene, double texels) {
  std::vector<const Json*> out;
  for (const auto& [text, record] : records) {
    const Json& key = record["key"];
    if (key["study"] != study || record.contains("refused")) continue;
    if ((!scene.empty() && key["scene"] != scene) || (texels > 0.0 && key["group_texels"] != texels)) continue;
    out.push_back(&record);
  }
  std::stable_sort(out.begin(), out.end(), [](const Json* a, const Json* b) { return (*a)["order"] < (*b)["order"]; });
  return out;
}

std::vector<Json> valuesOf(const std::vector<const Json*>& records, const std::string& member) {
  std::vector<Json> out;
  for (const Json* record : records) {
    const Json& here = (*record)["key"][member];
    if (std::find(out.begin(), out.end(), here) == out.end()) out.push_back(here);
  }
  return out;
}

double spearman(const std::vector<double>& a, const std::vector<double>& b) {
  const std::vector<double> x = ranks(a), y = ranks(b);
  const auto count = static_cast<double>(x.size());
  const auto isKnown = [](double v) { return std::isfinite(v); };
  if (x.size() < 3 || x.size() != y.size() || !std::all_of(a.begin(), a.end(), isKnown) || !std::all_of(b.begin(), b.end(), isKnown))
    return std::nan("");
  const double middle = (count - 1.0) / 2.0;
  double xy = 0.0, xx = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - middle) * (y[i] - middle);
    xx += (x[i] - middle) * (x[i] - middle);
    yy += (y[i] - middle) * (y[i] - middle);
  }
  return xy / std::sqrt(xx * yy);
}

double median(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2.0;
}

std::vector<Row> summarise(const std::vector<const Json*>& records) {
  std::map<std::string, const Json*> baselines;
  for (const Json* record : records)
    if ((*record)["order"] == 0) baselines[groupOf(*record)] = record;
  std::vector<Row> rows;
  for (const Json& label : valuesOf(records, "label")) {
    Row row;
    row.label = label.get<std::string>();
    double frame = 0.0, shadow = 0.0, triangles = 0.0, wrong = 0.0, near = 0.0, mean = 0.0, max = 0.0, needed = 0.0;
    for (const Json* record : records) {
      const Json& key = (*record)["key"];
      if (key["label"] != label) continue;
      const auto baseline = baselines.find(groupOf(*record));
      if (baseline == baselines.end()) continue;
      const Json &r = *record, &b = *baseline->second;
      row.method = key["method"];
      ++row.views;
      const auto ratio = [&](const char* member, double added = 0.0) {
        return std::log((value(r, member) + added) / (value(b, member) + added));
      };
      frame += ratio("frame_ms");
      shadow += ratio("shadow_ms");
      triangles += ratio("shadow_triangles", 1.0);
      wrong += ratio("wrong", 0.5);
      near += ratio("wrong_near", 0.5);
      mean += std::log(value(r, "mean_error"));
      max += std::log(value(r, "max_error"));
      needed += std::log(value(r, "needed_over_limit"));
      row.wrongShare += value(r, "wrong_share");
      row.passes += value(r, "passes");
      row.texels += value(r, "texels");
      row.solveUs += value(r, "solve_us");
      row.flips += value(r, "flips_camera");
      row.flipsLight += value(r, "flips_light");
      row.unserved += value(r, "unserved");
      row.distance += value(r, "wrong_distance");
    }
    if (row.views == 0) continue;
    const double n = row.views;
    row.frame = std::exp(frame / n);
    row.shadow = std::exp(shadow / n);
    row.triangles = std::exp(triangles / n);
    row.wrong = std::exp(wrong / n);
    row.wrongNear = std::exp(near / n);
    row.meanError = std::exp(mean / n);
    row.maxError = std::exp(max / n);
    row.neededOverLimit = std::exp(needed / n);
    for (double* each :
         {&row.wrongShare, &row.passes, &row.texels, &row.solveUs, &row.flips, &row.flipsLight, &row.unserved, &row.distance})
      *each /= n;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<Correlation> correlations(const Records& records) {
  std::vector<Correlation> out;
  for (const Json& scene : valuesOf(recordsOf(records, kSweep), "scene")) {
    for (const Json& texels : valuesOf(recordsOf(records, kSweep), "group_texels")) {
      const std::vector<const Json*> here = recordsOf(records, kSweep, scene.get<std::string>(), texels.get<double>());
      const std::vector<Json> labels = valuesOf(here, "label");
      struct Sum {
        double mean = 0.0, acrossEdges = 0.0, near = 0.0;
        std::size_t views = 0;
      };
      std::vector<Sum> sums;
      for (const Json& label : labels) {
        Sum& sum = sums.emplace_back();
        for (const Json* record : here) {
          if ((*record)["key"]["label"] != label) continue;
          sum.mean += value(*record, "mean_error");
          sum.acrossEdges += value(*record, "texel_across_edges");
          sum.near += value(*record, "wrong_near");
          ++sum.views;
        }
      }
      if (sums.empty()) continue;
      std::size_t most = 0;
      for (const Sum& sum : sums) most = std::max(most, sum.views);
      std::vector<double> mean, edges, near;
      for (const Sum& sum : sums) {
        if (sum.views < most) continue;  // refused in some view
        mean.push_back(sum.mean);
        edges.push_back(sum.acrossEdges);
        near.push_back(sum.near);
      }
      out.push_back(
          {scene.get<std::string>(), texels.get<double>(), spearman(mean, near), spearman(edges, near), static_cast<int>(near.size())});
    }
  }
  return out;
}

}  // namespace gnomon::report
