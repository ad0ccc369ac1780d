// The tool as a user runs it: every refusal, its exit code and its one line; the RESULT's keys; --set, --method, --repeat, -.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using Json = nlohmann::ordered_json;

struct Outcome {
  int exitCode = -1;
  std::string out, error;
};

std::string read(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// Each test program runs alone in its process, so the files' names need its number.
std::string temporary(const std::string& name) { return ::testing::TempDir() + "gnomon_cli_" + std::to_string(getpid()) + "_" + name; }

Outcome run(const std::string& arguments, const std::string& input = "") {
  std::ofstream(temporary("in")) << input;
  const std::string command = std::string(GNOMON_TOOL) + " " + arguments + " <" + temporary("in") + " >" + temporary("out") + " 2>" + temporary("error");
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(temporary("out")), read(temporary("error"))};
}

const char* const kCase = R"({
  "id": "a label",
  "camera": {"position": [1, 2, 3], "forward": [0.3, -0.2, 1], "up": [0, 1, 0], "near": 0.1, "far": 100, "projection": "perspective", "fov_y": 1.0, "aspect": 1.5},
  "light": {"type": "directional", "direction": [0.3, -0.8, 0.2]},
  "image": {"width": 1280, "height": 720},
  "scene": {"receivers": [{"min": [-50, 0, -50], "max": [50, 20, 50]}], "planes": [[0, 1, 0, 0]]},
  "method": {"name": "pssm"},
  "budget": {"partitions": 4, "resolution": 512}
})";

Outcome solve(const std::string& arguments, const Json& input = Json::parse(kCase)) { return run("solve - " + arguments, input.dump()); }

TEST(Cli, AnswersWithEveryKeyOfTheContract) {
  const Outcome answer = solve("");
  ASSERT_EQ(answer.exitCode, 0) << answer.error;
  EXPECT_EQ(answer.error, "");
  const Json result = Json::parse(answer.out);
  std::vector<std::string> keys;
  for (const auto& item : result.items()) keys.push_back(item.key());
  EXPECT_EQ(keys, (std::vector<std::string>{"status", "method", "atlas", "depth_clamp", "origin", "partitions", "error", "warnings", "block", "solve_ns"}));
  EXPECT_EQ(result["status"], "ok");
  EXPECT_EQ(result["method"], "pssm");
  EXPECT_EQ(result["depth_clamp"], true);
  EXPECT_EQ(result["origin"], Json::parse("[1.0, 2.0, 3.0]"));
  EXPECT_EQ(result["partitions"].size(), 4u);
  for (const Json& map : result["partitions"]) {
    for (const char* key : {"near", "far", "cull_planes", "world_to_clip", "viewport", "layer", "warp", "error"}) EXPECT_TRUE(map.contains(key)) << key;
    EXPECT_EQ(map["world_to_clip"].size(), 16u);
    for (const Json& number : map["world_to_clip"]) EXPECT_EQ(number.get<double>(), static_cast<double>(static_cast<float>(number.get<double>())));
    EXPECT_EQ(map["world_to_clip"][15], 1.0);  // row-major: the last row is 0 0 0 1
    EXPECT_EQ(map["world_to_clip"][12], 0.0);
    for (const char* key : {"s", "t", "extent"}) EXPECT_GT(map["error"][key].get<double>(), 0.0);
  }
  EXPECT_TRUE(result["error"]["limit_texels"].is_null());  // a scene cuts the view
  EXPECT_EQ(result["block"].get<std::string>().size(), (3328u + 2u) / 3u * 4u);
  Json whole = Json::parse(kCase);
  whole.erase("scene");
  EXPECT_TRUE(Json::parse(solve("", whole).out)["error"]["limit_texels"].is_number());
}

TEST(Cli, SetChangesAnyField) {
  EXPECT_EQ(Json::parse(solve("--set budget.partitions=2").out)["partitions"].size(), 2u);
  EXPECT_EQ(Json::parse(solve("--set count=3").out)["partitions"].size(), 3u);
  EXPECT_EQ(Json::parse(solve("--set count=automatic --set budget.target_error=1000").out)["partitions"].size(), 1u);
  EXPECT_EQ(Json::parse(solve("--set split=explicit --set splits=[2,30]").out)["partitions"].size(), 3u);
  EXPECT_EQ(Json::parse(solve("--set scene.receivers.0.max=[50,0,50]").out)["status"], "ok");
  EXPECT_EQ(Json::parse(solve("--set camera.shadow_distance=20").out)["partitions"].back()["far"], 20.0);
  EXPECT_EQ(Json::parse(solve("--set camera.shadow_distance=0.01").out)["partitions"].size(), 0u);
  EXPECT_EQ(Json::parse(solve("--world").out)["origin"], Json::parse("[0.0, 0.0, 0.0]"));
  EXPECT_EQ(Json::parse(solve("--layers --set fit=slice").out)["atlas"], Json::parse("[512, 512]"));
  EXPECT_GT(Json::parse(solve("--repeat 100").out)["solve_ns"].get<double>(), 0.0);
  Json other = Json::parse(kCase);
  other["method"] = {{"name", "pssm"}, {"split", "uniform"}, {"count", 2}};
  EXPECT_EQ(Json::parse(solve("--method pssm", other).out)["partitions"].size(), 4u);  // the whole method object is replaced
}

