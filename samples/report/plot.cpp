#include "plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace gnomon::report {
namespace {

// Okabe and Ito's colours, darkened where white behind them asks for it: told apart by colour-blind readers, too.
constexpr std::array<const char*, 8> kColours{"#0072b2", "#00875f", "#d98200", "#b8549a", "#5a6470", "#c33c00", "#7a5a2f", "#1c1c1c"};
constexpr std::array<const char*, 6> kMarks{"M4.5 0A4.5 4.5 0 1 1-4.5 0A4.5 4.5 0 1 1 4.5 0Z",
                                            "M-4-4H4V4H-4Z",
                                            "M0-5.2L5 3.8H-5Z",
                                            "M0-5.6L5.6 0L0 5.6L-5.6 0Z",
                                            "M0 5.2L5-3.8H-5Z",
                                            "M-1.6-5H1.6V-1.6H5V1.6H1.6V5H-1.6V1.6H-5V-1.6H-1.6Z"};

std::string number(double value, const char* format = "%.1f") {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// A tick's text: 0.02, 3, 40, 2 k, 5 M.
std::string tickText(double value) {
  if (value >= 1e6) return number(value / 1e6, "%g M");
  if (value >= 1e4) return number(value / 1e3, "%g k");
  return number(value, "%g");
}

// One logarithmic axis from data to pixels.
struct Axis {
  double low = 0.0, high = 1.0, from = 0.0, to = 1.0;  // log10; pixels

  void fit(double least, double most) {
    low = std::log10(least);
    high = std::log10(most);
    const double room = std::max(0.07 * (high - low), 0.06);
    low -= room;
    high += room;
  }
  [[nodiscard]] double at(double value) const { return from + (std::log10(value) - low) / (high - low) * (to - from); }
  [[nodiscard]] std::vector<double> ticks() const {
    std::vector<double> out;
    if (high - low < 0.75) {  // too short for powers of ten: even steps of 1, 2 or 5
      const double least = std::pow(10.0, low), most = std::pow(10.0, high), rough = (most - least) / 6.0,
                   power = std::pow(10.0, std::floor(std::log10(rough)));
      const double step = power * (rough / power <= 1.0 ? 1.0 : rough / power <= 2.0 ? 2.0 : rough / power <= 5.0 ? 5.0 : 10.0);
      for (double i = std::ceil(least / step); i * step <= most; i += 1.0) out.push_back(i * step);
      return out;
    }
    const std::vector<double> steps = high - low > 3.5   ? std::vector<double>{1.0}
                                      : high - low > 1.6 ? std::vector<double>{1.0, 3.0}
                                                         : std::vector<double>{1.0, 2.0, 5.0};
    for (int decade = static_cast<int>(std::floor(low)); decade <= static_cast<int>(std::ceil(high)); ++decade)
      for (const double step : steps)
        if (const double value = step * std::pow(10.0, decade); std::log10(value) >= low && std::log10(value) <= high) out.push_back(value);
    return out;
  }
};

bool isDrawable(const Point& point) { return point.x > 0.0 && point.y > 0.0 && std::isfinite(point.x) && std::isfinite(point.y); }

}  // namespace

std::string colourOf(int place) { return kColours[static_cast<std::size_t>(std::clamp(place, 0, static_cast<int>(kColours.size()) - 1))]; }

std::string markOf(int shape) { return kMarks[static_cast<std::size_t>(shape) % kMarks.size()]; }

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '&': out += "&amp;"; break;
      case '"': out += "&quot;"; break;
      default: out += c;
    }
  }
  return out;
}

std::vector<std::size_t> paretoFront(const std::vector<Point>& points) {
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return points[a].x < points[b].x || (points[a].x == points[b].x && points[a].y < points[b].y);
  });
  std::vector<std::size_t> front;
  for (const std::size_t i : order)
    if (front.empty() || points[i].y < points[front.back()].y) front.push_back(i);
  return front;
}

