#include "case.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iostream>
#include <iterator>
#include <limits>
#include <string_view>

#include "gnomon/camera.h"

namespace gnomon::cli {
namespace {

constexpr std::size_t kDeepest = 64;  // nesting of a case; its own form needs five
constexpr std::size_t kLongestText = 160;  // characters of a refused value that a message repeats

// JSON on one line, its numbers as short as they can be.
void write(const Json& value, std::string& out) {
  if (value.is_number()) {
    out += shortest(value.get<double>());
  } else if (value.is_array()) {
    out += '[';
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (i > 0) out += ',';
      write(value[i], out);
    }
    out += ']';
  } else if (value.is_object()) {
    out += '{';
    bool isFirst = true;
    for (const auto& [key, member] : value.items()) {
      if (!isFirst) out += ',';
      isFirst = false;
      write(Json(key), out);
      out += ':';
      write(member, out);
    }
    out += '}';
  } else {
    out += value.dump(-1, ' ', true, Json::error_handler_t::replace);
  }
}

std::string text(const Json& value) {
  std::string out;
  write(value, out);
  if (out.size() > kLongestText) out = out.substr(0, kLongestText) + "...";
  return out;
}

// A word without its quotes; control characters stay escaped, so the message stays on one line.
std::string word(const std::string& value) {
  const std::string quoted = text(Json(value));
  return quoted.size() >= 2 && quoted.back() == '"' ? quoted.substr(1, quoted.size() - 2) : quoted;
}

std::string wordOrText(const Json& value) { return value.is_string() ? word(value.get_ref<const std::string&>()) : text(value); }

[[noreturn]] void refuse(const std::string& field, const std::string& rule, const std::string& got) {
  throw Refusal(field + ": " + rule + ", got " + got);
}

std::string join(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& each : words) out += (out.empty() ? "" : ", ") + each;
  return out;
}

// ---- JSON text to a tree, with the path at hand when something is wrong ----

class Builder {
 public:
  explicit Builder(Json& root) : m_root(root) {}

  bool null() { return put(Json(nullptr)); }
  bool boolean(bool value) { return put(Json(value)); }
  bool number_integer(Json::number_integer_t value) { return put(Json(value)); }
  bool number_unsigned(Json::number_unsigned_t value) { return put(Json(value)); }
  bool number_float(Json::number_float_t value, const std::string&) { return put(Json(value)); }
  bool string(std::string& value) { return put(Json(value)); }
  bool binary(Json::binary_t&) { return false; }
  bool start_object(std::size_t) { return open(Json::object()); }
  bool start_array(std::size_t) { return open(Json::array()); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& name) {
    m_key = name;
    if (!m_open.back()->contains(name)) return true;
    m_error = path() + ": is given twice";
    return false;
  }
  bool parse_error(std::size_t, const std::string& token, const nlohmann::detail::exception& problem) {
    constexpr int kNumberOverflow = 406;
    if (problem.id == kNumberOverflow) {
      m_error = path() + ": must be a finite number, got " + word(token);
      return m_isOverflow = true, false;
    }
    const std::string_view what = problem.what();
    const std::size_t start = what.find("] ");
    m_syntax = start == std::string_view::npos ? what : what.substr(start + 2);
    return false;
  }

  const std::string& error() const { return m_error; }  // names a field
  const std::string& syntax() const { return m_syntax; }  // names a line and a column
  bool isOverflow() const { return m_isOverflow; }

 private:
  // The dotted name of the value that comes next.
  std::string path() const {
    std::string out;
    for (std::size_t i = 0; i < m_open.size(); ++i) {
      if (m_open[i]->is_array()) {
        const std::size_t next = m_open[i]->size() - (i + 1 < m_open.size() ? 1 : 0);
        out += '[' + std::to_string(next) + ']';
      } else {
        const std::string name = i + 1 < m_open.size() ? lastKey(*m_open[i]) : m_key;
        out += (out.empty() ? "" : ".") + word(name);
      }
    }
    return out.empty() ? "case" : out;
  }
  static std::string lastKey(const Json& object) {
    std::string name;
    for (const auto& item : object.items()) name = item.key();
    return name;
  }
  Json* place(Json&& value) {
    if (m_open.empty()) {
      m_root = std::move(value);
      return &m_root;
    }
    Json& parent = *m_open.back();
    if (parent.is_array()) {
      parent.push_back(std::move(value));
      return &parent.back();
    }
    return &(parent[m_key] = std::move(value));
  }
  bool put(Json&& value) {
    place(std::move(value));
    return true;
  }
  bool open(Json&& value) {
    if (m_open.size() >= kDeepest) {
      m_error = path() + ": is nested too deeply";
      return false;
    }
    m_open.push_back(place(std::move(value)));
    return true;
  }
  bool close() {
    m_open.pop_back();
    return true;
  }

  Json& m_root;
  std::vector<Json*> m_open;  // stays valid: only the innermost container grows
  std::string m_key;
  std::string m_error, m_syntax;
  bool m_isOverflow = false;
};

// ---- One object of the case ----

using Words = std::vector<std::string>;

