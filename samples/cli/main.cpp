// The gnomon tool: solve a case, list the methods, render and judge a scene, do all of it for the built-in scenes, or check shaders.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>

#include <CLI/CLI.hpp>

#include "case.h"
#include "check_command.h"
#include "job.h"
#include "report_command.h"
#include "result.h"
#include "scene.h"
#include "walk_command.h"

namespace {

using namespace gnomon;
using cli::Case;
using cli::Json;
using cli::Refusal;

struct SolveArguments {
  std::string path, method;
  std::vector<std::string> fields;
  bool worldSpace = false, layers = false;
  int repeat = 1;

  void addTo(CLI::App& app) {
    app.add_option("case", path, "CASE.json, or - for standard input")->required();
    app.add_option("--method", method, "replaces the case's whole method object");
    app.add_option("--set", fields, "KEY=VALUE: a setting of the method, or any field by its dotted path")->allow_extra_args(false);
    app.add_flag("--world", worldSpace, "matrices take world positions instead of world - camera position");
    app.add_flag("--layers", layers, "one layer of an array texture for each map instead of an atlas");
  }

  [[nodiscard]] Case read() const {
    Json root = cli::readJson(path);
    if (!method.empty()) cli::setMethod(root, method);
    for (const std::string& field : fields) cli::setField(root, field);
    Case input = cli::parseCase(std::move(root));
    input.frame.worldSpace = worldSpace;
    if (layers) input.frame.shadowMap.layout = MapLayout::layers;
    return input;
  }
};

// Solves and answers with the RESULT; refuses as the library does.
Json solveCase(const Case& input, int repeat, Solution& solution) {
  const double ns = cli::timedSolve(input, repeat, solution);
  if (solution.status != Status::ok) throw Refusal(cli::refusalText(input, solution));
  if (input.method != "auto") return cli::resultJson(input.method, input.frame, solution, ns);
  const auto why = std::make_unique<AutoReport>();
  (void)cli::solve(input, input.frame, solution, why.get());
  return cli::resultJson(input.method, input.frame, solution, ns, why.get());
}

int solve(const SolveArguments& arguments) {
  const Case input = arguments.read();
  auto solution = std::make_unique<Solution>();
  std::cout << cli::layOut(solveCase(input, arguments.repeat, *solution));
  return 0;
}

int listMethods(bool isJson) {
  if (isJson) {
    Json out = Json::array();
    for (const cli::Method& method : cli::methods()) {
      Json settings = Json::array();
      for (const cli::Setting& setting : method.settings)
        settings.push_back(
            {{"name", setting.name}, {"values", setting.values}, {"default", setting.fallback}, {"meaning", setting.meaning}});
      out.push_back({{"name", method.name}, {"meaning", method.meaning}, {"settings", settings}});
    }
    std::cout << cli::layOut(out);
    return 0;
  }
  for (const cli::Method& method : cli::methods()) {
    std::cout << method.name << ": " << method.meaning << "\n";
    for (const cli::Setting& setting : method.settings)
      std::cout << "  " << std::left << std::setw(8) << setting.name << " " << setting.meaning << "\n           " << setting.values
                << "; default " << setting.fallback.dump() << "\n";
  }
  return 0;
}

void writeText(const std::string& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

// A file that is missing or broken is bad input.
offscreen::Mesh loadFile(const std::string& path) {
  try {
    return offscreen::loadGlb(path);
  } catch (const std::runtime_error& error) {
    throw Refusal(error.what());
  }
}

// A built-in scene by name, or a glTF file.
offscreen::Mesh loadScene(const std::string& name) {
  const std::vector<std::string> names = offscreen::builtInNames();
  if (std::find(names.begin(), names.end(), name) != names.end()) return offscreen::makeBuiltIn(name).mesh;
  if (!std::filesystem::exists(name)) {
    std::string list;
    for (const std::string& each : names) list += (list.empty() ? "" : ", ") + each;
    throw Refusal("--scene: must be a .glb file that exists or one of " + list + ", got " + name);
  }
  return loadFile(name);
}

// The side of a picture: the solver takes any size, a picture whole pixels that a texture can hold.
int pictureSide(const char* field, double side) {
  if (side != std::floor(side) || !(side >= 1.0 && side <= kMaxTextureSide))
    throw Refusal(std::string(field) + ": must be a whole number in [1, " + std::to_string(kMaxTextureSide) + "] to render, got " +
                  cli::shortest(side));
  return static_cast<int>(side);
}

offscreen::Filter filterNamed(const std::string& name) {
  if (name == "none") return offscreen::Filter::none;
  if (name == "3x3") return offscreen::Filter::box3x3;
  if (name == "tent") return offscreen::Filter::tent;
  throw Refusal("--filter: must be one of none, 3x3, tent, got " + name);
}

// Gives a case whose method asks for samples those of the view; null where it does not ask.
std::unique_ptr<offscreen::ViewSamples> sampleView(offscreen::Renderer& renderer, Case& input, Solution& solution) {
  if (cli::solve(input, input.frame, solution) != Status::samplesMissing) return nullptr;
  const ImageSize& image = input.frame.image;
  auto samples =
      std::make_unique<offscreen::ViewSamples>(renderer, input.frame, static_cast<int>(image.width), static_cast<int>(image.height));
  samples->samples.latency = input.latency;
  input.frame.samples = &samples->samples;
  return samples;
}

std::string percent(double share) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(3) << 100.0 * share << " %";
  return out.str();
}

// Whether the maps of a case can be made where the depth buffer is.
void requireSampled(const Case& input) {
  const SdsmSettings &asked = input.sdsm, plain;
  const bool isPlain =
      asked.scheme == plain.scheme && asked.bounds && asked.hysteresis == 0.0 && !asked.quantise && !asked.automatic && asked.count == 0;
  if (input.method != "sdsm" || !isPlain || input.frame.samples || input.frame.worldSpace ||
      input.frame.shadowMap.layout != MapLayout::atlas)
    throw Refusal("--on-gpu: needs method sdsm in its plain form, the view's own samples, no --world and no --layers");
}

int render(const SolveArguments& arguments, const std::string& scene, const std::string& folder, const std::string& filter, bool isOnGpu) {
  Case input = arguments.read();
  if (isOnGpu) requireSampled(input);
  offscreen::RenderOptions options;
  options.width = pictureSide("image.width", input.frame.image.width);
  options.height = pictureSide("image.height", input.frame.image.height);
  options.filter = filterNamed(filter);
  auto solution = std::make_unique<Solution>();
  Json result;  // what is refused is refused before anything starts; missing samples the view has
  if (cli::solve(input, input.frame, *solution) != Status::samplesMissing) result = solveCase(input, arguments.repeat, *solution);
  const offscreen::Mesh mesh = loadScene(scene);
  std::cerr << "building the ray tracer's tree, " << mesh.indices.size() / 3 << " triangles\n";
  const offscreen::Tracer tracer(mesh);
  offscreen::Renderer renderer;
  std::cerr << "rendering on " << renderer.device() << "\n";
  renderer.load(mesh);
  offscreen::RenderOutput image;
  if (isOnGpu) {
    const offscreen::ReduceTimes times = renderer.timeReductions(input.frame, options.width, options.height);
    const bool isByFragments = times.faster() == offscreen::ReduceBy::fragments;
    std::cerr << std::setprecision(3) << "depth buffer reduced by fragment shaders in " << times.fragments << " ms, by compute shaders in "
              << times.workgroups << " ms: by " << (isByFragments ? "fragment" : "compute") << " shaders from here on\n";
    image = renderer.renderSampled(input.frame, times.faster(), *solution, options);
    result = cli::resultJson(input.method, input.frame, *solution, 0.0);
  } else {
    const auto samples = sampleView(renderer, input, *solution);
    if (samples) result = solveCase(input, arguments.repeat, *solution);
    image = renderer.render(input.frame, *solution, options);
  }
  std::vector<std::uint8_t> truth = offscreen::traceTruth(tracer, input.frame, *solution, image);
  const offscreen::Picture picture = offscreen::judgePicture(std::move(image), std::move(truth), input.frame, *solution);
  offscreen::writePictures(picture, folder);
  offscreen::writeArrays(picture, folder);
  writeText(folder + "/result.json", cli::layOut(result));
  const offscreen::WrongPixels& wrong = picture.wrong;
  std::cout << "wrong " << percent(wrong.share()) << " of " << wrong.counted << " pixels that face the light (" << wrong.wrongNear
            << " within a pixel of a true edge, " << wrong.wrongFar << " farther), " << std::setprecision(3) << wrong.perEdge()
            << " per edge pixel; predicted error " << picture.predicted.mean << " on average, " << percent(picture.predicted.overOne)
            << " of the points over 1, " << picture.acrossEdges << " pixels across edges; " << folder << "/\n";
  return 0;
}

// The main job's table.
class Table {
 public:
  explicit Table(std::vector<std::string> head) { rows_.push_back(std::move(head)); }
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] std::string text() const {
    std::vector<std::size_t> widths(rows_[0].size());
    for (const auto& row : rows_)
      for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
    std::string out;
    for (const auto& row : rows_) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        const std::string space(widths[i] - row[i].size(), ' ');
        out += (i == 0 ? "" : "  ") + (i < kTextColumns ? row[i] + space : space + row[i]);
      }
      out += "\n";
    }
    return out;
  }

 private:
  static constexpr std::size_t kTextColumns = 2;  // names to the left, numbers to the right
  std::vector<std::vector<std::string>> rows_;
};