std::string svgOf(const Plot& plot) {
  std::vector<Point> points;
  std::copy_if(plot.points.begin(), plot.points.end(), std::back_inserter(points), isDrawable);
  const double left = 58.0, right = 14.0, top = 30.0, bottom = 44.0;
  std::string out = "<svg class=\"plot\" viewBox=\"0 0 " + std::to_string(plot.width) + " " + std::to_string(plot.height) +
                    "\" xmlns=\"http://www.w3.org/2000/svg\" role=\"group\" aria-label=\"" + escaped(plot.title) +
                    "\" font-family=\"system-ui,'Segoe UI',Helvetica,Arial,sans-serif\" font-size=\"11\" fill=\"#3c434b\">\n";
  out += "<text x=\"" + number(left) + "\" y=\"17\" font-size=\"13\" font-weight=\"600\" fill=\"#1b1f24\">" + escaped(plot.title) +
         "</text>\n";
  if (points.empty()) return out + "</svg>\n";

  const auto [leastX, mostX] = std::minmax_element(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
  const auto [leastY, mostY] = std::minmax_element(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.y < b.y; });
  Axis x, y;
  x.fit(leastX->x, mostX->x);
  y.fit(leastY->y, mostY->y);
  x.from = left;
  x.to = plot.width - right;
  y.from = plot.height - bottom;
  y.to = top;
  for (const double tick : y.ticks()) {
    const std::string at = number(y.at(tick));
    out += "<path d=\"M" + number(x.from) + " " + at + "H" + number(x.to) + "\" stroke=\"#e6e8eb\"/><text x=\"" + number(x.from - 7.0) +
           "\" y=\"" + number(y.at(tick) + 3.8) + "\" text-anchor=\"end\">" + tickText(tick) + "</text>\n";
  }
  for (const double tick : x.ticks()) {
    const std::string at = number(x.at(tick));
    out += "<path d=\"M" + at + " " + number(y.from) + "V" + number(y.to) + "\" stroke=\"#f0f1f3\"/><text x=\"" + at + "\" y=\"" +
           number(y.from + 16.0) + "\" text-anchor=\"middle\">" + tickText(tick) + "</text>\n";
  }
  out += "<path d=\"M" + number(x.from) + " " + number(y.from) + "H" + number(x.to) + "\" stroke=\"#9aa1a9\"/>\n";
  out += "<text x=\"" + number(x.to) + "\" y=\"" + number(plot.height - 9.0) + "\" text-anchor=\"end\" fill=\"#1b1f24\">" +
         escaped(plot.xLabel) + " →</text>\n";
  out += "<text transform=\"translate(13 " + number(top) + ") rotate(-90)\" text-anchor=\"end\" fill=\"#1b1f24\">" + escaped(plot.yLabel) +
         " →</text>\n";
  if (plot.diagonal) {
    const double low = std::max(x.low, y.low), high = std::min(x.high, y.high);
    if (low < high)
      out += "<path d=\"M" + number(x.at(std::pow(10.0, low))) + " " + number(y.at(std::pow(10.0, low))) + "L" +
             number(x.at(std::pow(10.0, high))) + " " + number(y.at(std::pow(10.0, high))) +
             "\" stroke=\"#b9bec5\" stroke-dasharray=\"3 3\"/>\n";
  }

  const std::vector<std::size_t> front = plot.front ? paretoFront(points) : std::vector<std::size_t>{};
  if (front.size() > 1) {  // stairs: what is above and to the right of a step is beaten by it
    std::string path;
    for (const std::size_t i : front)
      path += path.empty() ? "M" + number(x.at(points[i].x)) + " " + number(y.at(points[i].y))
                           : "H" + number(x.at(points[i].x)) + "V" + number(y.at(points[i].y));
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"#9aa1a9\" stroke-width=\"1.2\"/>\n";
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const bool isFront = !plot.front || std::find(front.begin(), front.end(), i) != front.end();
    out += "<path class=\"p\" tabindex=\"0\" role=\"img\" data-l=\"" + escaped(point.label) + "\" aria-label=\"" + escaped(point.title) +
           "\" d=\"" + markOf(point.shape) + "\" transform=\"translate(" + number(x.at(point.x)) + " " + number(y.at(point.y)) +
           ")\" fill=\"" + colourOf(point.colour) + "\" stroke=\"#fff\" fill-opacity=\"" + (isFront ? "1" : "0.55") + "\"><title>" +
           escaped(point.title) + "</title></path>\n";
  }
  // Labels of the front, each where no other label and few marks are: beside, above or below its point.
  struct Box {
    double x, y, width;
    [[nodiscard]] bool meets(const Box& other) const {
      return x < other.x + other.width && other.x < x + width && std::abs(y - other.y) < 12.0;
    }
  };
  std::vector<std::pair<double, double>> obstacles;  // marks, and the stairs every few pixels
  for (const Point& point : points) obstacles.emplace_back(x.at(point.x), y.at(point.y));
  for (std::size_t i = 1; i < front.size(); ++i) {
    const double x0 = x.at(points[front[i - 1]].x), y0 = y.at(points[front[i - 1]].y), x1 = x.at(points[front[i]].x),
                 y1 = y.at(points[front[i]].y);
    for (double at = x0; at < x1; at += 6.0) obstacles.emplace_back(at, y0);
    for (double at = y0; at < y1; at += 6.0) obstacles.emplace_back(x1, at);
  }
  std::vector<Box> taken;
  std::vector<std::string> named;
  for (const std::size_t i : front) {
    const Point& point = points[i];
    if (std::find(named.begin(), named.end(), point.label) != named.end()) continue;
    named.push_back(point.label);
    std::size_t characters = 0;
    for (const char c : point.label) characters += (static_cast<unsigned char>(c) & 0xc0u) != 0x80u;
    const double width = 5.9 * static_cast<double>(characters), px = x.at(point.x), py = y.at(point.y);
    Box best{px + 8.0, py + 4.0, width};
    int least = 1000;
    for (const auto& [dx, dy] : std::initializer_list<std::pair<double, double>>{{8.0, 4.0},
                                                                                 {-8.0 - width, 4.0},
                                                                                 {8.0, -8.0},
                                                                                 {8.0, 16.0},
                                                                                 {-8.0 - width, -8.0},
                                                                                 {-8.0 - width, 16.0},
                                                                                 {-width / 2, -10.0},
                                                                                 {-width / 2, 19.0},
                                                                                 {6.0, -20.0},
                                                                                 {-6.0 - width, 28.0}}) {
      const Box box{px + dx, py + dy, width};
      if (box.x < x.from + 2.0 || box.x + width > x.to + right || box.y < top + 4.0 || box.y > y.from - 3.0) continue;
      int cost = 0;
      for (const Box& other : taken) cost += box.meets(other) ? 20 : 0;
      for (const auto& [ox, oy] : obstacles) cost += ox > box.x - 5.0 && ox < box.x + width + 5.0 && oy > box.y - 14.0 && oy < box.y + 5.0;
      if (cost < least) {
        least = cost;
        best = box;
      }
    }
    if (least >= 20) continue;  // no room: the point still has its title
    taken.push_back(best);
    out += "<text class=\"l\" x=\"" + number(best.x) + "\" y=\"" + number(best.y) + "\" fill=\"" + colourOf(point.colour) +
           "\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">" + escaped(point.label) + "</text>\n";
  }
  return out + "</svg>\n";
}

}  // namespace gnomon::report