class Fields {
 public:
  // Refuses what is not an object, and keys that are not among `allowed`.
  Fields(const Json& object, std::string path, const Words& allowed) : m_object(object), m_path(std::move(path)) {
    requireObject(object, m_path);
    for (const auto& item : object.items()) {
      bool isKnown = false;
      for (const std::string& name : allowed) isKnown = isKnown || name == item.key();
      if (!isKnown)
        throw Refusal(field(word(item.key())) + ": is not a known key; " + (m_path.empty() ? "a case" : m_path) + " takes " +
                      join(allowed));
    }
  }

  static void requireObject(const Json& value, const std::string& path) {
    if (!value.is_object()) refuse(path.empty() ? "case" : path, "must be an object", text(value));
  }

  std::string field(const std::string& key) const { return m_path.empty() ? key : m_path + "." + key; }

  const Json* find(const std::string& key) const {
    const auto at = m_object.find(key);
    return at == m_object.end() ? nullptr : &*at;
  }
  bool has(const std::string& key) const { return find(key) != nullptr; }

  const Json& need(const std::string& key, const std::string& rule) const {
    const Json* value = find(key);
    if (!value) refuse(field(key), rule, "nothing");
    return *value;
  }

  double number(const std::string& key, const std::string& rule) const {
    const Json& value = need(key, rule);
    if (!value.is_number()) refuse(field(key), rule, text(value));
    return value.get<double>();
  }
  double number(const std::string& key, Status rule) const { return number(key, statusRule(rule)); }
  void numberIf(const std::string& key, Status rule, double& out) const {
    if (has(key)) out = number(key, rule);
  }

  int whole(const std::string& key, const std::string& rule) const { return toWhole(need(key, rule), field(key), rule); }
  void wholeIf(const std::string& key, Status rule, int& out) const {
    if (has(key)) out = whole(key, statusRule(rule));
  }
  static int toWhole(const Json& value, const std::string& name, const std::string& rule) {
    if (!value.is_number()) refuse(name, rule, text(value));
    const double number = value.get<double>();
    constexpr double kMost = std::numeric_limits<int>::max();
    if (number != std::floor(number) || !(std::abs(number) <= kMost)) refuse(name, rule, shortest(number));
    return static_cast<int>(number);
  }

  // A list of exactly `size` numbers.
  static void toNumbers(const Json& value, const std::string& name, std::size_t size, const std::string& rule, double* out) {
    const std::string whole = "must be a list of " + std::to_string(size) + " numbers" + rule;
    if (!value.is_array() || value.size() != size) refuse(name, whole, text(value));
    for (std::size_t i = 0; i < size; ++i) {
      if (!value[i].is_number()) refuse(name + "[" + std::to_string(i) + "]", "must be a number", text(value[i]));
      out[i] = value[i].get<double>();
    }
  }
  glm::dvec3 vector(const std::string& key) const {
    std::array<double, 3> v{};
    toNumbers(need(key, "must be a list of 3 numbers"), field(key), v.size(), "", v.data());
    return {v[0], v[1], v[2]};
  }
  // 16 numbers, row by row; GLM's matrices are column-major.
  glm::dmat4 matrix(const std::string& key) const {
    std::array<double, 16> v{};
    toNumbers(need(key, "must be a list of 16 numbers, row by row"), field(key), v.size(), ", row by row", v.data());
    glm::dmat4 out;
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column) out[column][row] = v[static_cast<std::size_t>(4 * row + column)];
    return out;
  }

  // Which of the allowed words; -1 where the key is absent.
  int choice(const std::string& key, const Words& allowed, const std::string& rule = "") const {
    const Json* value = find(key);
    if (!value) return -1;
    for (std::size_t i = 0; i < allowed.size(); ++i)
      if (value->is_string() && value->get_ref<const std::string&>() == allowed[i]) return static_cast<int>(i);
    refuse(field(key), rule.empty() ? "must be one of " + join(allowed) : rule, wordOrText(*value));
  }

 private:
  const Json& m_object;
  std::string m_path;
};

const Words kDepths = {"negative_one_to_one", "zero_to_one", "reversed_zero_to_one"};

DepthConvention depthConvention(const Fields& fields, const std::string& key, DepthConvention fallback) {
  switch (fields.choice(key, kDepths)) {
    case 0: return DepthConvention::negativeOneToOne;
    case 1: return DepthConvention::zeroToOne;
    case 2: return DepthConvention::reversedZeroToOne;
    default: return fallback;
  }
}

void parseImage(const Json& value, ImageSize& image) {
  const Fields fields(value, "image", {"width", "height"});
  const std::string rule = "must be a finite number > 0";
  for (const auto& [key, side] : {std::pair<const char*, double*>{"width", &image.width}, {"height", &image.height}}) {
    if (!fields.has(key)) continue;
    *side = fields.number(key, rule);
    if (!(*side > 0.0)) refuse(fields.field(key), rule, shortest(*side));
  }
}

Camera parseMatrices(const Json& value, const ImageSize& image) {
  const Fields fields(value, "camera", {"view", "projection_matrix", "depth", "shadow_distance"});
  Camera camera;
  fields.numberIf("shadow_distance", Status::cameraShadowDistance, camera.shadowDistance);
  const glm::dmat4 view = fields.matrix("view");
  const glm::dmat4 projection = fields.matrix("projection_matrix");
  const DepthConvention depth = depthConvention(fields, "depth", camera.depth);
  const Status status = cameraFromMatrices(view, projection, depth, image, glm::dvec2(0.0), camera);
  if (status == Status::cameraViewMatrix) refuse("camera.view", statusRule(status), text(value["view"]));
  if (status == Status::cameraProjectionMatrix) refuse("camera.projection_matrix", statusRule(status), text(value["projection_matrix"]));
  if (status != Status::ok) throw Refusal(std::string(statusField(status)) + ": " + statusRule(status));
  return camera;
}