std::string number(double value, int digits) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(digits) << value;
  return out.str();
}

// Why auto chooses what it does: every choice that it compared, the chosen one and the next best first.
int explain(const SolveArguments& arguments) {
  const Case input = arguments.read();
  if (input.method != "auto") throw Refusal("method.name: must be auto to explain, got " + input.method);
  auto solution = std::make_unique<Solution>();
  const auto why = std::make_unique<AutoReport>();
  if (cli::solve(input, input.frame, *solution, why.get()) != Status::ok) throw Refusal(cli::refusalText(input, *solution));
  const Budget& budget = input.frame.budget;
  if (why->chosen < 0) {
    std::cout << "nothing to shadow: no map\n";
    return 0;
  }
  Table table({"", "choice", "maps", "texels", "error", "needed/limit", "cost"});
  const auto add = [&](const std::string& title, int i) {
    const AutoCandidate& candidate = why->candidates[i];
    table.add({title, cli::layoutName(candidate.choice.layout) + ", warp " + cli::warpName(candidate.choice.warp),
               std::to_string(candidate.maps), number(candidate.texels / 1e6, 3) + " M",
               number(candidate.error, 3) + (candidate.isMet ? "" : " (missed)"),
               solution->limitTexels > 0.0 ? number(candidate.neededTexels / solution->limitTexels, 2) : "-",
               number(candidate.cost / 1e3, 1) + " us"});
  };
  add("chosen", why->chosen);
  if (why->runnerUp >= 0) add("runner-up", why->runnerUp);
  for (int i = 0; i < why->count; ++i)
    if (i != why->chosen && i != why->runnerUp) add("", i);
  std::cout << table.text() << "\n";
  if (!input.automatic.hasTarget)
    std::cout << "no budget.target_error: the least error that the budget allows";
  else if (solution->maxError <= budget.targetError)
    std::cout << "target " << cli::shortest(budget.targetError) << " met at the least cost";
  else
    std::cout << "target " << cli::shortest(budget.targetError) << " missed; it takes " << cli::targetText(input.frame, *why);
  std::cout << "; certified error of the maps as made: " << number(solution->maxError, 3) << "\n";
  return 0;
}

