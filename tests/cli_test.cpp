// The tool as a user runs it: what it refuses and in which words, what it answers, and that its options do what they say.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "gnomon/gnomon.h"
#include "result.h"

namespace gnomon::test {
namespace {

namespace fs = std::filesystem;
using cli::Json;

struct Output {
  int code = -1;
  std::string out, err;
};

std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string quoted(const std::string& word) {
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// A folder of this test's own: tests run side by side.
class Cli : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    m_folder = fs::path(testing::TempDir()) / ("gnomon-cli-" + std::string(info->name()) + "-" + std::to_string(getpid()));
    fs::create_directories(m_folder);
  }
  void TearDown() override { fs::remove_all(m_folder); }

  Output run(const std::vector<std::string>& words, const std::string& standardInput = "") const {
    std::ofstream(m_folder / "in", std::ios::binary) << standardInput;
    std::string command = quoted(GNOMON_TOOL);
    for (const std::string& word : words) command += " " + quoted(word);
    command += " <" + quoted(m_folder / "in") + " >" + quoted(m_folder / "out") + " 2>" + quoted(m_folder / "err");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(m_folder / "out"), slurp(m_folder / "err")};
  }
  Output solveText(const std::string& text, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"solve", "-"});
    return run(more, text);
  }
  Json answer(const Json& input, const std::vector<std::string>& more = {}) const {
    const Output output = solveText(input.dump(), more);
    EXPECT_EQ(output.code, 0) << output.err;
    EXPECT_EQ(output.err, "");
    return Json::parse(output.out, nullptr, false);
  }
  // Refused: exit 2, one line that starts with the tool's name, nothing on standard output. Returns the line.
  static std::string refusal(const Output& output, const std::string& what = "") {
    EXPECT_EQ(output.code, 2) << what << "\n" << output.err;
    EXPECT_EQ(output.out, "") << what;
    EXPECT_EQ(output.err.rfind("gnomon: ", 0), 0u) << what << "\n" << output.err;
    EXPECT_EQ(std::count(output.err.begin(), output.err.end(), '\n'), 1) << what << "\n" << output.err;
    return output.err.substr(0, output.err.find('\n'));
  }
  const fs::path& folder() const { return m_folder; }

 private:
  fs::path m_folder;
};

// A usual case with every part that a refusal may need; a horizontal view, so that nothing is on a special axis by chance.
Json usual() {
  return Json::parse(R"({
    "id": "usual",
    "camera": {"position": [1, 2, 3], "forward": [0.3, -0.2, 1], "up": [0, 1, 0], "near": 0.1, "far": 100, "fov_y": 1.0, "aspect": 1.7777777777777777},
    "light": {"type": "directional", "direction": [0.3, -0.8, 0.2]},
    "image": {"width": 1280, "height": 720},
    "budget": {"partitions": 4, "resolution": 1024},
    "method": {"name": "pssm"}
  })");
}

using Edits = std::vector<std::pair<std::string, Json>>;  // JSON pointer and new value; a discarded value removes the field

const Json kAway(Json::value_t::discarded);

Json edited(const Edits& edits) {
  Json out = usual();
  for (const auto& [pointer, value] : edits) {
    const Json::json_pointer at(pointer);
    if (value.is_discarded())
      out.at(at.parent_pointer()).erase(at.back());
    else
      out[at] = value;
  }
  return out;
}

Json list(std::initializer_list<double> numbers) { return Json(std::vector<double>(numbers)); }

// A box {"min":..,"max":..}.
Json box(std::initializer_list<double> least, std::initializer_list<double> greatest) {
  return Json{{"min", list(least)}, {"max", list(greatest)}};
}

// A list of one: braces around a Json would copy it instead.
Json only(Json element) {
  Json out = Json::array();
  out.push_back(std::move(element));
  return out;
}

const Json kCube = {list({0, 0, 0}), list({1, 0, 0}), list({0, 1, 0}), list({1, 1, 0}),
                    list({0, 0, 1}), list({1, 0, 1}), list({0, 1, 1}), list({1, 1, 1})};
const Json kIdentity = list({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});

// OpenGL's perspective matrix, row by row, 90 degrees square, near 1, far 3.
const Json kProjection = list({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -2, -3, 0, 0, -1, 0});

Json matrixCamera(const Json& view, const Json& projection) { return Json{{"view", view}, {"projection_matrix", projection}}; }

// ---- Refusals ----

struct StatusRow {
  Status status;
  Edits edits;
  std::vector<std::string> options;
  std::string field, got;
};

// One way to each refusal of the library; the tool must repeat the library's rule, name the field and say what it was given.
Json rectangle(double near, double far, const std::vector<double>& least, const std::vector<double>& most) {
  return Json{{"near", near}, {"far", far}, {"min", least}, {"max", most}};
}