Camera parseCamera(const Json& value, const ImageSize& image) {
  Fields::requireObject(value, "camera");
  if (value.contains("view") || value.contains("projection_matrix")) return parseMatrices(value, image);

  const bool isOrthographic = value.contains("projection") && value["projection"] == "orthographic";
  Words allowed = {"position", "forward", "up", "near", "far", "shadow_distance", "depth", "projection", "aspect"};
  if (isOrthographic)
    allowed.insert(allowed.end(), {"height"});
  else
    allowed.insert(allowed.end(), {"fov_y", "tangents", "view", "projection_matrix"});
  const Fields fields(value, "camera", allowed);
  fields.choice("projection", {"perspective", "orthographic"});

  const glm::dvec3 position = fields.vector("position"), forward = fields.vector("forward"), up = fields.vector("up");
  const double near = fields.number("near", isOrthographic ? "must be a finite number" : statusRule(Status::cameraNear));
  const Json& farValue = fields.need("far", "must be a number > camera.near, or infinite");
  const double far = farValue == "infinite" ? kInfinity : fields.number("far", "must be a number > camera.near, or infinite");

  Camera camera;
  if (fields.has("tangents")) {
    for (const char* other : {"fov_y", "aspect"})
      if (fields.has(other)) throw Refusal(fields.field(other) + ": cannot be given together with camera.tangents, which say it too");
    std::array<double, 4> t{};
    Fields::toNumbers(value["tangents"], "camera.tangents", t.size(), ": left, right, down, up", t.data());
    camera = perspective(position, forward, up, 1.0, 1.0, near, far);
    camera.left = t[0];
    camera.right = t[1];
    camera.down = t[2];
    camera.up = t[3];
  } else {
    // The library holds tangents and half extents, so what they come from is checked here.
    constexpr double kPi = 3.14159265358979323846;
    const Status sizeRule = isOrthographic ? Status::cameraHeight : Status::cameraFovY;
    const char* sizeKey = isOrthographic ? "height" : "fov_y";
    const double size = fields.number(sizeKey, sizeRule);
    if (!(size > 0.0 && (isOrthographic || size < kPi))) refuse(fields.field(sizeKey), statusRule(sizeRule), shortest(size));
    const double aspect = fields.number("aspect", Status::cameraAspect);
    if (!(aspect > 0.0)) refuse("camera.aspect", statusRule(Status::cameraAspect), shortest(aspect));
    camera = isOrthographic ? orthographic(position, forward, up, size, aspect, near, far)
                            : perspective(position, forward, up, size, aspect, near, far);
  }
  fields.numberIf("shadow_distance", Status::cameraShadowDistance, camera.shadowDistance);
  camera.depth = depthConvention(fields, "depth", camera.depth);
  return camera;
}

void parseLight(const Json& value, DirectionalLight& light) {
  Fields::requireObject(value, "light");
  if (const auto type = value.find("type"); type != value.end() && *type != "directional") {
    const bool isKnown = *type == "spot" || *type == "point";
    refuse("light.type", "must be directional", wordOrText(*type) + (isKnown ? ": spot and point lights are not built yet" : ""));
  }
  light.directionWs = Fields(value, "light", {"type", "direction"}).vector("direction");
}

std::vector<Box> parseBoxes(const Json& value, const std::string& name) {
  if (!value.is_array()) refuse(name, "must be a list of boxes {\"min\":[x,y,z],\"max\":[x,y,z]}", text(value));
  std::vector<Box> boxes;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const Fields fields(value[i], name + "[" + std::to_string(i) + "]", {"min", "max"});
    boxes.push_back({fields.vector("min"), fields.vector("max")});
  }
  return boxes;
}

void parseScene(const Json& value, Case& out) {
  const Fields fields(value, "scene", {"receivers", "casters", "planes"});
  if (const Json* boxes = fields.find("receivers")) out.receivers = parseBoxes(*boxes, "scene.receivers");
  if (const Json* boxes = fields.find("casters")) out.casters = parseBoxes(*boxes, "scene.casters");
  if (const Json* planes = fields.find("planes")) {
    if (!planes->is_array()) refuse("scene.planes", "must be a list of half-spaces [a,b,c,d]", text(*planes));
    for (std::size_t i = 0; i < planes->size(); ++i) {
      std::array<double, 4> v{};
      Fields::toNumbers((*planes)[i], "scene.planes[" + std::to_string(i) + "]", v.size(), ": a, b, c, d", v.data());
      out.planes.emplace_back(v[0], v[1], v[2], v[3]);
    }
  }
  out.frame.scene = {out.receivers, out.casters, out.planes};
}

void parseMargin(const Json& value, Margin& margin) {
  const Fields fields(value, "margin", {"filter", "normal_offset", "blend", "border", "motion"});
  fields.numberIf("filter", Status::marginFilter, margin.filter);
  fields.numberIf("normal_offset", Status::marginNormalOffset, margin.normalOffset);
  fields.numberIf("blend", Status::marginBlend, margin.blend);
  fields.wholeIf("border", Status::marginBorder, margin.border);
  if (const Json* motion = fields.find("motion")) {
    if (!motion->is_array() || motion->size() > kMaxPartitions)
      refuse("margin.motion", "must be a list of at most 16 numbers, one for each map", text(*motion));
    Fields::toNumbers(*motion, "margin.motion", motion->size(), "", margin.motion);
  }
}

