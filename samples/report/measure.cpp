#include "measure.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include "gnomon/camera.h"
#include "gnomon/samples.h"
#include "picture.h"
#include "result.h"

namespace gnomon::report {
namespace {

using cli::Json;
using offscreen::kNothing;
using offscreen::RenderOutput;
using offscreen::View;

constexpr double kStride = 0.05;  // of the nearest visible depth, forward in each step of the camera path
constexpr double kCameraTurn = 0.1, kLightTurn = 0.25;  // degrees, about the camera's up, in each step
constexpr int kSolves = 31;
constexpr int kCropWidth = 320, kCropHeight = 180;

Json vectorJson(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

// The case of one solve, without its method and budget.
Json caseJson(const Camera& camera, const glm::dvec3& light, const Box& bounds, const Study& study, const Json& samples) {
  Json out;
  out["camera"] = {{"position", vectorJson(camera.positionWs)},
                   {"forward", vectorJson(camera.forwardWs)},
                   {"up", vectorJson(camera.upWs)},
                   {"near", camera.near},
                   {"far", camera.far},
                   {"tangents", {camera.left, camera.right, camera.down, camera.up}}};
  out["light"] = {{"type", "directional"}, {"direction", vectorJson(light)}};
  out["image"] = {{"width", study.width}, {"height", study.height}};
  out["scene"] = {{"receivers", {{{"min", vectorJson(bounds.minWs)}, {"max", vectorJson(bounds.maxWs)}}}}};
  out["margin"] = {{"normal_offset", 0.5}};
  if (!samples.is_null()) out["samples"] = samples;
  return out;
}

Json methodJson(const Variant& variant) {
  Json out{{"name", variant.method}};
  out.update(variant.settings);
  return out;
}

cli::Case caseOf(Json root, const Variant& variant, double texels) {
  root["method"] = methodJson(variant);
  root["budget"] = {{"partitions", variant.partitions}, {"texels", variant.texels > 0.0 ? variant.texels : texels}};
  return cli::parseCase(std::move(root));
}

// What a view samples, by its depth buffer: range, histogram, light-space bounds. ms: the time that takes on the processor.
Json samplesJson(const Frame& frame, const RenderOutput& image, double& ms) {
  constexpr int kBins = 256;
  std::vector<float> depths(image.lit.size());
  const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs);
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const glm::dvec3 fromEye(image.position[3 * i], image.position[3 * i + 1], image.position[3 * i + 2]);
    depths[i] = image.lit[i] == kNothing ? 1.0f : static_cast<float>(windowDepth(frame.camera, glm::dot(fromEye, forward)));
  }
  const std::ptrdiff_t width = image.width;
  const DepthImage buffer{depths.data() + width * (image.height - 1), image.width, image.height, -width};  // the top row comes first
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Samples samples;
  sampleRange(frame.camera, buffer, samples.near, samples.far);
  if (!(samples.near < samples.far)) return nullptr;
  std::vector<float> edges(kBins + 1);
  std::vector<std::uint32_t> counts(kBins);
  windowEdges(frame.camera, samples.near, samples.far, edges);
  sampleHistogram(frame.camera, buffer, edges, counts);
  glm::dmat3 lsFromView;
  if (lightForSamples(frame, lsFromView) != Status::ok) throw std::runtime_error("samples: no light");
  std::vector<SampleBounds> bounds(kMaxPartitions);
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const auto at = [&](std::size_t end) {
      return samples.near * std::pow(samples.far / samples.near, static_cast<double>(end) / kMaxPartitions);
    };
    bounds[i].near = at(i);
    bounds[i].far = i + 1 == bounds.size() ? samples.far : at(i + 1);
  }
  sampleBounds(frame.camera, buffer, lsFromView, bounds);
  bounds.resize(keepBounds(bounds));
  ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  Json out{{"near", samples.near}, {"far", samples.far}, {"histogram", counts}, {"bounds", Json::array()}};
  for (const SampleBounds& each : bounds)
    out["bounds"].push_back(
        {{"near", each.near}, {"far", each.far}, {"min", {each.least.x, each.least.y}}, {"max", {each.most.x, each.most.y}}});
  return out;
}

glm::dvec3 turned(const glm::dvec3& v, const glm::dvec3& axis, double degrees) {
  return glm::dvec3(glm::rotate(glm::dmat4(1.0), glm::radians(degrees), axis) * glm::dvec4(v, 0.0));
}

double texelsOf(const Solution& solution) {
  double texels = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i)
    texels += static_cast<double>(solution.partitions[i].viewport.z) * solution.partitions[i].viewport.w;
  return texels;
}

