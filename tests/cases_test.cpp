// The tool and an independent judge on outside cases, where GNOMON_EXTRA_DATA names a folder that holds cases/ and tools/judge.py.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

const fs::path kData = GNOMON_EXTRA_DATA;

class Cases : public ::testing::Test {
 protected:
  void SetUp() override {
    if (kData.empty() || !fs::exists(kData / "cases") || !fs::exists(kData / "tools/judge.py"))
      GTEST_SKIP() << "GNOMON_EXTRA_DATA has no cases and judge";
    if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) GTEST_SKIP() << "python3-numpy is missing";
    for (const auto& entry : fs::directory_iterator(kData / "cases"))
      if (entry.path().extension() == ".json") cases_.push_back(entry.path());
    ASSERT_FALSE(cases_.empty());
  }

  struct Answer {
    Json input, result, verdict;
  };

  // What a view may sample: neither the nearest nor the farthest depths, with gaps.
  static Json samplesOf(const Json& camera) {
    const double far = camera.contains("shadow_distance") ? camera["shadow_distance"].get<double>() : camera["far"].get<double>();
    Json samples = {{"near", camera["near"].get<double>() * 2.5}, {"far", far * 0.7}, {"histogram", Json::array()}};
    for (const auto& [bins, amount] : {std::pair(9, 4), {5, 0}, {14, 9}, {2, 0}, {1, 2}, {3, 0}, {8, 5}})
      for (int i = 0; i < bins; ++i) samples["histogram"].push_back(amount);
    return samples;
  }

  // partitions: allowed instead of the case's own number, or 0.
  [[nodiscard]] Answer solve(const fs::path& path, const std::string& settings, int partitions, bool isSampled) const {
    const std::string stem =
        ::testing::TempDir() + "gnomon_" + std::to_string(getpid()) + "_" + path.stem().string();  // tests run side by side
    Json input = Json::parse(std::ifstream(path));
    if (partitions > 0) input["budget"]["partitions"] = partitions;
    if (isSampled) input["samples"] = samplesOf(input["camera"]);
    std::ofstream(stem + ".case") << input;
    const std::string command = std::string(GNOMON_TOOL) + " solve " + stem + ".case " + settings + " > " + stem +
                                ".json && /usr/bin/python3 " + (kData / "tools/judge.py").string() + " " + stem + ".case " + stem +
                                ".json > " + stem + ".verdict";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return {std::move(input), Json::parse(std::ifstream(stem + ".json")), Json::parse(std::ifstream(stem + ".verdict"))};
  }

  // Zero uncovered, no rule broken, predictions never below the judge's and at most `above` over them. Returns the geometric
  // mean of needed / limit over the views of four maps without a scene, or over all without one where partitions are given.
  [[nodiscard]] double judge(const std::string& settings, double above, double aboveWithScene, int partitions = 0,
                             bool isSampled = false) const {
    double logs = 0.0;
    int count = 0;
    for (const fs::path& path : cases_) {
      const Answer answer = solve(path, settings, partitions, isSampled);
      const bool hasScene = answer.input.contains("scene");
      EXPECT_EQ(answer.verdict["uncovered"], 0) << path;
      EXPECT_TRUE(answer.verdict["violations"].empty()) << path << answer.verdict["violations"];
      const Json& per = answer.verdict["per_partition"];
      for (std::size_t i = 0; i < per.size(); ++i) {
        if (per[i]["points"] == 0) continue;
        for (const char* which : {"s", "t", "extent"}) {
          const double ratio =
              answer.result["partitions"][i]["error"][which].get<double>() / per[i]["max_" + std::string(which)].get<double>();
          EXPECT_GE(ratio, 1.0) << path << " " << i << which;
          EXPECT_LE(ratio, 1.0 + (hasScene ? aboveWithScene : above)) << path << " " << i << which;
        }
      }
      if (hasScene || (partitions == 0 && answer.input["budget"]["partitions"] != 4)) continue;
      logs += std::log(answer.verdict["needed_over_limit"].get<double>());
      ++count;
    }
    return count > 0 ? std::exp(logs / count) : 0.0;
  }

  std::vector<fs::path> cases_;
};

const std::string kPssm = "--method pssm --set split=logarithmic --set fit=", kLloyd = "--method lloyd --set scheme=";

TEST_F(Cases, TightIsCoveredPredictedAndNearTheBestRectangles) {
  const double needed = judge(kPssm + "tight", 1e-5, 0.15);
  RecordProperty("needed_over_limit", std::to_string(needed));
  EXPECT_LE(needed, 5.1);  // the best rectangles reach 5.01
}

TEST_F(Cases, SliceIsCoveredAndPredicted) { EXPECT_GT(judge(kPssm + "slice", 1e-5, 0.15), 1.0); }

// Stable maps hold whole slices, so a scene's prediction may lie above what its receivers see.
TEST_F(Cases, StableIsCoveredAndCostsAtMostTwenty) { EXPECT_LE(judge(kPssm + "stable", 1e-5, 0.15), 20.0); }

// Warps: the certificate bounds the inside of a slice too, which the judge samples; it may lie a few per cent above.
TEST_F(Cases, WarpedSlices) { EXPECT_LE(judge(kLloyd + "zp+w", 0.05, 0.15), 5.0); }
// Of a scene the judge sees few points in each face, so its maxima say little from above.
TEST_F(Cases, WarpedFaces) { EXPECT_GT(judge(kLloyd + "fp+zp+w", 0.08, 1e9, 9), 1.0); }
TEST_F(Cases, BestOfFour) { EXPECT_LE(judge(kLloyd + "best --set warp=least", 0.05, 0.15), 4.7); }  // numerical optimum 4.62
// Of a scene the judge sees few points in each row, as in each face. Slices' numerical optimum is 2.93; rows reach below.
TEST_F(Cases, BestOfEight) { EXPECT_LE(judge(kLloyd + "best --set warp=least", 0.05, 1e9, 8), 2.9); }
TEST_F(Cases, FittedRows) { EXPECT_GT(judge("--method lspsm", 1e-5, 1e9, 8), 1.0); }
// Slices' numerical optimum is 2.93; rows reach below.
TEST_F(Cases, AutoOfEight) { EXPECT_LE(judge("--method auto", 0.05, 1e9, 8), 3.0); }

// By the judge: covered, within the budget, and the target met wherever it is said to be.
TEST_F(Cases, AutoMeetsItsTarget) {
  int met = 0;
  for (const fs::path& path : cases_)
    for (const double target : {1.0, 4.0, 20.0}) {
      const Answer answer = solve(path, "--method auto --set budget.target_error=" + std::to_string(target), 0, false);
      EXPECT_EQ(answer.verdict["uncovered"], 0) << path;
      EXPECT_TRUE(answer.verdict["violations"].empty()) << path << answer.verdict["violations"];
      if (!answer.result["warnings"].empty()) continue;
      ++met;
      EXPECT_LE(answer.verdict["max"].get<double>(), 1.01 * target) << path;
    }
  EXPECT_GT(met, 10);
}
TEST_F(Cases, RowsByError) { EXPECT_LE(judge("--method lspsm --set rows=error --set warp=least", 0.05, 1e9, 8), 2.9); }

// The judge sees few points of what is sampled in each slice.
TEST_F(Cases, SlicesBySamples) {
  for (const std::string scheme : {"logarithmic", "kmeans", "adaptive", "optimal --set norm=mean --set quantise=true"})
    EXPECT_GT(judge("--method sdsm --set scheme=" + scheme, 1e9, 1e9, 0, true), 0.0) << scheme;
}

}  // namespace