std::vector<StatusRow> statusRows() {
  return {
      {Status::cameraForward, {{"/camera/forward", list({0, 0, 0})}}, {}, "camera.forward", "[0,0,0]"},
      {Status::cameraUp, {{"/camera/up", list({0, 0, 0})}}, {}, "camera.up", "[0,0,0]"},
      {Status::cameraUp, {{"/camera/up", list({0.6, -0.4, 2})}}, {}, "camera.up", "[0.6,-0.4,2]"},
      {Status::cameraNear, {{"/camera/near", 0}}, {}, "camera.near", "0"},
      {Status::cameraNear, {{"/camera/near", -0.5}}, {}, "camera.near", "-0.5"},
      {Status::cameraNear, {{"/camera/near", "near"}}, {}, "camera.near", "\"near\""},
      {Status::cameraNear, {{"/camera/near", nullptr}}, {}, "camera.near", "null"},
      {Status::cameraNear, {{"/camera/near", kAway}}, {}, "camera.near", "nothing"},
      {Status::cameraFar, {{"/camera/far", 0.1}}, {}, "camera.far", "0.1"},
      {Status::cameraInfiniteFar, {{"/camera/far", "infinite"}}, {}, "camera.far", "infinite"},
      {Status::cameraShadowDistance, {{"/camera/shadow_distance", true}}, {}, "camera.shadow_distance", "true"},
      {Status::cameraFovY, {{"/camera/fov_y", 0}}, {}, "camera.fov_y", "0"},
      {Status::cameraFovY, {{"/camera/fov_y", 3.15}}, {}, "camera.fov_y", "3.15"},
      {Status::cameraFovY, {{"/camera/fov_y", kAway}}, {}, "camera.fov_y", "nothing"},
      {Status::cameraAspect, {{"/camera/aspect", -1}}, {}, "camera.aspect", "-1"},
      {Status::cameraAspect, {{"/camera/aspect", kAway}}, {}, "camera.aspect", "nothing"},
      {Status::cameraHeight,
       {{"/camera/projection", "orthographic"}, {"/camera/fov_y", kAway}, {"/camera/height", 0}},
       {},
       "camera.height",
       "0"},
      {Status::cameraTangents,
       {{"/camera/fov_y", kAway}, {"/camera/aspect", kAway}, {"/camera/tangents", list({1, -1, 1, 1})}},
       {},
       "camera.tangents",
       "[1,-1,1,1]"},
      {Status::cameraViewMatrix,
       {{"/camera", matrixCamera(list({2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1}), kProjection)}},
       {},
       "camera.view",
       "[2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1]"},
      {Status::cameraProjectionMatrix,
       {{"/camera", matrixCamera(kIdentity, list({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}))}},
       {},
       "camera.projection_matrix",
       "[0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]"},
      {Status::corners, {{"/corners", {list({0, 0, 0}), list({1, 0, 0})}}}, {}, "corners", "[[0,0,0],[1,0,0]]"},
      {Status::lightDirection, {{"/light/direction", list({0, 0, 0})}}, {}, "light.direction", "[0,0,0]"},
      {Status::receiverBox,
       {{"/scene/receivers", {box({0, 0, 0}, {1, 1, 1}), box({0, 2, 0}, {1, 1, 1})}}},
       {},
       "scene.receivers[1]",
       R"({"min":[0,2,0],"max":[1,1,1]})"},
      {Status::casterBox,
       {{"/scene/casters", only(box({5, 0, 0}, {1, 1, 1}))}},
       {},
       "scene.casters[0]",
       R"({"min":[5,0,0],"max":[1,1,1]})"},
      {Status::halfSpace, {{"/scene/planes", {list({0, 1, 0, 0}), list({0, 0, 0, 1})}}}, {}, "scene.planes[1]", "[0,0,0,1]"},
      {Status::marginFilter, {{"/margin/filter", -1}}, {}, "margin.filter", "-1"},
      {Status::marginNormalOffset, {{"/margin/normal_offset", -0.25}}, {}, "margin.normal_offset", "-0.25"},
      {Status::marginBlend, {{"/margin/blend", 1}}, {}, "margin.blend", "1"},
      {Status::marginBorder, {{"/margin/border", 1025}}, {}, "margin.border", "1025"},
      {Status::marginBorder, {{"/margin/border", 1.5}}, {}, "margin.border", "1.5"},
      {Status::marginMotion, {{"/margin/motion", list({1, -2})}}, {}, "margin.motion", "[1,-2]"},
      {Status::marginTexels, {{"/margin/filter", 5000}}, {}, "margin", R"({"filter":5000})"},
      {Status::fade, {{"/fade", 1.25}}, {}, "fade", "1.25"},
      {Status::budgetPartitions, {{"/budget/partitions", 0}}, {}, "budget.partitions", "0"},
      {Status::budgetPartitions, {{"/budget/partitions", 17}}, {}, "budget.partitions", "17"},
      {Status::budgetPartitions, {{"/budget/partitions", 2.5}}, {}, "budget.partitions", "2.5"},
      {Status::budgetPartitions, {{"/budget/partitions", 1e10}}, {}, "budget.partitions", "1e+10"},
      {Status::budgetResolution, {{"/budget/resolution", 0}}, {}, "budget.resolution", "0"},
      {Status::budgetResolution, {{"/budget/resolution", 20000}}, {}, "budget.resolution", "20000"},
      {Status::budgetResolution, {{"/budget/resolution", 0.5}}, {}, "budget.resolution", "0.5"},
      {Status::budgetTexels, {{"/budget/texels", 3}}, {}, "budget.texels", "3"},
      {Status::budgetTexels, {{"/budget/texels", 0}}, {}, "budget.texels", "0"},
      {Status::budgetAtlas, {{"/budget/atlas", list({1, 1})}}, {}, "budget.atlas", "[1,1]"},
      {Status::budgetAtlas, {{"/budget/atlas", list({4096, 0})}}, {}, "budget.atlas[1]", "0"},
      {Status::budgetAtlas, {{"/budget/atlas", list({4096.5, 4096})}}, {}, "budget.atlas[0]", "4096.5"},
      {Status::budgetTargetError, {{"/budget/target_error", 0}}, {}, "budget.target_error", "0"},
      {Status::splitLambda, {{"/method", {{"name", "pssm"}, {"split", "practical"}, {"lambda", 1.5}}}}, {}, "method.lambda", "1.5"},
      {Status::splitBias, {{"/method", {{"name", "pssm"}, {"split", "practical"}, {"bias", -1}}}}, {}, "method.bias", "-1"},
      {Status::splitBiasOrder, {{"/method", {{"name", "pssm"}, {"split", "practical"}, {"bias", 5000}}}}, {}, "method.bias", "5000"},
      {Status::splitExplicit,
       {{"/method", {{"name", "pssm"}, {"split", "explicit"}, {"splits", list({5, 5})}}}},
       {},
       "method.splits[1]",
       "5"},
      {Status::splitExplicit,
       {{"/method", {{"name", "pssm"}, {"split", "explicit"}, {"splits", list({1, 2, 3, 4})}}}},
       {},
       "method.splits[3]",
       "4"},
      {Status::splitCount, {{"/method", {{"name", "pssm"}, {"count", 5}}}}, {}, "method.count", "5"},
      {Status::stableAutomatic, {{"/method", {{"name", "pssm"}, {"fit", "stable"}, {"count", "automatic"}}}}, {}, "method.fit", "stable"},
      {Status::stableCorners, {{"/method", {{"name", "pssm"}, {"fit", "stable"}}}, {"/corners", kCube}}, {}, "method.fit", "stable"},
      {Status::stableWorldSpace,
       {{"/method", {{"name", "pssm"}, {"fit", "stable"}}}, {"/camera/position", list({1e9, 0, 0})}},
       {"--world"},
       "method.fit",
       "stable"},
      {Status::warpEta, {{"/method", {{"name", "lloyd"}, {"eta", 1.5}}}}, {}, "method.eta", "1.5"},
      {Status::rowsZeta, {{"/method", {{"name", "lspsm"}, {"zeta", 0.5}}}}, {}, "method.zeta", "0.5"},
      {Status::rowsSigma, {{"/method", {{"name", "lspsm"}, {"sigma", 0}}}}, {}, "method.sigma", "0"},
      {Status::rowsMaxRows, {{"/method", {{"name", "lspsm"}, {"max_rows", 17}}}}, {}, "method.max_rows", "17"},
      {Status::rowsMaxColumns, {{"/method", {{"name", "lspsm"}, {"max_columns", 0}}}}, {}, "method.max_columns", "0"},
      {Status::rowsReach, {{"/method", {{"name", "lspsm"}, {"rows", "paper"}, {"max_rows", 1}}}}, {}, "method.rows", "paper"},
      {Status::samplesMissing, {{"/method", {{"name", "sdsm"}}}}, {}, "samples", "nothing"},
      {Status::samplesNear, {{"/samples", {{"near", 0}, {"far", 2}, {"histogram", list({1})}}}}, {}, "samples.near", "0"},
      {Status::samplesNear, {{"/samples", {{"far", 2}}}}, {}, "samples.near", "nothing"},
      {Status::samplesFar, {{"/samples", {{"near", 3}, {"far", 2}}}}, {}, "samples.far", "2"},
      {Status::samplesHistogram, {{"/samples", {{"near", 1}, {"far", 2}, {"histogram", list({1, -2})}}}}, {}, "samples.histogram[1]", "-2"},
      {Status::samplesHistogram, {{"/samples", {{"near", 1}, {"far", 2}, {"histogram", 3}}}}, {}, "samples.histogram", "3"},
      {Status::samplesWeights,
       {{"/samples", {{"near", 1}, {"far", 2}, {"histogram", list({1, 2})}, {"weights", list({1, -1})}}}},
       {},
       "samples.weights[1]",
       "-1"},
      {Status::samplesBounds,
       {{"/samples", {{"near", 1}, {"far", 2}, {"bounds", {rectangle(1, 2, {0, 0}, {1, 1}), rectangle(2, 1, {0, 0}, {1, 1})}}}}},
       {},
       "samples.bounds[1]",
       R"({"near":2,"far":1,"min":[0,0],"max":[1,1]})"},
      {Status::samplesLatency,
       {{"/method", {{"name", "sdsm"}, {"latency", -1}}}, {"/samples", {{"near", 1}, {"far", 2}}}},
       {},
       "method.latency",
       "-1"},
      {Status::sdsmHysteresis,
       {{"/method", {{"name", "sdsm"}, {"hysteresis", 2}}}, {"/samples", {{"near", 1}, {"far", 2}}}},
       {},
       "method.hysteresis",
       "2"},
      {Status::autoPass, {{"/method", {{"name", "auto"}, {"pass_ns", -1}}}}, {}, "method.pass_ns", "-1"},
      {Status::autoTexel, {{"/method", {{"name", "auto"}, {"texel_ns", -1}}}}, {}, "method.texel_ns", "-1"},
      {Status::autoFit, {{"/method", {{"name", "auto"}, {"fit_ns", -1}}}}, {}, "method.fit_ns", "-1"},
      {Status::autoSearch, {{"/method", {{"name", "auto"}, {"search_ns", -1}}}}, {}, "method.search_ns", "-1"},
      {Status::biasSlope, {{"/bias/slope", -1}}, {}, "bias.slope", "-1"},
      {Status::biasConstant, {{"/bias/constant", -2}}, {}, "bias.constant", "-2"},
      {Status::worldSpacePrecision, {{"/camera/position", list({1e30, 0, 0})}}, {"--world"}, "camera.position", "[1e+30,0,0]"},
      {Status::floatRange, {{"/camera/near", 1e299}, {"/camera/far", 1e300}}, {}, "camera", "near 1e+299 and far 1e+300"},
  };
}

