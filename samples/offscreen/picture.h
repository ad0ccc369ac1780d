// picture: the files that `gnomon render` leaves behind: PNG for people, npy for programs.
//
// Based on: the npy format, version 1.0 (little-endian, C order, header padded to a multiple of 64 bytes).
// Shader part: none.
// Test: tests/picture_test.cpp
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gnomon::offscreen {

// All: rows top first; throw std::runtime_error naming the path where the sizes disagree or the file cannot be written.

// channels: 1 grey, 2 grey and alpha, 3 rgb, 4 rgba; pixels: height x width x channels.
void writePng(const std::string& path, int width, int height, int channels, std::span<const std::uint8_t> pixels);

// The same in memory, for pages that carry their pictures; jpeg: rgb, quality 1 to 100.
[[nodiscard]] std::vector<std::uint8_t> encodePng(int width, int height, int channels, std::span<const std::uint8_t> pixels);
[[nodiscard]] std::vector<std::uint8_t> encodeJpeg(int width, int height, std::span<const std::uint8_t> pixels, int quality);

// float32, height x width x 3.
void writeNpy(const std::string& path, int width, int height, std::span<const float> values);

// uint8, height x width.
void writeNpy(const std::string& path, int width, int height, std::span<const std::uint8_t> values);

}  // namespace gnomon::offscreen
