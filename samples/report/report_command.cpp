#include "report_command.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "measure.h"
#include "page.h"
#include "profile.h"
#include "result.h"
#include "summary.h"

namespace gnomon::report {
namespace {

using cli::Json;
using cli::Refusal;
namespace fs = std::filesystem;

constexpr const char* kJobs = "/jobs.jsonl";
constexpr const char* kProgram = "/program.txt";  // what measured them

void writeText(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

// True where a file's last line was cut off: a run that was killed while it wrote.
bool endsInside(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  return file && file.tellg() > 0 && file.seekg(-1, std::ios::end).get() != '\n';
}

// A hash of the running program (FNV-1a); empty where the system does not show it.
std::string programHash() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  if (!file) return {};
  std::uint64_t hash = 0xcbf29ce484222325;
  std::vector<char> block(1 << 20);
  while (file.read(block.data(), static_cast<std::streamsize>(block.size())), file.gcount() > 0)
    for (std::streamsize i = 0; i < file.gcount(); ++i)
      hash = (hash ^ static_cast<unsigned char>(block[static_cast<std::size_t>(i)])) * 0x100000001b3;
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

// Numbers of another build are not gone on with.
void forgetOtherPrograms(const std::string& folder) {
  const std::string own = programHash();
  std::string before;
  std::ifstream(folder + kProgram) >> before;
  if (before == own) return;
  if (fs::remove(folder + kJobs)) std::cerr << folder << ": was measured by another build of the program; starting over\n";
  writeText(folder + kProgram, own + "\n");
}

// "2/5": the second of five.
std::pair<int, int> parseShard(const std::string& text) {
  int index = 0, count = 0;
  char end = 0;
  if (text.empty()) return {1, 1};
  if (std::sscanf(text.c_str(), "%d/%d%c", &index, &count, &end) != 2 || count < 1 || index < 1 || index > count)
    throw Refusal("--shard: must be i/n with i in [1, n], got " + text);
  return {index, count};
}

void writeReport(const Records& records, const std::string& folder) {
  writeText(folder + "/report.json", cli::Json(jsonOf(records)).dump(1) + "\n");
  writeText(folder + "/report.csv", csvOf(records));
  writeText(folder + "/summary.svg", summarySvg(records));
  writeText(folder + "/summary.md", summaryTable(records));
  writeText(folder + "/report.html", pageOf(records, folder));
  std::cout << summaryTable(records) << "\n";
  std::vector<double> all;
  for (const Correlation& each : correlations(records)) {
    if (!std::isfinite(each.overVisible)) continue;  // too few settings that differ
    all.push_back(each.overVisible);
    std::printf(
        "%-12s %8.0f texels: rank correlation of predicted mean error with wrong pixels near edges %.3f (across edges %.3f), %d methods\n",
        fs::path(each.scene).stem().string().c_str(), each.texels, each.overVisible, each.acrossEdges, each.variants);
  }
  if (!all.empty()) std::printf("rank correlation: median %.3f\n", median(all));
  std::printf("%s/report.html\n", folder.c_str());
}

int merge(const ReportArguments& arguments) {
  Records records;
  fs::create_directories(arguments.folder);
  for (const std::string& from : arguments.merged) {
    if (!fs::exists(from + kJobs)) throw Refusal("--merge: must be folders of reports, got " + from);
    readRecords(from + kJobs, records);
    for (const char* part : {"/pictures", "/cases", "/peers.json", kProgram})
      if (fs::exists(from + part) && !fs::equivalent(from, arguments.folder))
        fs::copy(from + part, arguments.folder + part, fs::copy_options::recursive | fs::copy_options::overwrite_existing);
  }
  std::string lines;
  for (const auto& [_, record] : records) lines += record.dump() + "\n";
  writeText(arguments.folder + kJobs, lines);
  writeReport(records, arguments.folder);
  return 0;
}

}  // namespace

void ReportArguments::addTo(CLI::App& app) {
  app.add_option("--scenes", scenes, "built-in scenes by name, or .glb files; none: the built-in ones")->delimiter(',');
  app.add_option("--methods", methods, "only these methods; none: all")->delimiter(',');
  app.add_flag("--quick", quick, "one view of each scene, one budget, fewer settings and repetitions");
  app.add_flag("--profile", profile, "no report: what passes, texels and solves take on this device, as settings of method auto");
  app.add_option("--shard", shard, "i/n: the i-th of n parts; join them with --merge");
  app.add_option("--merge", merged, "folders of shards: nothing is measured, one report is made of them");
  app.add_option("--out", folder, "folder; a run that was interrupted there goes on")->default_val("out/report");
}

int report(const ReportArguments& arguments) {
  if (!arguments.merged.empty()) return merge(arguments);
  for (const std::string& name : arguments.methods)
    if (std::none_of(cli::methods().begin(), cli::methods().end(), [&](const cli::Method& method) { return method.name == name; }))
      throw Refusal("--methods: must be methods of `gnomon methods`, got " + name);
  if (arguments.profile) {
    offscreen::Renderer renderer;
    std::cout << cli::layOut(profileOf(renderer));
    return 0;
  }
  const auto [shard, shards] = parseShard(arguments.shard);
  const std::vector<Study> plan = studies(arguments.methods, arguments.quick);
  if (plan.empty()) throw Refusal("--methods: must leave two settings to compare");
  const Effort effort = arguments.quick ? Effort{.repetitions = 2, .steps = 1} : Effort{};
  const std::string& folder = arguments.folder;
  fs::create_directories(folder + "/pictures");

  forgetOtherPrograms(folder);
  Records done, wanted;
  readRecords(folder + kJobs, done);
  offscreen::Renderer renderer;
  std::cerr << "rendering on " << renderer.device() << "\n";
  const std::vector<std::string> scenes = arguments.scenes.empty() ? offscreen::builtInNames() : arguments.scenes;

  struct Group {
    const Study* study;
    const offscreen::View* view;
    double texels;
  };
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  int place = 0;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    std::unique_ptr<Stage> stage;
    try {
      stage = std::make_unique<Stage>(renderer, scenes[s]);
    } catch (const std::runtime_error& error) {
      throw Refusal("--scenes: " + std::string(error.what()));
    }
    std::vector<Group> groups;
    for (const Study& study : plan) {
      bool hasOne = false;
      for (const offscreen::View& view : stage->views()) {
        if ((!study.light.empty() && view.light != study.light) || (!study.allViews && hasOne)) continue;
        hasOne = true;
        for (const double texels : study.texels) groups.push_back({&study, &view, texels});
      }
    }
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (place++ % shards != shard - 1) continue;
      const auto& [study, view, texels] = groups[g];
      bool isDone = true;
      for (const Variant& variant : study->variants)
        isDone = isDone && done.contains(keyText({{"key", keyOf(*study, scenes[s], *view, texels, variant, effort)}}));
      if (!isDone) {
        const std::vector<Json> records = stage->measure(*study, *view, texels, effort, folder, [&](const Shot& shot) {
          writeText(folder + "/pictures/" + shot.name, std::string(shot.bytes.begin(), shot.bytes.end()));
        });
        std::string lines;
        for (const Json& record : records) {
          lines += record.dump() + "\n";
          done[keyText(record)] = record;
        }
        const bool isTorn = endsInside(folder + kJobs);
        std::ofstream file(folder + kJobs, std::ios::app);
        file << (isTorn ? "\n" : "") << lines;
        if (!file.flush()) throw std::runtime_error(folder + kJobs + ": cannot be written");
      }
      for (const Variant& variant : study->variants) {
        const std::string key = keyText({{"key", keyOf(*study, scenes[s], *view, texels, variant, effort)}});
        wanted[key] = done.at(key);
        wanted[key]["order"] = static_cast<int>(&variant - study->variants.data());  // of this run's settings
      }
      const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
      std::cerr << "scene " << s + 1 << "/" << scenes.size() << " " << fs::path(scenes[s]).stem().string() << ", " << g + 1 << "/"
                << groups.size() << ": " << study->name << ", " << view->camera << ", " << view->light << " light"
                << (isDone ? " (already there)" : "") << ", " << std::lround(seconds) << " s\n";
    }
  }
  if (wanted.empty()) throw Refusal("--shard: no work for this part");
  writeReport(wanted, folder);
  return 0;
}

}  // namespace gnomon::report
