#include "scan.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <sstream>

namespace gnomon::check {
namespace {

bool isStart(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool isPart(char c) { return isStart(c) || std::isdigit(static_cast<unsigned char>(c)) != 0; }
bool isWord(const std::string& text) { return !text.empty() && isStart(text[0]); }

// Words that may stand before a name without being its type.
const std::set<std::string> kNoType{"return",        "else",   "in",      "out",       "inout",    "const",     "uniform",   "buffer",
                                    "shared",        "flat",   "smooth",  "centroid",  "sample",   "patch",     "invariant", "precise",
                                    "highp",         "lowp",   "mediump", "coherent",  "volatile", "restrict",  "readonly",  "writeonly",
                                    "noperspective", "layout", "struct",  "precision", "case",     "attribute", "varying",   "do"};

// Blanks out comments; lines stay where they are.
std::string withoutComments(std::string text) {
  for (std::size_t i = 0; i + 1 < text.size(); ++i) {
    if (text[i] != '/' || (text[i + 1] != '/' && text[i + 1] != '*')) continue;
    const bool isLine = text[i + 1] == '/';
    const std::size_t found = text.find(isLine ? "\n" : "*/", i + 2),
                      end = found == std::string::npos ? text.size() : found + (isLine ? 0 : 2);
    for (; i < end; ++i)
      if (text[i] != '\n') text[i] = ' ';
    --i;
  }
  return text;
}

// A directive's name and what follows it; false: the line is none.
bool splitDirective(const std::string& line, Directive& out) {
  std::size_t at = line.find_first_not_of(" \t\r");
  if (at == std::string::npos || line[at] != '#') return false;
  at = std::min(line.find_first_not_of(" \t", at + 1), line.size());
  std::size_t end = at;
  while (end < line.size() && isPart(line[end])) ++end;
  out.name = line.substr(at, end - at);
  const std::size_t rest = line.find_first_not_of(" \t", end), last = line.find_last_not_of(" \t\r");
  out.rest = rest == std::string::npos || last < rest ? "" : line.substr(rest, last + 1 - rest);
  return true;
}

// "#line 12 "file"": the next line's place. A number for a file is left as it is.
void obeyLine(const Directive& directive, GlslPlace& place) {
  if (directive.name != "line") return;
  place.line = std::atoi(directive.rest.c_str()) - 1;
  const std::size_t open = directive.rest.find('"'), close = directive.rest.rfind('"');
  if (open < close && close != std::string::npos) place.file = directive.rest.substr(open + 1, close - open - 1);
}

// Tokens as one would write them.
std::string joined(const std::vector<Token>& tokens, std::size_t from, std::size_t to) {
  std::string out;
  for (std::size_t i = from; i < to; ++i) {
    const bool isTight = out.empty() || out.back() == '(' || out.back() == '[' || tokens[i].text == "(" || tokens[i].text == ")" ||
                         tokens[i].text == "," || tokens[i].text == "[" || tokens[i].text == "]";
    out += (isTight ? "" : " ") + tokens[i].text;
  }
  return out;
}

class Reader {
 public:
  explicit Reader(const std::vector<Token>& tokens) : m_tokens(tokens) {}

  Declarations read() {
    int depth = 0;
    for (std::size_t i = 0; i < m_tokens.size(); ++i) {
      const std::string& text = at(i);
      if (text == "{") ++depth;
      if (text == "}") --depth;
      if (!isWord(text)) continue;
      if (isName(i)) m_out.names.push_back(m_tokens[i]);
      if (depth > 0) continue;
      if (text == "struct" && at(i + 2) == "{") m_out.structs.push_back({at(i + 1), members(i + 3), m_tokens[i + 1].place});
      if ((text == "uniform" || text == "buffer") && at(i + 2) == "{")
        m_out.blocks.push_back({at(i + 1), layout(i), members(i + 3), m_tokens[i + 1].place});
      if (at(i + 1) == "(" && i > 0 && ((isWord(at(i - 1)) && kNoType.count(at(i - 1)) == 0) || at(i - 1) == "]")) function(i);
    }
    return std::move(m_out);
  }

 private:
  const std::string& at(std::size_t i) const {
    static const std::string nothing;
    return i < m_tokens.size() ? m_tokens[i].text : nothing;
  }
  bool isName(std::size_t i) const {
    static const std::set<std::string> after{";", ",", "=", "(", ")", "["};
    return i > 0 && isWord(at(i - 1)) && kNoType.count(at(i - 1)) == 0 && after.count(at(i + 1)) > 0;
  }
  std::size_t closing(std::size_t open) const {
    int depth = 0;
    for (std::size_t i = open; i < m_tokens.size(); ++i) {
      depth += (at(i) == "(") - (at(i) == ")");
      if (depth == 0) return i;
    }
    return m_tokens.size();
  }

  void function(std::size_t i) {
    const std::size_t close = closing(i + 1);
    const std::string& next = at(close + 1);
    if (next != ";" && next != "{") return;
    Function found;
    found.name = at(i);
    found.place = m_tokens[i].place;
    found.isDefinition = next == "{";
    std::size_t start = i;
    while (start > 0 && (isWord(at(start - 1)) || at(start - 1) == "[" || at(start - 1) == "]")) --start;
    found.signature = joined(m_tokens, start, close + 1);
    std::vector<std::string> words;
    const auto finish = [&] {
      if (!words.empty() && words[0] != "void") found.types.push_back(words[0]);
      words.clear();
    };
    for (std::size_t k = i + 2; k < close; ++k) {
      if (at(k) == ",")
        finish();
      else if (kNoType.count(at(k)) == 0 && isWord(at(k)))
        words.push_back(at(k));
    }
    finish();
    m_out.functions.push_back(std::move(found));
  }

  // Members up to the closing brace: [qualifiers] type name [array], name [array] ... ;
  std::vector<Member> members(std::size_t i) const {
    std::vector<Member> out;
    for (; i < m_tokens.size() && at(i) != "}"; ++i) {
      if (at(i) == "layout") {
        i = closing(i + 1);
        continue;
      }
      if (!isWord(at(i)) || kNoType.count(at(i)) > 0) continue;
      const std::string type = at(i++);
      for (; i < m_tokens.size() && at(i) != ";" && at(i) != "}"; ++i) {
        if (isWord(at(i))) out.push_back({type, at(i), "", m_tokens[i].place});
        if (at(i) != "[" || out.empty()) continue;
        const std::size_t open = i + 1;
        while (i < m_tokens.size() && at(i) != "]") ++i;
        out.back().array = joined(m_tokens, open, i);
      }
      if (at(i) == "}") break;
    }
    return out;
  }

  // The words of the layout(...) before position i, qualifiers between allowed.
  std::vector<std::string> layout(std::size_t i) const {
    std::vector<std::string> out;
    while (i > 0 && isWord(at(i - 1))) --i;
    if (i == 0 || at(i - 1) != ")") return out;
    for (--i; i > 0 && at(i) != "layout"; --i)
      if (isWord(at(i))) out.push_back(at(i));
    return out;
  }

  const std::vector<Token>& m_tokens;
  Declarations m_out;
};

// Edits between two names, a swap of neighbours counted as one (optimal string alignment).
std::size_t distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
    for (std::size_t j = 1; j <= b.size(); ++j) {
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

}  // namespace

std::vector<Token> tokensOf(const std::string& text, const std::string& file) {
  std::vector<Token> out;
  GlslPlace place{file, 0};
  std::istringstream lines(withoutComments(text));
  for (std::string line; std::getline(lines, line);) {
    ++place.line;
    Directive directive;
    if (splitDirective(line, directive)) {
      obeyLine(directive, place);
      while (!line.empty() && line.back() == '\\' && std::getline(lines, line)) ++place.line;
      continue;
    }
    for (std::size_t i = 0; i < line.size();) {
      if (std::isspace(static_cast<unsigned char>(line[i])) != 0) {
        ++i;
        continue;
      }
      std::size_t end = i + 1;
      while (isPart(line[i]) && end < line.size() && (isPart(line[end]) || (line[end] == '.' && !isStart(line[i])))) ++end;
      out.push_back({line.substr(i, end - i), place});
      i = end;
    }
  }
  return out;
}

std::vector<Directive> directivesOf(const std::string& text) {
  std::vector<Directive> out;
  std::istringstream lines(withoutComments(text));
  Directive directive;
  for (std::string line; std::getline(lines, line);) {
    ++directive.line;
    if (splitDirective(line, directive)) out.push_back(directive);
  }
  return out;
}

std::vector<std::string> wordsOf(const std::string& text) {
  std::vector<std::string> out;
  for (const Token& token : tokensOf(text, ""))
    if (isWord(token.text)) out.push_back(token.text);
  return out;
}

Declarations declarationsOf(const std::vector<Token>& tokens) { return Reader(tokens).read(); }

std::string nearest(const std::string& name, const std::vector<std::string>& candidates) {
  constexpr std::size_t kShort = 3, kLettersPerSlip = 4;  // gnomonSelct: two slips allowed; bas: one; uv: none but of case
  std::string best;
  std::size_t least = name.size() < kShort ? 1 : std::max<std::size_t>(2, name.size() / kLettersPerSlip + 1);
  for (const std::string& candidate : candidates) {
    if (candidate == name) continue;
    const auto isSame = [](char a, char b) {
      return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
    };
    const bool isCase = std::equal(name.begin(), name.end(), candidate.begin(), candidate.end(), isSame);
    const std::size_t slips = isCase ? 0 : distance(name, candidate);
    if (slips < least) {
      least = slips;
      best = candidate;
    }
  }
  return best;
}

}  // namespace gnomon::check