TEST_F(Cli, RefusesWhatTheLibraryRefuses) {
  // JSON has no number that is not finite, a picture's sides are told apart by the tool itself, and the tool has no frame before.
  std::set<Status> reached = {Status::cameraPosition, Status::imageSize, Status::autoHysteresis};
  for (const StatusRow& row : statusRows()) {
    const std::string line = refusal(solveText(edited(row.edits).dump(), row.options), row.field + " " + row.got);
    const std::string start = "gnomon: " + row.field + ": " + statusRule(row.status), end = ", got " + row.got;
    // The tool knows one more word for far and for count, and adds it to the rule.
    EXPECT_EQ(line.rfind(start, 0), 0u) << line << "\nexpected " << start;
    EXPECT_TRUE(line.size() >= end.size() && line.compare(line.size() - end.size(), end.size(), end) == 0) << line << "\nexpected" << end;
    EXPECT_LE(line.size(), start.size() + end.size() + std::strlen(", or automatic")) << line;
    reached.insert(row.status);
  }
  for (int i = 1; i <= static_cast<int>(Status::floatRange); ++i)
    EXPECT_TRUE(reached.contains(static_cast<Status>(i)))
        << statusField(static_cast<Status>(i)) << " " << statusRule(static_cast<Status>(i));
}

struct FormRow {
  Edits edits;
  std::string line;  // the whole line after "gnomon: "
};

TEST_F(Cli, RefusesWhatHasTheWrongForm) {
  const std::vector<FormRow> rows = {
      {{{"/camera/near", 0}}, "camera.near: must be a finite number > 0, got 0"},  // the contract's own example
      {{{"/camera", kAway}}, "camera: must be an object, got nothing"},
      {{{"/camera", list({1})}}, "camera: must be an object, got [1]"},
      {{{"/light", kAway}}, "light: must be an object, got nothing"},
      {{{"/light", "sun"}}, "light: must be an object, got \"sun\""},
      {{{"/light/direction", kAway}}, "light.direction: must be a list of 3 numbers, got nothing"},
      {{{"/light/direction", list({1, 2})}}, "light.direction: must be a list of 3 numbers, got [1,2]"},
      {{{"/light/direction", {1, 2, "3"}}}, "light.direction[2]: must be a number, got \"3\""},
      {{{"/light/type", "spot"}}, "light.type: must be directional, got spot: spot and point lights are not built yet"},
      {{{"/light", {{"type", "point"}, {"position", list({0, 5, 0})}, {"range", 10}}}},
       "light.type: must be directional, got point: spot and point lights are not built yet"},
      {{{"/light/type", "area"}}, "light.type: must be directional, got area"},
      {{{"/light/type", 3}}, "light.type: must be directional, got 3"},
      {{{"/camera/position", kAway}}, "camera.position: must be a list of 3 numbers, got nothing"},
      {{{"/camera/position", list({1, 2, 3, 4})}}, "camera.position: must be a list of 3 numbers, got [1,2,3,4]"},
      {{{"/camera/position", 7}}, "camera.position: must be a list of 3 numbers, got 7"},
      {{{"/camera/forward/1", nullptr}}, "camera.forward[1]: must be a number, got null"},
      {{{"/camera/up", kAway}}, "camera.up: must be a list of 3 numbers, got nothing"},
      {{{"/camera/far", kAway}}, "camera.far: must be a number > camera.near, or infinite, got nothing"},
      {{{"/camera/far", "endless"}}, "camera.far: must be a number > camera.near, or infinite, got \"endless\""},
      {{{"/camera/projection", "isometric"}}, "camera.projection: must be one of perspective, orthographic, got isometric"},
      {{{"/camera/depth", "zero"}}, "camera.depth: must be one of negative_one_to_one, zero_to_one, reversed_zero_to_one, got zero"},
      {{{"/shadow_depth", 1}}, "shadow_depth: must be one of negative_one_to_one, zero_to_one, reversed_zero_to_one, got 1"},
      {{{"/camera/tangents", list({1, 1, 1, 1})}}, "camera.fov_y: cannot be given together with camera.tangents, which say it too"},
      {{{"/camera/fov_y", kAway}, {"/camera/aspect", kAway}, {"/camera/tangents", list({1, 1, 1})}},
       "camera.tangents: must be a list of 4 numbers: left, right, down, up, got [1,1,1]"},
      {{{"/camera", {{"view", kIdentity}}}}, "camera.projection_matrix: must be a list of 16 numbers, row by row, got nothing"},
      {{{"/camera", matrixCamera(list({1, 2}), kProjection)}}, "camera.view: must be a list of 16 numbers, row by row, got [1,2]"},
      {{{"/image/width", 0}}, "image.width: must be a finite number > 0, got 0"},
      {{{"/image/height", "720p"}}, "image.height: must be a finite number > 0, got \"720p\""},
      {{{"/scene", list({})}}, "scene: must be an object, got []"},
      {{{"/scene/receivers", 1}}, "scene.receivers: must be a list of boxes {\"min\":[x,y,z],\"max\":[x,y,z]}, got 1"},
      {{{"/scene/receivers", {box({0, 0, 0}, {1, 1, 1}), {{"min", list({0, 0, 0})}}}}},
       "scene.receivers[1].max: must be a list of 3 numbers, got nothing"},
      {{{"/scene/casters", only(list({1}))}}, "scene.casters[0]: must be an object, got [1]"},
      {{{"/scene/planes", only(list({1, 2, 3}))}}, "scene.planes[0]: must be a list of 4 numbers: a, b, c, d, got [1,2,3]"},
      {{{"/corners", 8}}, std::string("corners: ") + statusRule(Status::corners) + ", got 8"},
      {{{"/corners", only(list({1, 2}))}}, "corners[0]: must be a list of 3 numbers, got [1,2]"},
      {{{"/margin/motion", 1}}, "margin.motion: must be a list of at most 16 numbers, one for each map, got 1"},
      {{{"/scene/planes", true}}, "scene.planes: must be a list of half-spaces [a,b,c,d], got true"},
      {{{"/margin", 2}}, "margin: must be an object, got 2"},
      {{{"/budget", "all"}}, "budget: must be an object, got \"all\""},
      {{{"/budget/atlas", 4096}}, "budget.atlas: must be a list of 2 numbers: width, height, got 4096"},
      {{{"/id", 3}}, "id: must be text, got 3"},
      {{{"/samples", list({1, 2})}}, "samples: must be an object, got [1,2]"},
      {{{"/samples", {{"near", 1}, {"far", 2}, {"middle", 1.5}}}},
       "samples.middle: is not a known key; samples takes near, far, histogram, weights, bounds"},
      {{{"/samples", {{"near", 1}, {"far", 2}, {"bounds", list({1})}}}}, "samples.bounds[0]: must be an object, got 1"},
      {{{"/method", "pssm"}}, "method: must be an object, got \"pssm\""},
      {{{"/method", {{"split", "uniform"}}}}, "method.name: must be one of pssm, lloyd, lspsm, sdsm, single, auto, got nothing"},
      {{{"/method", {{"name", "single"}, {"fit", "stable"}, {"warp", "none"}}}},
       "method.warp: can be given only where method.fit is tight"},
      {{{"/method", {{"name", "auto"}, {"pass_ns", "long"}}}}, "method.pass_ns: must be a finite number >= 0, got \"long\""},
      {{{"/method", {{"name", "lloyd"}, {"scheme", "fp"}}}}, "method.scheme: must be one of w, zp, zp+w, fp+w, fp+zp+w, best, got fp"},
      {{{"/method", {{"name", "lloyd"}, {"fit", "tight"}}}},
       "method.fit: is not a known key; method takes name, split, lambda, bias, splits, count, scheme, warp, eta, shares, near_face, rows"},
      {{{"/method", {{"name", "lloyd"}, {"rows", 1}}}}, "method.rows: must be true or false, got 1"},
      {{{"/method/name", "csm"}}, "method.name: must be one of pssm, lloyd, lspsm, sdsm, single, auto, got csm"},
      {{{"/method/name", 1}}, "method.name: must be one of pssm, lloyd, lspsm, sdsm, single, auto, got 1"},
      {{{"/method", {{"name", "pssm"}, {"split", "log"}}}},
       "method.split: must be one of uniform, logarithmic, practical, explicit, got log"},
      {{{"/method", {{"name", "pssm"}, {"fit", "loose"}}}}, "method.fit: must be one of tight, slice, stable, got loose"},
      {{{"/method", {{"name", "pssm"}, {"splits", list({1})}}}}, "method.splits: can be given only where method.split is explicit"},
      {{{"/method", {{"name", "pssm"}, {"split", "explicit"}}}},
       "method.splits: must be a list of view depths where method.split is explicit, got nothing"},
      {{{"/method", {{"name", "pssm"}, {"split", "explicit"}, {"splits", 3}}}}, "method.splits: must be a list of view depths, got 3"},
      {{{"/method", {{"name", "pssm"}, {"split", "explicit"}, {"splits", {1, "2"}}}}}, "method.splits[1]: must be a number, got \"2\""},
      {{{"/method", {{"name", "pssm"}, {"count", 0}}}},
       "method.count: must be a whole number in [1, budget.partitions], or automatic, got 0"},
      {{{"/method", {{"name", "pssm"}, {"count", 1.5}}}},
       "method.count: must be a whole number in [1, budget.partitions], or automatic, got 1.5"},
      {{{"/method", {{"name", "pssm"}, {"count", "auto"}}}},
       "method.count: must be a whole number in [1, budget.partitions], or automatic, got \"auto\""},
  };
  for (const FormRow& row : rows) EXPECT_EQ(refusal(solveText(edited(row.edits).dump()), row.line), "gnomon: " + row.line);
}

