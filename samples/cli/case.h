// case: CASE.json, read strictly into what a solve takes.
//
// Every refusal is one line that starts with the dotted name of the field: "camera.near: must be a finite number > 0, got 0".
// Shader part: none.
// Test: tests/cli_test.cpp
#pragma once

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "gnomon/auto.h"
#include "gnomon/lloyd.h"
#include "gnomon/lspsm.h"
#include "gnomon/pssm.h"
#include "gnomon/sdsm.h"

namespace gnomon::cli {

using Json = nlohmann::ordered_json;

// What is wrong with the input; what() is one line.
class Refusal : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A case, and the storage behind the spans of its frame and settings: movable, not copyable.
struct Case {
  Case() = default;
  Case(Case&&) = default;
  Case& operator=(Case&&) = default;
  Case(const Case&) = delete;
  Case& operator=(const Case&) = delete;

  std::string id;
  std::string method;
  Frame frame;
  PssmSettings pssm;
  LloydSettings lloyd;
  LspsmSettings lspsm;
  SdsmSettings sdsm;
  AutoSettings automatic;
  Json json;  // what was read, for the text of refusals

  std::vector<Box> receivers, casters;
  std::vector<glm::dvec4> planes;
  std::vector<glm::dvec3> corners;
  std::vector<double> splits, weights;
  std::vector<std::uint32_t> histogram;
  std::vector<SampleBounds> bounds;
  double latency = 0.0;  // of samples, these or others
  std::unique_ptr<Samples> samples;  // at an address that a move keeps
};

// Parses JSON text; numbers too large for a double, keys given twice and anything that is not JSON are refused.
// source: names the text in the message where no field can be named.
[[nodiscard]] Json parseJson(const std::string& text, const std::string& source);

// Reads a file, or standard input for "-".
[[nodiscard]] Json readJson(const std::string& path);

// Replaces the whole method object.
void setMethod(Json& root, const std::string& name);

// Applies KEY=VALUE: a bare key that the method knows, or a dotted path ("budget.partitions", "scene.receivers.0.min").
// VALUE is JSON where it parses as that, text otherwise.
void setField(Json& root, const std::string& assignment);

[[nodiscard]] Case parseCase(Json root);

// A case of a method with its default settings and nothing else; no name: the method of cases that name none.
[[nodiscard]] Case methodCase(const std::string& name);

// A warp as cases spell it.
[[nodiscard]] const std::string& warpName(Warp warp);

// A layout as the tool spells it.
[[nodiscard]] const std::string& layoutName(AutoLayout layout);

// Solves a frame by the case's method; why: what auto compared, or null. Returns solution.status.
Status solve(const Case& input, const Frame& frame, Solution& solution, AutoReport* why = nullptr);

// The line for a solve that the library refused.
[[nodiscard]] std::string refusalText(const Case& input, const Solution& solution);

// One setting of a method, for `gnomon methods` and for --set.
struct Setting {
  std::string name;
  std::string values;  // what is allowed
  Json fallback;  // the library's default
  std::string meaning;
};
struct Method {
  std::string name;
  std::string meaning;
  std::vector<Setting> settings;
};
[[nodiscard]] const std::vector<Method>& methods();

// The shortest decimal text that reads back as the same number.
[[nodiscard]] std::string shortest(double value);

}  // namespace gnomon::cli
