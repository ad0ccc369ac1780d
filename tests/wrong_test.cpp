#include "wrong.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "truth.h"

namespace gnomon::offscreen {
namespace {

// Pictures drawn with characters, rows top first: '.' lit, '#' shadowed, ' ' nothing.
struct Picture {
  int width, height;
  std::vector<std::uint8_t> values;
};

Picture draw(const std::vector<std::string>& rows) {
  Picture picture{static_cast<int>(rows[0].size()), static_cast<int>(rows.size()), {}};
  for (const std::string& row : rows) {
    for (const char c : row) picture.values.push_back(c == '.' ? kLit : c == '#' ? kShadowed : kNothing);
  }
  return picture;
}

std::vector<std::uint8_t> everyPixelThere(const Picture& truth) {
  std::vector<std::uint8_t> counted;
  for (const std::uint8_t value : truth.values) counted.push_back(value == kNothing ? 0 : 1);
  return counted;
}

WrongPixels judge(const std::vector<std::string>& answer, const std::vector<std::string>& truth) {
  const Picture a = draw(answer), t = draw(truth);
  return countWrong(t.width, t.height, a.values, t.values, everyPixelThere(t));
}

TEST(WrongTest, RefusesPicturesOfDifferentSizes) {
  const std::vector<std::uint8_t> four(4, kLit), three(3, kLit);
  EXPECT_THROW((void)countWrong(2, 2, three, four, four), std::runtime_error);
  EXPECT_THROW((void)countWrong(2, 2, four, three, four), std::runtime_error);
  EXPECT_THROW((void)countWrong(2, 2, four, four, three), std::runtime_error);
  EXPECT_THROW((void)countWrong(-2, -2, four, four, four), std::runtime_error);
  EXPECT_THROW((void)differencePicture(3, 2, four, four, four), std::runtime_error);
  EXPECT_THROW((void)countedPixels(four, std::vector<float>(9), glm::dvec3(0, -1, 0)), std::runtime_error);
  EXPECT_NO_THROW((void)countWrong(2, 2, four, four, four));
}

TEST(WrongTest, MeanDistanceIsFromTheNearestEdge) {
  // The edge runs between columns 2 and 3; wrong: one pixel beside it, one three columns off, one in the far corner.
  const WrongPixels wrong = judge({"..#.###", "......#", "#..####"}, {"...####", "...####", "...####"});
  EXPECT_EQ(wrong.wrong, 6u);
  EXPECT_DOUBLE_EQ(wrong.meanDistance, (0 + 0 + 0 + 1 + 2 + 2) / 6.0);
  EXPECT_EQ(judge({"#.."}, {"..."}).meanDistance, 0.0);  // no edge to be away from
}

TEST(WrongTest, CountedPixelsFaceTheLight) {
  // Light straight down; normals at a cosine just under and just over 0.02, of length 2, one turned away, and one where there is nothing.
  const auto leaning = [](double cosine) {
    return std::vector<float>{static_cast<float>(2 * std::sqrt(1 - cosine * cosine)), static_cast<float>(2 * cosine), 0};
  };
  std::vector<float> normal;
  for (const double cosine : {0.0199, 0.0201, 1.0, -1.0, 1.0}) {
    const std::vector<float> n = leaning(cosine);
    normal.insert(normal.end(), n.begin(), n.end());
  }
  const std::vector<std::uint8_t> truth{kLit, kShadowed, kLit, kShadowed, kNothing};
  EXPECT_EQ(countedPixels(truth, normal, glm::dvec3(0, -3, 0)), (std::vector<std::uint8_t>{0, 1, 1, 0, 0}));
}

TEST(WrongTest, AllRight) {
  const WrongPixels w = judge({"..##", "..##"}, {"..##", "..##"});
  EXPECT_EQ(w.counted, 8u);
  EXPECT_EQ(w.edge, 4u);  // the two columns that meet
  EXPECT_EQ(w.shadowed, 4u);
  EXPECT_EQ(w.wrong, 0u);
  EXPECT_EQ(w.share(), 0.0);
  EXPECT_EQ(w.perEdge(), 0.0);
  EXPECT_EQ(w.farShare(), 0.0);
  EXPECT_EQ(w.shadowedShare(), 0.5);
}

TEST(WrongTest, DistancesAlongARow) {
  // truth      . . . . # # # #     distances 3 2 1 0 0 1 2 3
  // answer: every pixel wrong.
  const WrongPixels w = judge({"####...."}, {"....####"});
  EXPECT_EQ(w.counted, 8u);
  EXPECT_EQ(w.edge, 2u);
  EXPECT_EQ(w.wrong, 8u);
  EXPECT_EQ(w.wrongNear, 4u);
  EXPECT_EQ(w.wrongFar, 4u);
  EXPECT_EQ(w.falselyShadowed, 4u);
  EXPECT_EQ(w.falselyLit, 4u);
  EXPECT_EQ(w.share(), 1.0);
  EXPECT_EQ(w.perEdge(), 4.0);
  EXPECT_EQ(w.farShare(), 0.5);
}

TEST(WrongTest, DiagonalsAreAtDistanceOneAndMakeNoEdges) {
  // One shadowed pixel in the middle of 5 x 5: it and its 4 neighbours are edge pixels. Within Chebyshev distance 1 of
  // those five lies everything but the four corners; the centre's diagonal neighbours are not edge pixels themselves.
  const WrongPixels w = judge({"#####", "#####", "##.##", "#####", "#####"}, {".....", ".....", "..#..", ".....", "....."});
  EXPECT_EQ(w.counted, 25u);
  EXPECT_EQ(w.edge, 5u);
  EXPECT_EQ(w.wrong, 25u);
  EXPECT_EQ(w.wrongNear, 21u);
  EXPECT_EQ(w.wrongFar, 4u);
  EXPECT_EQ(w.falselyLit, 1u);
}

TEST(WrongTest, AThinLostShadowIsNearItsOwnEdges) {
  // A shadow one pixel wide, missed altogether: 3 wrong pixels, all of them edge pixels; 9 edge pixels.
  const WrongPixels w = judge({".....", ".....", "....."}, {"..#..", "..#..", "..#.."});
  EXPECT_EQ(w.edge, 9u);
  EXPECT_EQ(w.wrong, 3u);
  EXPECT_EQ(w.wrongNear, 3u);
  EXPECT_EQ(w.falselyLit, 3u);
  EXPECT_DOUBLE_EQ(w.share(), 0.2);
  EXPECT_DOUBLE_EQ(w.perEdge(), 1.0 / 3.0);
}

TEST(WrongTest, NothingBetweenMakesNoEdge) {
  // The truths differ across a pixel where there is nothing: no pair of counted neighbours differs.
  const WrongPixels none = judge({"# ."}, {". #"});
  EXPECT_EQ(none.counted, 2u);
  EXPECT_EQ(none.edge, 0u);
  EXPECT_EQ(none.wrongFar, 2u);
  EXPECT_EQ(none.perEdge(), 0.0);

  // Distance runs across nothing: . # | nothing | . : the last pixel is 2 from the edge pixel '#'; one nearer it would count as near.
  const WrongPixels across = judge({".# #"}, {".# ."});
  EXPECT_EQ(across.edge, 2u);
  EXPECT_EQ(across.wrongNear, 0u);
  EXPECT_EQ(across.wrongFar, 1u);
  // Two rows: the wrong pixel (3, 1) touches the edge pixel (2, 0) at a corner, with nothing beside it.
  const WrongPixels corner = judge({".## ", "   #"}, {".#. ", "   ."});
  EXPECT_EQ(corner.edge, 3u);
  EXPECT_EQ(corner.wrong, 2u);
  EXPECT_EQ(corner.wrongNear, 2u);
}

TEST(WrongTest, PixelsThatDoNotCountAreNeverWrongAndMakeNoEdges) {
  const Picture truth = draw({"..##"}), answer = draw({"####"});
  // The second pixel faces away: the pair that differed is gone, and so is one of the two wrong pixels.
  const WrongPixels w = countWrong(4, 1, answer.values, truth.values, {1, 0, 1, 1});
  EXPECT_EQ(w.counted, 3u);
  EXPECT_EQ(w.edge, 0u);
  EXPECT_EQ(w.wrong, 1u);
  EXPECT_EQ(w.wrongFar, 1u);
}

TEST(WrongTest, NoAnswerIsWrong) {
  const WrongPixels w = judge({"  "}, {".#"});
  EXPECT_EQ(w.wrong, 2u);
  EXPECT_EQ(w.falselyLit, 1u);
  EXPECT_EQ(w.falselyShadowed, 1u);
}

TEST(WrongTest, EmptyPictureHasNoShares) {
  const WrongPixels w = judge({"  "}, {"  "});
  EXPECT_EQ(w.counted, 0u);
  EXPECT_EQ(w.share(), 0.0);
  EXPECT_EQ(w.shadowedShare(), 0.0);
}

TEST(WrongTest, DifferencePicture) {
  const Picture truth = draw({".#.#. "}), answer = draw({".##.# "});
  const std::vector<std::uint8_t> rgb = differencePicture(6, 1, answer.values, truth.values, {1, 1, 1, 1, 0, 0});
  ASSERT_EQ(rgb.size(), 18u);
  const auto at = [&](int pixel, int channel) { return static_cast<int>(rgb[static_cast<std::size_t>(3 * pixel + channel)]); };
  const auto brightness = [&](int pixel) { return at(pixel, 0) + at(pixel, 1) + at(pixel, 2); };
  for (const int agreed : {0, 1}) {  // grey
    EXPECT_EQ(at(agreed, 0), at(agreed, 1));
    EXPECT_EQ(at(agreed, 1), at(agreed, 2));
  }
  EXPECT_GT(brightness(0), brightness(1));
  EXPECT_GT(at(2, 0), 2 * at(2, 2));  // falsely shadowed: red
  EXPECT_GT(at(3, 2), 2 * at(3, 0));  // falsely lit: blue
  EXPECT_LT(brightness(4), brightness(1));
  EXPECT_LT(brightness(5), brightness(4));
}

}  // namespace
}  // namespace gnomon::offscreen