// Median and quartiles.
Json spread(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto low = static_cast<std::size_t>(place);
    const std::size_t high = std::min(low + 1, values.size() - 1);
    return values[low] + (place - static_cast<double>(low)) * (values[high] - values[low]);
  };
  return {at(0.5), at(0.25), at(0.75)};
}

// Where a crop shows most true shadow edges.
glm::ivec2 cropAt(int width, int height, const std::vector<std::uint8_t>& edge) {
  glm::ivec2 best(0);
  int most = -1;
  for (int y = 0; y + kCropHeight <= height; y += 20)
    for (int x = 0; x + kCropWidth <= width; x += 20) {
      int count = 0;
      for (int v = y; v < y + kCropHeight; ++v)
        for (int u = x; u < x + kCropWidth; ++u) count += edge[static_cast<std::size_t>(v * width + u)];
      if (count > most) {
        most = count;
        best = {x, y};
      }
    }
  return best;
}

std::vector<std::uint8_t> crop(const std::vector<std::uint8_t>& rgb, int width, const glm::ivec2& from) {
  std::vector<std::uint8_t> out;
  for (int y = from.y; y < from.y + kCropHeight; ++y) {
    const auto row = rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * width + from.x);
    out.insert(out.end(), row, row + 3 * kCropWidth);
  }
  return out;
}

// Letters and digits, and dashes for the rest.
std::string fileName(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      out += c;
    else if (!out.empty() && out.back() != '-')
      out += '-';
  }
  return out.substr(0, out.find_last_not_of('-') + 1);
}

}  // namespace

Json keyOf(const Study& study, const std::string& scene, const View& view, double texels, const Variant& variant, const Effort& effort) {
  return {{"study", study.name},
          {"scene", scene},
          {"camera", view.camera},
          {"light", view.light},
          {"width", study.width},
          {"height", study.height},
          {"label", variant.label},
          {"method", methodJson(variant)},
          {"partitions", variant.partitions},
          {"texels", variant.texels > 0.0 ? variant.texels : texels},
          {"group_texels", texels},
          {"samples", variant.samples},
          {"repetitions", effort.repetitions},
          {"steps", study.isPath ? effort.steps : 0}};
}

// A view and the steps of its paths. The pictures of the steps are drawn from the first camera: the same points, other maps.
struct Stage::Seen {
  struct Step {
    Json plain, withSamples;  // cases without method and budget
    std::vector<std::uint8_t> truth, counted;
  };
  std::string study;
  View view;
  double samplesMs = 0.0;
  std::vector<Step> camera, light;  // both begin with the view itself
};

Stage::~Stage() = default;

Stage::Stage(offscreen::Renderer& renderer, const std::string& scene) : renderer_(renderer), scene_(scene) {
  const std::vector<std::string> names = offscreen::builtInNames();
  offscreen::Mesh mesh;
  if (std::find(names.begin(), names.end(), scene) != names.end()) {
    offscreen::BuiltIn builtIn = offscreen::makeBuiltIn(scene);
    mesh = std::move(builtIn.mesh);
    views_ = std::move(builtIn.views);
  } else {
    mesh = offscreen::loadGlb(scene);
    views_ = offscreen::standingViews(mesh, 16.0 / 9.0);  // first: in the framed ones most settings are alike
    for (offscreen::View& view : offscreen::framedViews(mesh, 16.0 / 9.0)) views_.push_back(std::move(view));
  }
  bounds_ = {mesh.min, mesh.max};
  tracer_ = std::make_unique<offscreen::Tracer>(mesh);
  renderer_.load(mesh);
  name_ = std::filesystem::path(scene).stem().string();
}

