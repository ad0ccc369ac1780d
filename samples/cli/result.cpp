#include "result.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "gnomon/error.h"

namespace gnomon::cli {
namespace {

void write(const Json& value, std::size_t depth, std::string& out) {
  const auto isLeaf = [](const Json& each) { return !each.is_structured(); };
  if (!value.is_structured() || value.empty() || (value.is_array() && std::all_of(value.begin(), value.end(), isLeaf))) {
    out += value.dump();
    return;
  }
  const std::string margin(2 * (depth + 1), ' ');
  out += value.is_array() ? "[\n" : "{\n";
  bool isFirst = true;
  for (const auto& item : value.items()) {
    if (!isFirst) out += ",\n";
    isFirst = false;
    out += margin;
    if (value.is_object()) out += Json(item.key()).dump() + ": ";
    write(item.value(), depth + 1, out);
  }
  out += "\n" + std::string(2 * depth, ' ') + (value.is_array() ? "]" : "}");
}

Json planesJson(const glm::dvec4* planes, int count) {
  Json out = Json::array();
  for (int i = 0; i < count; ++i) out.push_back({planes[i].x, planes[i].y, planes[i].z, planes[i].w});
  return out;
}

Json partitionJson(const Partition& partition) {
  Json matrix = Json::array();  // row-major; a float is exact as a double
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix.push_back(static_cast<double>(partition.clipFromWorld[column][row]));
  const glm::ivec4& v = partition.viewport;
  Json out;
  out["near"] = partition.near;
  out["far"] = partition.far;
  out["cull_planes"] = planesJson(partition.cullPlanes, partition.cullPlaneCount);
  out["world_to_clip"] = std::move(matrix);
  out["viewport"] = {v.x, v.y, v.z, v.w};
  out["layer"] = partition.layer;
  out["warp"] = warpName(partition.warp);
  if (partition.planeCount > 0) out["planes"] = planesJson(partition.planes, partition.planeCount);
  out["error"]["s"] = partition.error.s;
  out["error"]["t"] = partition.error.t;
  out["error"]["extent"] = partition.error.extent;
  return out;
}

// What the errors come to, beside what the maps are.
Json reportJson(const Frame& frame, const Solution& solution) {
  const auto costJson = [](const TexelCost& cost) -> Json {
    return {{"extent", cost.extent}, {"needed_texels", cost.needed}, {"spent_texels", cost.spent}, {"storage_factor", cost.storageFactor}};
  };
  Json out = costJson(texelCost(solution, frame.image));
  out["partitions"] = Json::array();
  out["seams"] = Json::array();
  for (int i = 0; i < solution.partitionCount; ++i) {
    out["partitions"].push_back(costJson(texelCost(solution.partitions[i], frame.image)));
    for (int k = i + 1; k < solution.partitionCount; ++k)
      if (const double jump = seamJump(frame, solution, i, k); jump > 0.0) out["seams"].push_back({{"between", {i, k}}, {"jump", jump}});
  }
  return out;
}

Json candidateJson(const AutoCandidate& candidate) {
  return {{"layout", layoutName(candidate.choice.layout)},
          {"warp", warpName(candidate.choice.warp)},
          {"maps", candidate.maps},
          {"needed_texels", candidate.neededTexels},
          {"texels", candidate.texels},
          {"error", candidate.error},
          {"cost_ns", candidate.cost},
          {"meets_target", candidate.isMet}};
}

// What auto compared.
Json whyJson(const AutoReport& why) {
  Json out;
  out["chosen"] = why.chosen >= 0 ? candidateJson(why.candidates[why.chosen]) : Json(nullptr);
  out["runner_up"] = why.runnerUp >= 0 ? candidateJson(why.candidates[why.runnerUp]) : Json(nullptr);
  out["compared"] = Json::array();
  for (int i = 0; i < why.count; ++i) out["compared"].push_back(candidateJson(why.candidates[i]));
  return out;
}

}  // namespace

std::string targetText(const Frame& frame, const AutoReport& why) {
  std::string text = shortest(std::ceil(why.texelsForTarget)) + " texels in at most " + std::to_string(frame.budget.partitions) +
                     (frame.budget.partitions == 1 ? " map" : " maps");
  if (why.mapsForTarget > 0)
    text += ", or " + std::to_string(why.mapsForTarget) + (frame.budget.texels > 0.0 ? " maps" : " maps of budget.resolution");
  return text;
}

Json resultJson(const std::string& method, const Frame& frame, const Solution& solution, double solveNs, const AutoReport* why) {
  Json out;
  out["status"] = "ok";
  out["method"] = method;
  out["atlas"] = {solution.atlas.x, solution.atlas.y};
  out["depth_clamp"] = solution.depthClamp;
  out["origin"] = {solution.originWs.x, solution.originWs.y, solution.originWs.z};
  out["partitions"] = Json::array();
  for (int i = 0; i < solution.partitionCount; ++i) out["partitions"].push_back(partitionJson(solution.partitions[i]));
  out["error"]["max"] = solution.maxError;
  out["error"]["storage_factor"] = solution.storageFactor;
  out["error"]["needed_texels"] = solution.neededTexels;
  out["error"]["limit_texels"] = solution.limitTexels > 0.0 ? Json(solution.limitTexels) : Json(nullptr);
  out["report"] = reportJson(frame, solution);
  if (why) out["report"]["auto"] = whyJson(*why);
  out["warnings"] = Json::array();
  for (int i = 0; i < kWarningCount; ++i) {
    const std::uint32_t bit = 1u << i;
    if ((solution.warnings & bit) == 0) continue;
    std::string text = warningText(static_cast<Warning>(bit));
    if (why && static_cast<Warning>(bit) == Warning::targetMissed) text += ": " + targetText(frame, *why);
    out["warnings"].push_back(text);
  }
  out["block"] = base64({reinterpret_cast<const std::uint8_t*>(&solution.block), sizeof solution.block});
  out["solve_ns"] = solveNs;
  return out;
}

std::string layOut(const Json& value) {
  std::string out;
  write(value, 0, out);
  return out + "\n";
}

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = static_cast<std::uint32_t>(bytes[i]) << 16;
    if (left > 1) group |= static_cast<std::uint32_t>(bytes[i + 1]) << 8;
    if (left > 2) group |= bytes[i + 2];
    for (std::size_t digit = 0; digit < 4; ++digit) out += digit <= left ? kDigits[(group >> (18 - 6 * digit)) & 63u] : '=';
  }
  return out;
}

double timedSolve(const Case& input, int repeat, Solution& solution) {
  using Clock = std::chrono::steady_clock;
  constexpr int kBatches = 101;  // of many solves each, where many are asked for: then reading the clock costs them nothing
  const int batch = std::max(repeat / kBatches, 1);
  std::vector<double> times;
  for (int done = 0; done < repeat && (done == 0 || solution.status == Status::ok);) {
    const int count = std::min(batch, repeat - done);
    const Clock::time_point start = Clock::now();
    for (int i = 0; i < count; ++i) (void)solve(input, input.frame, solution);
    times.push_back(std::chrono::duration<double, std::nano>(Clock::now() - start).count() / count);
    done += count;
  }
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::nth_element(times.begin(), middle, times.end());
  const double upper = *middle;
  if (times.size() % 2 == 1) return upper;
  return (upper + *std::max_element(times.begin(), middle)) / 2.0;
}

}  // namespace gnomon::cli