TEST_F(Cli, RefusesUnknownKeysByName) {
  struct Row {
    Edits edits;
    std::string start;
  };
  const Json method = {{"name", "pssm"}, {"eta", 0.5}};
  const std::vector<Row> rows = {
      {{{"/lights", 1}}, "lights: is not a known key; a case takes id, camera, corners, light, "},
      {{{"/camera/nera", 1}}, "camera.nera: is not a known key; camera takes position, forward, up, near, far, "},
      {{{"/camera/height", 1}}, "camera.height: is not a known key; camera takes "},  // of an orthographic camera only
      {{{"/camera/projection", "orthographic"}, {"/camera/height", 1}}, "camera.fov_y: is not a known key; camera takes "},
      {{{"/camera/view", kIdentity}}, "camera.position: is not a known key; camera takes view, projection_matrix, depth, shadow_distance"},
      {{{"/light/position", 1}}, "light.position: is not a known key; light takes type, direction"},
      {{{"/image/depth", 1}}, "image.depth: is not a known key; image takes width, height"},
      {{{"/scene/walls", 1}}, "scene.walls: is not a known key; scene takes receivers, casters, planes"},
      {{{"/scene/receivers", only({{"mim", 1}})}}, "scene.receivers[0].mim: is not a known key; scene.receivers[0] takes min, max"},
      {{{"/margin/pad", 1}}, "margin.pad: is not a known key; margin takes filter, normal_offset, blend, border, motion"},
      {{{"/bias/normal", 1}}, "bias.normal: is not a known key; bias takes slope, constant"},
      {{{"/budget/maps", 1}}, "budget.maps: is not a known key; budget takes partitions, resolution, texels, atlas, target_error"},
      {{{"/method", method}}, "method.eta: is not a known key; method takes name, split, lambda, bias, splits, count, fit"},
      {{{"/two\nlines", 1}}, "two\\nlines: is not a known key; "},
  };
  for (const Row& row : rows) {
    const std::string line = refusal(solveText(edited(row.edits).dump()), row.start);
    EXPECT_EQ(line.rfind("gnomon: " + row.start, 0), 0u) << line << "\nexpected " << row.start;
  }
}

TEST_F(Cli, RefusesTextThatIsNoCase) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"", "standard input: is not JSON: parse error at line 1, column 1"},
      {"{\n \"camera\": tru", "standard input: is not JSON: parse error at line 2"},
      {"{\"camera\": NaN}", "standard input: is not JSON: parse error at line 1"},
      {"{} {}", "standard input: is not JSON: parse error at line 1"},
      {"[1]", "case: must be an object, got [1]"},
      {"7", "case: must be an object, got 7"},
      {"{\"camera\":{\"near\":1e999}}", "camera.near: must be a finite number, got 1e999"},
      {"{\"camera\":{\"near\":-1e999}}", "camera.near: must be a finite number, got -1e999"},
      {"{\"camera\":{\"position\":[0,1e400,0]}}", "camera.position[1]: must be a finite number, got 1e400"},
      {"{\"scene\":{\"receivers\":[{\"min\":[0,0,0]},{\"min\":[0,0,1e999]}]}}",
       "scene.receivers[1].min[2]: must be a finite number, got 1e999"},
      {"{\"camera\":{\"near\":1,\"near\":2}}", "camera.near: is given twice"},
      {"{\"light\":{},\"light\":{}}", "light: is given twice"},
      {std::string(100000, '['), "case[0][0]"},
  };
  for (const auto& [text, start] : rows) {
    const std::string line = refusal(solveText(text), start);
    if (start == "case[0][0]")
      EXPECT_NE(line.find("is nested too deeply"), std::string::npos) << line;
    else
      EXPECT_EQ(line.rfind("gnomon: " + start, 0), 0u) << line << "\nexpected " << start;
  }
}

TEST_F(Cli, RefusesFilesThatCannotBeRead) {
  const std::string missing = folder() / "missing.json", broken = folder() / "broken.json";
  std::ofstream(broken) << "{";
  EXPECT_EQ(refusal(run({"solve", missing})), "gnomon: " + missing + ": cannot be read");
  EXPECT_EQ(refusal(run({"solve", folder()})), "gnomon: " + folder().string() + ": cannot be read");
  EXPECT_EQ(refusal(run({"solve", broken})).rfind("gnomon: " + broken + ": is not JSON: parse error at line 1", 0), 0u);
  EXPECT_EQ(refusal(run({"run", missing, "--out", folder()})).rfind("gnomon: " + missing + ": ", 0), 0u);
}