Stage::Seen& Stage::look(const Study& study, const View& given, const Effort& effort) {
  if (seen_ && seen_->study == study.name && seen_->view.camera == given.camera && seen_->view.light == given.light) return *seen_;
  seen_ = std::make_unique<Seen>();
  Seen& seen = *seen_;
  seen.study = study.name;
  seen.view = given;
  Camera& base = seen.view.cam;
  const double aspect = static_cast<double>(study.width) / study.height;
  base.left = base.right = 0.5 * (base.down + base.up) * aspect;

  offscreen::RenderOptions options{.width = study.width, .height = study.height, .time = false, .pictures = false};
  const auto solution = std::make_unique<Solution>();
  const glm::dvec3 up = glm::normalize(base.upWs), forward = glm::normalize(base.forwardWs);
  RenderOutput first;
  const auto step = [&](const Camera& camera, const glm::dvec3& light, bool isCamera) {
    Seen::Step out;
    out.plain = caseJson(camera, light, bounds_, study, nullptr);
    const cli::Case input = caseOf(out.plain, {.label = "", .method = "pssm"}, 4.0 * 256.0 * 256.0);
    if (cli::solve(input, input.frame, *solution) != Status::ok)
      throw std::runtime_error(name_ + ": " + cli::refusalText(input, *solution));
    RenderOutput moved;
    if (isCamera) moved = renderer_.render(input.frame, *solution, options);
    if (first.lit.empty()) first = moved;
    double ms = 0.0;
    out.withSamples = caseJson(camera, light, bounds_, study, samplesJson(input.frame, isCamera ? moved : first, ms));
    if (seen.camera.empty()) seen.samplesMs = ms;
    if (seen.camera.empty() || !isCamera) {
      out.truth = offscreen::traceTruth(*tracer_, input.frame, *solution, first);
      out.counted = offscreen::countedPixels(out.truth, first.normal, light);
    } else {
      out.truth = seen.camera.front().truth;
      out.counted = seen.camera.front().counted;
    }
    return out;
  };
  seen.camera.push_back(step(base, given.lightDirectionWs, true));
  seen.light.push_back(seen.camera.front());
  for (int i = 1; study.isPath && i <= effort.steps; ++i) {
    Camera camera = base;
    camera.positionWs += forward * (kStride * base.near * i);
    camera.forwardWs = turned(forward, up, kCameraTurn * i);
    seen.camera.push_back(step(camera, given.lightDirectionWs, true));
    seen.light.push_back(step(base, turned(given.lightDirectionWs, up, kLightTurn * i), false));
  }
  return seen;
}

