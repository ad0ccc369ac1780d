#include "picture.h"

#include <bit>
#include <cstddef>
#include <fstream>
#include <stdexcept>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb/stb_image_write.h>

namespace gnomon::offscreen {
namespace {

static_assert(std::endian::native == std::endian::little, "npy files are declared little-endian and written as they lie in memory");

[[noreturn]] void fail(const std::string& path, const char* reason) { throw std::runtime_error(path + ": " + reason); }

void checkSize(const std::string& path, int width, int height, int channels, std::size_t given) {
  if (width <= 0 || height <= 0) fail(path, "an empty picture");
  const std::size_t needed = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(channels);
  if (given != needed) fail(path, "the values do not fill the picture");
}

void writeNpyFile(const std::string& path, const char* type, const std::string& shape, const void* data, std::size_t bytes) {
  std::string dictionary = std::string("{'descr': '") + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  constexpr std::size_t kPreamble = 10;  // bytes: magic, version, length of the dictionary
  dictionary.append(63 - (kPreamble + dictionary.size()) % 64, ' ');
  dictionary += '\n';
  const auto length = static_cast<std::uint16_t>(dictionary.size());
  const char preamble[kPreamble] = {
      '\x93', 'N', 'U', 'M', 'P', 'Y', 1, 0, static_cast<char>(length & 0xff), static_cast<char>(length >> 8)};

  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) fail(path, "cannot be opened for writing");
  file.write(preamble, kPreamble);
  file.write(dictionary.data(), static_cast<std::streamsize>(dictionary.size()));
  file.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
  file.close();
  if (!file) fail(path, "cannot be written");
}

// stb's writer.
void append(void* out, void* data, int size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  static_cast<std::vector<std::uint8_t>*>(out)->insert(static_cast<std::vector<std::uint8_t>*>(out)->end(), bytes, bytes + size);
}

}  // namespace

void writePng(const std::string& path, int width, int height, int channels, std::span<const std::uint8_t> pixels) {
  if (channels < 1 || channels > 4) fail(path, "channels must be 1 to 4");
  checkSize(path, width, height, channels, pixels.size());
  if (stbi_write_png(path.c_str(), width, height, channels, pixels.data(), width * channels) == 0) fail(path, "cannot be written");
}

std::vector<std::uint8_t> encodePng(int width, int height, int channels, std::span<const std::uint8_t> pixels) {
  checkSize("png", width, height, channels, pixels.size());
  std::vector<std::uint8_t> out;
  if (stbi_write_png_to_func(append, &out, width, height, channels, pixels.data(), width * channels) == 0) fail("png", "cannot be made");
  return out;
}

std::vector<std::uint8_t> encodeJpeg(int width, int height, std::span<const std::uint8_t> pixels, int quality) {
  checkSize("jpeg", width, height, 3, pixels.size());
  std::vector<std::uint8_t> out;
  if (stbi_write_jpg_to_func(append, &out, width, height, 3, pixels.data(), quality) == 0) fail("jpeg", "cannot be made");
  return out;
}

void writeNpy(const std::string& path, int width, int height, std::span<const float> values) {
  checkSize(path, width, height, 3, values.size());
  writeNpyFile(path, "<f4", "(" + std::to_string(height) + ", " + std::to_string(width) + ", 3)", values.data(), values.size_bytes());
}

void writeNpy(const std::string& path, int width, int height, std::span<const std::uint8_t> values) {
  checkSize(path, width, height, 1, values.size());
  writeNpyFile(path, "|u1", "(" + std::to_string(height) + ", " + std::to_string(width) + ")", values.data(), values.size_bytes());
}

}  // namespace gnomon::offscreen