void parseBudget(const Json& value, Budget& budget) {
  const Fields fields(value, "budget", {"partitions", "resolution", "texels", "atlas", "target_error"});
  fields.wholeIf("partitions", Status::budgetPartitions, budget.partitions);
  fields.wholeIf("resolution", Status::budgetResolution, budget.resolution);
  if (fields.has("texels")) {
    budget.texels = fields.number("texels", Status::budgetTexels);
    // Zero stands for "not given" in the library, and so must not be given.
    if (budget.texels == 0.0) refuse("budget.texels", statusRule(Status::budgetTexels), "0");
  }
  if (const Json* atlas = fields.find("atlas")) {
    const std::string rule = statusRule(Status::budgetAtlas);
    if (!atlas->is_array() || atlas->size() != 2) refuse("budget.atlas", "must be a list of 2 numbers: width, height", text(*atlas));
    for (int i = 0; i < 2; ++i) {
      const std::string name = "budget.atlas[" + std::to_string(i) + "]";
      budget.atlas[i] = Fields::toWhole((*atlas)[static_cast<std::size_t>(i)], name, rule);
      if (budget.atlas[i] == 0) refuse(name, rule, "0");
    }
  }
  fields.numberIf("target_error", Status::budgetTargetError, budget.targetError);
}

const char* const kDefaultMethod = "auto";
const Words kSplitWords = {"uniform", "logarithmic", "practical", "explicit"};
const Words kLloydSplitWords = {"uniform", "logarithmic", "practical", "explicit", "minimax"};
const Words kFitWords = {"tight", "slice", "stable"};
const Words kSchemeWords = {"w", "zp", "zp+w", "fp+w", "fp+zp+w", "best"};
const Words kWarpWords = {"none", "lispsm", "psm", "tsm", "eta", "least"};
const Words kShareWords = {"equal", "error"};
const Words kNearFaceWords = {"own", "stretched"};
const Words kRowWords = {"paper", "fitted", "error"};
const Words kSdsmWords = {"logarithmic", "kmeans", "adaptive", "optimal"};
const Words kNormWords = {"max", "mean", "mean_square"};
const Words kBoundsWords = {"none", "light_space"};
const Words kLayoutWords = {"slices", "faces", "rows", "columns"};

// Sets an enumeration whose values stand in the order of their words.
template <class Enum>
void choiceIf(const Fields& fields, const std::string& key, const Words& words, Enum& value) {
  if (const int choice = fields.choice(key, words); choice >= 0) value = static_cast<Enum>(choice);
}

void parseSamples(const Json& value, Case& out) {
  const Fields fields(value, "samples", {"near", "far", "histogram", "weights", "bounds"});
  out.samples = std::make_unique<Samples>();
  out.samples->near = fields.number("near", Status::samplesNear);
  out.samples->far = fields.number("far", Status::samplesFar);
  const std::string rule = statusRule(Status::samplesHistogram);
  if (const Json* counts = fields.find("histogram")) {
    if (!counts->is_array()) refuse("samples.histogram", rule, text(*counts));
    for (std::size_t i = 0; i < counts->size(); ++i) {
      const Json& count = (*counts)[i];
      const double number = count.is_number() ? count.get<double>() : -1.0;
      if (!(number >= 0.0 && number <= std::numeric_limits<std::uint32_t>::max() && number == std::floor(number)))
        refuse("samples.histogram[" + std::to_string(i) + "]", rule, text(count));
      out.histogram.push_back(static_cast<std::uint32_t>(number));
    }
    out.samples->histogram = out.histogram;
  }
  if (const Json* weights = fields.find("weights")) {
    if (!weights->is_array()) refuse("samples.weights", statusRule(Status::samplesWeights), text(*weights));
    out.weights.resize(weights->size());
    Fields::toNumbers(*weights, "samples.weights", weights->size(), "", out.weights.data());
    out.samples->weights = out.weights;
  }
  if (const Json* bounds = fields.find("bounds")) {
    if (!bounds->is_array()) refuse("samples.bounds", statusRule(Status::samplesBounds), text(*bounds));
    for (std::size_t i = 0; i < bounds->size(); ++i) {
      const std::string name = "samples.bounds[" + std::to_string(i) + "]";
      const Fields each((*bounds)[i], name, {"near", "far", "min", "max"});
      SampleBounds& parsed = out.bounds.emplace_back();
      parsed.near = each.number("near", Status::samplesBounds);
      parsed.far = each.number("far", Status::samplesBounds);
      Fields::toNumbers(each.need("min", statusRule(Status::samplesBounds)), each.field("min"), 2, "", &parsed.least.x);
      Fields::toNumbers(each.need("max", statusRule(Status::samplesBounds)), each.field("max"), 2, "", &parsed.most.x);
    }
    out.samples->bounds = out.bounds;
  }
  out.frame.samples = out.samples.get();
}