std::vector<Json> Stage::measure(const Study& study, const View& view, double texels, const Effort& effort, const std::string& folder,
                                 const std::function<void(const Shot&)>& shots) {
  Seen& seen = look(study, view, effort);
  struct Job {
    Json record;
    cli::Case input;
    std::unique_ptr<Solution> solution;
    std::vector<double> shadowMs, frameMs;
  };
  const auto optionsWith = [&](bool pictures) {
    return offscreen::RenderOptions{.width = study.width, .height = study.height, .time = false, .pictures = pictures};
  };

  std::vector<Job> jobs;
  for (const Variant& variant : study.variants) {
    const Json& root = variant.samples ? seen.camera[0].withSamples : seen.camera[0].plain;
    Job job{{{"key", keyOf(study, scene_, view, texels, variant, effort)}},
            caseOf(root, variant, texels),
            std::make_unique<Solution>(),
            {},
            {}};
    Json& record = job.record;
    record["order"] = static_cast<int>(&variant - study.variants.data());
    record["device"] = renderer_.device();
    const double ns = cli::timedSolve(job.input, kSolves, *job.solution);

    const std::string caseName =
        "cases/" + fileName(study.name + "-" + name_ + "-" + view.camera + "-" + view.light + (variant.samples ? "-samples" : "")) +
        ".json";
    std::filesystem::create_directories(folder + "/cases");
    std::ofstream(folder + "/" + caseName) << cli::layOut(root);
    const bool isFile = std::filesystem::exists(scene_);  // else a built-in scene's name
    std::string command = "gnomon render " + caseName + " --scene " +
                          (isFile ? "'" + std::filesystem::absolute(scene_).string() + "'" : scene_) + " --method " + variant.method;
    for (const auto& [key, value] : variant.settings.items())
      command += " --set " + key + "=" + (value.is_string() ? value.get<std::string>() : value.dump());
    command += " --set budget.partitions=" + std::to_string(variant.partitions) +
               " --set budget.texels=" + cli::shortest(variant.texels > 0.0 ? variant.texels : texels) + " --out DIR";
    record["command"] = command;
    if (job.solution->status != Status::ok) {
      record["refused"] = cli::refusalText(job.input, *job.solution);
      jobs.push_back(std::move(job));
      continue;
    }

    const Solution& solution = *job.solution;
    const Frame& frame = job.input.frame;
    const bool isPictured = study.isPath && variant.pictured && shots;
    const offscreen::Picture picture =
        offscreen::judgePicture(renderer_.render(frame, solution, optionsWith(isPictured)), seen.camera[0].truth, frame, solution);
    const offscreen::WrongPixels& wrong = picture.wrong;
    std::size_t unserved = 0;
    for (std::size_t i = 0; i < picture.counted.size(); ++i) unserved += picture.counted[i] && picture.image.index[i] == 255;
    record["solve_us"] = ns / 1e3;
    record["passes"] = solution.partitionCount;
    record["texels"] = texelsOf(solution);
    record["needed_texels"] = solution.neededTexels;
    record["limit_texels"] = solution.limitTexels;
    record["needed_over_limit"] = solution.limitTexels > 0.0 ? Json(solution.neededTexels / solution.limitTexels) : Json(nullptr);
    record["max_error"] = solution.maxError;
    record["mean_error"] = picture.predicted.mean;
    record["texel_across_edges"] = picture.acrossEdges;
    record["over_one"] = picture.predicted.overOne;
    record["shadow_triangles"] = picture.image.shadowTriangles;
    record["counted"] = wrong.counted;
    record["edge"] = wrong.edge;
    record["wrong"] = wrong.wrong;
    record["wrong_near"] = wrong.wrongNear;
    record["wrong_far"] = wrong.wrongFar;
    record["wrong_share"] = wrong.share();
    record["wrong_per_edge"] = wrong.perEdge();
    record["wrong_distance"] = wrong.meanDistance;
    record["unserved"] = unserved;
    if (variant.samples) record["samples_ms"] = seen.samplesMs;

    // Pixels whose answer changes from step to step although the truth does not.
    const auto flips = [&](const std::vector<Seen::Step>& path) -> Json {
      if (path.size() < 2) return nullptr;
      double count = 0.0;
      RenderOutput before = picture.image;
      for (std::size_t i = 1; i < path.size(); ++i) {
        cli::Case moved = caseOf(variant.samples ? path[i].withSamples : path[i].plain, variant, texels);
        const auto there = std::make_unique<Solution>();
        if (cli::solve(moved, moved.frame, *there) != Status::ok) return nullptr;
        Frame seenFrom = moved.frame;
        seenFrom.camera = frame.camera;
        offscreen::RenderOptions held = optionsWith(false);
        held.selectByViewDepth = true;  // the depth buffer is the first camera's, the block the moved one's
        RenderOutput after = renderer_.render(seenFrom, *there, held);
        for (std::size_t p = 0; p < after.lit.size(); ++p)
          count += path[i].counted[p] && path[i - 1].counted[p] && path[i].truth[p] == path[i - 1].truth[p] && before.index[p] != 255 &&
                   after.index[p] != 255 && before.lit[p] != after.lit[p];
        before = std::move(after);
      }
      return count / static_cast<double>(path.size() - 1);
    };
    record["flips_camera"] = flips(seen.camera);
    record["flips_light"] = flips(seen.light);

    if (isPictured) {
      const RenderOutput& image = picture.image;
      const glm::ivec2 from =
          cropAt(image.width, image.height, offscreen::edgePixels(image.width, image.height, picture.truth, picture.counted));
      const std::string name = fileName(name_ + "-" + view.camera + "-" + view.light + "-" + variant.label);
      const std::vector<std::uint8_t> difference =
          offscreen::differencePicture(image.width, image.height, image.lit, picture.truth, picture.counted);
      shots({name + "-grid.jpg", offscreen::encodeJpeg(kCropWidth, kCropHeight, crop(image.tinted, image.width, from), 82)});
      shots({name + "-difference.png", offscreen::encodePng(kCropWidth, kCropHeight, 3, crop(difference, image.width, from))});
      record["shots"] = {name + "-grid.jpg", name + "-difference.png"};
      if (&variant == &study.variants.front()) {
        const std::string whole = fileName(name_ + "-" + view.camera + "-" + view.light) + ".jpg";
        shots({whole, offscreen::encodeJpeg(image.width, image.height, image.shaded, 82)});
        record["whole"] = whole;
      }
    }
    jobs.push_back(std::move(job));
  }

  // Forward and back by turns, and each time from another one on: none is always first, or always after the same one.
  const std::size_t count = jobs.size();
  for (std::size_t repetition = 0; repetition < static_cast<std::size_t>(effort.repetitions); ++repetition)
    for (std::size_t turn = 0; turn < count; ++turn) {
      const std::size_t place = (turn + repetition * count / static_cast<std::size_t>(effort.repetitions)) % count;
      Job& job = jobs[repetition % 2 == 0 ? place : count - 1 - place];
      if (job.solution->status != Status::ok) continue;
      const RenderOutput image = renderer_.render(job.input.frame, *job.solution, optionsWith(false));
      job.shadowMs.push_back(image.shadowMs);
      job.frameMs.push_back(image.frameMs);
    }
  std::vector<Json> records;
  for (Job& job : jobs) {
    if (!job.frameMs.empty()) {
      job.record["shadow_ms"] = spread(job.shadowMs);
      job.record["frame_ms"] = spread(job.frameMs);
    }
    records.push_back(std::move(job.record));
  }
  return records;
}

}  // namespace gnomon::report
