#include "picture.h"

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_image.h>
#pragma GCC diagnostic pop

namespace gnomon::offscreen {
namespace {

class PictureTest : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder = std::filesystem::temp_directory_path() / (std::string("gnomon_picture_") + info->name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::string path(const char* name) const { return (folder / name).string(); }
  static std::string contents(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder;
};

TEST_F(PictureTest, RefusesWhatCannotBeWrittenAndNamesThePath) {
  const std::vector<std::uint8_t> two{1, 2};
  const std::vector<float> three{1.0f, 2.0f, 3.0f};
  const std::string nowhere = path("missing/picture");
  const auto expectNamed = [](const std::string& name, const auto& write) {
    try {
      write();
      ADD_FAILURE() << "nothing thrown for " << name;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  };
  expectNamed(nowhere, [&] { writePng(nowhere, 2, 1, 1, two); });
  expectNamed(nowhere, [&] { writeNpy(nowhere, 2, 1, two); });
  expectNamed(nowhere, [&] { writeNpy(nowhere, 1, 1, three); });
  const std::string file = path("file");
  expectNamed(file, [&] { writePng(file, 3, 1, 1, two); });  // sizes disagree
  expectNamed(file, [&] { writePng(file, 2, 1, 5, two); });
  expectNamed(file, [&] { writePng(file, 0, 1, 1, {}); });
  expectNamed(file, [&] { writeNpy(file, 2, 2, two); });
  expectNamed(file, [&] { writeNpy(file, 3, 1, three); });  // three channels, so one pixel
  EXPECT_FALSE(std::filesystem::exists(file));
}

// What numpy.save writes for the same array: its header is the reference, byte for byte.
TEST_F(PictureTest, BytesOfOneChannelNpy) {
  writeNpy(path("lit.npy"), 3, 2, std::vector<std::uint8_t>{0, 1, 2, 3, 4, 255});
  std::string expected("\x93NUMPY\x01\x00\x76\x00", 10);
  expected += "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 3), }";
  expected.append(127 - expected.size(), ' ');
  expected += '\n';
  ASSERT_EQ(expected.size(), 128u);
  expected += std::string("\x00\x01\x02\x03\x04\xff", 6);
  EXPECT_EQ(contents(path("lit.npy")), expected);
}

TEST_F(PictureTest, BytesOfThreeChannelNpy) {
  writeNpy(path("position.npy"), 1, 2, std::vector<float>{1.0f, -2.0f, 0.5f, 0.0f, 3.0f, -0.25f});
  std::string expected("\x93NUMPY\x01\x00\x76\x00", 10);
  expected += "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 1, 3), }";
  expected.append(127 - expected.size(), ' ');
  expected += '\n';
  // IEEE 754 single, little-endian: 1 = 3f800000, -2 = c0000000, 0.5 = 3f000000, 0, 3 = 40400000, -0.25 = be800000.
  expected += std::string("\x00\x00\x80\x3f\x00\x00\x00\xc0\x00\x00\x00\x3f\x00\x00\x00\x00\x00\x00\x40\x40\x00\x00\x80\xbe", 24);
  EXPECT_EQ(contents(path("position.npy")), expected);
}

TEST_F(PictureTest, NpyDataStartsAtAMultipleOf64) {
  for (const int width : {1, 10, 100, 1000, 10000}) {
    writeNpy(path("a.npy"), width, 1, std::vector<std::uint8_t>(static_cast<std::size_t>(width), 7));
    const std::string file = contents(path("a.npy"));
    ASSERT_GT(file.size(), static_cast<std::size_t>(width));
    const std::size_t header = file.size() - static_cast<std::size_t>(width);
    EXPECT_EQ(header % 64, 0u) << width;
    EXPECT_EQ(file[header - 1], '\n') << width;
  }
}

TEST_F(PictureTest, PngReadBack) {
  for (const int channels : {1, 3, 4}) {
    std::vector<std::uint8_t> pixels;
    for (int i = 0; i < 5 * 3 * channels; ++i) pixels.push_back(static_cast<std::uint8_t>((i * 37 + 11) % 256));
    const std::string file = path("a.png");
    writePng(file, 5, 3, channels, pixels);
    int width = 0, height = 0, found = 0;
    stbi_uc* read = stbi_load(file.c_str(), &width, &height, &found, 0);
    ASSERT_NE(read, nullptr);
    EXPECT_EQ(width, 5);
    EXPECT_EQ(height, 3);
    ASSERT_EQ(found, channels);
    EXPECT_EQ(std::memcmp(read, pixels.data(), pixels.size()), 0);  // rows top first
    stbi_image_free(read);
  }
}

// The README's picture is what the sample draws. Edges may move by a pixel between rasterisers; nothing else may.
TEST_F(PictureTest, TheSampleDrawsTheReadmesPicture) {
  const std::string file = path("picture.png");
  ASSERT_EQ(std::system((std::string("\"") + GNOMON_SAMPLE + "\" \"" + file + "\"").c_str()), 0);
  struct Image {
    int width = 0, height = 0, channels = 0;
    std::vector<std::uint8_t> pixels;
  };
  const auto load = [](const std::string& name) {
    Image image;
    stbi_uc* read = stbi_load(name.c_str(), &image.width, &image.height, &image.channels, 3);
    if (read) image.pixels.assign(read, read + 3 * image.width * image.height);
    stbi_image_free(read);
    return image;
  };
  const Image drawn = load(file), kept = load(std::string(GNOMON_SOURCE_DIR) + "/samples/offscreen/picture.png");
  ASSERT_EQ(kept.width, 1280);
  ASSERT_EQ(kept.height, 720);
  ASSERT_EQ(drawn.pixels.size(), kept.pixels.size());
  int differs = 0;
  for (std::size_t i = 0; i < kept.pixels.size(); ++i) differs += std::abs(drawn.pixels[i] - kept.pixels[i]) > 4;
  EXPECT_LT(differs, static_cast<int>(kept.pixels.size()) / 1000);
}

}  // namespace
}  // namespace gnomon::offscreen