// `count` of a method: a whole number, or automatic.
void parseCount(const Fields& fields, int& number, bool& isAutomatic) {
  const Json* count = fields.find("count");
  if (!count) return;
  const std::string rule = std::string(statusRule(Status::splitCount)) + ", or automatic";
  if (*count == "automatic") {
    isAutomatic = true;
    return;
  }
  number = Fields::toWhole(*count, "method.count", rule);
  // Zero stands for "as many as the budget allows" in the library, which a case says by leaving count out.
  if (number <= 0) refuse("method.count", rule, std::to_string(number));
}

// Returns the place of the word that method.split has, or -1.
int parseSplit(const Fields& fields, const Words& words, SplitSettings& split, std::vector<double>& depths) {
  const int scheme = fields.choice("split", words);
  if (scheme >= 0 && scheme < static_cast<int>(kSplitWords.size())) split.scheme = static_cast<SplitScheme>(scheme);
  fields.numberIf("lambda", Status::splitLambda, split.lambda);
  fields.numberIf("bias", Status::splitBias, split.bias);
  const bool isExplicit = split.scheme == SplitScheme::explicitDepths;
  if (const Json* splits = fields.find("splits")) {
    if (!splits->is_array()) refuse("method.splits", "must be a list of view depths", text(*splits));
    if (!isExplicit) throw Refusal("method.splits: can be given only where method.split is explicit");
    for (std::size_t i = 0; i < splits->size(); ++i) {
      if (!(*splits)[i].is_number()) refuse("method.splits[" + std::to_string(i) + "]", "must be a number", text((*splits)[i]));
      depths.push_back((*splits)[i].get<double>());
    }
    split.depths = depths;
  } else if (isExplicit) {
    refuse("method.splits", "must be a list of view depths where method.split is explicit", "nothing");
  }
  parseCount(fields, split.count, split.automatic);
  return scheme;
}

void parseWarp(const Fields& fields, WarpSettings& warp) {
  choiceIf(fields, "warp", kWarpWords, warp.warp);
  fields.numberIf("eta", Status::warpEta, warp.eta);
}

void parseSdsm(const Fields& fields, Case& out) {
  SdsmSettings& sdsm = out.sdsm;
  choiceIf(fields, "scheme", kSdsmWords, sdsm.scheme);
  choiceIf(fields, "norm", kNormWords, sdsm.norm);
  choiceIf(fields, "bounds", kBoundsWords, sdsm.bounds);
  fields.numberIf("latency", Status::samplesLatency, out.latency);
  if (out.samples) out.samples->latency = out.latency;
  fields.numberIf("hysteresis", Status::sdsmHysteresis, sdsm.hysteresis);
  if (const Json* quantise = fields.find("quantise")) {
    if (!quantise->is_boolean()) refuse("method.quantise", "must be true or false", wordOrText(*quantise));
    sdsm.quantise = quantise->get<bool>();
  }
  parseCount(fields, sdsm.count, sdsm.automatic);
}

void parsePssm(const Fields& fields, Case& out) {
  (void)parseSplit(fields, kSplitWords, out.pssm.split, out.splits);
  choiceIf(fields, "fit", kFitWords, out.pssm.fit);
}

void parseLloyd(const Fields& fields, Case& out) {
  LloydSettings& lloyd = out.lloyd;
  lloyd.minimax = parseSplit(fields, kLloydSplitWords, lloyd.split, out.splits) == static_cast<int>(kSplitWords.size());
  choiceIf(fields, "scheme", kSchemeWords, lloyd.scheme);
  parseWarp(fields, lloyd.warp);
  choiceIf(fields, "shares", kShareWords, lloyd.shares);
  choiceIf(fields, "near_face", kNearFaceWords, lloyd.nearFace);
  if (const Json* rows = fields.find("rows")) {
    if (!rows->is_boolean()) refuse("method.rows", "must be true or false", text(*rows));
    lloyd.rows = rows->get<bool>();
  }
}

void parseLspsm(const Fields& fields, Case& out) {
  RowSettings& rows = out.lspsm.rows;
  choiceIf(fields, "rows", kRowWords, rows.rule);
  fields.numberIf("zeta", Status::rowsZeta, rows.zeta);
  fields.numberIf("sigma", Status::rowsSigma, rows.sigma);
  fields.wholeIf("max_rows", Status::rowsMaxRows, rows.maxRows);
  fields.wholeIf("max_columns", Status::rowsMaxColumns, rows.maxColumns);
  parseWarp(fields, out.lspsm.warp);
}

// One map: the warped one of the whole view, or a box of its one slice.
void parseSingle(const Fields& fields, Case& out) {
  out.lloyd = {.scheme = LloydScheme::w, .warp = {.warp = Warp::least}};
  out.pssm.split.count = 1;
  choiceIf(fields, "fit", kFitWords, out.pssm.fit);
  for (const char* key : {"warp", "eta"})
    if (fields.has(key) && out.pssm.fit != FitMode::tight)
      throw Refusal(fields.field(key) + ": can be given only where method.fit is tight");
  parseWarp(fields, out.lloyd.warp);
}

void parseAuto(const Fields& fields, Case& out) {
  DeviceProfile& profile = out.automatic.profile;
  fields.numberIf("pass_ns", Status::autoPass, profile.pass);
  fields.numberIf("texel_ns", Status::autoTexel, profile.texel);
  fields.numberIf("fit_ns", Status::autoFit, profile.fit);
  fields.numberIf("search_ns", Status::autoSearch, profile.search);
  out.automatic.hasTarget = out.json.contains("budget") && out.json["budget"].contains("target_error");
}