// A floor with a block on it, as small a .glb as there can be.
std::string smallScene() {
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  const auto add = [&](float x0, float x1, float y0, float y1, float z0, float z1) {
    const auto first = static_cast<std::uint32_t>(positions.size() / 3);
    for (int i = 0; i < 8; ++i) positions.insert(positions.end(), {i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0});
    for (const std::uint32_t corner :
         {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5})
      indices.push_back(first + corner);
  };
  add(-20.0f, 20.0f, -1.0f, 0.0f, -12.0f, 12.0f);
  add(3.0f, 4.0f, 0.0f, 6.0f, -1.0f, 1.0f);
  const std::size_t bytes = 4 * (positions.size() + indices.size());
  const Json json = {{"asset", {{"version", "2.0"}}},
                     {"scene", 0},
                     {"scenes", {{{"nodes", {0}}}}},
                     {"nodes", {{{"mesh", 0}}}},
                     {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}}},
                     {"buffers", {{{"byteLength", bytes}}}},
                     {"bufferViews",
                      {{{"buffer", 0}, {"byteOffset", 0}, {"byteLength", 4 * positions.size()}},
                       {{"buffer", 0}, {"byteOffset", 4 * positions.size()}, {"byteLength", 4 * indices.size()}}}},
                     {"accessors",
                      {{{"bufferView", 0},
                        {"componentType", 5126},
                        {"count", positions.size() / 3},
                        {"type", "VEC3"},
                        {"min", {-20, -1, -12}},
                        {"max", {20, 6, 12}}},
                       {{"bufferView", 1}, {"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}}}}};
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string out;
  const auto word = [&](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    out.append(reinterpret_cast<const char*>(&number), 4);
  };
  for (const std::size_t value :
       {std::size_t{0x46546c67}, std::size_t{2}, 12 + 8 + text.size() + 8 + bytes, text.size(), std::size_t{0x4e4f534a}})
    word(value);
  out += text;
  word(bytes);
  word(0x004e4942);
  out.append(reinterpret_cast<const char*>(positions.data()), 4 * positions.size());
  out.append(reinterpret_cast<const char*>(indices.data()), 4 * indices.size());
  return out;
}

// Every row of its tables is there, and every number is one.
TEST_F(Cli, WalksThroughAFile) {
  const fs::path scene = folder() / "block.glb";
  std::ofstream(scene, std::ios::binary) << smallScene();
  const Output output = run({"walk", scene, "--out", folder() / "walk", "--steps", "2"});
  ASSERT_EQ(output.code, 0) << output.err;
  EXPECT_EQ(output.out, slurp(folder() / "walk/walk.txt"));
  EXPECT_EQ(output.out.find("nan"), std::string::npos) << output.out;
  for (const char* row :
       {"block ", "zeta ", "splits 0.8", "slices by samples", "maps by samples 1", "both, optimal mean", "splits 0.8, stable"})
    EXPECT_NE(output.out.find(row), std::string::npos) << row;
  // No way of slices gets below what no slices do, and a hull is in its rectangle.
  const auto errorOf = [&](const std::string& row) {
    const std::size_t at = output.out.find(row);
    return at == std::string::npos ? -1.0 : std::stod(output.out.substr(at + 22));  // the names' column
  };
  const double rectangles = errorOf("no rectangles below"), maps = errorOf("no maps below");
  EXPECT_GT(maps, 0.0);
  EXPECT_GE(rectangles, maps);
  for (const char* row : {"splits 0.5", "splits 0.8", "splits 1 ", "both  ", "both, optimal mean"})
    EXPECT_GE(errorOf(row), rectangles) << row;
  EXPECT_TRUE(fs::exists(folder() / "walk/block-1/shaded.png"));
}

// A method that needs samples takes them from the view: the same as those that its depths say, and no depth that nothing is at.
TEST_F(Cli, RendersWithTheViewsOwnSamples) {
  const fs::path scene = folder() / "block.glb", path = folder() / "case.json";
  std::ofstream(scene, std::ios::binary) << smallScene();
  Json input = usual();
  input["camera"]["position"] = {-15.0, 4.0, 0.0};
  input["camera"]["forward"] = {1.0, -0.2, 0.0};
  input["image"] = {{"width", 160}, {"height", 90}};
  std::ofstream(path) << input;
  for (const bool isOnGpu : {false, true}) {
    std::vector<std::string> words{"render", path, "--method", "sdsm", "--scene", scene, "--out", folder() / "pictures"};
    if (isOnGpu) words.emplace_back("--on-gpu");
    const Output output = run(words);
    ASSERT_EQ(output.code, 0) << output.err;
    EXPECT_EQ(output.err.find("fragment shaders in ") != std::string::npos, isOnGpu) << output.err;
    const Json result = Json::parse(slurp(folder() / "pictures/result.json"));
    ASSERT_EQ(result["partitions"].size(), 4u);
    const double dip = 0.2 / std::hypot(1.0, 0.2), ahead = 1.0 / std::hypot(1.0, 0.2);
    // The floor at the picture's lower edge, and its far end at x = 20: view depths by hand, to what a pixel spans.
    EXPECT_NEAR(result["partitions"][0]["near"].get<double>(), 4.0 / (dip + ahead * std::tan(0.5)), 0.2);
    EXPECT_LE(result["partitions"][3]["far"].get<double>(), 35.0 * ahead + 4.0 * dip + 1e-3);
    EXPECT_GE(result["partitions"][3]["far"].get<double>(), 30.0);
  }
  for (const std::vector<std::string>& other : std::vector<std::vector<std::string>>{
           {"--method", "pssm"}, {"--method", "sdsm", "--set", "hysteresis=0.5"}, {"--method", "sdsm", "--layers"}}) {
    std::vector<std::string> words{"render", path, "--scene", scene, "--out", folder() / "other", "--on-gpu"};
    words.insert(words.end(), other.begin(), other.end());
    EXPECT_NE(refusal(run(words)).find("--on-gpu: "), std::string::npos);
  }
}

TEST_F(Cli, RefusesWrongUsageInOneLine) {
  const std::string path = folder() / "case.json";
  std::ofstream(path) << usual();
  refusal(run({}));
  refusal(run({"draw"}));
  refusal(run({"solve"}));
  refusal(run({"solve", path, "--bogus"}));
  refusal(run({"solve", path, "--repeat", "0"}));
  refusal(run({"solve", path, "--repeat", "many"}));
  refusal(run({"solve", path, "--set"}));
  refusal(run({"render", path, "--out", folder()}));
  refusal(run({"render", path, "--scene", "hall"}));
  EXPECT_EQ(refusal(run({"solve", path, "--set", "near"})), "gnomon: --set: must be KEY=VALUE, got near");
  EXPECT_EQ(refusal(run({"solve", path, "--set", "=1"})), "gnomon: --set: must be KEY=VALUE, got =1");
  EXPECT_EQ(refusal(run({"solve", path, "--set", "camera..near=1"})),
            "gnomon: --set: must name a field by a dotted path, got camera..near");
  const std::string other = refusal(run({"solve", path, "--method", "pssm", "--set", "eta=0.5"}));
  EXPECT_EQ(other.rfind("gnomon: method.eta: is not a known key; method takes name, split, lambda", 0), 0u) << other;
  EXPECT_EQ(refusal(run({"render", path, "--scene", "moon", "--out", folder()})),
            "gnomon: --scene: must be a .glb file that exists or one of colonnade, relief, city, hall, got moon");
  EXPECT_EQ(refusal(run({"render", path, "--scene", "hall", "--out", folder(), "--filter", "5x5"})),
            "gnomon: --filter: must be one of none, 3x3, tent, got 5x5");
  EXPECT_EQ(refusal(run({"render", path, "--scene", "hall", "--out", folder(), "--set", "image.width=640.5"})),
            "gnomon: image.width: must be a whole number in [1, 16384] to render, got 640.5");
}

TEST_F(Cli, HelpIsNoError) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"--help"}, {"solve", "--help"}, {"methods", "--help"}, {"render", "--help"}, {"run", "--help"}}) {
    const Output output = run(words);
    EXPECT_EQ(output.code, 0) << words.front();
    EXPECT_NE(output.out.find("Usage: "), std::string::npos) << output.out;
    EXPECT_EQ(output.err, "");
  }
}

// ---- Answers ----

std::vector<std::string> keys(const Json& object) {
  std::vector<std::string> out;
  for (const auto& item : object.items()) out.push_back(item.key());
  return out;
}

std::vector<std::uint8_t> decoded(const std::string& text) {  // RFC 4648, section 4
  static const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> out;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<std::uint32_t>(digits.find(c));
    if (held += 6; held >= 8) out.push_back(static_cast<std::uint8_t>(bits >> (held -= 8)));
  }
  return out;
}

