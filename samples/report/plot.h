// plot: scatter plots as SVG text, for a page that is read by mouse, by keyboard, on paper and by a screen reader.
//
// Each point is a focusable mark with a title and a label of its own, which no plotting library at hand gives; that is why these are drawn here.
// Test: tests/report_test.cpp
#pragma once

#include <string>
#include <vector>

namespace gnomon::report {

struct Point {
  double x = 0.0, y = 0.0;  // finite; > 0 on a logarithmic axis
  std::string label;  // short: drawn beside the point where it is on the front
  std::string title;  // read out and shown on hover
  int colour = 0, shape = 0;
};

struct Plot {
  std::string title, xLabel, yLabel;
  std::vector<Point> points;
  bool front = true;  // join the points that no other beats in both; less is better
  bool diagonal = false;  // a line of equal values
  int width = 460, height = 330;
};

// Colour of a method by its place in the tool's table; ones past the end share the last.
[[nodiscard]] std::string colourOf(int place);

// A mark of a shape, as an SVG path around the origin.
[[nodiscard]] std::string markOf(int shape);

// The places of the points that no other point beats in both, by rising x. Of equal ones, the first.
[[nodiscard]] std::vector<std::size_t> paretoFront(const std::vector<Point>& points);

// Both axes logarithmic. Points that cannot be drawn are left out.
[[nodiscard]] std::string svgOf(const Plot& plot);

// Text with <, >, & and quotes escaped.
[[nodiscard]] std::string escaped(const std::string& text);

}  // namespace gnomon::report
