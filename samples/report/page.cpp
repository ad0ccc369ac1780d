#include "page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "claims.h"
#include "plan.h"
#include "plot.h"
#include "result.h"

namespace gnomon::report {
namespace {

using cli::Json;

std::string text(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string text(const char* format, ...) {
  char out[512];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(out, sizeof out, format, arguments);
  va_end(arguments);
  return out;
}

// Three significant digits, without an exponent below a million.
std::string number(double value) {
  if (!std::isfinite(value)) return "–";
  const double size = std::abs(value);
  if (size >= 1e6) return text("%.2f M", value / 1e6);
  if (size >= 100.0) return text("%.0f", value);
  if (size >= 10.0) return text("%.1f", value);
  if (size >= 0.1 || size == 0.0) return text("%.2f", value);
  return text("%.2g", value);
}

std::string texelText(double texels) { return text("%.2f M texels", texels / (1024.0 * 1024.0)); }

std::string titleOf(const std::string& scene) { return std::filesystem::path(scene).stem().string(); }

double value(const Json& record, const char* member) {
  const auto at = record.find(member);
  if (at == record.end()) return std::nan("");
  if (at->is_array()) return (*at)[0].get<double>();
  return at->is_number() ? at->get<double>() : std::nan("");
}

int placeOf(const std::string& method) {
  const std::vector<cli::Method>& all = cli::methods();
  return static_cast<int>(std::find_if(all.begin(), all.end(), [&](const cli::Method& each) { return each.name == method; }) - all.begin());
}

// The marks of variants: a colour for each method, a shape for each of its variants.
class Marks {
 public:
  explicit Marks(const std::vector<const Json*>& records) {
    for (const Json* record : records) {
      const Json& key = (*record)["key"];
      const auto label = key["label"].get<std::string>(), method = key["method"]["name"].get<std::string>();
      if (std::any_of(marks_.begin(), marks_.end(), [&](const Mark& mark) { return mark.label == label; })) continue;
      const auto before = std::count_if(marks_.begin(), marks_.end(), [&](const Mark& mark) { return mark.method == method; });
      marks_.push_back({label, method, placeOf(method), static_cast<int>(before)});
    }
  }
  void put(const std::string& label, Point& point) const {
    for (const Mark& mark : marks_)
      if (mark.label == label) {
        point.colour = mark.colour;
        point.shape = mark.shape;
      }
    point.label = label;
  }
  [[nodiscard]] std::string swatch(const std::string& label) const {
    Point point;
    put(label, point);
    return "<svg class=\"swatch\" viewBox=\"-7 -7 14 14\" aria-hidden=\"true\"><path d=\"" + markOf(point.shape) + "\" fill=\"" +
           colourOf(point.colour) + "\"/></svg>" + escaped(label);
  }
  [[nodiscard]] std::string legend() const {
    std::string out = "<ul class=\"legend\" aria-label=\"Marks\">";
    for (const Mark& mark : marks_) out += "<li tabindex=\"0\" data-l=\"" + escaped(mark.label) + "\">" + swatch(mark.label) + "</li>";
    return out + "</ul>\n";
  }

 private:
  struct Mark {
    std::string label, method;
    int colour, shape;
  };
  std::vector<Mark> marks_;
};

std::string settingsText(const Json& method) {
  std::string out = method["name"].get<std::string>();
  for (const auto& [key, setting] : method.items())
    if (key != "name") out += " " + key + "=" + (setting.is_string() ? setting.get<std::string>() : setting.dump());
  return out;
}

std::string pointTitle(const Json& record) {
  const Json& key = record["key"];
  return key["label"].get<std::string>() + ", " + key["camera"].get<std::string>() + ", " + key["light"].get<std::string>() + " light, " +
         texelText(key["texels"].get<double>()) + ": " + number(value(record, "frame_ms")) + " ms, " + number(value(record, "wrong")) +
         " wrong pixels, " + number(value(record, "passes")) + " passes, needed/limit " + number(value(record, "needed_over_limit")) +
         ", predicted " + number(value(record, "mean_error")) + "; " + settingsText(key["method"]);
}

std::vector<Point> pointsOf(const std::vector<const Json*>& records, const Marks& marks, const char* x, const char* y,
                            double yScale = 1.0) {
  std::vector<Point> points;
  for (const Json* record : records) {
    Point point{.x = value(*record, x), .y = yScale * value(*record, y), .label = {}, .title = pointTitle(*record)};
    marks.put((*record)["key"]["label"], point);
    points.push_back(std::move(point));
  }
  return points;
}

std::string figure(const Plot& plot) { return "<figure class=\"panel\">" + svgOf(plot) + "</figure>\n"; }

Plot summaryPlot(const std::vector<Row>& rows, const Marks& marks, const std::string& baseline) {
  Plot plot{.title = "All views: frame time against wrong pixels",
            .xLabel = "frame time over that of " + baseline,
            .yLabel = "wrong pixels over those of " + baseline,
            .points = {},
            .width = 760,
            .height = 400};
  for (const Row& row : rows) {
    Point point{.x = row.frame,
                .y = row.wrong,
                .label = {},
                .title = row.label + ": frame time × " + number(row.frame) + ", wrong pixels × " + number(row.wrong)};
    marks.put(row.label, point);
    plot.points.push_back(std::move(point));
  }
  return plot;
}

// The summary's columns: head, Markdown or HTML cell.
struct Column {
  const char *head, *title;
  std::string (*cell)(const Row&);
};
constexpr Column kColumns[] = {
    {"frame", "frame time over the first row's", [](const Row& row) { return number(row.frame); }},
    {"shadow passes", "their time over the first row's", [](const Row& row) { return number(row.shadow); }},
    {"wrong", "wrong pixels over the first row's", [](const Row& row) { return number(row.wrong); }},
    {"wrong, %", "of the pixels that face the light", [](const Row& row) { return number(100.0 * row.wrongShare); }},
    {"from edge", "mean distance of wrong pixels from the true edge, pixels", [](const Row& row) { return number(row.distance); }},
    {"predicted", "mean error over visible points, geometric mean over views", [](const Row& row) { return number(row.meanError); }},
    {"needed/limit", "texels for error 1 over the least possible", [](const Row& row) { return number(row.neededOverLimit); }},
    {"passes", "maps drawn", [](const Row& row) { return number(row.passes); }},
    {"triangles", "in all maps after culling, over the first row's", [](const Row& row) { return number(row.triangles); }},
    {"flips", "pixels a frame along the camera path", [](const Row& row) { return number(row.flips); }},
    {"solve, µs", "", [](const Row& row) { return number(row.solveUs); }},
};

std::string summaryHtml(const std::vector<Row>& rows, const Marks& marks) {
  std::string out = "<table><thead><tr><th>method</th>";
  for (const Column& column : kColumns) out += "<th title=\"" + escaped(column.title) + "\">" + escaped(column.head) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const Row& row : rows) {
    out += "<tr data-l=\"" + escaped(row.label) + "\"><th title=\"" + escaped(settingsText(row.method)) + "\">" + marks.swatch(row.label) +
           "</th>";
    for (const Column& column : kColumns) out += "<td>" + column.cell(row) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

std::string claimsHtml(const Records& records) {
  std::string out;
  for (const Claim& claim : claims()) {
    const std::vector<const Json*> here = recordsOf(records, claim.study);
    if (here.empty()) continue;
    out += "<h3 id=\"" + std::string(claim.study) + "\">" + escaped(claim.title) + "</h3>\n<p>" + escaped(claim.says) + "</p>\n";
    out +=
        "<table><thead><tr><th>method</th><th>paper</th><th>here</th><th>wrong, %</th><th>max "
        "error</th><th>predicted</th><th>passes</th><th>shadow passes</th></tr></thead><tbody>\n";
    for (const Row& row : summarise(here)) {
      std::string paper = "–";
      for (const auto& [label, printed] : claim.paper)
        if (row.label == label) paper = printed;
      out += "<tr><th>" + escaped(row.label) + "</th><td>" + escaped(paper) + "</td><td>" + number(row.frame) + "</td><td>" +
             number(100.0 * row.wrongShare) + "</td><td>" + number(row.maxError) + "</td><td>" + number(row.meanError) + "</td><td>" +
             number(row.passes) + "</td><td>" + number(row.shadow) + "</td></tr>\n";
    }
    out += "</tbody></table>\n<p class=\"note\">" + escaped(claim.remark) + "</p>\n";
  }
  return out;
}

// Other systems' cascades, as gnomon_peers left them; where they beat ours comes first.
std::string peersHtml(const std::string& folder) {
  std::ifstream file(folder + "/peers.json");
  const Json peers = Json::parse(file, nullptr, false);
  if (!peers.is_object()) return "";
  std::string out =
      "<h2 id=\"peers\">Real systems beside it</h2>\n<p>Their own code, headless, on the built-in scenes' whole views, four maps of 1024 × "
      "1024; their matrices sampled by the measure "
      "that ours are sampled by.</p>\n";
  if (peers["lost"].empty())
    out += "<p>None of them needs fewer texels than ours with any settings.</p>\n";
  else {
    out +=
        "<p>Where ours lose:</p>\n<table><thead><tr><th>case</th><th>system</th><th>its needed/limit</th><th>ahead "
        "of</th></tr></thead><tbody>\n";
    for (const Json& lost : peers["lost"])
      out += "<tr><th>" + escaped(lost["case"]) + "</th><td>" +
             escaped(lost["system"].get<std::string>() + ", " + lost["settings"].get<std::string>()) + "</td><td>" +
             number(lost["needed_over_limit"]) + "</td><td>" + escaped(lost["ours"]) + "</td></tr>\n";
    out += "</tbody></table>\n";
  }
  out +=
      "<table><thead><tr><th>system</th><th>settings</th><th>needed/limit</th><th>cases with points outside</th><th>solve, "
      "µs</th></tr></thead><tbody>\n";
  for (const Json& row : peers["rows"])
    out += "<tr><th>" + escaped(row["system"]) + "</th><td>" + escaped(row["settings"]) + "</td><td>" + number(row["needed_over_limit"]) +
           "</td><td>" + text("%d of %d", row["uncovered_cases"].get<int>(), row["cases"].get<int>()) + "</td><td>" +
           number(row["solve_us"]) + "</td></tr>\n";
  return out + "</tbody></table>\n";
}

std::string correlationHtml(std::vector<Correlation> all) {
  std::erase_if(all, [](const Correlation& each) { return !std::isfinite(each.overVisible); });  // too few settings that differ
  if (all.empty()) return "<p>Too few settings were measured to rank.</p>\n";
  std::vector<double> visible, edges;
  std::vector<std::string> scenes;
  std::vector<double> budgets;
  for (const Correlation& each : all) {
    visible.push_back(each.overVisible);
    edges.push_back(each.acrossEdges);
    if (std::find(scenes.begin(), scenes.end(), each.scene) == scenes.end()) scenes.push_back(each.scene);
    if (std::find(budgets.begin(), budgets.end(), each.texels) == budgets.end()) budgets.push_back(each.texels);
  }
  std::string out =
      "<p>Spearman's rank correlation, across methods, of the predicted mean error with wrong pixels near true edges: median <b>" +
      text("%.3f", median(visible)) + "</b>, least <b>" + text("%.3f", *std::min_element(visible.begin(), visible.end())) +
      "</b>. Of the pixels that a texel is wide across true shadow edges, where alone it shows: median " + text("%.3f", median(edges)) +
      ". In the table: over visible points / across edges.</p>\n<table><thead><tr><th>scene</th>";
  for (const double texels : budgets) out += "<th>" + texelText(texels) + "</th>";
  out += "</tr></thead><tbody>\n";
  for (const std::string& scene : scenes) {
    out += "<tr><th>" + escaped(titleOf(scene)) + "</th>";
    for (const double texels : budgets) {
      const auto each = std::find_if(all.begin(), all.end(), [&](const Correlation& c) { return c.scene == scene && c.texels == texels; });
      out += each == all.end() ? "<td></td>" : text("<td>%.2f / %.2f</td>", each->overVisible, each->acrossEdges);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table>\n";
}

// A file as a data URI; empty where it is missing.
std::string dataUri(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "";
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  return std::string("data:image/") + (path.ends_with(".png") ? "png" : "jpeg") + ";base64," +
         cli::base64({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::string picturesHtml(const std::vector<const Json*>& records, const Marks& marks, const std::string& folder) {
  std::string out, whole, shots;
  const auto image = [&](const std::string& name, const std::string& alt) {
    const std::string uri = dataUri(folder + "/pictures/" + name);
    return uri.empty() ? "" : "<img alt=\"" + escaped(alt) + "\" src=\"" + uri + "\">";
  };
  for (const Json* record : records) {
    const Json &key = (*record)["key"], &first = (*records.front())["key"];
    if (key["camera"] != first["camera"] || key["light"] != first["light"]) continue;  // one view says it
    const auto label = key["label"].get<std::string>();
    if (record->contains("whole") && whole.empty()) whole = image((*record)["whole"], "The whole view, drawn with " + label);
    if (!record->contains("shots")) continue;
    const std::string grid = image((*record)["shots"][0], label + ": partitions tinted, texel borders drawn");
    if (grid.empty()) continue;
    shots += "<figure>" + grid + image((*record)["shots"][1], label + ": difference from ray tracing") + "<figcaption><b>" +
             marks.swatch(label) + "</b><span>" + number(100.0 * value(*record, "wrong_share")) + " % wrong, predicted " +
             number(value(*record, "mean_error")) + "</span></figcaption></figure>\n";
  }
  if (shots.empty()) return out;
  return "<div class=\"shots\">" +
         (whole.empty() ? "" : "<figure class=\"whole\">" + whole + "<figcaption><span>the whole view</span></figcaption></figure>\n") +
         shots + "</div>\n";
}

std::string tableOfAll(const std::vector<const Json*>& records) {
  std::string out =
      "<details><summary>Every point, with its settings and the command that draws it again</summary><table "
      "class=\"all\"><thead><tr><th>view</th><th>method</th>"
      "<th>texels</th><th>frame, ms</th><th>quartiles</th><th>wrong</th><th>near / far</th><th>max</th><th>mean</th><th>flips, camera / "
      "light</th><th>command</th></tr></thead><tbody>\n";
  for (const Json* record : records) {
    const Json& key = (*record)["key"];
    const Json& r = *record;
    out += "<tr><td>" + escaped(key["camera"].get<std::string>() + ", " + key["light"].get<std::string>()) + "</td><th>" +
           escaped(key["label"].get<std::string>()) + "</th><td>" + number(value(r, "texels")) + "</td><td>" +
           number(value(r, "frame_ms")) + "</td><td>" + number(r["frame_ms"][1].get<double>()) + " – " +
           number(r["frame_ms"][2].get<double>()) + "</td><td>" + text("%.0f", value(r, "wrong")) + "</td><td>" +
           text("%.0f / %.0f", value(r, "wrong_near"), value(r, "wrong_far")) + "</td><td>" + number(value(r, "max_error")) + "</td><td>" +
           number(value(r, "mean_error")) + "</td><td>" + number(value(r, "flips_camera")) + " / " + number(value(r, "flips_light")) +
           "</td><td><code>" + escaped(r["command"].get<std::string>()) + "</code></td></tr>\n";
  }
  return out + "</tbody></table></details>\n";
}

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>gnomon: speed against error</title>
<style>
:root { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1180px; padding: 28px 24px 60px; background: #fff; color: #24292f;
       font: 15px/1.5 system-ui, 'Segoe UI', Helvetica, Arial, sans-serif; }
h1 { font-size: 27px; margin: 0 0 4px; letter-spacing: -0.01em; } h2 { font-size: 20px; margin: 44px 0 8px; padding-top: 14px; border-top: 1px solid #dfe2e6; }
h3 { font-size: 16px; margin: 26px 0 4px; } p { max-width: 78ch; margin: 6px 0 12px; } .note { color: #57606a; }
nav a { margin-right: 14px; } a { color: #0860b0; }
.panels { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 14px 26px; }
figure { margin: 0; } .plot { width: 100%; height: auto; display: block; } .summary .plot { max-width: 860px; }
.p { cursor: default; } .p:hover, .p:focus { fill-opacity: 1; stroke: #111; stroke-width: 1.6; outline: none; }
.on { fill-opacity: 1; stroke: #111; stroke-width: 1.6; } .off { opacity: 0.13; }
.legend { list-style: none; display: flex; flex-wrap: wrap; gap: 4px 18px; padding: 0; margin: 10px 0; font-size: 13px; }
.legend li { cursor: default; border-radius: 3px; } .legend li:focus, .legend li:hover { background: #eef1f4; outline: 1px solid #9aa1a9; }
.swatch { width: 14px; height: 14px; margin-right: 6px; vertical-align: -2px; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; margin: 10px 0; }
th, td { padding: 3px 11px 3px 0; text-align: right; white-space: nowrap; } th:first-child, td:first-child, .all th, .all td:last-child { text-align: left; }
thead th { border-bottom: 1px solid #9aa1a9; font-weight: 600; } tbody th { font-weight: 400; } tbody tr:hover { background: #f6f8fa; }
.shots { display: grid; grid-template-columns: repeat(auto-fill, minmax(300px, 1fr)); gap: 14px; margin: 14px 0; }
.shots img { width: 100%; display: block; image-rendering: pixelated; } .shots .whole img { image-rendering: auto; height: auto; }
figcaption { font-size: 13px; display: flex; justify-content: space-between; padding: 3px 0; } figcaption b { font-weight: 400; } figcaption span { color: #57606a; }
details { margin: 10px 0; } summary { cursor: pointer; font-size: 13px; } code { font-size: 11px; } .all { font-size: 12px; display: block; overflow-x: auto; }
@media print { body { max-width: none; padding: 0; font-size: 11px; } nav, details { display: none; } h2 { break-after: avoid; } .panel, .shots figure, tr { break-inside: avoid; }
  .panels { grid-template-columns: 1fr 1fr; } .shots { grid-template-columns: repeat(3, 1fr); } * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
</style></head><body>
)";

// Marks of one method light up together. The page says everything without it.
constexpr const char* kScript = R"(<script>
const marks = [...document.querySelectorAll('.p')];
for (const source of document.querySelectorAll('.p, .legend li, tr[data-l]')) {
  const show = isOn => { for (const m of marks) { const same = m.dataset.l === source.dataset.l; m.classList.toggle('on', isOn && same); m.classList.toggle('off', isOn && !same); } };
  for (const name of ['mouseenter', 'focus']) source.addEventListener(name, () => show(true));
  for (const name of ['mouseleave', 'blur']) source.addEventListener(name, () => show(false));
}
</script>
)";

std::string baselineOf(const std::vector<Row>& rows) { return rows.empty() ? "" : rows.front().label; }

// Name, of what a record is a value.
constexpr std::array<const char*, 27> kValues{"solve_us",      "passes",           "texels",
                                              "needed_texels", "limit_texels",     "needed_over_limit",
                                              "max_error",     "mean_error",       "texel_across_edges",
                                              "over_one",      "shadow_triangles", "shadow_ms",
                                              "frame_ms",      "counted",          "edge",
                                              "wrong",         "wrong_near",       "wrong_far",
                                              "wrong_share",   "wrong_per_edge",   "wrong_distance",
                                              "unserved",      "flips_camera",     "flips_light",
                                              "samples_ms",    "repetitions",      "steps"};

}  // namespace

std::string summarySvg(const Records& records) {
  const std::vector<const Json*> sweep = recordsOf(records, kSweep);
  const std::vector<Row> rows = summarise(sweep);
  return svgOf(summaryPlot(rows, Marks(sweep), baselineOf(rows)));
}

std::string summaryTable(const Records& records) {
  std::string out = "| method |", rule = "|---|";
  for (const Column& column : kColumns) {
    out += " " + std::string(column.head) + " |";
    rule += "---|";
  }
  out += "\n" + rule + "\n";
  for (const Row& row : summarise(recordsOf(records, kSweep))) {
    out += "| " + row.label + " |";
    for (const Column& column : kColumns) out += " " + column.cell(row) + " |";
    out += "\n";
  }
  return out;
}

std::string csvOf(const Records& records) {
  std::string out = "study,scene,camera,light,width,height,label,method,partitions,budget_texels,samples";
  for (const char* name : kValues) out += std::string(",") + name;
  out += ",frame_ms_low,frame_ms_high,refused,device,command\n";
  const auto quoted = [](const std::string& cell) {
    std::string doubled;
    for (const char c : cell) doubled += c == '"' ? "\"\"" : std::string(1, c);
    return "\"" + doubled + "\"";
  };
  for (const auto& [_, record] : records) {
    const Json& key = record["key"];
    const auto plain = [&](const char* member) {
      return key[member].is_string() ? quoted(key[member].get<std::string>()) : key[member].dump();
    };
    std::string line;
    for (const char* member : {"study", "scene", "camera", "light", "width", "height", "label"}) line += plain(member) + ",";
    line += quoted(key["method"].dump()) + "," + plain("partitions") + "," + plain("texels") + "," + plain("samples");
    for (const char* name : kValues) {
      const double at = value(key.contains(name) && std::string(name) != "texels" ? key : record, name);
      line += "," + (std::isfinite(at) ? cli::shortest(at) : "");
    }
    for (const std::size_t i : {std::size_t{1}, std::size_t{2}})
      line += "," + (record.contains("frame_ms") ? cli::shortest(record["frame_ms"][i].get<double>()) : "");
    line += "," + (record.contains("refused") ? quoted(record["refused"]) : "") + "," + quoted(record["device"]) + "," +
            quoted(record["command"]);
    out += line + "\n";
  }
  return out;
}

Json jsonOf(const Records& records) {
  const auto rowsJson = [](const std::vector<Row>& rows) {
    Json out = Json::array();
    const auto orNull = [](double v) { return std::isfinite(v) ? Json(v) : Json(nullptr); };
    for (const Row& row : rows)
      out.push_back({{"label", row.label},
                     {"method", row.method},
                     {"views", row.views},
                     {"frame", orNull(row.frame)},
                     {"shadow_passes", orNull(row.shadow)},
                     {"triangles", orNull(row.triangles)},
                     {"wrong", orNull(row.wrong)},
                     {"wrong_near", orNull(row.wrongNear)},
                     {"wrong_share", orNull(row.wrongShare)},
                     {"wrong_distance", orNull(row.distance)},
                     {"mean_error", orNull(row.meanError)},
                     {"max_error", orNull(row.maxError)},
                     {"needed_over_limit", orNull(row.neededOverLimit)},
                     {"passes", row.passes},
                     {"texels", row.texels},
                     {"solve_us", row.solveUs},
                     {"flips_camera", orNull(row.flips)},
                     {"flips_light", orNull(row.flipsLight)},
                     {"unserved", row.unserved}});
    return out;
  };
  Json out;
  out["summary"] = rowsJson(summarise(recordsOf(records, kSweep)));
  out["rank_correlation"] = Json::array();
  for (const Correlation& each : correlations(records))
    out["rank_correlation"].push_back({{"scene", each.scene},
                                       {"texels", each.texels},
                                       {"variants", each.variants},
                                       {"over_visible", std::isfinite(each.overVisible) ? Json(each.overVisible) : Json(nullptr)},
                                       {"across_edges", std::isfinite(each.acrossEdges) ? Json(each.acrossEdges) : Json(nullptr)}});
  out["papers"] = Json::object();
  for (const Claim& claim : claims())
    if (const auto here = recordsOf(records, claim.study); !here.empty()) out["papers"][claim.study] = rowsJson(summarise(here));
  out["records"] = Json::array();
  for (const auto& [_, record] : records) out["records"].push_back(record);
  return out;
}

std::string pageOf(const Records& records, const std::string& folder) {
  const std::vector<const Json*> sweep = recordsOf(records, kSweep);
  const Marks marks(sweep);
  const std::vector<Row> rows = summarise(sweep);
  const std::vector<Json> scenes = valuesOf(sweep, "scene"), budgets = valuesOf(sweep, "group_texels");
  std::string out = kHead;
  out += "<h1>Speed against error</h1>\n<nav aria-label=\"Sections\"><a href=\"#summary\">Summary</a>";
  for (const Json& scene : scenes) out += "<a href=\"#" + escaped(titleOf(scene)) + "\">" + escaped(titleOf(scene)) + "</a>";
  const std::string peers = peersHtml(folder);
  out += "<a href=\"#prediction\">Prediction</a>" + std::string(peers.empty() ? "" : "<a href=\"#peers\">Real systems</a>") +
         "<a href=\"#papers\">The papers</a><a href=\"#how\">How it was measured</a></nav>\n";

  out += "<h2 id=\"summary\">Summary</h2>\n<div class=\"summary\">" + figure(summaryPlot(rows, marks, baselineOf(rows))) + "</div>\n" +
         marks.legend();
  out +=
      "<p>Left and below is better; the line joins what no other beats in both. Geometric means over views and texel budgets, each as a "
      "ratio to " +
      escaped(baselineOf(rows)) + " on the same view at the same texels, drawn in turn.</p>\n";
  out += summaryHtml(rows, marks);

  for (const Json& scene : scenes) {
    const std::vector<const Json*> here = recordsOf(records, kSweep, scene.get<std::string>());
    const std::string title = titleOf(scene);
    out += "<h2 id=\"" + escaped(title) + "\">" + escaped(title) + "</h2>\n<div class=\"panels\">\n";
    out += figure({.title = "Frame time against wrong pixels",
                   .xLabel = "frame, ms",
                   .yLabel = "wrong, % of the pixels that face the light",
                   .points = pointsOf(here, marks, "frame_ms", "wrong_share", 100.0)});
    out += figure({.title = "Predicted against measured",
                   .xLabel = "predicted mean error, pixels",
                   .yLabel = "wrong pixels within one of a true edge",
                   .points = pointsOf(here, marks, "mean_error", "wrong_near"),
                   .front = false});
    out += figure({.title = "Texels against needed / limit",
                   .xLabel = "texels allocated",
                   .yLabel = "needed / limit",
                   .points = pointsOf(here, marks, "texels", "needed_over_limit")});
    out += figure({.title = "Passes against needed / limit",
                   .xLabel = "passes",
                   .yLabel = "needed / limit",
                   .points = pointsOf(here, marks, "passes", "needed_over_limit")});
    out += "</div>\n";
    const double budget = budgets[budgets.size() / 2].get<double>();
    const std::vector<const Json*> middle = recordsOf(records, kSweep, scene.get<std::string>(), budget);
    if (const std::string pictures = picturesHtml(middle, marks, folder); !pictures.empty())
      out += "<p>" + texelText(budget) +
             ". Above: a colour for each partition, lines along texel borders. Below: red is falsely shadowed, blue falsely lit.</p>\n" +
             pictures;
    out += tableOfAll(here);
  }

  out += "<h2 id=\"prediction\">Does the prediction rank methods?</h2>\n" + correlationHtml(correlations(records));
  out += peers;
  out +=
      "<h2 id=\"papers\">The papers' claims, measured</h2>\n<p>Frame times are ratios to the first row of each table; the numbers are "
      "means over the scenes.</p>\n" +
      claimsHtml(records);

  std::string devices;
  for (const auto& [_, record] : records)
    if (const auto device = record["device"].get<std::string>(); devices.find(device) == std::string::npos)
      devices += (devices.empty() ? "" : "; ") + device;
  std::string refused;
  for (const auto& [_, record] : records)
    if (record.contains("refused"))
      refused += "<li>" +
                 escaped(record["key"]["label"].get<std::string>() + ", " + titleOf(record["key"]["scene"]) + ": " +
                         record["refused"].get<std::string>()) +
                 "</li>";
  out += "<h2 id=\"how\">How it was measured</h2>\n<p>Drawn on " + escaped(devices) +
         "; times are of a rasteriser on the processor unless that names a GPU: compare them with each other only. A time is the median of "
         "the repetitions, "
         "in which all methods of a view are drawn in turn; quartiles are in the tables. Wrong: the map's answer is not the ray-traced "
         "one, among "
         "pixels that face the light. Near: within one pixel of a true shadow edge. Predicted: the wider edge of the texel that serves a "
         "point over a pixel's width, mean "
         "over visible points. Needed / limit: texels for error 1 everywhere over the least that any map could do with. Flips: pixels "
         "whose answer changes from one step of a path to the next "
         "although the truth does not; the points are held, the maps follow the camera or the light. Methods that are told what the view "
         "samples (SDSM) get range, histogram and bounds of the "
         "very view.</p>\n";
  if (!refused.empty()) out += "<p>Refused:</p><ul>" + refused + "</ul>\n";
  return out + kScript + "</body></html>\n";
}

}  // namespace gnomon::report