TEST_F(Cli, AnswersInTheFormOfTheContract) {
  const Json result = answer(usual());
  EXPECT_EQ(keys(result), (std::vector<std::string>{"status", "method", "atlas", "depth_clamp", "origin", "partitions", "error", "report",
                                                    "warnings", "block", "solve_ns"}));
  EXPECT_EQ(result["status"], "ok");
  EXPECT_EQ(result["method"], "pssm");
  EXPECT_EQ(result["depth_clamp"], true);  // no casters given
  EXPECT_EQ(result["origin"], list({1, 2, 3}));
  EXPECT_EQ(result["warnings"], Json::array());
  EXPECT_GT(result["solve_ns"].get<double>(), 0.0);
  EXPECT_EQ(keys(result["error"]), (std::vector<std::string>{"max", "storage_factor", "needed_texels", "limit_texels"}));
  EXPECT_TRUE(result["error"]["limit_texels"].is_number());

  const std::vector<std::uint8_t> bytes = decoded(result["block"]);
  ASSERT_EQ(bytes.size(), sizeof(GnomonBlock));
  EXPECT_EQ(bytes.size(), 4736u);  // std140 of gnomon_block.glsl, counted by hand: 8 + 8 + 24 rows of 16 bytes, 16 partitions of 16
  GnomonBlock block;
  std::memcpy(&block, bytes.data(), sizeof block);
  EXPECT_EQ(block.info.x, 4u);

  ASSERT_EQ(result["partitions"].size(), 4u);
  double most = 0.0, needed = 0.0, texels = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Json& map = result["partitions"][i];
    EXPECT_EQ(keys(map), (std::vector<std::string>{"near", "far", "cull_planes", "world_to_clip", "viewport", "layer", "warp", "error"}));
    // Logarithmic planes: n (f/n)^(i/m), with n = 0.1, f = 100, m = 4.  [Zhang 2006, eq. 4]
    EXPECT_NEAR(map["near"].get<double>(), 0.1 * std::pow(1000.0, static_cast<double>(i) / 4.0), 1e-9);
    EXPECT_NEAR(map["far"].get<double>(), 0.1 * std::pow(1000.0, static_cast<double>(i + 1) / 4.0), 1e-9);
    EXPECT_EQ(map["layer"], 0);
    EXPECT_EQ(map["warp"], "none");
    EXPECT_GE(map["cull_planes"].size(), 4u);
    for (const Json& plane : map["cull_planes"]) EXPECT_EQ(plane.size(), 4u);
    ASSERT_EQ(map["world_to_clip"].size(), 16u);
    for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(map["world_to_clip"][12 + c], c < 3 ? 0.0 : 1.0);  // row-major
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column)  // the very floats of the block
        EXPECT_EQ(map["world_to_clip"][static_cast<std::size_t>(4 * row + column)].get<double>(),
                  static_cast<double>(block.partitions[i].clipFromWorld[column][row]));
    ASSERT_EQ(map["viewport"].size(), 4u);
    const double width = map["viewport"][2], height = map["viewport"][3];
    EXPECT_LE(map["viewport"][0].get<double>() + width, result["atlas"][0].get<double>());
    EXPECT_LE(map["viewport"][1].get<double>() + height, result["atlas"][1].get<double>());
    EXPECT_EQ(keys(map["error"]), (std::vector<std::string>{"s", "t", "extent"}));
    const double s = map["error"]["s"], t = map["error"]["t"];
    EXPECT_GE(map["error"]["extent"].get<double>(), std::max(s, t));
    most = std::max({most, s, t});
    needed += s * t * width * height;
    texels += width * height;
  }
  EXPECT_LE(texels, 4.0 * 1024 * 1024);
  EXPECT_DOUBLE_EQ(result["error"]["max"].get<double>(), most);
  EXPECT_NEAR(result["error"]["needed_texels"].get<double>() / needed, 1.0, 1e-9);
  EXPECT_NEAR(result["error"]["storage_factor"].get<double>() / (needed / (1280.0 * 720.0)), 1.0, 1e-9);

  const Json& report = result["report"];
  const std::vector<std::string> cost{"extent", "needed_texels", "spent_texels", "storage_factor"};
  EXPECT_EQ(report["needed_texels"], result["error"]["needed_texels"]);
  EXPECT_NEAR(report["spent_texels"].get<double>() / (most * most * texels), 1.0, 1e-9);
  ASSERT_EQ(report["partitions"].size(), 4u);
  for (const Json& map : report["partitions"]) EXPECT_EQ(keys(map), cost);
  // Maps that are not warped have one size of texel each, so a jump is the ratio of the sizes: error over a pixel at the slice's near end.
  ASSERT_EQ(report["seams"].size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto size = [&](std::size_t k) {
      const Json &map = result["partitions"][k], &error = map["error"];
      return std::max(error["s"].get<double>(), error["t"].get<double>()) * map["near"].get<double>();
    };
    EXPECT_EQ(report["seams"][i]["between"], list({static_cast<double>(i), static_cast<double>(i + 1)}));
    EXPECT_NEAR(report["seams"][i]["jump"].get<double>() / (size(i + 1) / size(i)), 1.0, 1e-4);
  }
}

Json untimed(Json result) {
  result.erase("solve_ns");
  return result;
}

TEST_F(Cli, SceneDecidesClampAndLimit) {
  const Json cast = answer(edited({{"/scene/casters", only(box({-5, 0, 0}, {5, 5, 50}))}}));
  EXPECT_EQ(cast["depth_clamp"], false);
  const Json received = answer(edited({{"/scene/receivers", only(box({-5, -5, 10}, {5, 0, 20}))}}));
  EXPECT_TRUE(received["error"]["limit_texels"].is_number());
  // Behind the camera: nothing to shadow is an answer.
  const Json behind = answer(edited({{"/scene/receivers", only(box({-5, -5, -20}, {5, 0, -10}))}}));
  EXPECT_EQ(behind["status"], "ok");
  EXPECT_EQ(behind["error"]["limit_texels"], nullptr);
  EXPECT_EQ(behind["partitions"], Json::array());
  EXPECT_EQ(untimed(answer(edited({{"/scene", Json::object()}, {"/margin", Json::object()}}))), untimed(answer(usual())));
}

TEST_F(Cli, DefaultsAreTheContracts) {
  const Json bare = edited({{"/id", kAway}, {"/image", kAway}, {"/budget", kAway}, {"/method", kAway}});
  const Json full = edited({{"/image", {{"width", 1920}, {"height", 1080}}},
                            {"/budget", {{"partitions", 4}, {"resolution", 2048}}},
                            {"/camera/projection", "perspective"},
                            {"/camera/depth", "negative_one_to_one"},
                            {"/shadow_depth", "zero_to_one"},
                            {"/margin", {{"filter", 0}, {"normal_offset", 0}, {"blend", 0}, {"border", 0}}},
                            {"/method", {{"name", "auto"}, {"pass_ns", 50000}}}});
  EXPECT_EQ(untimed(answer(bare)), untimed(answer(full)));
}

TEST_F(Cli, SetEqualsAnEditedCase) {
  struct Row {
    std::vector<std::string> options;
    Edits edits;
  };
  const std::vector<Row> rows = {
      {{"--set", "budget.partitions=3"}, {{"/budget/partitions", 3}}},
      {{"--set=budget.partitions=3"}, {{"/budget/partitions", 3}}},
      {{"--set", "split=uniform"}, {{"/method", {{"name", "pssm"}, {"split", "uniform"}}}}},
      {{"--set", "method.split=uniform"}, {{"/method", {{"name", "pssm"}, {"split", "uniform"}}}}},
      {{"--set", "split=practical", "--set", "lambda=0.25", "--set", "bias=0.5"},
       {{"/method", {{"name", "pssm"}, {"split", "practical"}, {"lambda", 0.25}, {"bias", 0.5}}}}},
      {{"--set", "bias.slope=2"}, {{"/bias/slope", 2}}},
      {{"--set", "split=explicit", "--set", "splits=[2,20]"},
       {{"/method", {{"name", "pssm"}, {"split", "explicit"}, {"splits", list({2, 20})}}}}},
      {{"--set", "count=automatic", "--set", "budget.target_error=3"},
       {{"/method", {{"name", "pssm"}, {"count", "automatic"}}}, {"/budget/target_error", 3}}},
      {{"--set", "fit=stable"}, {{"/method", {{"name", "pssm"}, {"fit", "stable"}}}}},
      {{"--set", "shadow_depth=reversed_zero_to_one"}, {{"/shadow_depth", "reversed_zero_to_one"}}},
      {{"--set", "scene.receivers.0={\"min\":[-5,-5,10],\"max\":[5,0,20]}"}, {{"/scene/receivers", only(box({-5, -5, 10}, {5, 0, 20}))}}},
      {{"--set", "scene.receivers.0.min=[-5,-5,10]", "--set", "scene.receivers.0.max=[5,0,20]", "--set", "scene.receivers.0.max.1=1"},
       {{"/scene/receivers", only(box({-5, -5, 10}, {5, 1, 20}))}}},
      {{"--set", "camera.far=infinite", "--set", "camera.shadow_distance=50"},
       {{"/camera/far", "infinite"}, {"/camera/shadow_distance", 50}}},
      {{"--method", "pssm", "--set", "count=2"}, {{"/method", {{"name", "pssm"}, {"count", 2}}}}},
  };
  const Json plain = untimed(answer(usual()));
  for (const Row& row : rows) {
    const Json set = untimed(answer(usual(), row.options));
    EXPECT_EQ(set, untimed(answer(edited(row.edits)))) << row.options.back();
    EXPECT_NE(set, plain) << row.options.back();
  }
}

TEST_F(Cli, SetIsRefusedLikeTheCase) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"camera.near=0", "camera.near: must be a finite number > 0, got 0"},
      {"camera.near=zero", "camera.near: must be a finite number > 0, got \"zero\""},
      {"camera.near=1e999", "camera.near: must be a finite number, got 1e999"},
      {"split=log", "method.split: must be one of uniform, logarithmic, practical, explicit, got log"},
      {"camera.position.3=1", "camera.position: must be a list of 3 numbers, got [1,2,3,1]"},
      {"camera.position.4=1", "camera.position: has 3 elements, counted from 0, got 4"},
      {"camera.position.x=1", "camera.position: has 3 elements, counted from 0, got x"},
      {"camera.near.deep=1", "camera.near: must be an object or a list for --set camera.near.deep, got 0.1"},
  };
  for (const auto& [assignment, line] : rows)
    EXPECT_EQ(refusal(solveText(usual().dump(), {"--set", assignment}), assignment), "gnomon: " + line);
  EXPECT_EQ(refusal(solveText(usual().dump(), {"--set", "camera.nera=1"})).rfind("gnomon: camera.nera: is not a known key; ", 0), 0u);
}

