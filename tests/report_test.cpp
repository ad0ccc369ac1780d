// The report: its statistics against worked examples, and the command as a user runs it: resumed, cut into shards, merged, read in a browser.
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

#include "claims.h"
#include "page.h"
#include "plan.h"
#include "plot.h"
#include "profile.h"
#include "summary.h"

namespace gnomon::report {
namespace {

namespace fs = std::filesystem;
using cli::Json;

TEST(Report, SpearmanIsThatOfItsFormula) {
  // Squared differences of rank: 4, 9, 0, 0, 25, 49, 9, 36, 49, 1.
  EXPECT_NEAR(spearman({7, 4, 3, 10, 6, 2, 9, 8, 1, 5}, {5, 7, 3, 10, 1, 9, 6, 2, 8, 4}), 1.0 - 6.0 * 182.0 / 990.0, 1e-12);
  EXPECT_NEAR(spearman({1, 2, 3, 4}, {10, 100, 1000, 1e6}), 1.0, 1e-12);
  EXPECT_NEAR(spearman({1, 2, 3, 4}, {4, 3, 2, 1}), -1.0, 1e-12);
  // Ties share a rank: 1, 2.5, 2.5, 4 against 1 to 4 is 4.5 / sqrt(4.5 * 5).
  EXPECT_NEAR(spearman({1, 2, 2, 3}, {1, 2, 3, 4}), std::sqrt(0.9), 1e-12);
  EXPECT_TRUE(std::isnan(spearman({1, 2}, {1, 2})));
  EXPECT_TRUE(std::isnan(spearman({1, 1, 1}, {1, 2, 3})));
}

TEST(Report, WeightsAreThoseTheTimesWereMadeOf) {
  std::vector<Timing> timings;
  for (const double passes : {1.0, 4.0})
    for (const double texels : {1e4, 1e6}) timings.push_back({passes, texels, 3000.0 * passes + 0.02 * texels});
  EXPECT_NEAR(fitWeights(timings).pass, 3000.0, 1e-6);
  EXPECT_NEAR(fitWeights(timings).texel, 0.02, 1e-12);
  // Eight times the passes in half the time: none is given to passes; a texel alone takes (1/2 + 1) / (1/4 + 1).
  const Weights border = fitWeights({{1.0, 1.0, 2.0}, {8.0, 1.0, 1.0}});
  EXPECT_EQ(border.pass, 0.0);
  EXPECT_NEAR(border.texel, 1.2, 1e-12);
  EXPECT_EQ(fitWeights({}).pass, 0.0);
}

TEST(Report, FrontHoldsWhatNothingBeats) {
  const auto at = [](double x, double y) { return Point{.x = x, .y = y, .label = {}, .title = {}}; };
  EXPECT_EQ(paretoFront({at(2, 2), at(1, 3), at(3, 1), at(2.5, 2), at(1, 4), at(3, 3)}), (std::vector<std::size_t>{1, 0, 2}));
  EXPECT_EQ(paretoFront({at(1, 1), at(1, 1)}).size(), 1u);
  EXPECT_TRUE(paretoFront({}).empty());
}

TEST(Report, PlotsLeaveOutWhatALogarithmCannotShow) {
  Plot plot{.title = "a & b", .xLabel = "x", .yLabel = "y", .points = {}};
  const auto marks = [&] {
    const std::string svg = svgOf(plot);
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_NE(svg.find("a &amp; b"), std::string::npos);
    std::size_t count = 0;
    for (std::size_t i = svg.find("class=\"p\""); i != std::string::npos; i = svg.find("class=\"p\"", i + 1)) ++count;
    return count;
  };
  EXPECT_EQ(marks(), 0u);
  for (const double y : {1.0, 0.0, -1.0, std::nan(""), 5.0}) plot.points.push_back({.x = 1.0, .y = y, .label = "p", .title = "<p>"});
  EXPECT_EQ(marks(), 2u);
}

TEST(Report, StudiesAskOnlyForMethodsThereAre) {
  std::set<std::string> known;
  for (const cli::Method& method : cli::methods()) known.insert(method.name);
  for (const bool quick : {false, true})
    for (const Study& study : studies({}, quick)) {
      std::set<std::string> labels;
      for (const Variant& variant : study.variants) {
        EXPECT_TRUE(known.contains(variant.method));
        EXPECT_TRUE(labels.insert(variant.label).second) << study.name << ": " << variant.label << " twice";
      }
    }
  const std::vector<Study> one = studies({"pssm"}, false);
  ASSERT_FALSE(one.empty());
  for (const Variant& variant : one[0].variants) EXPECT_EQ(variant.method, "pssm");
  EXPECT_TRUE(studies({"pssm", "sdsm"}, true).size() == 1);
  // What a paper printed stands beside a variant that is measured.
  const std::vector<Study> all = studies({}, false);
  for (const Claim& claim : claims()) {
    const auto study = std::find_if(all.begin(), all.end(), [&](const Study& each) { return each.name == claim.study; });
    ASSERT_NE(study, all.end()) << claim.study;
    for (const auto& [label, printed] : claim.paper)
      EXPECT_TRUE(std::any_of(study->variants.begin(), study->variants.end(), [&](const Variant& v) { return v.label == label; })) << label;
  }
}

// A record of one variant of a made-up study.
Json record(const std::string& label, int order, const std::string& camera, double frame, double wrong, double mean) {
  Json out;
  out["key"] = {{"study", kSweep}, {"scene", "s"},     {"camera", camera},       {"light", "l"},
                {"label", label},  {"texels", 1024.0}, {"group_texels", 1024.0}, {"method", {{"name", "pssm"}}}};
  out["order"] = order;
  out["frame_ms"] = {frame, frame, frame};
  out["shadow_ms"] = {1.0, 1.0, 1.0};
  out["wrong"] = out["wrong_near"] = wrong;
  out["mean_error"] = out["texel_across_edges"] = out["max_error"] = mean;
  for (const char* rest : {"shadow_triangles", "needed_over_limit", "wrong_share", "passes", "texels", "solve_us", "flips_camera",
                           "flips_light", "unserved", "wrong_distance"})
    out[rest] = 1.0;
  return out;
}

TEST(Report, RatiosAreTakenWithinOneGroup) {
  Records records;
  for (const Json& each :
       {record("base", 0, "a", 10.0, 99.5, 1.0), record("other", 1, "a", 20.0, 49.5, 2.0), record("base", 0, "b", 1000.0, 0.5, 1.0),
        record("other", 1, "b", 500.0, 3.5, 8.0), record("third", 2, "b", 1000.0, 0.5, 1.0)})
    records[keyText(each)] = each;
  const std::vector<Row> rows = summarise(recordsOf(records, kSweep));
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_NEAR(rows[1].frame, 1.0, 1e-12);  // 2 and 1/2
  EXPECT_NEAR(rows[1].wrong, std::sqrt(0.5 * 4.0), 1e-12);  // 50/100 and 4/1
  EXPECT_NEAR(rows[1].meanError, 4.0, 1e-12);
  EXPECT_EQ(rows[2].views, 1);
  // "third" was not measured in every view: two variants are left, too few to rank.
  ASSERT_EQ(correlations(records).size(), 1u);
  EXPECT_EQ(correlations(records)[0].variants, 2);
}

class ReportRun : public testing::Test {
 protected:
  void SetUp() override {
    m_folder = fs::path(testing::TempDir()) / ("gnomon-report-" + std::to_string(getpid()));
    fs::create_directories(m_folder);
  }
  void TearDown() override { fs::remove_all(m_folder); }