// How a method reads its settings and solves.
struct Engine {
  const char* name;
  void (*parse)(const Fields&, Case&);
  Status (*solve)(const Case&, const Frame&, Solution&, AutoReport*);
};
constexpr Engine kEngines[] = {
    {"pssm", parsePssm,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport*) { return solvePssm(frame, input.pssm, out); }},
    {"lloyd", parseLloyd,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport*) { return solveLloyd(frame, input.lloyd, out); }},
    {"lspsm", parseLspsm,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport*) { return solveLspsm(frame, input.lspsm, out); }},
    {"sdsm", parseSdsm,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport*) {
       SdsmState state;  // of one frame: hysteresis has nothing to remember
       return solveSdsm(frame, input.sdsm, state, out);
     }},
    {"single", parseSingle,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport*) {
       return input.pssm.fit == FitMode::tight ? solveLloyd(frame, input.lloyd, out) : solvePssm(frame, input.pssm, out);
     }},
    {"auto", parseAuto,
     [](const Case& input, const Frame& frame, Solution& out, AutoReport* why) {
       AutoState state;
       return solveAuto(frame, input.automatic, state, out, why);
     }},
};
const Engine& engineOf(const Case& input) {
  return *std::find_if(std::begin(kEngines), std::end(kEngines), [&](const Engine& engine) { return input.method == engine.name; });
}

void parseMethod(const Json& value, Case& out) {
  Fields::requireObject(value, "method");
  Words names;
  for (const Method& method : methods()) names.push_back(method.name);
  const std::string nameRule = names.size() == 1 ? "must be " + names.front() : "must be one of " + join(names);
  const auto name = value.find("name");
  if (name == value.end()) refuse("method.name", nameRule, "nothing");
  const auto method = std::find_if(methods().begin(), methods().end(), [&](const Method& known) { return *name == known.name; });
  if (method == methods().end()) refuse("method.name", nameRule, wordOrText(*name));
  out.method = method->name;

  Words allowed = {"name"};
  for (const Setting& setting : method->settings) allowed.push_back(setting.name);
  const Fields fields(value, "method", allowed);
  engineOf(out).parse(fields, out);
}

// A part of a dotted path as a place in a list, or -1.
long listIndex(const std::string& part) {
  long index = -1;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
  return error == std::errc() && end == part.data() + part.size() && index >= 0 ? index : -1;
}

}  // namespace

std::string shortest(double value) {
  if (std::isnan(value)) return "nan";
  if (std::isinf(value)) return value > 0.0 ? "infinite" : "-infinite";
  std::array<char, 64> buffer{};
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc() ? std::string(buffer.data(), end) : std::string("?");
}

Json parseJson(const std::string& input, const std::string& source) {
  Json root;
  Builder builder(root);
  if (Json::sax_parse(input, &builder)) return root;
  if (!builder.error().empty()) throw Refusal(builder.error());
  throw Refusal(word(source) + ": is not JSON: " + builder.syntax());
}

Json readJson(const std::string& path) {
  const std::string name = path == "-" ? "standard input" : path;
  std::string input;
  if (path == "-") {
    input.assign(std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>());
  } else {
    // A folder opens like a file.
    std::error_code unknown;
    std::ifstream file(path, std::ios::binary);
    if (!file || std::filesystem::is_directory(path, unknown)) throw Refusal(word(name) + ": cannot be read");
    input.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return parseJson(input, name);
}

namespace {

const Words kCaseKeys = {"id",     "camera",       "corners", "light", "image",  "scene", "samples",
                         "margin", "shadow_depth", "bias",    "fade",  "method", "budget"};

bool hasSetting(const Method& method, const std::string& name) {
  return std::any_of(method.settings.begin(), method.settings.end(), [&](const Setting& setting) { return setting.name == name; });
}

}  // namespace

void setMethod(Json& root, const std::string& name) {
  Fields::requireObject(root, "");
  root["method"] = Json{{"name", name}};
}

void setField(Json& root, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) refuse("--set", "must be KEY=VALUE", word(assignment));
  const std::string key = assignment.substr(0, equals), valueText = assignment.substr(equals + 1);
  Fields::requireObject(root, "");

  Words parts;
  for (std::size_t start = 0;;) {
    const std::size_t dot = key.find('.', start);
    parts.push_back(key.substr(start, dot == std::string::npos ? dot : dot - start));
    if (parts.back().empty()) refuse("--set", "must name a field by a dotted path", word(key));
    if (dot == std::string::npos) break;
    start = dot + 1;
  }
  if (parts.size() > kDeepest) refuse("--set", "must name a field by a dotted path", word(key));
  if (parts.size() == 1) {
    // A setting of the case's method, or of another, which then says what it takes.
    const std::string name = parts.front();
    const bool isNamed = root.contains("method") && root["method"].is_object();
    const bool isField = std::find(kCaseKeys.begin(), kCaseKeys.end(), name) != kCaseKeys.end();
    const auto knows = [&](const Method& method) {
      return hasSetting(method, name) && (!isField || !isNamed || root["method"].value("name", Json("")) == method.name);
    };
    if (std::any_of(methods().begin(), methods().end(), knows)) parts.insert(parts.begin(), "method");
  }
  if (parts.front() == "method" && parts.size() > 1 && !root.contains("method")) {
    const auto knows = [&](const Method& method) { return hasSetting(method, parts[1]); };
    const auto method = std::find_if(methods().begin(), methods().end(), knows);
    root["method"] = Json{{"name", method == methods().end() ? kDefaultMethod : method->name}};
  }

  Json value;
  Builder builder(value);
  if (!Json::sax_parse(valueText, &builder)) {
    if (builder.isOverflow()) refuse(word(key), "must be a finite number", word(valueText));
    value = valueText;
  }

  Json* at = &root;
  std::string path;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string& part = parts[i];
    // What is made where the path leads to nothing yet: a list where a number comes next.
    const Json missing = i + 1 < parts.size() && listIndex(parts[i + 1]) >= 0 ? Json::array() : Json::object();
    if (at->is_array()) {
      const long index = listIndex(part);
      if (index < 0 || static_cast<std::size_t>(index) > at->size())
        refuse(word(path), "has " + std::to_string(at->size()) + " elements, counted from 0", word(part));
      if (static_cast<std::size_t>(index) == at->size()) at->push_back(missing);
      at = &(*at)[static_cast<std::size_t>(index)];
    } else {
      if (!at->is_object()) refuse(word(path), "must be an object or a list for --set " + word(key), text(*at));
      if (!at->contains(part)) (*at)[part] = missing;
      at = &(*at)[part];
    }
    path += (path.empty() ? "" : ".") + part;
  }
  *at = std::move(value);
}