// Renders and judges every view; pictures in folders under `folder`, the table on standard output and in table.txt.
int run(const std::string& file, const std::string& method, const std::string& folder) {
  constexpr double kWidth = 1280.0, kHeight = 720.0;
  cli::Case input = cli::methodCase(method.empty() ? "pssm" : method);
  constexpr int kTimings = 101;
  struct Job {
    offscreen::Mesh mesh;
    std::vector<offscreen::View> views;
  };
  const auto prepare = [](const std::string& name) {
    offscreen::BuiltIn scene = offscreen::makeBuiltIn(name);
    return Job{std::move(scene.mesh), std::move(scene.views)};
  };
  const auto open = [](const std::string& path) {
    Job job{loadFile(path), {}};
    job.views = offscreen::framedViews(job.mesh, kWidth / kHeight);
    return job;
  };
  Job given;  // a file is read first: one that cannot be used is refused before anything starts
  if (!file.empty()) given = open(file);
  const std::vector<std::string> names = file.empty() ? offscreen::builtInNames() : std::vector<std::string>{file};
  offscreen::Renderer renderer;
  std::cerr << "rendering on " << renderer.device() << ", " << kWidth << " x " << kHeight
            << ", four maps of 2048 x 2048 texels, unfiltered\n";
  Table table({"scene", "light", "passes", "texels", "max error", "mean", "across edges", "needed/limit", "wrong", "near edge", "farther",
               "solve", "frame"});
  std::filesystem::create_directories(folder);
  for (const std::string& name : names) {
    std::cerr << name << ": preparing\n";
    const Job job = file.empty() ? prepare(name) : std::move(given);
    const std::string title = file.empty() ? name : std::filesystem::path(file).stem().string();
    const offscreen::Tracer tracer(job.mesh);
    renderer.load(job.mesh);
    const Box bounds{job.mesh.min, job.mesh.max};
    for (const offscreen::View& view : job.views) {
      std::cerr << title << ": " << view.camera << ", " << view.light << " light\n";
      Frame frame;
      frame.camera = view.cam;
      frame.light.directionWs = view.lightDirectionWs;
      frame.image = {kWidth, kHeight};
      frame.scene.receivers = {&bounds, 1};
      auto solution = std::make_unique<Solution>();
      input.frame = frame;
      const auto samples = sampleView(renderer, input, *solution);
      const double ns = cli::timedSolve(input, kTimings, *solution);
      if (solution->status != Status::ok)
        throw std::runtime_error(title + ": " + statusField(solution->status) + " " + statusRule(solution->status));
      const offscreen::Picture picture = offscreen::makePicture(renderer, tracer, input.frame, *solution, {});
      offscreen::writePictures(picture, folder + "/" + title + "-" + view.camera + "-" + view.light);
      double texels = 0.0;
      for (int i = 0; i < solution->partitionCount; ++i)
        texels += static_cast<double>(solution->partitions[i].viewport.z) * solution->partitions[i].viewport.w;
      const std::string ratio = solution->limitTexels > 0.0 ? number(solution->neededTexels / solution->limitTexels, 2) : "-";
      table.add({title + ", " + view.camera, view.light, std::to_string(solution->partitionCount), number(texels / 1e6, 1) + " M",
                 number(solution->maxError, 2), number(picture.predicted.mean, 2), number(picture.acrossEdges, 2), ratio,
                 percent(picture.wrong.share()), std::to_string(picture.wrong.wrongNear), std::to_string(picture.wrong.wrongFar),
                 number(ns / 1e3, 2) + " us", number(picture.image.frameMs, 0) + " ms"});
    }
  }
  const std::string text = table.text() +
                           "\nmax error: widest texel edge over a pixel's width, predicted; mean: over the points seen that face the "
                           "light; across edges: pixels\nthat a texel is wide across true shadow edges, mean; needed/limit: texels for "
                           "error 1 over the least that any map could do with; wrong: share "
                           "of the pixels that face "
                           "the light, against ray tracing; near edge: wrong pixels within one pixel of a true shadow edge. Pictures: " +
                           folder + "/*/\n";
  writeText(folder + "/table.txt", text);
  std::cout << text;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("gnomon: shadow-map partitions, solved, rendered, judged and checked");
  app.require_subcommand(1);
  app.set_version_flag("--version", GNOMON_VERSION);
  SolveArguments arguments;
  std::string scene, folder, file, filter = "none";
  bool isJson = false;

  CLI::App* solveCommand = app.add_subcommand("solve", "solve a case; RESULT.json on standard output");
  arguments.addTo(*solveCommand);
  CLI::App* explainCommand = app.add_subcommand("explain", "what method auto compares for a case, what it chooses and why");
  arguments.addTo(*explainCommand);
  CLI::App* methodsCommand = app.add_subcommand("methods", "methods and their settings, defaults and ranges");
  methodsCommand->add_flag("--json", isJson, "as JSON");
  CLI::App* renderCommand = app.add_subcommand("render", "solve a case, render a scene with it and judge the picture against ray tracing");
  arguments.addTo(*renderCommand);
  for (CLI::App* command : {solveCommand, renderCommand})
    command->add_option("--repeat", arguments.repeat, "solve so often; solve_ns is the median of some hundred batches")
        ->check(CLI::Range(1, 100000000));
  renderCommand->add_option("--scene", scene, "a .glb file, or a built-in scene: colonnade, relief, city, hall")->required();
  renderCommand->add_option("--out", folder, "folder for pictures and arrays")->required();
  renderCommand->add_option("--filter", filter, "none, 3x3 or tent (give margin.filter 1 or 2 with them)");
  bool isOnGpu = false;
  renderCommand->add_flag("--on-gpu", isOnGpu,
                          "sdsm: maps made where the view's depth buffer is, by the faster of two reductions, and drawn indirectly");
  CLI::App* runCommand = app.add_subcommand("run", "the main job: render and judge the built-in scenes, or a .glb");
  runCommand->add_option("scene", file, "a .glb file; none: the built-in scenes");
  runCommand->add_option("--out", folder, "folder for pictures and the table")->default_val("out");
  runCommand->add_option("--method", arguments.method, "the method, as it stands");
  std::vector<std::string> walked;
  std::string walkFolder;
  CLI::App* walkCommand =
      app.add_subcommand("walk", "what light-plane rows and samples of the view cost and give along a walk, beside splits");
  int steps = 96;
  walkCommand->add_option("--steps", steps, "of the walk; one in 24 is drawn with each method")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  walkCommand->add_option("scenes", walked, ".glb files; none: the built-in scenes");
  walkCommand->add_option("--out", walkFolder, "folder for pictures and the table")->default_val("out/walk");
  report::ReportArguments reportArguments;
  CLI::App* reportCommand = app.add_subcommand("report", "speed against error: every method on the same views, as a page, JSON and CSV");
  reportArguments.addTo(*reportCommand);
  CLI::App* checkCommand = app.add_subcommand("check", "check shaders that use the includes: file, line, cause and what to do");
  cli::CheckArguments checkArguments;
  checkArguments.addTo(*checkCommand);

  try {
    app.parse(argc, argv);
    int code = 0;
    if (solveCommand->parsed())
      code = solve(arguments);
    else if (explainCommand->parsed())
      code = explain(arguments);
    else if (methodsCommand->parsed())
      code = listMethods(isJson);
    else if (renderCommand->parsed())
      code = render(arguments, scene, folder, filter, isOnGpu);
    else if (walkCommand->parsed())
      code = cli::walk(walked, walkFolder, steps);
    else if (reportCommand->parsed())
      code = report::report(reportArguments);
    else if (checkCommand->parsed())
      code = cli::check(checkArguments);
    else
      code = run(file, arguments.method, folder);
    if (!std::cout.flush()) throw std::runtime_error("standard output: cannot be written");
    return code;
  } catch (const CLI::Success& asked) {  // --help
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "gnomon: %s\n", error.what());
  } catch (const Refusal& refusal) {
    std::fprintf(stderr, "gnomon: %s\n", refusal.what());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gnomon: %s\n", error.what());
    return 1;
  }
  return 2;
}
