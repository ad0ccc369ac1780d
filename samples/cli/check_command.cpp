#include "check_command.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>

#include <CLI/CLI.hpp>

#include "case.h"
#include "check.h"
#include "library.h"
#include "result.h"

namespace gnomon::cli {
namespace {

namespace fs = std::filesystem;
using check::Finding;
using check::Report;
using check::Shader;
using check::Target;

const char* const kStageRule = "must be vertex, tessellation-control, tessellation-evaluation, geometry, fragment or compute";
const char* const kTargetRule = "must be a GLSL version (\"330 core\", \"300 es\"), vulkan, opengl, or both (\"450 vulkan\")";

[[noreturn]] void refuse(const std::string& what, const std::string& rule, const std::string& got) {
  throw Refusal(what + ": " + rule + ", got " + got);
}

std::string readText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path)) throw Refusal(path + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

// What every shader of a command line or a list shares, and each may add to.
struct Settings {
  std::vector<std::string> folders;
  std::vector<std::pair<std::string, std::string>> defines;
  std::vector<Target> targets;
  std::string stage;
};

void addDefine(Settings& settings, const std::string& what, const std::string& name, const std::string& value) {
  const auto isPart = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  if (name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) != 0 || !std::all_of(name.begin(), name.end(), isPart))
    refuse(what, "must be NAME or NAME=VALUE", name);
  if (value.find('\n') != std::string::npos) refuse(what, "must be one line", "several");
  settings.defines.emplace_back(name, value);
}

void addTarget(Settings& settings, const std::string& what, const std::string& text) {
  Target target;
  if (!check::parseTarget(text, target)) refuse(what, kTargetRule, text.empty() ? "nothing" : text);
  settings.targets.push_back(target);
}

void addFolder(Settings& settings, const std::string& what, const fs::path& folder) {
  if (!fs::is_directory(folder)) refuse(what, "must be a folder", folder.string());
  settings.folders.push_back(folder.string());
}

Shader makeShader(const std::string& path, const Settings& settings) {
  Shader shader;
  shader.file = path;
  shader.text = readText(path);
  if (!settings.stage.empty() && !check::parseStage(settings.stage, shader.stage)) refuse("stage", kStageRule, settings.stage);
  if (settings.stage.empty() && !check::guessStage(path, shader.stage))
    throw Refusal(path + ": its name does not say which stage it is; give --stage");
  shader.folders = settings.folders;
  shader.defines = settings.defines;
  shader.targets = settings.targets;
  if (shader.targets.empty()) shader.targets.emplace_back();
  return shader;
}

// ---- The list ----

const Json* find(const Json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() ? nullptr : &*at;
}

std::string text(const Json& value, const std::string& what) {
  if (!value.is_string()) refuse(what, "must be a text", value.dump());
  return value.get<std::string>();
}

std::vector<std::string> texts(const Json& value, const std::string& what) {
  if (!value.is_array()) refuse(what, "must be a list of texts", value.dump());
  std::vector<std::string> out;
  for (std::size_t i = 0; i < value.size(); ++i) out.push_back(text(value[i], what + "[" + std::to_string(i) + "]"));
  return out;
}

void requireKeys(const Json& object, const std::string& what, const std::vector<std::string>& allowed) {
  if (!object.is_object()) refuse(what.empty() ? "list" : what, "must be an object", object.dump());
  for (const auto& item : object.items()) {
    if (std::find(allowed.begin(), allowed.end(), item.key()) != allowed.end()) continue;
    std::string list;
    for (const std::string& each : allowed) list += (list.empty() ? "" : ", ") + each;
    throw Refusal((what.empty() ? "" : what + ".") + item.key() + ": is not a known key; " + (what.empty() ? "a list" : what) + " takes " +
                  list);
  }
}

