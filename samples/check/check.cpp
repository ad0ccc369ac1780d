#include "check.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <sstream>

#include "layout.h"
#include "library.h"
#include "scan.h"

namespace gnomon::check {
namespace {

// The least versions that the includes are written in.
constexpr int kLeastDesktop = 330, kLeastEs = 300;

// Words that are reserved in some GLSL up to 4.60 or ES up to 3.20 [GLSL 4.60.8, ESSL 3.20.8, section 3.6] but not in all that the includes
// compile in.
const std::set<std::string> kReserved{
    "active",    "asm",      "atomic_uint",   "attribute", "buffer",    "cast",   "class",   "coherent",   "common",
    "double",    "enum",     "extern",        "external",  "filter",    "fixed",  "fvec2",   "fvec3",      "fvec4",
    "goto",      "half",     "hvec2",         "hvec3",     "hvec4",     "inline", "input",   "interface",  "long",
    "namespace", "noinline", "noperspective", "output",    "partition", "patch",  "precise", "public",     "readonly",
    "resource",  "restrict", "sample",        "shared",    "short",     "sizeof", "static",  "subroutine", "superp",
    "template",  "this",     "typedef",       "union",     "unsigned",  "using",  "varying", "volatile",   "writeonly"};

struct Version {
  int number = 0;
  bool isEs = false;
};
Version parseVersion(const std::string& text) {
  constexpr int kOldEs = 100;
  const int number = std::atoi(text.c_str());
  return {number, number == kOldEs || text.find("es") != std::string::npos};
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool isPrefixed(const std::string& name) { return lower(name).rfind("gnomon", 0) == 0; }

std::string fileName(const std::string& path) { return std::filesystem::path(path).filename().string(); }

std::string written(const GlslPlace& place) { return place.file + ":" + std::to_string(place.line); }

bool isSame(const GlslPlace& a, const GlslPlace& b) { return a.file == b.file && a.line == b.line; }

std::string listed(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

const Function* findFunction(const std::vector<Function>& list, const std::string& name) {
  const auto at = std::find_if(list.begin(), list.end(), [&](const Function& each) { return each.name == name; });
  return at == list.end() ? nullptr : &*at;
}

// One shader for one target.
class Checker {
 public:
  Checker(const Shader& shader, const Target& target, Report& report) : m_shader(shader), m_target(target), m_report(report) {
    m_source.text = shader.text;
    m_source.name = shader.file;
    m_source.folders = shader.folders;
    m_source.version = target.version;
    for (const auto& [name, value] : shader.defines) m_source.preamble += "#define " + name + " " + value + "\n";
    const std::string written = target.version.empty() ? versionOf(shader.text) : target.version;
    m_version = parseVersion(written);
    m_outcome.target = written;
    if (target.kind != GlslTarget::validate)
      m_outcome.target += std::string(written.empty() ? "" : " ") + (target.kind == GlslTarget::vulkan ? "vulkan" : "opengl");
  }

  void run(bool hasStatistics) {
    const std::size_t before = m_errors;
    if (checkVersion()) {
      m_result = compileGlsl(m_shader.stage, m_source, m_target.kind, false);
      readFunctions();
      m_declarations = declarationsOf(m_tokens);
      checkIncludesVersion();
      checkMacros();
      checkFunctions();
      checkBlock();
      diagnose();
      checkReserved();
      if (m_result.isFine) finish(hasStatistics);
    }
    m_outcome.isFine = m_errors == before;
    m_report.outcomes.push_back(m_outcome);
  }

 private:
  // The library's macros as functions: declarations, and of a shader that fails the messages, by the names that the user wrote.
  void readFunctions() {
    GlslSource source = m_source;
    source.hasFunctions = true;
    m_tokens = tokensOf(preprocessGlsl(m_shader.stage, source, m_target.kind), m_shader.file);
    if (m_result.isFine) return;
    GlslResult read = compileGlsl(m_shader.stage, source, m_target.kind, false);
    m_isFineAsFunctions = read.isFine;
    if (std::none_of(read.messages.begin(), read.messages.end(), [](const GlslMessage& message) { return message.isError; })) return;
    m_result.messages = std::move(read.messages);
    m_source = std::move(source);
  }

  // ---- Places and findings ----

  bool isMain(const std::string& file) const { return file == m_shader.file; }
  bool isUsers(const std::string& file) const { return isMain(file) || !isLibraryFile(file); }

  // Where the user's own text asks for the library's file that a place is in.
  GlslPlace usersPlace(GlslPlace place) const {
    while (!isUsers(place.file)) {
      const auto at = m_result.includedFrom.find(place.file);
      if (at == m_result.includedFrom.end()) return {m_shader.file, 0};
      place = at->second;
    }
    return place;
  }

  void add(Finding finding) {
    if (finding.place.file.empty()) finding.place.file = m_shader.file;
    for (std::string file = finding.place.file; !isMain(file);) {
      const auto at = m_result.includedFrom.find(file);
      if (at == m_result.includedFrom.end()) break;
      finding.includedFrom.push_back(at->second);
      file = at->second.file;
    }
    m_errors += finding.isError ? 1 : 0;
    for (Finding& known : m_report.findings)
      if (known.kind == finding.kind && isSame(known.place, finding.place) && known.cause == finding.cause) {
        known.targets.push_back(m_outcome.target);
        return;
      }
    finding.targets = {m_outcome.target};
    m_report.findings.push_back(std::move(finding));
  }
  void error(const std::string& kind, const GlslPlace& place, const std::string& cause, const std::string& fix,
             const std::string& compiler = "") {
    m_places.push_back(place);
    add({true, kind, place, cause, fix, compiler, {}, {}});
  }
  void warning(const std::string& kind, const GlslPlace& place, const std::string& cause, const std::string& fix) {
    add({false, kind, place, cause, fix, "", {}, {}});
  }

  // ---- What the texts say ----

  bool checkVersion() {
    if (m_version.number > 0) return true;
    if (m_shader.text.rfind("\xef\xbb\xbf", 0) == 0) {
      error("no-version", {m_shader.file, 1}, "the file begins with a byte-order mark, so #version is not its first word",
            "save it as UTF-8 without one");
      return false;
    }
    error("no-version", {m_shader.file, 1}, "no #version line: GLSL 110 is meant, which has no uniform blocks",
          "begin with `#version 330 core`, or give --target \"330 core\" where your renderer adds the line");
    return false;
  }

  void checkIncludesVersion() {
    if (m_version.number >= (m_version.isEs ? kLeastEs : kLeastDesktop)) return;
    for (const auto& [file, text] : m_result.texts) {
      if (isUsers(file)) continue;
      error("version", versionPlace(),
            "the includes need GLSL " + std::to_string(kLeastDesktop) + " or ES " + std::to_string(kLeastEs) + ", this is " +
                m_outcome.target,
            std::string("raise #version to `") + (m_version.isEs ? "300 es`" : "330 core`"));
      return;
    }
  }
  GlslPlace versionPlace() const {
    for (const Directive& directive : directivesOf(m_shader.text))
      if (directive.name == "version") return {m_shader.file, directive.line};
    return {m_shader.file, 0};
  }

  // Macros with the library's prefix: options are the user's, everything else is not.
  void checkMacros() {
    for (const auto& [name, value] : m_shader.defines) checkMacro(name, {m_shader.file, 0}, "-D " + name);
    for (const auto& [file, text] : m_result.texts) {
      if (!isUsers(file)) continue;
      for (const Directive& directive : directivesOf(text)) {
        const std::vector<std::string> words = wordsOf(directive.rest);
        if (directive.name == "define" && !words.empty()) checkMacro(words[0], {file, directive.line}, "#define " + words[0]);
        if (directive.name == "if" || directive.name == "ifdef" || directive.name == "ifndef" || directive.name == "elif")
          for (const std::string& word : words) checkAsked(word, {file, directive.line});
      }
    }
  }
  void checkMacro(const std::string& name, const GlslPlace& place, const std::string& what) {
    if (!isPrefixed(name) || library().options.count(name) > 0) return;
    // A shader that holds the includes' text, pasted or flattened, defines what they define.
    const auto& names = library().names;
    if (std::find(names.begin(), names.end(), name) != names.end()) {
      if (!isCopy(place.file))
        error("clash", place, what + ": the name is the library's own", "rename it; options are " + listed(options()));
      return;
    }
    const std::string near = nearest(name, options());
    if (!near.empty())
      error("unknown-option", place, what + ": there is no such option, it has no effect", "write " + near);
    else
      warning("prefix", place, what + ": names that begin with gnomon are the library's, a later version may define it", "rename it");
  }
  void checkAsked(const std::string& name, const GlslPlace& place) {
    const auto& names = library().names;
    if (name.rfind("GNOMON_", 0) != 0 || std::find(names.begin(), names.end(), name) != names.end()) return;
    for (const auto& [file, text] : m_result.texts)
      for (const Directive& directive : directivesOf(text))
        if (directive.name == "define" && directive.rest.rfind(name, 0) == 0) return;
    const std::string near = nearest(name, names);
    if (!near.empty()) error("unknown-name", place, name + " is asked for and nothing defines it", "write " + near);
  }
  static std::vector<std::string> options() { return {library().options.begin(), library().options.end()}; }
  bool holdsCopy(const std::string& file) const {
    return std::any_of(m_declarations.structs.begin(), m_declarations.structs.end(),
                       [&](const Struct& each) { return each.name == "GnomonBlock" && each.place.file == file; });
  }

  // The library's text under its own name or pasted: what it defines is no clash.
  bool isCopy(const std::string& file) const { return isLibraryFile(file) || holdsCopy(file); }

  // Functions and structs with the library's prefix.
  void checkFunctions() {
    for (const Function& function : m_declarations.functions)
      if (function.isDefinition && !findFunction(library().hooks, function.name))
        checkDeclared(function.name, function.place, findFunction(library().functions, function.name));
    for (const Struct& each : m_declarations.structs) {
      const auto isOwn = [&](const Struct& own) { return own.name == each.name; };
      const auto own = std::find_if(library().structs.begin(), library().structs.end(), isOwn);
      if (own != library().structs.end() && each.name.find("Block") == std::string::npos &&
          each.name.find("Partition") == std::string::npos)
        clash(each.name, each.place, own->place);
      else if (own == library().structs.end())
        checkDeclared(each.name, each.place, nullptr);
    }
  }
  void checkDeclared(const std::string& name, const GlslPlace& place, const Function* own) {
    if (!isPrefixed(name) || isCopy(place.file)) return;
    if (own)
      clash(name, place, own->place);
    else
      warning("prefix", place, name + ": names that begin with gnomon are the library's, a later version may define it", "rename it");
  }
  void clash(const std::string& name, const GlslPlace& place, const GlslPlace& own) {
    if (!isCopy(place.file))
      error("clash", place, name + " is the library's own (" + fileName(own.file) + ":" + std::to_string(own.line) + ")", "rename yours");
  }

  // ---- The block ----

  void checkBlock() {
    const auto block = std::find_if(m_declarations.structs.begin(), m_declarations.structs.end(),
                                    [](const Struct& each) { return each.name == "GnomonBlock"; });
    if (block == m_declarations.structs.end()) return;
    const std::string file = block->place.file;
    const bool isCarried = file.rfind(kLibraryFolder, 0) == 0;
    int version = library().layoutVersion, line = block->place.line;
    if (!isCarried && !findNumber(m_result.texts[file], "GNOMON_LAYOUT_VERSION", version, line)) version = 0;
    m_report.layoutVersion = version;
    const LayoutDifference difference = isCarried ? LayoutDifference{} : compareLayout(m_declarations.structs);
    const std::string fix = "copy the library's gnomon_block.glsl again, and the includes beside it";
    if (version != library().layoutVersion)
      error("layout-version", {file, line},
            "this block has layout version " + std::to_string(version) + ", the solver writes version " +
                std::to_string(library().layoutVersion) + (difference.text.empty() ? "" : ": " + difference.text),
            fix);
    else if (!difference.text.empty())
      error("layout", difference.place, difference.text, fix);
    for (const Member& member : block->members)
      if (member.name == "partitions") checkCount(member);
    checkUniform();
  }

  void checkCount(const Member& member) {
    std::string digits;
    for (const char c : member.array)
      if (c != '(' && c != ')' && c != ' ') digits += c;
    if (digits.empty() || digits.find_first_not_of("-0123456789") != std::string::npos) return;  // an expression: the compiler's to judge
    const int count = std::atoi(digits.c_str());
    if (count >= 1 && count <= library().mostPartitions) return;
    error("partitions", definePlace("GNOMON_MAX_PARTITIONS", usersPlace(member.place)),
          "GNOMON_MAX_PARTITIONS is " + digits + ", the block holds 1 to " + std::to_string(library().mostPartitions),
          "give a number in [1, " + std::to_string(library().mostPartitions) + "]");
  }

  // Where the user's texts define a macro.
  GlslPlace definePlace(const std::string& name, const GlslPlace& otherwise) const {
    for (const auto& [file, text] : m_result.texts)
      for (const Directive& directive : directivesOf(text)) {
        const std::vector<std::string> words = wordsOf(directive.rest);
        if (isUsers(file) && directive.name == "define" && !words.empty() && words[0] == name) return {file, directive.line};
      }
    return otherwise;
  }

  // Blocks that hold a GnomonBlock: the offsets are std140's (std430's are the same here), the matrices column-major.
  void checkUniform() {
    for (const Block& block : m_declarations.blocks) {
      const bool isOurs =
          std::any_of(block.members.begin(), block.members.end(), [](const Member& member) { return member.type == "GnomonBlock"; });
      if (!isOurs || !isUsers(block.place.file)) continue;
      const auto has = [&](const char* word) { return std::find(block.layout.begin(), block.layout.end(), word) != block.layout.end(); };
      if (!has("std140") && !has("std430"))
        error("layout", block.place, "block " + block.name + " is not std140: the driver places its members, the solver cannot know where",
              "write layout(std140) uniform " + block.name);
      if (has("row_major"))
        error("layout", block.place, "block " + block.name + " is row_major: the solver writes matrices by columns", "take row_major away");
    }
  }

  // ---- What the compiler says ----

  void diagnose() {
    bool isFirst = true;
    for (const GlslMessage& message : m_result.messages) {
      if (!message.isError) {
        const bool isNoise = has(message.text, "all default precisions are highp");  // said of desktop GLSL, where precision means nothing
        if (!isNoise && isUsers(message.place.file) && !message.place.file.empty()) warning("compiler", message.place, said(message), "");
        continue;
      }
      // After the first error the compiler is on its way out: what follows is its echo.
      if (!isFirst) continue;
      isFirst = false;
      const bool isKnown =
          std::any_of(m_places.begin(), m_places.end(), [&](const GlslPlace& place) { return isSame(place, message.place); });
      const bool isInside = !message.place.file.empty() && (!isUsers(message.place.file) || holdsCopy(message.place.file));
      if (!isKnown && !(isInside && !m_places.empty())) explain(message);
    }
    if (!m_result.isFine && m_places.empty()) error("compiler", {}, "does not compile: " + m_result.log, "");
  }

  // Without the empty token and the spaces that the compiler leaves.
  static std::string said(const GlslMessage& message) {
    std::istringstream words(message.text.rfind("'' :", 0) == 0 ? message.text.substr(4) : message.text);
    std::string out;
    for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
    return out;
  }
  static bool has(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

  // The compiler's words, with the file of the library they are about.
  std::string compilerSaid(const GlslMessage& message) const {
    return said(message) + (isUsers(message.place.file) || message.place.file.empty() ? "" : " (in " + written(message.place) + ")");
  }

  void explain(const GlslMessage& message) {
    const std::string& text = message.text;
    const std::size_t close = text.find('\'', 1);
    std::string token = text[0] == '\'' && close != std::string::npos ? text.substr(1, close - 1) : "";
    token = token.substr(0, token.find('('));
    const GlslPlace place = usersPlace(message.place.file.empty() ? GlslPlace{m_shader.file, 0} : message.place);
    const std::string words = compilerSaid(message);

    if (explainMacro(message.place, words)) return;
    if (has(text, "Could not process include directive")) return explainInclude(text.substr(text.rfind(": ") + 2), place);
    if (has(text, "No function definition (body) found")) return explainBodies(text.substr(text.rfind(": ") + 2));
    if (has(text, "Missing entry point"))
      return error("no-main", place, "there is no main()", "check the shader that includes this file, not the file", words);
    if (findFunction(library().hooks, token) && has(text, "overloaded functions must")) return explainHook(token, place, words);
    if (has(text, "already has a body") || has(text, "redefinition"))
      return error("clash", place, "'" + token + "' is defined twice", "rename yours, or take one away", words);
    if (has(text, "already has a name at global scope")) return explainGlobal(place, words);
    if (explainReserved(message, token, place)) return;
    if (has(text, "default precision qualifier")) return explainPrecision(token, message.place, place, words);
    if (explainInterface(text, place, words)) return;
    if (has(text, "syntax error") && isUsers(message.place.file)) {
      if (!explainVersion(message, "", place, words)) explainSyntax(message);
      return;
    }
    if (explainStage(message, token, place, words)) return;
    if (!isPrefixed(token) && explainVersion(message, token, place, words)) return;
    if (explainName(text, token, place, words)) return;
    if (explainVersion(message, token, place, words)) return;
    error("compiler", place, words, "");
  }

  void explainInclude(const std::string& name, const GlslPlace& place) {
    for (const auto& [file, text] : m_result.texts)
      if (fileName(file) == fileName(name))
        return error("endless-include", place, "\"" + name + "\" includes itself without end", "give it a guard: #ifndef, #define, #endif");
    std::vector<std::string> looked{"beside " + place.file};
    looked.insert(looked.end(), m_shader.folders.begin(), m_shader.folders.end());
    looked.emplace_back("the library's own");
    std::vector<std::string> files;
    for (const auto& [file, text] : libraryTexts()) files.push_back(file);
    const std::string near = nearest(fileName(name), files);
    error("missing-include", place, "\"" + name + "\" is not found (looked: " + listed(looked) + ")",
          near.empty() ? "give its folder with -I" : "write \"" + near + "\"");
  }

  // "gnomonCompare(i1;vf2;f1;f1;", one or more.
  void explainBodies(const std::string& mangled) {
    std::istringstream words(mangled);
    for (std::string word; words >> word;) {
      const std::string name = word.substr(0, word.find('('));
      const Function* const hook = findFunction(library().hooks, name);
      const Function* declared = nullptr;
      const Function* other = nullptr;
      for (const Function& function : m_declarations.functions) {
        if (function.name != name) continue;
        (function.isDefinition ? other : declared) = &function;
      }
      const GlslPlace place = declared ? usersPlace(declared->place) : GlslPlace{m_shader.file, 0};
      if (hook && other)
        explainHook(name, other->place, "");
      else if (hook)
        error("missing-hook", place, name + " is yours to define, and the shader has none", "add: " + hook->signature + " { ... }");
      else
        error("missing-body", place, name + " is declared and called, and has no body", "define it, or take the call away");
    }
  }
  void explainHook(const std::string& name, const GlslPlace& place, const std::string& compiler) {
    std::string got;
    for (const Function& function : m_declarations.functions)
      if (function.name == name && isSame(function.place, place)) got = function.signature;
    error("wrong-hook", place, name + " has another signature than the one that is called: " + got,
          "write: " + findFunction(library().hooks, name)->signature, compiler);
  }

  // The block's own name, taken by a global of the user's: that one's place is the one to tell.
  void explainGlobal(GlslPlace place, const std::string& words) {
    std::string taken = "a name";
    const std::vector<std::string>& names = library().names;
    for (const Token& name : m_declarations.names)
      if (isUsers(name.place.file) && std::find(names.begin(), names.end(), name.text) != names.end()) {
        taken = name.text;
        place = name.place;
      }
    error("clash", place, taken + " is the library's own: its uniform block has it",
          "rename yours, or define GNOMON_NO_UNIFORM and declare the block", words);
  }

  // "syntax error, unexpected SAMPLE, expecting": SAMPLE.
  static std::string unexpected(const std::string& text) {
    const std::string mark = "unexpected ";
    const std::size_t start = text.find(mark);
    return start == std::string::npos ? "" : text.substr(start + mark.size(), text.find(',', start) - start - mark.size());
  }

  // "Reserved word", or a syntax error at a keyword of this version.
  bool explainReserved(const GlslMessage& message, const std::string& token, const GlslPlace& place) {
    const std::string keyword = lower(unexpected(message.text));
    const std::string word = has(message.text, "Reserved word") ? token : kReserved.count(keyword) > 0 ? keyword : "";
    if (word.empty() || !isUsers(message.place.file)) return false;
    error("reserved-word", place, "'" + word + "' is a reserved word of GLSL " + m_outcome.target, "rename it", compilerSaid(message));
    return true;
  }

  // The grammar's names for tokens as one writes them. A `;` is missing where the line before ends, not where the compiler notices.
  void explainSyntax(const GlslMessage& message) {
    static const std::vector<std::pair<std::string, std::string>> spellings{
        {"SEMICOLON", "`;`"},     {"COMMA", "`,`"},      {"LEFT_PAREN", "`(`"},  {"RIGHT_PAREN", "`)`"}, {"LEFT_BRACKET", "`[`"},
        {"RIGHT_BRACKET", "`]`"}, {"LEFT_BRACE", "`{`"}, {"RIGHT_BRACE", "`}`"}, {"EQUAL", "`=`"},       {"IDENTIFIER", "name"}};
    std::string text = said(message), token = unexpected(text);
    for (const auto& [name, spelling] : spellings) {
      if (const std::size_t at = text.find(name); at != std::string::npos) text.replace(at, name.size(), spelling);
      if (token == name) token = spelling;
    }
    if (const std::size_t at = text.find("unexpected " + token);
        !token.empty() && std::isupper(static_cast<unsigned char>(token[0])) != 0) {
      text.replace(text.find(' ', at) + 1, token.size(), "`" + lower(token) + "`");
      token = "`" + lower(token) + "`";
    }
    GlslPlace place = message.place;
    if (has(text, "`;`") && text.find("`;`") > text.find("expecting")) {
      // First in its line: what is unexpected is what the line begins with.
      const std::vector<Token> tokens = tokensOf(m_result.texts[place.file], place.file);
      const auto at = std::find_if(tokens.begin(), tokens.end(), [&](const Token& each) { return each.place.line == place.line; });
      if (at != tokens.begin() && at != tokens.end() && (token == "name" || token == "`" + at->text + "`")) place = (at - 1)->place;
    }
    error("syntax", place, text, "", compilerSaid(message) + ", line " + std::to_string(message.place.line));
  }

  // The compiler calls every opaque type "sampler/image": the line says which.
  void explainPrecision(std::string type, const GlslPlace& at, const GlslPlace& place, const std::string& words) {
    if (type == "sampler/image")
      for (const Token& token : tokensOf(m_result.texts[at.file], at.file))
        if (token.place.line == at.line && (has(token.text, "sampler") || has(token.text, "image"))) type = token.text;
    error("precision", place, "GLSL ES has no default precision for " + type + " in this stage",
          "write `precision highp " + type + ";` before it and before the includes", words);
  }

  // Locations and bindings that SPIR-V needs.
  bool explainInterface(const std::string& text, const GlslPlace& place, const std::string& words) {
    const std::string kind = m_target.kind == GlslTarget::vulkan ? "SPIR-V for Vulkan" : "SPIR-V";
    if (has(text, "SPIR-V requires location")) {
      error("location", place, kind + " needs a location for every input and output", "write layout(location = n) before it", words);
      return true;
    }
    if (has(text, "require") && has(text, "layout(binding=X)")) {
      const bool isInside = has(words, kLibraryFolder) || has(words, "gnomon_block.glsl");
      error("binding", place, isInside ? kind + " needs a binding for the block gnomonUniforms" : kind + " needs a binding here",
            isInside ? "write `#define GNOMON_BINDING n` before the include, or give -D GNOMON_BINDING=n"
                     : "write layout(binding = n) before it",
            words);
      return true;
    }
    if (has(text, "'binding'") && has(text, "not supported for this version") && has(words, "gnomon_block.glsl")) {
      error("version", definePlace("GNOMON_BINDING", place), "GNOMON_BINDING needs GLSL 420 or ES 310, this is " + m_outcome.target,
            "raise #version, or take GNOMON_BINDING away and bind gnomonUniforms by name", words);
      return true;
    }
    return false;
  }

  // The first error, had the shader been compiled otherwise, comes later or not at all.
  bool isBetter(GlslStage stage, const std::string& version, const GlslPlace& place) const {
    GlslSource source = m_source;
    source.version = version;
    const GlslResult result = compileGlsl(stage, source, m_target.kind, false);
    for (const GlslMessage& message : result.messages)
      if (message.isError) return result.isCompiled || (message.place.file == place.file && message.place.line > place.line);
    return true;
  }

  // Taken for another stage than it was written for.
  bool explainStage(const GlslMessage& message, const std::string& token, const GlslPlace& place, const std::string& words) {
    const bool isAbout = has(message.text, "not supported in this stage") ||
                         (has(message.text, "undeclared identifier") && token.rfind("gl_", 0) == 0) ||
                         (has(message.text, "no matching overloaded function") && !isPrefixed(token));
    if (!isAbout) return false;
    for (const GlslStage stage : {GlslStage::fragment, GlslStage::vertex, GlslStage::geometry, GlslStage::compute,
                                  GlslStage::tessellationControl, GlslStage::tessellationEvaluation}) {
      if (stage == m_shader.stage || !isBetter(stage, m_source.version, message.place)) continue;
      error("stage", place,
            "'" + token + "' belongs to a " + stageName(stage) + " shader, this is checked as a " + stageName(m_shader.stage) + " shader",
            std::string("name the file so, give --stage ") + stageName(stage) + ", or take it away", words);
      return true;
    }
    return false;
  }

  bool explainVersion(const GlslMessage& message, const std::string& token, const GlslPlace& place, const std::string& words) {
    const std::vector<int> versions = m_version.isEs ? std::vector<int>{310, 320} : std::vector<int>{400, 420, 430, 450};
    for (const int number : versions) {
      if (number <= m_version.number) continue;
      const std::string version = std::to_string(number) + (m_version.isEs ? " es" : " core");
      if (!isBetter(m_shader.stage, version, message.place)) continue;
      error("version", place, (token.empty() ? "this" : "'" + token + "'") + " needs GLSL " + version + ", this is " + m_outcome.target,
            "raise #version, or do without it", words);
      return true;
    }
    return false;
  }

  // A function, variable or member that is not known, or not with these arguments.
  bool explainName(const std::string& text, const std::string& token, const GlslPlace& place, const std::string& words) {
    const bool isCall = has(text, "no matching overloaded function"), isMember = has(text, "no such field");
    if (!isCall && !isMember && !has(text, "undeclared identifier")) return false;
    std::vector<std::string> known, signatures;
    for (const Struct& each : m_declarations.structs)
      for (const Member& member : each.members)
        if (isMember) known.push_back(member.name);
    for (const Function& function : m_declarations.functions) {
      if (!isMember) known.push_back(function.name);
      if (function.name == token && std::find(signatures.begin(), signatures.end(), function.signature) == signatures.end())
        signatures.push_back(function.signature);
    }
    if (isCall && !signatures.empty()) {
      error("arguments", place, "'" + token + "' does not take these arguments", "it is " + listed(signatures), words);
      return true;
    }
    if (const Function* const own = findFunction(library().functions, token)) {
      const std::string file = fileName(own->place.file);
      error("not-included", place, "'" + token + "' is in " + file + ", which is not included", "write #include \"" + file + "\"", words);
      return true;
    }
    if (!isMember) known.insert(known.end(), library().names.begin(), library().names.end());
    if (!isMember && !isCall)
      for (const Token& name : m_declarations.names)
        if (!isSame(name.place, place)) known.push_back(name.text);
    const std::string near = nearest(token, known);
    error("unknown-name", place, "'" + token + "' is not known", near.empty() ? "declare it before this line" : "write " + near, words);
    return true;
  }

  // Fine as a function, not as the macro that it is: its block is an expression.
  bool explainMacro(const GlslPlace& place, const std::string& words) {
    if (!m_isFineAsFunctions || isCopy(place.file)) return false;
    for (const Token& token : m_tokens) {
      const Function* const own = isSame(token.place, place) ? findFunction(library().functions, token.text) : nullptr;
      if (!own || own->types.empty() || own->types[0] != "GnomonBlock") continue;
      error("arguments", place, "'" + token.text + "' is a macro: its block is the name of a uniform, no expression",
            "it is " + own->signature, words);
      return true;
    }
    return false;
  }

  // ---- Words that other dialects reserve ----

  void checkReserved() {
    for (const Token& name : m_declarations.names) {
      if (kReserved.count(name.text) == 0 || !isUsers(name.place.file)) continue;
      const bool isKnown = std::any_of(m_places.begin(), m_places.end(), [&](const GlslPlace& place) { return isSame(place, name.place); });
      if (!isKnown) warning("reserved-word", name.place, "'" + name.text + "' is a reserved word of other GLSL versions", "rename it");
    }
  }

  // ---- SPIR-V ----

  void finish(bool hasStatistics) {
    if (m_target.kind != GlslTarget::validate) {
      const std::string wrong = validateSpirv(m_result.spirv, m_target.kind);
      m_outcome.isSpirvValid = wrong.empty();
      if (!wrong.empty())
        return error("spirv", {m_shader.file, 0}, "spirv-val refuses the module: " + wrong, "report it: the compiler made it");
    }
    if (!hasStatistics) return;
    const GlslTarget kind = m_target.kind == GlslTarget::validate ? GlslTarget::openGl : m_target.kind;
    const GlslResult made = m_target.kind == kind ? m_result : compileGlsl(m_shader.stage, m_source, kind, true);
    if (!made.isFine) return;  // ES 300 has no SPIR-V
    std::string said;
    m_outcome.instructions = countInstructions(made.spirv);
    m_outcome.optimised = countInstructions(optimiseSpirv(made.spirv, kind, said));
  }

  const Shader& m_shader;
  const Target& m_target;
  Report& m_report;
  GlslSource m_source;
  Version m_version;
  GlslResult m_result;
  bool m_isFineAsFunctions = false;
  std::vector<Token> m_tokens;
  Declarations m_declarations;
  std::vector<GlslPlace> m_places;  // of this target's errors
  std::size_t m_errors = 0;
  Outcome m_outcome;
};

struct StageWords {
  GlslStage stage;
  const char* name;
  std::vector<std::string> endings;
};
const std::vector<StageWords>& stages() {
  static const std::vector<StageWords> all{{GlslStage::vertex, "vertex", {"vert", "vs"}},
                                           {GlslStage::tessellationControl, "tessellation-control", {"tesc"}},
                                           {GlslStage::tessellationEvaluation, "tessellation-evaluation", {"tese"}},
                                           {GlslStage::geometry, "geometry", {"geom", "gs"}},
                                           {GlslStage::fragment, "fragment", {"frag", "fs"}},
                                           {GlslStage::compute, "compute", {"comp", "cs"}}};
  return all;
}

}  // namespace

bool parseTarget(const std::string& text, Target& out) {
  static const std::set<std::string> profiles{"core", "es", "compatibility"};
  Target target;
  std::istringstream words(text);
  std::string word;
  bool isMore = static_cast<bool>(words >> word);
  const bool hasVersion = isMore && word.size() == 3 && word.find_first_not_of("0123456789") == std::string::npos;
  if (hasVersion) {
    target.version = word;
    isMore = static_cast<bool>(words >> word);
    if (isMore && profiles.count(word) > 0) {
      target.version += " " + word;
      isMore = static_cast<bool>(words >> word);
    }
  }
  const bool hasKind = isMore && (word == "vulkan" || word == "opengl");
  if (hasKind) target.kind = word == "vulkan" ? GlslTarget::vulkan : GlslTarget::openGl;
  if (!(hasVersion || hasKind) || (isMore && !hasKind) || words >> word) return false;
  out = target;
  return true;
}

bool parseStage(const std::string& name, GlslStage& out) {
  for (const StageWords& each : stages()) {
    if (name != each.name && std::find(each.endings.begin(), each.endings.end(), name) == each.endings.end()) continue;
    out = each.stage;
    return true;
  }
  return false;
}

bool guessStage(const std::string& file, GlslStage& out) {
  std::filesystem::path path(file);
  if (path.extension() == ".glsl") path = path.stem();
  const std::string extension = path.extension().string();
  return !extension.empty() && parseStage(extension.substr(1), out);
}

const char* stageName(GlslStage stage) {
  for (const StageWords& each : stages())
    if (each.stage == stage) return each.name;
  return "";
}

Report checkShader(const Shader& shader, bool hasStatistics) {
  Report report;
  report.file = shader.file;
  report.stage = shader.stage;
  for (const Target& target : shader.targets) Checker(shader, target, report).run(hasStatistics);
  return report;
}

}  // namespace gnomon::check
