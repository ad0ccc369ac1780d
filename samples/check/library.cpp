#include "library.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

namespace gnomon::check {
namespace {

// What a text's directives say of macros: options are asked for before they are set; a guard is set to nothing.
void readMacros(const std::string& text, Library& out) {
  std::set<std::string> guards;
  for (const Directive& directive : directivesOf(text)) {
    const std::vector<std::string> words = wordsOf(directive.rest);
    if (directive.name == "define" && !words.empty()) {
      if (directive.rest == words[0]) guards.insert(words[0]);
      if (out.options.count(words[0]) == 0) out.macros.insert(words[0]);
    }
    const bool isAsked = directive.name == "ifdef" || directive.name == "ifndef" || directive.rest.find("defined") != std::string::npos;
    for (const std::string& word : words)
      if (isAsked && word.rfind("GNOMON_", 0) == 0 && out.macros.count(word) == 0) out.options.insert(word);
  }
  for (const std::string& guard : guards) {
    out.options.erase(guard);
    out.macros.insert(guard);
  }
}

// The signatures that stand in comments of their own, "//   float gnomonFade(GnomonBlock block, float viewDepth)", by name.
std::map<std::string, std::string> commentedSignatures(const std::string& text) {
  const std::string mark = "//   ";
  std::map<std::string, std::string> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(mark, 0) != 0) continue;
    const std::string signature = line.substr(mark.size(), line.find_last_not_of('\r') + 1 - mark.size());
    for (const Function& function : declarationsOf(tokensOf(signature + ";", "")).functions)
      if (function.signature == signature && function.name.rfind("gnomon", 0) == 0) out[function.name] = signature;
  }
  return out;
}

Library read() {
  Library out;
  std::vector<Function> prototypes;
  for (const auto& [name, written] : libraryTexts()) {
    const std::string text = withFunctions(written);
    const Declarations declarations = declarationsOf(tokensOf(text, kLibraryFolder + name));
    for (const Function& function : declarations.functions) (function.isDefinition ? out.functions : prototypes).push_back(function);
    out.structs.insert(out.structs.end(), declarations.structs.begin(), declarations.structs.end());
    for (const Block& block : declarations.blocks) {
      out.names.push_back(block.name);
      for (const Member& member : block.members) out.names.push_back(member.name);
    }
    readMacros(text, out);
    int line = 0;
    (void)findNumber(text, "GNOMON_LAYOUT_VERSION", out.layoutVersion, line);
    (void)findNumber(text, "GNOMON_MAX_PARTITIONS", out.mostPartitions, line);
  }
  for (const Function& prototype : prototypes) {
    const auto isSame = [&](const Function& other) { return other.name == prototype.name; };
    if (std::none_of(out.functions.begin(), out.functions.end(), isSame)) out.hooks.push_back(prototype);
  }
  for (const auto* list : {&out.functions, &out.hooks})
    for (const Function& function : *list) out.names.push_back(function.name);
  for (const Struct& each : out.structs) out.names.push_back(each.name);
  for (const auto* list : {&out.options, &out.macros}) out.names.insert(out.names.end(), list->begin(), list->end());
  return out;
}

}  // namespace

const Library& library() {
  static const Library read = check::read();
  return read;
}

std::string withFunctions(const std::string& text) {
  const std::map<std::string, std::string> signatures = commentedSignatures(text);
  if (signatures.empty()) return text;
  std::map<int, std::string> functions;  // by line
  for (const Directive& directive : directivesOf(text)) {
    const std::string name = directive.rest.substr(0, directive.rest.find('('));
    const auto at = signatures.find(name);
    if (directive.name != "define" || at == signatures.end()) continue;
    const std::string type = at->second.substr(0, at->second.find(' '));
    functions[directive.line] = at->second + (type == "void" ? " {}" : " { " + type + " result; return result; }");
  }
  std::string out;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line); out += "\n") {
    const auto at = functions.find(++number);
    if (at == functions.end()) {
      out += line;
      continue;
    }
    out += at->second;
    for (; !line.empty() && line.back() == '\\' && std::getline(lines, line); ++number) out += "\n";
  }
  return out;
}

bool isLibraryFile(const std::string& path) {
  return path.rfind(kLibraryFolder, 0) == 0 || libraryTexts().count(std::filesystem::path(path).filename().string()) > 0;
}

bool findNumber(const std::string& text, const std::string& name, int& value, int& line) {
  for (const Directive& directive : directivesOf(text)) {
    if (directive.name != "define" || directive.rest.rfind(name + " ", 0) != 0) continue;
    const char* const start = directive.rest.c_str() + name.size();
    char* end = nullptr;
    const long number = std::strtol(start, &end, 10);
    if (end == start) continue;
    value = static_cast<int>(number);
    line = directive.line;
    return true;
  }
  return false;
}

}  // namespace gnomon::check