// Folders are relative to the list. What an entry says comes before what the list and the command line say; its targets replace theirs.
Settings readSettings(const Json& object, const std::string& what, const fs::path& folder, const Settings& outer) {
  const std::string dot = what.empty() ? "" : what + ".";
  Settings out;
  if (const Json* const list = find(object, "include"))
    for (const std::string& each : texts(*list, dot + "include")) addFolder(out, dot + "include", (folder / each).lexically_normal());
  if (const Json* const define = find(object, "define")) {
    if (!define->is_object()) refuse(dot + "define", "must be an object of names and values", define->dump());
    for (const auto& [name, value] : define->items())
      addDefine(out, dot + "define", name, value.is_string() ? value.get<std::string>() : value.dump());
  }
  if (const Json* const list = find(object, "target"))
    for (const std::string& each : texts(*list, dot + "target")) addTarget(out, dot + "target", each);
  out.folders.insert(out.folders.end(), outer.folders.begin(), outer.folders.end());
  for (const auto& define : outer.defines)
    if (std::none_of(out.defines.begin(), out.defines.end(), [&](const auto& own) { return own.first == define.first; }))
      out.defines.push_back(define);
  if (out.targets.empty()) out.targets = outer.targets;
  return out;
}

void readList(const std::string& path, const Settings& outer, std::vector<Shader>& out) {
  const Json list = parseJson(readText(path), path);
  const fs::path folder = fs::path(path).parent_path();
  requireKeys(list, "", {"shaders", "include", "define", "target"});
  const Json* const shaders = find(list, "shaders");
  if (!shaders || !shaders->is_array() || shaders->empty())
    refuse("shaders", "must be a list of files, or of objects with a file", shaders ? shaders->dump() : "nothing");
  const Settings shared = readSettings(list, "", folder, outer);
  for (std::size_t i = 0; i < shaders->size(); ++i) {
    const Json& entry = (*shaders)[i];
    const std::string what = "shaders[" + std::to_string(i) + "]";
    Settings settings = shared;
    std::string file;
    if (entry.is_string()) {
      file = entry.get<std::string>();
    } else {
      requireKeys(entry, what, {"file", "stage", "include", "define", "target"});
      const Json* const name = find(entry, "file");
      if (!name) refuse(what + ".file", "must be a text", "nothing");
      file = text(*name, what + ".file");
      settings = readSettings(entry, what, folder, shared);
      if (const Json* const stage = find(entry, "stage")) settings.stage = text(*stage, what + ".stage");
    }
    out.push_back(makeShader((folder / file).lexically_normal().string(), settings));
  }
}

std::vector<Shader> gather(const CheckArguments& arguments) {
  if (arguments.files.empty() && arguments.list.empty()) throw Refusal("nothing to check; give files, or --list");
  Settings settings;
  settings.stage = arguments.stage;
  for (const std::string& folder : arguments.folders) addFolder(settings, "-I", folder);
  for (const std::string& define : arguments.defines) {
    const std::size_t equals = define.find('=');
    addDefine(settings, "-D", define.substr(0, equals), equals == std::string::npos ? "1" : define.substr(equals + 1));
  }
  for (const std::string& target : arguments.targets) addTarget(settings, "--target", target);
  std::vector<Shader> out;
  for (const std::string& file : arguments.files) out.push_back(makeShader(file, settings));
  if (!arguments.list.empty()) {
    settings.stage.clear();
    readList(arguments.list, settings, out);
  }
  return out;
}

// ---- The answer ----

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

std::string written(const check::GlslPlace& place) { return place.file + (place.line > 0 ? ":" + std::to_string(place.line) : ""); }

