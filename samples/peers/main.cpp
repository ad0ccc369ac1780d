// gnomon_peers: real systems' cascades judged by the measure that judges ours.
//
//     gnomon_peers cases FOLDER              the built-in scenes' views as whole frusta, four maps of 1024 x 1024
//     gnomon_peers judge OUT CASE... -- RESULTS.jsonl...    a table on standard output; OUT gets peers.json
//
// Both sides are sampled alike: rays through a grid over the image, depths from each slice's near end to its far end. Lateral coverage only:
// depth ranges follow casters, and these cases have none.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>

#include <glm/geometric.hpp>

#include "case.h"
#include "gnomon/camera.h"
#include "gnomon/error.h"
#include "result.h"
#include "scene.h"

namespace {

using namespace gnomon;
using cli::Json;

struct Judged {
  double needed = 0.0;  // over the limit
  double uncovered = 0.0;  // share of the sampled points that lie outside their map
};

// A map as any system has it: which depths, which matrix (from world - camera position), how many texels.
struct Map {
  double near, far;
  glm::mat4 clipFromWorld;
  glm::ivec2 size;
  std::vector<glm::dvec4> planes;  // serves only these half-spaces, world
};

Judged judge(const Frame& frame, double limit, const std::vector<Map>& maps) {
  constexpr int kColumns = 33, kRows = 19, kDepths = 33;
  constexpr double kOutside = 1.0 + 1e-6;
  const Camera& camera = frame.camera;
  const glm::dvec3 forward = glm::normalize(camera.forwardWs), right = glm::normalize(glm::cross(forward, camera.upWs)),
                   up = glm::cross(right, forward), light = glm::normalize(frame.light.directionWs);
  Judged out;
  double points = 0.0;
  for (const Map& map : maps) {
    double s = 0.0, t = 0.0;
    const glm::ivec4 viewport(0, 0, map.size);
    for (int k = 0; k < kDepths; ++k) {
      const double z = map.near * std::pow(map.far / map.near, static_cast<double>(k) / (kDepths - 1));
      for (int j = 0; j < kRows; ++j)
        for (int i = 0; i < kColumns; ++i) {
          const double x = -camera.left + (camera.left + camera.right) * i / (kColumns - 1),
                       y = -camera.down + (camera.down + camera.up) * j / (kRows - 1);
          const glm::dvec3 point = z * (forward + x * right + y * up);
          if (std::any_of(map.planes.begin(), map.planes.end(),
                          [&](const glm::dvec4& plane) { return glm::dot(glm::dvec3(plane), point + camera.positionWs) + plane.w < 0.0; }))
            continue;
          const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(point, 1.0);
          ++points;
          if (!(clip.w > 0.0 && std::abs(clip.x) <= kOutside * clip.w && std::abs(clip.y) <= kOutside * clip.w)) {
            ++out.uncovered;
            continue;
          }
          const TexelError texel = texelSize(map.clipFromWorld, viewport, light, point);
          const double pixel = pixelWidth(camera, frame.image, z);
          s = std::max(s, texel.s / pixel);
          t = std::max(t, texel.t / pixel);
        }
    }
    out.needed += s * t * map.size.x * map.size.y;
  }
  out.needed /= limit;
  out.uncovered /= std::max(points, 1.0);
  return out;
}

int writeCases(const std::string& folder) {
  std::filesystem::create_directories(folder);
  const auto vectorJson = [](const glm::dvec3& v) { return Json{v.x, v.y, v.z}; };
  for (const std::string& name : offscreen::builtInNames())
    for (const offscreen::View& view : offscreen::makeBuiltIn(name).views) {
      const Camera& c = view.cam;
      Json out;
      out["id"] = name + ", " + view.camera + ", " + view.light;
      out["camera"] = {{"position", vectorJson(c.positionWs)},
                       {"forward", vectorJson(c.forwardWs)},
                       {"up", vectorJson(c.upWs)},
                       {"near", c.near},
                       {"far", c.far},
                       {"fov_y", 2.0 * std::atan(c.up)},
                       {"aspect", c.right / c.up}};
      out["light"] = {{"type", "directional"}, {"direction", vectorJson(view.lightDirectionWs)}};
      out["image"] = {{"width", 1920}, {"height", 1080}};
      out["budget"] = {{"partitions", 4}, {"resolution", 1024}};
      std::ofstream(folder + "/" + name + "-" + view.camera + "-" + view.light + ".json") << cli::layOut(out);
    }
  return 0;
}

struct Line {
  std::string system, settings;
  double logNeeded = 0.0, worstUncovered = 0.0, solveUs = 0.0;
  int cases = 0, uncoveredCases = 0;
  std::map<std::string, double> needed;  // by case
};

int judgeAll(const std::string& folder, const std::vector<std::string>& cases, const std::vector<std::string>& results) {
  std::vector<Line> lines;
  std::map<std::string, std::pair<cli::Case, double>> known;
  const auto add = [&](const std::string& system, const std::string& settings, const std::string& name, const Judged& judged, double us) {
    auto line =
        std::find_if(lines.begin(), lines.end(), [&](const Line& each) { return each.system == system && each.settings == settings; });
    if (line == lines.end()) line = lines.insert(lines.end(), Line{.system = system, .settings = settings, .needed = {}});
    ++line->cases;
    line->logNeeded += std::log(judged.needed);
    line->uncoveredCases += judged.uncovered > 0.0;
    line->worstUncovered = std::max(line->worstUncovered, judged.uncovered);
    line->solveUs += us;
    line->needed[name] = judged.needed;
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> ours{
      {"pssm", {"method.name=pssm"}},
      {"zp+w, LiSPSM", {"method.name=lloyd", "method.scheme=zp+w", "method.warp=lispsm"}},
      {"best", {"method.name=lloyd", "method.scheme=best"}}};
  for (const std::string& path : cases) {
    Json root = cli::readJson(path);
    for (const auto& [settings, fields] : ours) {
      Json mine = root;
      mine.erase("method");
      for (const std::string& field : fields) cli::setField(mine, field);
      cli::Case input = cli::parseCase(std::move(mine));
      const auto solution = std::make_unique<Solution>();
      const double ns = cli::timedSolve(input, 201, *solution);
      if (solution->status != Status::ok) throw cli::Refusal(path + ": " + cli::refusalText(input, *solution));
      std::vector<Map> maps;
      for (int i = 0; i < solution->partitionCount; ++i) {
        const Partition& p = solution->partitions[i];
        maps.push_back({p.near, p.far, p.clipFromWorld, {p.viewport.z, p.viewport.w}, {p.planes, p.planes + p.planeCount}});
      }
      add("gnomon", settings, path, judge(input.frame, solution->limitTexels, maps), ns / 1e3);
      known.insert_or_assign(path, std::pair(std::move(input), solution->limitTexels));
    }
  }
  for (const std::string& path : results) {
    std::ifstream file(path);
    for (std::string text; std::getline(file, text);) {
      if (text.empty() || text[0] != '{') continue;
      const Json result = Json::parse(text);
      const auto name = result["case"].get<std::string>();
      const auto& [input, limit] = known.at(name);
      std::vector<Map> maps;
      for (const Json& each : result["partitions"]) {
        // From world coordinates in the system's precision to ours: the camera's position taken out in double.
        glm::dmat4 clip;
        for (int row = 0; row < 4; ++row)
          for (int column = 0; column < 4; ++column)
            clip[column][row] = each["world_to_clip"][static_cast<std::size_t>(4 * row + column)].get<double>();
        clip[3] = clip * glm::dvec4(input.frame.camera.positionWs, 1.0);
        maps.push_back({each["near"], each["far"], glm::mat4(clip), {each["size"][0].get<int>(), each["size"][1].get<int>()}, {}});
      }
      add(result["system"], result["settings"], name, judge(input.frame, limit, maps), result["solve_us"]);
    }
  }
  // Where ours need more texels than some system's.
  Json out{{"cases", cases.size()}, {"lost", Json::array()}, {"rows", Json::array()}};
  for (const Line& theirs : lines) {
    if (theirs.system == "gnomon") continue;
    for (const auto& [name, needed] : theirs.needed) {
      std::string beaten;
      for (const Line& mine : lines)
        if (mine.system == "gnomon" && mine.needed.at(name) > needed) beaten += (beaten.empty() ? "" : "; ") + mine.settings;
      if (!beaten.empty())
        out["lost"].push_back({{"case", std::filesystem::path(name).stem().string()},
                               {"system", theirs.system},
                               {"settings", theirs.settings},
                               {"needed_over_limit", needed},
                               {"ours", beaten}});
    }
  }
  std::printf("%-20s %-24s %12s %10s %12s %12s\n", "system", "settings", "needed/limit", "solve, us", "uncovered in", "at worst, %");
  for (const Line& line : lines) {
    const double needed = std::exp(line.logNeeded / line.cases), us = line.solveUs / line.cases;
    std::printf("%-20s %-24s %12.2f %10.1f %6d of %2d %12.3f\n", line.system.c_str(), line.settings.c_str(), needed, us,
                line.uncoveredCases, line.cases, 100.0 * line.worstUncovered);
    out["rows"].push_back({{"system", line.system},
                           {"settings", line.settings},
                           {"needed_over_limit", needed},
                           {"solve_us", us},
                           {"uncovered_cases", line.uncoveredCases},
                           {"cases", line.cases},
                           {"worst_uncovered", line.worstUncovered}});
  }
  for (const Json& lost : out["lost"])
    std::printf("lost: %s, %s (%.2f) beats %s\n", lost["case"].get<std::string>().c_str(),
                (lost["system"].get<std::string>() + ", " + lost["settings"].get<std::string>()).c_str(),
                lost["needed_over_limit"].get<double>(), lost["ours"].get<std::string>().c_str());
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/peers.json") << cli::layOut(out);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  try {
    if (words.size() == 2 && words[0] == "cases") return writeCases(words[1]);
    const auto dashes = std::find(words.begin(), words.end(), "--");
    if (words.size() > 3 && words[0] == "judge" && dashes != words.end())
      return judgeAll(words[1], {words.begin() + 2, dashes}, {dashes + 1, words.end()});
    std::fprintf(stderr, "usage: gnomon_peers cases FOLDER | judge FOLDER CASE... -- RESULTS.jsonl...\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gnomon_peers: %s\n", error.what());
    return 1;
  }
}
