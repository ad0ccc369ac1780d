#include "layout.h"

#include <algorithm>

#include "library.h"

namespace gnomon::check {
namespace {

constexpr const char* kPartitions = "partitions";  // last, and the one array whose size is the shader's choice

const Struct* find(const std::vector<Struct>& structs, const std::string& name) {
  const auto at = std::find_if(structs.begin(), structs.end(), [&](const Struct& each) { return each.name == name; });
  return at == structs.end() ? nullptr : &*at;
}

// Offsets from the compiler's reflection of a shader that holds these structs and nothing else. Empty: they do not compile.
std::map<std::string, int> offsetsOf(const std::vector<Struct>& structs) {
  std::string text = "#version 450\n";
  for (const Struct& each : structs) {
    text += "struct " + each.name + " {\n";
    for (const Member& member : each.members) {
      // The library's size is a macro, the user's may be anything: one element places them all.
      const std::string array = member.name == kPartitions ? "1" : member.array;
      text += "  " + member.type + " " + member.name + (array.empty() ? "" : "[" + array + "]") + ";\n";
    }
    text += "};\n";
  }
  const Struct* const block = find(structs, "GnomonBlock");
  if (!block || block->members.empty()) return {};
  const std::string first = "b." + block->members[0].name;
  text += "layout(std140) uniform Uniforms { GnomonBlock b; };\nout vec4 colour;\nvoid main() { colour = vec4(" + first + " == " + first +
          " ? 1.0 : 0.0); }\n";
  // "b.bias", "b.windowStart[0]", "b.partitions[0].layer" (or without [0]) to the struct's name and the member's.
  std::map<std::string, int> out;
  for (const auto& [name, offset] : compileGlsl(GlslStage::fragment, text).offsets) {
    const std::size_t start = name.find('.') + 1, dot = name.find('.', start);
    const std::string member = name.substr(start, std::min(name.find('[', start), dot) - start);
    const auto [at, isNew] = out.emplace("GnomonBlock." + member, offset);
    if (!isNew) at->second = std::min(at->second, offset);
    if (dot != std::string::npos) out.emplace("GnomonPartition." + name.substr(dot + 1), offset);
  }
  return out;
}

std::string written(const Member& member) {
  return "`" + member.type + " " + member.name + (member.array.empty() || member.name == kPartitions ? "" : "[" + member.array + "]") + "`";
}

LayoutDifference compare(const Struct& user, const Struct& own, const std::map<std::string, int>& here,
                         const std::map<std::string, int>& there) {
  for (std::size_t i = 0; i < std::max(user.members.size(), own.members.size()); ++i) {
    if (i >= own.members.size())
      return {user.members[i].place, user.name + " holds " + written(user.members[i]) + " after the library's last member"};
    const Member& right = own.members[i];
    const auto place = there.find(own.name + "." + right.name);
    const std::string byte = place == there.end() ? "" : " (byte " + std::to_string(place->second) + ")";
    if (i >= user.members.size()) return {user.place, user.name + " ends before the library's " + written(right) + byte};
    if (written(user.members[i]) == written(right)) continue;
    std::string text = user.name + " has " + written(user.members[i]) + " where the library has " + written(right) + byte;
    // What that does to the members behind it.
    for (std::size_t k = i; k < own.members.size(); ++k) {
      const std::string name = own.name + "." + own.members[k].name;
      const auto from = here.find(name), to = there.find(name);
      if (from == here.end() || to == there.end() || from->second == to->second) continue;
      text += "; `" + own.members[k].name + "` is read at byte " + std::to_string(from->second) + ", the solver writes it at " +
              std::to_string(to->second);
      break;
    }
    return {user.members[i].place, text};
  }
  return {};
}

}  // namespace

LayoutDifference compareLayout(const std::vector<Struct>& structs) {
  static const std::map<std::string, int> own = offsetsOf(library().structs);
  const std::map<std::string, int> here = offsetsOf(structs);
  for (const char* name : {"GnomonPartition", "GnomonBlock"}) {
    const Struct *const user = find(structs, name), *const right = find(library().structs, name);
    if (!user || !right) continue;
    LayoutDifference difference = compare(*user, *right, here, own);
    if (!difference.text.empty()) return difference;
  }
  return {};
}

}  // namespace gnomon::check