std::string asText(const Report& report) {
  std::ostringstream out;
  for (const Finding& finding : report.findings) {
    out << written(finding.place) << ": " << (finding.isError ? "error: " : "warning: ") << finding.cause;
    if (!finding.fix.empty()) out << "; " << finding.fix;
    if (finding.targets.size() < report.outcomes.size()) out << " [" << joined(finding.targets) << "]";
    out << "\n";
    for (const check::GlslPlace& place : finding.includedFrom) out << "  included from " << written(place) << "\n";
    if (!finding.compiler.empty()) out << "  compiler: " << finding.compiler << "\n";
  }
  for (const check::Outcome& outcome : report.outcomes) {
    if (!outcome.isFine) continue;
    out << report.file << ": " << check::stageName(report.stage) << ", " << outcome.target << ": fine";
    if (outcome.isSpirvValid == true) out << ", spirv-val accepts it";
    if (outcome.optimised > 0) out << ", " << outcome.instructions << " instructions, " << outcome.optimised << " after spirv-opt -O";
    out << "\n";
  }
  return out.str();
}

Json asJson(const check::GlslPlace& place) { return {{"file", place.file}, {"line", place.line}}; }

Json asJson(const Report& report) {
  Json findings = Json::array(), targets = Json::array();
  for (const Finding& finding : report.findings) {
    Json chain = Json::array();
    for (const check::GlslPlace& place : finding.includedFrom) chain.push_back(asJson(place));
    findings.push_back({{"severity", finding.isError ? "error" : "warning"},
                        {"kind", finding.kind},
                        {"file", finding.place.file},
                        {"line", finding.place.line},
                        {"cause", finding.cause},
                        {"fix", finding.fix},
                        {"compiler", finding.compiler},
                        {"included_from", chain},
                        {"targets", finding.targets}});
  }
  for (const check::Outcome& outcome : report.outcomes) {
    Json target{{"target", outcome.target},
                {"fine", outcome.isFine},
                {"spirv_valid", outcome.isSpirvValid ? Json(*outcome.isSpirvValid) : Json(nullptr)}};
    if (outcome.optimised > 0) target.update({{"instructions", outcome.instructions}, {"optimised", outcome.optimised}});
    targets.push_back(target);
  }
  return {{"file", report.file},
          {"stage", check::stageName(report.stage)},
          {"layout_version", report.layoutVersion > 0 ? Json(report.layoutVersion) : Json(nullptr)},
          {"targets", targets},
          {"findings", findings}};
}

}  // namespace

void CheckArguments::addTo(CLI::App& app) {
  app.add_option("files", files, "shaders; the stage is guessed from .vert .tesc .tese .geom .frag .comp");
  app.add_option("-I,--include", folders, "include path; the library's own includes are found without one")->allow_extra_args(false);
  app.add_option("-D,--define", defines, "NAME=VALUE, or NAME for 1")->allow_extra_args(false);
  app.add_option("--stage", stage, "stage of the files whose names do not say it");
  app.add_option("--target", targets, "330 core, 300 es, ..., vulkan, opengl, 450 vulkan; none: as #version says; repeatable")
      ->allow_extra_args(false);
  app.add_option("--list", list, "a JSON list of shaders with their include paths, defines and targets");
  app.add_flag("--json", isJson, "answer in JSON");
  app.add_flag("--statistics", hasStatistics, "SPIR-V instructions, before and after spirv-opt -O");
}

int check(const CheckArguments& arguments) {
  std::vector<Shader> shaders;
  try {
    shaders = gather(arguments);
  } catch (const Refusal& refusal) {
    throw Refusal(std::string("check: ") + refusal.what());
  }
  std::size_t errors = 0, warnings = 0;
  Json list = Json::array();
  for (const Shader& shader : shaders) {
    const Report report = check::checkShader(shader, arguments.hasStatistics);
    for (const Finding& finding : report.findings) ++(finding.isError ? errors : warnings);
    if (arguments.isJson)
      list.push_back(asJson(report));
    else
      std::cout << asText(report);
  }
  if (arguments.isJson)
    std::cout
        << Json({{"errors", errors}, {"warnings", warnings}, {"library_layout_version", check::library().layoutVersion}, {"shaders", list}})
               .dump(2, ' ', false, Json::error_handler_t::replace)
        << "\n";
  return errors > 0 ? 1 : 0;
}

}  // namespace gnomon::cli