Case parseCase(Json root) {
  Case out;
  out.json = std::move(root);
  const Fields fields(out.json, "", kCaseKeys);
  if (const Json* id = fields.find("id")) {
    if (!id->is_string()) refuse("id", "must be text", text(*id));
    out.id = id->get<std::string>();
  }
  Frame& frame = out.frame;
  if (const Json* image = fields.find("image")) parseImage(*image, frame.image);
  frame.camera = parseCamera(fields.need("camera", "must be an object"), frame.image);
  if (const Json* corners = fields.find("corners")) {
    if (!corners->is_array() || corners->empty()) refuse("corners", statusRule(Status::corners), text(*corners));
    for (std::size_t i = 0; i < corners->size(); ++i) {
      glm::dvec3 corner;
      Fields::toNumbers((*corners)[i], "corners[" + std::to_string(i) + "]", 3, "", &corner.x);
      out.corners.push_back(corner);
    }
    frame.cornersWs = out.corners;
  }
  parseLight(fields.need("light", "must be an object"), frame.light);
  if (const Json* scene = fields.find("scene")) parseScene(*scene, out);
  if (const Json* samples = fields.find("samples")) parseSamples(*samples, out);
  if (const Json* margin = fields.find("margin")) parseMargin(*margin, frame.margin);
  frame.shadowMap.depth = depthConvention(fields, "shadow_depth", frame.shadowMap.depth);
  if (const Json* bias = fields.find("bias")) {
    const Fields biasFields(*bias, "bias", {"slope", "constant"});
    biasFields.numberIf("slope", Status::biasSlope, frame.bias.slope);
    biasFields.numberIf("constant", Status::biasConstant, frame.bias.constant);
  }
  fields.numberIf("fade", Status::fade, frame.fade);
  if (const Json* budget = fields.find("budget")) parseBudget(*budget, frame.budget);
  parseMethod(fields.has("method") ? *fields.find("method") : Json{{"name", kDefaultMethod}}, out);
  return out;
}

Case methodCase(const std::string& name) {
  Case out;
  parseMethod(Json{{"name", name.empty() ? kDefaultMethod : name}}, out);
  return out;
}

std::string refusalText(const Case& input, const Solution& solution) {
  std::string name = statusField(solution.status);
  const Json* at = &input.json;
  for (std::size_t start = 0; at && start <= name.size();) {
    const std::size_t dot = std::min(name.find('.', start), name.size());
    const std::string part = name.substr(start, dot - start);
    at = at->is_object() && at->contains(part) ? &(*at)[part] : nullptr;
    start = dot + 1;
  }
  if (solution.refusedIndex >= 0) {
    const auto index = static_cast<std::size_t>(solution.refusedIndex);
    name += "[" + std::to_string(index) + "]";
    at = at && at->is_array() && index < at->size() ? &(*at)[index] : nullptr;
  }
  // A vector or a box says more than its first bad number; a whole camera says less.
  std::string got = shortest(solution.refusedValue);
  if (at)
    if (const std::string given = wordOrText(*at); given.size() <= kLongestText) got = given;
  if (solution.status == Status::samplesMissing) got = "nothing";
  if (solution.status == Status::floatRange)
    got = "near " + shortest(input.frame.camera.near) + " and far " + shortest(input.frame.camera.far);
  return name + ": " + statusRule(solution.status) + ", got " + got;
}