TEST_F(Cli, MethodReplacesTheWholeObject) {
  const Json uniform = edited({{"/method", {{"name", "pssm"}, {"split", "uniform"}, {"fit", "slice"}}}});
  EXPECT_NE(untimed(answer(uniform)), untimed(answer(usual())));
  EXPECT_EQ(untimed(answer(uniform, {"--method", "pssm"})), untimed(answer(usual())));
  // Also where what is replaced would be refused.
  EXPECT_EQ(untimed(answer(edited({{"/method", "broken"}}), {"--method", "pssm"})), untimed(answer(usual())));
  EXPECT_EQ(refusal(solveText(usual().dump(), {"--method", "later"})),
            "gnomon: method.name: must be one of pssm, lloyd, lspsm, sdsm, single, auto, got later");
}

// A setting given without a method is the first one's that has it.
TEST_F(Cli, SetNamesTheMethod) {
  const Json bare = edited({{"/method", kAway}});
  EXPECT_EQ(untimed(answer(bare, {"--set", "split=uniform"})), untimed(answer(usual(), {"--set", "split=uniform"})));
  EXPECT_EQ(answer(bare, {"--set", "scheme=w"})["method"], "lloyd");
  EXPECT_EQ(answer(bare, {"--set", "pass_ns=0"})["method"], "auto");
}

// One map: Lloyd's warped one, or the box of one slice.
TEST_F(Cli, SingleIsOneMap) {
  for (const auto& [settings, method] : std::vector<std::pair<std::vector<std::string>, Json>>{
           {{}, {{"name", "lloyd"}, {"scheme", "w"}, {"warp", "least"}}},
           {{"--set", "warp=eta", "--set", "eta=0.5"}, {{"name", "lloyd"}, {"scheme", "w"}, {"warp", "eta"}, {"eta", 0.5}}},
           {{"--set", "fit=stable"}, {{"name", "pssm"}, {"count", 1}, {"fit", "stable"}}}}) {
    std::vector<std::string> options{"--method", "single"};
    options.insert(options.end(), settings.begin(), settings.end());
    Json single = untimed(answer(usual(), options)), known = untimed(answer(edited({{"/method", method}})));
    EXPECT_EQ(single["partitions"].size(), 1u);
    EXPECT_EQ(single["method"], "single");
    single["method"] = known["method"];
    EXPECT_EQ(single, known);
  }
}

// What auto compared stands in the report; explain says the same in words.
TEST_F(Cli, AutoSaysWhy) {
  const Json met = answer(usual(), {"--method", "auto", "--set", "budget.target_error=20"}), why = met["report"]["auto"];
  EXPECT_LE(met["error"]["max"].get<double>(), 20.0);
  EXPECT_EQ(met["warnings"], Json::array());
  EXPECT_EQ(why["chosen"]["maps"], met["partitions"].size());
  EXPECT_EQ(why["chosen"]["meets_target"], true);
  EXPECT_LE(why["chosen"]["cost_ns"].get<double>(), why["runner_up"]["cost_ns"].get<double>());
  EXPECT_GE(why["compared"].size(), 2u);
  EXPECT_FALSE(answer(usual())["report"].contains("auto"));

  const std::string path = folder() / "why.json";
  std::ofstream(path) << usual();
  const Output text = run({"explain", path, "--method", "auto", "--set", "budget.target_error=20"});
  ASSERT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("chosen     " + why["chosen"]["layout"].get<std::string>()), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("runner-up  " + why["runner_up"]["layout"].get<std::string>()), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("target 20 met"), std::string::npos) << text.out;
  EXPECT_EQ(refusal(run({"explain", path})), "gnomon: method.name: must be auto to explain, got pssm");

  const Json missed = answer(usual(), {"--method", "auto", "--set", "budget.target_error=0.5"});
  ASSERT_EQ(missed["warnings"].size(), 1u);
  EXPECT_EQ(missed["warnings"][0].get<std::string>().rfind(warningText(Warning::targetMissed), 0), 0u);
  EXPECT_NE(missed["warnings"][0].get<std::string>().find(" texels in at most 4 maps"), std::string::npos);
}

TEST_F(Cli, FileAndStandardInputGiveTheSame) {
  const std::string path = folder() / "case.json";
  std::ofstream(path) << usual();
  const Output output = run({"solve", path});
  ASSERT_EQ(output.code, 0) << output.err;
  EXPECT_EQ(untimed(Json::parse(output.out)), untimed(answer(usual())));
  // Once more: byte for byte but for the time.
  EXPECT_EQ(untimed(Json::parse(run({"solve", path}).out)).dump(), untimed(Json::parse(output.out)).dump());
}

TEST_F(Cli, RepeatTakesTheMedian) {
  const Json result = answer(usual(), {"--repeat", "2001"});
  EXPECT_EQ(untimed(result), untimed(answer(usual())));
  EXPECT_GT(result["solve_ns"].get<double>(), 0.0);
  EXPECT_LT(result["solve_ns"].get<double>(), 1e6);  // a solve takes microseconds, even under a sanitizer
}

TEST_F(Cli, WorldMovesTheOrigin) {
  const Json relative = answer(usual()), world = answer(usual(), {"--world"});
  EXPECT_EQ(world["origin"], list({0, 0, 0}));
  ASSERT_EQ(world["partitions"].size(), relative["partitions"].size());
  // The same world point lands in the same place of the map.
  const std::array<double, 3> point{2.0, 1.0, 9.0}, eye{1.0, 2.0, 3.0};
  for (std::size_t i = 0; i < world["partitions"].size(); ++i)
    for (std::size_t row = 0; row < 3; ++row) {
      const auto at = [&](const Json& result, bool isRelative) {
        const Json& m = result["partitions"][i]["world_to_clip"];
        double sum = m[4 * row + 3];
        for (std::size_t c = 0; c < 3; ++c) sum += m[4 * row + c].get<double>() * (point[c] - (isRelative ? eye[c] : 0.0));
        return sum;
      };
      EXPECT_NEAR(at(world, false), at(relative, true), 1e-4 * (1.0 + std::abs(at(relative, true))));
    }
  const Json far = answer(edited({{"/camera/position", list({3e4, 0, 0})}}), {"--world"});
  EXPECT_EQ(far["warnings"].size(), 1u);
}

TEST_F(Cli, LayersGiveEachMapItsOwn) {
  const Json result = answer(usual(), {"--layers", "--set", "fit=slice"});
  EXPECT_EQ(result["atlas"], list({1024, 1024}));
  ASSERT_EQ(result["partitions"].size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(result["partitions"][i]["layer"], i);
    EXPECT_EQ(result["partitions"][i]["viewport"][0], 0);
    EXPECT_EQ(result["partitions"][i]["viewport"][1], 0);
  }
}

// ---- Camera forms ----

void expectSameMaps(const Json& a, const Json& b, double tolerance) {
  ASSERT_EQ(a["partitions"].size(), b["partitions"].size());
  for (std::size_t i = 0; i < a["partitions"].size(); ++i) {
    const Json &left = a["partitions"][i], &right = b["partitions"][i];
    for (const char* key : {"near", "far"})
      EXPECT_NEAR(left[key].get<double>(), right[key].get<double>(), tolerance * right[key].get<double>()) << key;
    for (const char* key : {"s", "t"})
      EXPECT_NEAR(left["error"][key].get<double>(), right["error"][key].get<double>(), tolerance * right["error"][key].get<double>())
          << key;
    EXPECT_EQ(left["viewport"], right["viewport"]);
  }
}