  // Returns the exit code; what was said is in m_folder / "said".
  int shell(const std::string& command) const {
    const int status = std::system(("cd '" + m_folder.string() + "' && (" + command + ") >said 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string read(const std::string& name) const {
    std::ifstream file(m_folder / name, std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }
  fs::path m_folder;
};

TEST_F(ReportRun, ResumesMergesAndReadsInABrowser) {
  const std::string tool = std::string("'") + GNOMON_TOOL + "' report --quick --methods single,lloyd ";
  ASSERT_EQ(shell(tool + "--scenes hall,city --shard 1/2 --out a"), 0) << read("said");
  ASSERT_EQ(shell(tool + "--scenes hall,city --shard 2/2 --out b"), 0) << read("said");
  ASSERT_EQ(shell(std::string("'") + GNOMON_TOOL + "' report --merge a b --out c"), 0) << read("said");
  EXPECT_EQ(shell(tool + "--shard 3/2 --out a"), 2);
  EXPECT_EQ(shell(tool + "--scenes nowhere.glb --out a"), 2);
  EXPECT_EQ(shell(std::string("'") + GNOMON_TOOL + "' report --merge nowhere --out c"), 2);

  // Interrupted: the last line cut off. Only what is missing is measured again, and the rest stays to the byte.
  const std::string lines = read("a/jobs.jsonl");
  const std::size_t cut = lines.rfind("{\"key\"") + 40;
  std::ofstream(m_folder / "a/jobs.jsonl") << lines.substr(0, cut);
  ASSERT_EQ(shell(tool + "--scenes hall,city --shard 1/2 --out a"), 0);
  EXPECT_EQ(read("said").find("already there"), std::string::npos);
  ASSERT_EQ(shell(tool + "--scenes hall,city --shard 1/2 --out a"), 0);
  EXPECT_NE(read("said").find("already there"), std::string::npos);
  std::ofstream(m_folder / "a/program.txt") << "another\n";  // and all of it after a change of the program
  ASSERT_EQ(shell(tool + "--scenes hall,city --shard 1/2 --out a"), 0);
  EXPECT_NE(read("said").find("starting over"), std::string::npos);
  EXPECT_EQ(read("said").find("already there"), std::string::npos);
  ASSERT_EQ(shell(std::string("'") + GNOMON_TOOL + "' report --merge a --out d"), 0) << read("said");
  EXPECT_EQ(Json::parse(read("d/report.json"))["records"].size(), static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n')));
  EXPECT_EQ(shell(tool + "--methods lloyd,nosuch --out a"), 2);

  const Json json = Json::parse(read("c/report.json"));
  EXPECT_EQ(json["rank_correlation"].size(), 2u);  // a scene from each shard
  ASSERT_FALSE(json["records"].empty());
  std::istringstream csv(read("c/report.csv"));
  std::size_t rows = 0;
  for (std::string line; std::getline(csv, line);) ++rows;
  EXPECT_EQ(rows, json["records"].size() + 1);
  for (const Json& each : json["records"]) {
    EXPECT_EQ(each["unserved"], 0) << each["key"];
    EXPECT_EQ(each["wrong"], each["wrong_near"].get<int>() + each["wrong_far"].get<int>());
    EXPECT_GE(each["frame_ms"][0], each["shadow_ms"][0]);
  }

  // The command of a point draws the same picture.
  const Json& point = json["records"][0];
  std::string command = point["command"];
  command.replace(0, 6, std::string("'") + GNOMON_TOOL + "'");
  command.replace(command.rfind("DIR"), 3, "again");
  ASSERT_EQ(shell("cd c && " + command), 0) << read("said");
  EXPECT_NE(read("said").find(std::to_string(point["wrong_near"].get<int>()) + " within a pixel of a true edge, " +
                              std::to_string(point["wrong_far"].get<int>())),
            std::string::npos)
      << read("said");

  // What the page holds, as a browser without a network sees it.
  if (std::system("command -v chromium >/dev/null 2>&1") != 0) GTEST_SKIP() << "no chromium: the page was written, not read";
  std::string page = read("c/report.html");
  const std::string check = R"(<script>addEventListener('load', () => {
    const said = [], plots = [...document.querySelectorAll('.panel svg')], seen = e => e.getBoundingClientRect().width > 2 && e.getBoundingClientRect().height > 2;
    if (plots.length < 9) said.push('plots: ' + plots.length);
    for (const plot of plots) if (plot.querySelectorAll('.p').length < 2 || ![...plot.querySelectorAll('.p')].every(seen)) said.push('empty: ' + plot.getAttribute('aria-label'));
    for (const p of document.querySelectorAll('.p')) if (!p.getAttribute('aria-label') || !p.querySelector('title')) said.push('a point without a name');
    for (const img of document.images) if (!img.naturalWidth || !img.alt) said.push('picture: ' + img.alt);
    if (document.images.length < 6) said.push('pictures: ' + document.images.length);
    for (const text of document.querySelectorAll('svg .l')) { const t = text.getBoundingClientRect(), f = text.ownerSVGElement.getBoundingClientRect();
      if (t.left < f.left || t.right > f.right + 1) said.push('cut off: ' + text.textContent); }
    const first = document.querySelector('.p'); first.focus(); if (document.activeElement !== first) said.push('no focus');
    if (!document.querySelector('.p.off')) said.push('focus lights nothing up');
    if (performance.getEntriesByType('resource').some(e => !e.name.startsWith('data:'))) said.push('it fetches something');
    document.title = 'checked: ' + (said.join('; ') || 'fine');
  });</script>)";
  page.insert(page.find("</body>"), check);
  std::ofstream(m_folder / "checked.html", std::ios::binary) << page;
  const std::string chromium =
      "timeout 60 chromium --headless --no-sandbox --disable-gpu --disable-background-networking --user-data-dir=profile ";
  ASSERT_EQ(shell(chromium + "--dump-dom file://\"$PWD\"/checked.html"), 0) << read("said");
  const std::string said = read("said");
  const std::size_t title = said.find("checked: ");
  ASSERT_NE(title, std::string::npos);
  EXPECT_EQ(said.substr(title, said.find('<', title) - title), "checked: fine");
  ASSERT_EQ(shell(chromium + "--window-size=1240,1800 --screenshot=page.png file://\"$PWD\"/c/report.html"), 0) << read("said");
  EXPECT_GT(fs::file_size(m_folder / "page.png"), 50000u);
  ASSERT_EQ(shell(chromium + "--print-to-pdf=page.pdf file://\"$PWD\"/c/report.html"), 0) << read("said");
  EXPECT_GT(fs::file_size(m_folder / "page.pdf"), 50000u);
}

}  // namespace
}  // namespace gnomon::report
