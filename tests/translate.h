// translate: a fragment shader taken to another language and back, so that a driver here can run what was made of it.
#pragma once

#include <map>
#include <string>

namespace gnomon::test {

// A fragment shader with the product's includes and without its #version line, as GLSL 330 without one: compiled as Vulkan GLSL,
// optimised as by spirv-opt -O, and written by SPIRV-Cross; or written as HLSL (shader model 5.0), compiled as that, and written back.
// Throws std::runtime_error with the reason.
[[nodiscard]] std::string throughVulkan(const std::string& fragment);
[[nodiscard]] std::string throughHlsl(const std::string& fragment);

// Offsets of every member of every constant buffer of an HLSL pixel shader, by full name, as glslang's HLSL front end lays them out.
[[nodiscard]] std::map<std::string, int> hlslOffsets(const std::string& text);

}  // namespace gnomon::test