TEST_F(Cli, CameraFormsAgree) {
  const double up = std::tan(0.5), side = up * 1280.0 / 720.0;  // fov_y 1, aspect 16:9
  const Json tangents = edited({{"/camera/fov_y", kAway}, {"/camera/aspect", kAway}, {"/camera/tangents", list({side, side, up, up})}});
  expectSameMaps(answer(tangents), answer(usual()), 1e-9);

  // A camera at (1, 2, 3) that looks along -z, y up: OpenGL's view and projection matrices, row by row.
  const Json plain = edited({{"/camera/forward", list({0, 0, -1})}});
  const double n = 0.1, f = 100.0;
  const Json view = list({1, 0, 0, -1, 0, 1, 0, -2, 0, 0, 1, -3, 0, 0, 0, 1});
  const Json openGl = list({1 / side, 0, 0, 0, 0, 1 / up, 0, 0, 0, 0, -(f + n) / (f - n), -2 * f * n / (f - n), 0, 0, -1, 0});
  expectSameMaps(answer(edited({{"/camera", matrixCamera(view, openGl)}})), answer(plain), 1e-9);
  EXPECT_EQ(answer(edited({{"/camera", matrixCamera(view, openGl)}}))["origin"], list({1, 2, 3}));

  // Reversed depth, infinite far, half a pixel of jitter: the form that engines with temporal antialiasing hold.
  Json reversed = matrixCamera(view, list({1 / side, 0, 1.0 / 1280, 0, 0, 1 / up, -1.0 / 720, 0, 0, 0, 0, n, 0, 0, -1, 0}));
  reversed["depth"] = "reversed_zero_to_one";
  reversed["shadow_distance"] = 100;
  const Json endless = edited({{"/camera/forward", list({0, 0, -1})},
                               {"/camera/far", "infinite"},
                               {"/camera/shadow_distance", 100},
                               {"/camera/depth", "reversed_zero_to_one"}});
  expectSameMaps(answer(edited({{"/camera", reversed}})), answer(endless), 1e-9);
}

TEST_F(Cli, OrthographicTakesAnyNear) {
  const Json input =
      edited({{"/camera/projection", "orthographic"}, {"/camera/fov_y", kAway}, {"/camera/height", 20}, {"/camera/near", -10}});
  const Json result = answer(input);
  ASSERT_EQ(result["partitions"].size(), 4u);
  EXPECT_EQ(result["partitions"][0]["near"], -10);
  EXPECT_EQ(result["partitions"][3]["far"], 100);
  EXPECT_GT(result["error"]["limit_texels"].get<double>(), 0.0);
}

TEST_F(Cli, ShadowDistanceEndsTheMaps) {
  EXPECT_EQ(answer(edited({{"/camera/shadow_distance", 30}}))["partitions"][3]["far"], 30);
  EXPECT_EQ(answer(edited({{"/camera/shadow_distance", 0.05}}))["partitions"], Json::array());  // before near: nothing is left
}

// ---- The other commands ----

TEST_F(Cli, MethodsListsEverySetting) {
  const Output text = run({"methods"}), json = run({"methods", "--json"});
  ASSERT_EQ(text.code, 0);
  ASSERT_EQ(json.code, 0);
  const Json list = Json::parse(json.out);
  ASSERT_EQ(list.size(), 6u);
  const std::vector<std::pair<std::string, Json>> splitting = {
      {"split", "logarithmic"}, {"lambda", 0.5}, {"bias", 0.0}, {"splits", nullptr}, {"count", nullptr}};
  const std::vector<std::pair<std::string, std::vector<std::pair<std::string, Json>>>> methods = {
      {"pssm", {{"fit", "tight"}}},
      {"lloyd", {{"scheme", "zp+w"}, {"warp", "lispsm"}, {"eta", 0.0}, {"shares", "error"}, {"near_face", "own"}, {"rows", true}}},
      {"lspsm", {{"rows", "fitted"}, {"zeta", 0.25}, {"sigma", 0.5}, {"max_rows", 16}, {"max_columns", 2}, {"warp", "none"}, {"eta", 0.0}}},
      {"sdsm",
       {{"scheme", "logarithmic"},
        {"norm", "max"},
        {"bounds", "light_space"},
        {"latency", 0.0},
        {"hysteresis", 0.0},
        {"quantise", false},
        {"count", nullptr}}},
      {"single", {{"warp", "least"}, {"eta", 0.0}, {"fit", "tight"}}},
      {"auto", {{"pass_ns", 50000.0}, {"texel_ns", 0.05}, {"fit_ns", 500.0}, {"search_ns", 5000.0}}}};
  for (std::size_t m = 0; m < methods.size(); ++m) {
    EXPECT_EQ(list[m]["name"], methods[m].first);
    auto settings = m < 2 ? splitting : std::vector<std::pair<std::string, Json>>();  // rows have no slices
    settings.insert(settings.end(), methods[m].second.begin(), methods[m].second.end());
    ASSERT_EQ(list[m]["settings"].size(), settings.size());
    for (std::size_t i = 0; i < settings.size(); ++i) {
      EXPECT_EQ(list[m]["settings"][i]["name"], settings[i].first);
      EXPECT_EQ(list[m]["settings"][i]["default"], settings[i].second);
      EXPECT_FALSE(list[m]["settings"][i]["values"].get<std::string>().empty());
      EXPECT_NE(text.out.find("\n  " + settings[i].first + " "), std::string::npos) << settings[i].first;
    }
  }
}

// Each scheme answers, and a face's partition says which half-spaces it serves.
TEST_F(Cli, LloydAnswersWithPlanesAndWarps) {
  const Json faces = answer(edited({{"/method", {{"name", "lloyd"}, {"scheme", "fp+w"}}}, {"/budget", {{"partitions", 8}}}}));
  EXPECT_EQ(faces["method"], "lloyd");
  ASSERT_GE(faces["partitions"].size(), 2u);
  for (const Json& each : faces["partitions"]) EXPECT_FALSE(each["planes"].empty());
  const Json slices = answer(usual(), {"--method", "lloyd"});
  ASSERT_EQ(slices["partitions"].size(), 4u);
  for (const Json& each : slices["partitions"]) {
    EXPECT_FALSE(each.contains("planes"));
    EXPECT_EQ(each["warp"], "lispsm");
  }
}

// The npy header of version 1.0: magic, version, length, and a dictionary in text.
std::string npyHeader(const fs::path& path) {
  const std::string bytes = slurp(path);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8)) << path;
  return bytes.substr(10, 100);
}

TEST_F(Cli, RenderLeavesTheContractsFiles) {
  const std::string path = folder() / "case.json";
  std::ofstream(path) << edited({{"/camera/position", list({0, 2, 0})}, {"/image", {{"width", 64}, {"height", 36}}}});
  const fs::path out = folder() / "made" / "here";
  const Output output = run({"render", path, "--scene", "colonnade", "--out", out, "--set", "budget.resolution=256"});
  ASSERT_EQ(output.code, 0) << output.err;
  EXPECT_EQ(output.out.rfind("wrong ", 0), 0u) << output.out;
  for (const char* name : {"shaded.png", "tinted.png", "difference.png", "maps.png"})
    EXPECT_EQ(slurp(out / name).substr(1, 3), "PNG") << name;
  for (const char* name : {"position.npy", "normal.npy"}) {
    EXPECT_NE(npyHeader(out / name).find("(36, 64, 3)"), std::string::npos) << name;
    EXPECT_NE(npyHeader(out / name).find("<f4"), std::string::npos) << name;
  }
  for (const char* name : {"lit.npy", "index.npy"}) {
    EXPECT_NE(npyHeader(out / name).find("(36, 64)"), std::string::npos) << name;
    EXPECT_NE(npyHeader(out / name).find("|u1"), std::string::npos) << name;
  }
  const Json result = Json::parse(slurp(out / "result.json"));
  EXPECT_EQ(result["status"], "ok");
  EXPECT_EQ(result["partitions"].size(), 4u);
}

TEST_F(Cli, UnwritableOutputIsTheMachinesFault) {
  const std::string path = folder() / "case.json";
  std::ofstream(path) << usual();
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const int status = std::system((quoted(GNOMON_TOOL) + " solve " + quoted(path) + " >/dev/full 2>" + quoted(folder() / "err")).c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  EXPECT_EQ(slurp(folder() / "err"), "gnomon: standard output: cannot be written\n");
}

// RFC 4648, section 10.
TEST(CliText, Base64) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foob", "Zm9vYg=="}, {"fooba", "Zm9vYmE="}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, text] : rows) {
    const std::vector<std::uint8_t> bytes(plain.begin(), plain.end());
    EXPECT_EQ(cli::base64(bytes), text);
  }
}

TEST(CliText, NumbersAreAsShortAsTheyCanBe) {
  const std::vector<std::pair<double, std::string>> rows = {{0.0, "0"},
                                                            {-0.0, "-0"},
                                                            {0.1, "0.1"},
                                                            {1280.0, "1280"},
                                                            {1e30, "1e+30"},
                                                            {kInfinity, "infinite"},
                                                            {-kInfinity, "-infinite"},
                                                            {std::nan(""), "nan"}};
  for (const auto& [value, text] : rows) EXPECT_EQ(cli::shortest(value), text);
}

}  // namespace
}  // namespace gnomon::test