const std::vector<Method>& methods() {
  static const std::vector<Method> list = [] {
    const auto word = [](const Words& words, auto value) { return words[static_cast<std::size_t>(value)]; };
    const SplitSettings split;
    const Setting countSetting{"count", "whole number in [1, budget.partitions], or automatic", nullptr,
                               "slices; left out: as many as the budget allows; automatic: the fewest that meet budget.target_error"};
    const std::vector<Setting> planes = {
        {"lambda", "number in [0, 1]", split.lambda, "practical: weight of the logarithmic planes"},
        {"bias", "number >= 0", split.bias, "practical: added to the interior planes, world units"},
        {"splits", "list of view depths, strictly increasing", nullptr, "explicit: the interior planes (needed there, refused elsewhere)"},
        countSetting,
    };
    const PssmSettings pssm;
    const LloydSettings lloyd;
    const LspsmSettings lspsm;
    const auto warping = [&](const WarpSettings& warp) {
      return std::vector<Setting>{{"warp", join(kWarpWords), word(kWarpWords, warp.warp),
                                   "how far the maps are warped; least: the projective map that needs the fewest texels"},
                                  {"eta", "number in [-1, 1]", warp.eta, "with warp eta: -1 none, 0 lispsm, 1 psm"}};
    };
    const auto splitting = [&](const Words& words, const std::string& meaning) {
      std::vector<Setting> all = {{"split", join(words), word(words, split.scheme), meaning}};
      all.insert(all.end(), planes.begin(), planes.end());
      return all;
    };
    const auto add = [](std::vector<Setting> all, const std::vector<Setting>& more) {
      all.insert(all.end(), more.begin(), more.end());
      return all;
    };
    const SdsmSettings sdsm;
    const DeviceProfile profile;
    return std::vector<Method>{
        {"pssm", "parallel-split shadow maps: one map for each slice of view depth [Zhang 2006]",
         add(splitting(kSplitWords, "how the slices share the depth range"),
             {{"fit", join(kFitWords), word(kFitWords, pssm.fit),
               "tight: fewest texels; slice: the paper's box; stable: still shadows while the camera moves"}})},
        {"lloyd", "warped maps of slices of view depth or of the view's faces [Lloyd 2006]",
         add(add(add(splitting(kLloydSplitWords, "how the slices share the depth range; minimax: by what their maps need"),
                     {{"scheme", join(kSchemeWords), word(kSchemeWords, lloyd.scheme),
                       "w: one warped map; zp: slices; fp: faces; +w: warped; best: whichever needs the fewest texels"}}),
                 warping(lloyd.warp)),
             {{"shares", join(kShareWords), word(kShareWords, lloyd.shares),
               "of the texels: equal, or so that every map has the same error"},
              {"near_face", join(kNearFaceWords), word(kNearFaceWords, lloyd.nearFace),
               "fp: the near plane has a map of its own, or is shared among the sides'"},
              {"rows", "true, false", lloyd.rows, "best: may rows of the light plane be chosen"}})},
        {"lspsm", "rectangles of the light plane, in rows and columns that do not overlap [Tang 2017]",
         add({{"rows", join(kRowWords), word(kRowWords, lspsm.rows.rule),
               "paper: eq. 1 as printed; fitted: the same, ending where the view does; error: by the texels that the view needs"},
              {"zeta", "number in (0, 0.5)", lspsm.rows.zeta, "paper, fitted: the greatest share of a row wasted on each side"},
              {"sigma", "number > 0", lspsm.rows.sigma, "paper, fitted: rectangles are at most 1 + sigma times as wide as high"},
              {"max_rows", "whole number in [1, 16]", lspsm.rows.maxRows, "rows at most; they and the columns fit the budget's maps"},
              {"max_columns", "whole number in [1, 16]", lspsm.rows.maxColumns, "columns of a row at most: they give way first"}},
             warping(lspsm.warp))},
        {"sdsm",
         "slices where the view's samples are (the case's `samples`), each map cut to its own [Lauritzen 2010]",
         {{"scheme", join(kSdsmWords), word(kSdsmWords, sdsm.scheme),
           "equal ratios over what is sampled; clusters; equal ratios that skip gaps; the least norm of the error"},
          {"norm", join(kNormWords), word(kNormWords, sdsm.norm), "optimal: of the error over the samples"},
          {"bounds", join(kBoundsWords), word(kBoundsWords, sdsm.bounds), "whether samples.bounds cut the maps"},
          {"latency", "number >= 0", Samples{}.latency, "world units that the camera may have moved since the samples were taken"},
          {"hysteresis", "number in [0, 1]", sdsm.hysteresis, "how far splits and maps may be off before they are taken anew, by share"},
          {"quantise", "false, true", sdsm.quantise, "sides of maps grow and shrink by powers of two, snapped to texels"},
          countSetting}},
        {"single", "one map for all that must be shadowed",
         add(warping({.warp = Warp::least}),
             {{"fit", join(kFitWords), word(kFitWords, pssm.fit), "tight: as pssm, and only it is warped; slice, stable: as pssm"}})},
        {"auto",
         "the cheapest of all these that meets budget.target_error; without one, the least error that the budget allows",
         {{"pass_ns", "number >= 0", profile.pass, "what drawing a map takes, whatever its size"},
          {"texel_ns", "number >= 0", profile.texel, "what a texel takes"},
          {"fit_ns", "number >= 0", profile.fit, "what the solver takes for a slice"},
          {"search_ns", "number >= 0", profile.search, "and for its least warp"}}},
    };
  }();
  return list;
}

const std::string& warpName(Warp warp) { return kWarpWords[static_cast<std::size_t>(warp)]; }

const std::string& layoutName(AutoLayout layout) { return kLayoutWords[static_cast<std::size_t>(layout)]; }

Status solve(const Case& input, const Frame& frame, Solution& solution, AutoReport* why) {
  return engineOf(input).solve(input, frame, solution, why);
}

}  // namespace gnomon::cli