TEST(Cli, EveryCameraFormWorks) {
  Json input = Json::parse(kCase);
  input["camera"].erase("fov_y");
  input["camera"].erase("aspect");
  input["camera"]["tangents"] = {0.2, 0.9, 0.4, 0.5};
  EXPECT_EQ(solve("", input).exitCode, 0);
  input = Json::parse(kCase);
  input["camera"].erase("fov_y");
  input["camera"]["projection"] = "orthographic";
  input["camera"]["height"] = 30;
  input["camera"]["near"] = -20;
  EXPECT_EQ(solve("", input).exitCode, 0);
  input = Json::parse(kCase);
  input["camera"]["far"] = "infinite";
  EXPECT_EQ(solve("--set camera.shadow_distance=60", input).exitCode, 0);
  // Looking along -z from (0, 0, 5), 90 degrees square, near 1, far 9, clip depth -1 to 1.
  input = Json::parse(kCase);
  input["camera"] = {{"view", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -5, 0, 0, 0, 1}}, {"projection_matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.25, -2.25, 0, 0, -1, 0}}};
  input.erase("scene");
  const Outcome answer = solve("--set count=1", input);
  ASSERT_EQ(answer.exitCode, 0) << answer.error;
  const Json result = Json::parse(answer.out);
  EXPECT_EQ(result["origin"], Json::parse("[0.0, 0.0, 5.0]"));
  EXPECT_NEAR(result["partitions"][0]["near"].get<double>(), 1.0, 1e-12);
  EXPECT_NEAR(result["partitions"][0]["far"].get<double>(), 9.0, 1e-12);
}

struct Refused {
  const char* set;    // arguments after "solve -"
  const char* field;  // what the line must begin with, after "gnomon: "
};

class CliRefuses : public ::testing::TestWithParam<Refused> {};

TEST_P(CliRefuses, WithOneLineThatNamesTheField) {
  const Outcome answer = solve(GetParam().set);
  EXPECT_EQ(answer.exitCode, 2) << answer.out;
  EXPECT_EQ(answer.out, "");
  EXPECT_EQ(answer.error.rfind(std::string("gnomon: ") + GetParam().field, 0), 0u) << answer.error;
  EXPECT_EQ(std::count(answer.error.begin(), answer.error.end(), '\n'), 1) << answer.error;
}

INSTANTIATE_TEST_SUITE_P(
    Fields, CliRefuses,
    ::testing::Values(Refused{"--set camera.near=0", "camera.near: must be a finite number > 0, got 0\n"}, Refused{"--set camera.near=-2.5", "camera.near: must be a finite number > 0, got -2.5\n"},
                      Refused{"--set camera.far=0.05", "camera.far: must be a number > camera.near, got 0.05\n"}, Refused{"--set 'camera.far=\"infinite\"'", "camera.far: "},
                      Refused{"--set camera.position=[1,2]", "camera.position: "}, Refused{"--set 'camera.position=\"here\"'", "camera.position: "},
                      Refused{"--set camera.forward=[0,0,0]", "camera.forward: "}, Refused{"--set camera.up=[0.6,-0.4,2]", "camera.up: "},
                      Refused{"--set camera.fov_y=0", "camera.fov_y: "}, Refused{"--set camera.fov_y=3.2", "camera.fov_y: "}, Refused{"--set camera.aspect=0", "camera.aspect: "},
                      Refused{"--set camera.depth=backwards", "camera.depth: "}, Refused{"--set camera.projection=fisheye", "camera.projection: "},
                      Refused{"--set camera.shadow_distance=1e999", "camera.shadow_distance: "}, Refused{"--set camera.tangents=[1,1]", "camera.fov_y: "},
                      Refused{"--set camera.zoom=2", "camera.zoom: "}, Refused{"--set light.direction=[0,0,0]", "light.direction: "}, Refused{"--set light.type=spot", "light.type: "},
                      Refused{"--set light.type=lamp", "light.type: "}, Refused{"--set light.colour=1", "light.colour: "}, Refused{"--set image.width=0", "image"},
                      Refused{"--set scene.receivers.0.min=[60,0,0]", "scene.receivers[0]"}, Refused{"--set 'scene.casters=[{\"min\":[1,0,0],\"max\":[0,1,1]}]'", "scene.casters[0]"},
                      Refused{"--set scene.planes=[[0,0,0,1]]", "scene.planes[0]"}, Refused{"--set scene.planes=[[0,0,1]]", "scene.planes[0]"}, Refused{"--set scene.walls=[]", "scene.walls: "},
                      Refused{"--set margin.filter=-1", "margin.filter: "}, Refused{"--set margin.normal_offset=-1", "margin.normal_offset: "}, Refused{"--set margin.blend=1", "margin.blend: "},
                      Refused{"--set margin.border=1.5", "margin.border: "}, Refused{"--set margin.border=2000", "margin.border: "}, Refused{"--set margin.filter=400", "margin: "},
                      Refused{"--set shadow_depth=upside", "shadow_depth: "}, Refused{"--set budget.partitions=17", "budget.partitions: "}, Refused{"--set budget.partitions=2.5", "budget.partitions: "},
                      Refused{"--set budget.resolution=0", "budget.resolution: "}, Refused{"--set budget.texels=-1", "budget.texels: "}, Refused{"--set budget.atlas=[0,10]", "budget.atlas"},
                      Refused{"--set budget.atlas=[1,1]", "budget.atlas"}, Refused{"--set budget.target_error=0", "budget.target_error: "}, Refused{"--set split=cubic", "method.split: "},
                      Refused{"--set lambda=2", "method.lambda: "}, Refused{"--set split=practical --set bias=-1", "method.bias: "}, Refused{"--set split=practical --set bias=90", "method.bias: "},
                      Refused{"--set split=explicit --set splits=[3,2]", "method.splits"}, Refused{"--set split=explicit", "method.splits"}, Refused{"--set count=9", "method.count: "},
                      Refused{"--set count=0", "method.count: "}, Refused{"--set fit=loose", "method.fit: "}, Refused{"--set fit=stable --set count=automatic", "method.fit: "},
                      Refused{"--set fit=stable --world --set camera.position=[1e6,10,0] --set scene={}", "method.fit: "},
                      Refused{"--world --set camera.position=[1e9,10,0] --set scene={}", "camera.position: "}, Refused{"--method lloyd", "method.name: "}, Refused{"--method magic", "method.name: "},
                      Refused{"--set 'samples={\"near\":1,\"far\":2}'", "samples: "}, Refused{"--set colour=1", "colour"}, Refused{"--set =1", "--set"}, Refused{"--nonsense", ""}, Refused{"--repeat 0", "--repeat"}));

TEST(Cli, RefusesWhatIsNotACase) {
  for (const auto& [input, words] : std::vector<std::pair<std::string, std::string>>{
           {"", ""}, {"{", ""}, {"[]", ""}, {"{\"camera\": 3}", "camera: "}, {"{\"light\": {}}", "camera: "}, {"{\"near\": 1, \"near\": 2}", "near: "}}) {
    const Outcome answer = run("solve -", input);
    EXPECT_EQ(answer.exitCode, 2) << input;
    EXPECT_EQ(answer.out, "");
    EXPECT_EQ(answer.error.rfind("gnomon: " + words, 0), 0u) << answer.error;
    EXPECT_EQ(std::count(answer.error.begin(), answer.error.end(), '\n'), 1) << answer.error;
  }
  const Outcome missing = run("solve /nowhere/case.json");
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_EQ(missing.error.rfind("gnomon: /nowhere/case.json: ", 0), 0u) << missing.error;
}

TEST(Cli, ListsMethodsWithTheirSettings) {
  const Outcome text = run("methods");
  EXPECT_EQ(text.exitCode, 0);
  for (const char* word : {"pssm", "split", "lambda", "bias", "splits", "count", "fit", "logarithmic", "tight", "stable"}) EXPECT_NE(text.out.find(word), std::string::npos) << word;
  const Json list = Json::parse(run("methods --json").out);
  EXPECT_EQ(list[0]["name"], "pssm");
  EXPECT_EQ(list[0]["settings"].size(), 6u);
}

TEST(Cli, RenderWritesTheFilesOfTheContract) {
  const std::string folder = temporary("render");
  Json input = Json::parse(kCase);
  input["camera"] = Json::parse(R"({"position": [0, 1.7, 6], "forward": [0, -0.05, -1], "up": [0, 1, 0], "near": 0.5, "far": 300, "fov_y": 1.0, "aspect": 1.5})");
  input["image"] = {{"width", 150}, {"height", 100}};
  input.erase("scene");
  const Outcome answer = run("render - --scene colonnade --out " + folder, input.dump());
  ASSERT_EQ(answer.exitCode, 0) << answer.error;
  for (const char* file : {"shaded.png", "tinted.png", "difference.png", "maps.png"}) EXPECT_EQ(read(folder + "/" + file).rfind("\x89PNG", 0), 0u) << file;
  EXPECT_NE(read(folder + "/position.npy").find("(100, 150, 3)"), std::string::npos);
  EXPECT_NE(read(folder + "/normal.npy").find("'<f4'"), std::string::npos);
  EXPECT_NE(read(folder + "/lit.npy").find("(100, 150)"), std::string::npos);
  EXPECT_NE(read(folder + "/index.npy").find("'|u1'"), std::string::npos);
  EXPECT_EQ(Json::parse(read(folder + "/result.json"))["partitions"].size(), 4u);
  const Outcome unknown = run("render - --scene nowhere --out " + folder, input.dump());
  EXPECT_EQ(unknown.exitCode, 2);
  EXPECT_NE(unknown.error.find("colonnade"), std::string::npos);
}

}  // namespace
