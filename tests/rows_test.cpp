#include "support.h"

#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

#include "gnomon/fit.h"
#include "gnomon/rows.h"

namespace gnomon::test {
namespace {

Trapezoid trapezoid(double base, double length, double degrees) {
  return {{1.0, 0.0}, 0.0, length, 0.0, base, std::tan(degrees * kPi / 180.0)};
}

TEST(Rows, RefusesBadSettings) {
  double value = 0.0;
  for (const double bad : {0.0, -0.1, 0.5, 0.7, std::nan("")}) EXPECT_EQ(validate(RowSettings{.zeta = bad}, value), Status::rowsZeta);
  for (const double bad : {0.0, -1.0, kInfinity, std::nan("")}) EXPECT_EQ(validate(RowSettings{.sigma = bad}, value), Status::rowsSigma);
  for (const int bad : {0, -1, 17}) {
    EXPECT_EQ(validate(RowSettings{.maxRows = bad}, value), Status::rowsMaxRows);
    EXPECT_EQ(value, bad);
    EXPECT_EQ(validate(RowSettings{.maxColumns = bad}, value), Status::rowsMaxColumns);
  }
  EXPECT_EQ(validate(RowSettings{}, value), Status::ok);
}

// Eq. 1 evaluated to forty digits elsewhere: width and height of the last row, columns of each, how many rows.
TEST(Rows, PaperAsPrinted) {
  const struct {
    double base, length, degrees, zeta;
    int most, rows, columns;
    double width, height;
  } known[] = {
      {1.0, 20.0, 0.0, 0.25, 4, 4, 1, 1.0, 1.0},
      {1.0, 20.0, 5.0, 0.25, 4, 4, 1, 2.158422525575828, 2.158422525575828},
      {1.0, 20.0, 20.0, 0.25, 4, 4, 1, 16.0, 10.989909677818488},
      {1.0, 20.0, 27.0, 0.25, 4, 4, 2, 16.0, 7.850442022020602},
      {2.0, 300.0, 30.0, 0.1, 99, 24, 4, 423.51647362715016, 73.35520501646286},
  };
  for (const auto& row : known) {
    RowSize sizes[99];
    ASSERT_EQ(paperRows(trapezoid(row.base, row.length, row.degrees), row.zeta, row.most, sizes), row.rows);
    EXPECT_NEAR(sizes[row.rows - 1].width / row.width, 1.0, 1e-12);
    EXPECT_NEAR(sizes[row.rows - 1].height / row.height, 1.0, 1e-12);
    for (int i = 0; i < row.rows; ++i) EXPECT_EQ(columnCount(sizes[i], 0.5, 99), row.columns);
  }
}

TEST(Rows, PaperMatchesTheReferenceFile) {
  const std::filesystem::path path = std::filesystem::path(GNOMON_EXTRA_DATA) / "reference/closed_forms.json";
  if (std::string(GNOMON_EXTRA_DATA).empty() || !std::filesystem::exists(path)) GTEST_SKIP() << "GNOMON_EXTRA_DATA has no reference";
  const auto entries = nlohmann::json::parse(std::ifstream(path))["lspsm"];
  ASSERT_GT(entries.size(), 5u);
  for (const auto& entry : entries) {
    const Trapezoid shape = trapezoid(entry["near_base"], entry["length"], entry["leg_angle_degrees"]);
    RowSize sizes[99];
    const auto& rows = entry["rows"];
    ASSERT_EQ(paperRows(shape, entry["zeta"], entry["max_rows"], sizes), static_cast<int>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_NEAR(sizes[i].width / rows[i]["W"].get<double>(), 1.0, 1e-12);
      EXPECT_NEAR(sizes[i].height / rows[i]["H"].get<double>(), 1.0, 1e-12);
      EXPECT_EQ(columnCount(sizes[i], entry["sigma"], entry["max_columns"]), rows[i]["columns"].get<int>());
      EXPECT_NEAR(wasteOf(sizes[i], shape.tangent), rows[i]["waste"].get<double>(), 1e-12);
    }
  }
}

// Never more rows than eq. 1 takes, one ratio of width, the far end met, and no more waste than zeta where that many are allowed.
TEST(Rows, FittedEndWhereTheTrapezoidDoes) {
  Random random(501);
  for (int k = 0; k < 20000; ++k) {
    const double tangent = k % 4 == 0 ? random.logUniform(1e-14, 1e-3) : random.logUniform(1e-3, 10.0), zeta = random.uniform(0.01, 0.49);
    const Trapezoid shape{{1.0, 0.0}, 0.0, random.logUniform(0.1, 1e4), 0.0, random.logUniform(1e-3, 10.0), k % 16 == 0 ? 0.0 : tangent};
    RowSize fitted[64], paper[64];
    const int printed = paperRows(shape, zeta, 64, paper), count = fittedRows(shape, zeta, 64, fitted);
    double paperReach = 0.0, reach = 0.0;
    for (int i = 0; i < printed; ++i) paperReach += paper[i].height;
    ASSERT_GE(count, 1);
    ASSERT_LE(count, printed) << k;
    for (int i = 0; i < count; ++i) {
      reach += fitted[i].height;
      ASSERT_GT(fitted[i].height, 0.0);
      ASSERT_NEAR(fitted[i].width / (shape.base + 2.0 * shape.tangent * reach), 1.0, 1e-12);
      const double before = i > 0 ? fitted[i - 1].width : shape.base;
      ASSERT_NEAR(fitted[i].width / before / (fitted[0].width / shape.base), 1.0, 1e-9);
      if (paperReach >= shape.length) {
        ASSERT_LE(wasteOf(fitted[i], shape.tangent), zeta * (1.0 + 1e-9)) << k;
      }
    }
    ASSERT_NEAR(reach / shape.length, 1.0, 1e-12);
  }
}

// In long double, by the plain power, where that is not 0/0; and equal heights where nothing grows.
TEST(Rows, FittedIsTheClosedForm) {
  RowSize rows[16];
  for (const double degrees : {1e-3, 1.0, 10.0, 30.0, 60.0}) {
    const Trapezoid shape = trapezoid(2.0, 300.0, degrees);
    const int count = fittedRows(shape, 0.25, 4, rows);
    const long double t = shape.tangent, ratio = 1.0L + 2.0L * 300.0L * t / 2.0L;
    for (int i = 0; i < count; ++i) {
      const long double from = std::pow(ratio, static_cast<long double>(i) / count), to = std::pow(ratio, (i + 1.0L) / count);
      EXPECT_NEAR(rows[i].height, static_cast<double>(2.0L * (to - from) / (2.0L * t)), 1e-9 * rows[i].height);
    }
  }
  ASSERT_EQ(fittedRows(trapezoid(2.0, 300.0, 0.0), 0.25, 3, rows), 3);
  for (int i = 0; i < 3; ++i) EXPECT_DOUBLE_EQ(rows[i].height, 100.0);
}

// Holds every point, and no slope among ten thousand holds them with less, weighed at the same place.
TEST(Rows, TheTrapezoidIsTheLeast) {
  Random random(502);
  for (int k = 0; k < 200; ++k) {
    const int count = 3 + random.index(10);
    glm::dvec2 hull[16];
    const double turn = random.uniform(0.0, 2.0 * kPi);
    for (int i = 0; i < count; ++i) {  // convex: points of an ellipse
      const double at = turn + 2.0 * kPi * (i + random.uniform(0.0, 0.5)) / count;
      hull[i] = {std::cos(at) * 3.0 + 1.0, std::sin(at) + 0.5 * std::cos(at) - 2.0};
    }
    const double angle = random.uniform(0.0, 2.0 * kPi);
    const glm::dvec2 axis(std::cos(angle), std::sin(angle));
    double from = kInfinity, to = -kInfinity;
    for (int i = 0; i < count; ++i) {
      from = std::min(from, glm::dot(axis, hull[i]));
      to = std::max(to, glm::dot(axis, hull[i]));
    }
    // Inside, at the ends and past them, where the nearer end counts.
    const double past = random.uniform(0.0, 1.0), inside = random.uniform(from, to);
    const double centres[] = {inside, from, to, from - past, to + past}, centre = centres[random.index(5)],
                 at = std::clamp(centre, from, to);
    const Trapezoid shape = leastTrapezoid(hull, count, axis, centre, 1e-9);
    const glm::dvec2 across(-shape.axis.y, shape.axis.x);
    for (int i = 0; i < count; ++i) {
      const double u = glm::dot(shape.axis, hull[i]) - shape.from, v = glm::dot(across, hull[i]) - shape.centre;
      EXPECT_GE(u, -1e-12);
      EXPECT_LE(u, shape.length + 1e-12);
      EXPECT_LE(std::abs(v), shape.base / 2.0 + shape.tangent * u + 1e-9);
    }
    const double along = glm::dot(shape.axis, axis) > 0.0 ? at : -at;
    const double width = shape.base + 2.0 * shape.tangent * (along - shape.from);
    for (int i = 0; i < 10000; ++i) {
      const double m = std::tan(random.uniform(-1.5, 1.5));
      double a = -kInfinity, b = -kInfinity;
      for (int j = 0; j < count; ++j) {
        const double u = glm::dot(axis, hull[j]), v = axis.x * hull[j].y - axis.y * hull[j].x;
        a = std::max(a, v - m * u);
        b = std::max(b, -v - m * u);
      }
      ASSERT_GE(a + b + 2.0 * m * at, width * (1.0 - 1e-12) - 1.001e-9);  // no side is shorter than 1e-9
    }
  }
}

// A point, a line along the axis and one across it still have sides.
TEST(Rows, FlatHullsHaveSides) {
  const glm::dvec2 line[2] = {{1.0, 2.0}, {4.0, 2.0}};
  for (const glm::dvec2 axis : {glm::dvec2(1.0, 0.0), glm::dvec2(0.0, 1.0)})
    for (const int count : {1, 2}) {
      const Trapezoid shape = leastTrapezoid(line, count, axis, glm::dot(axis, line[0]), 0.01);
      EXPECT_GE(shape.length, 0.01);
      EXPECT_GE(shape.base, 0.01);
      EXPECT_TRUE(std::isfinite(shape.tangent));
    }
}

struct Made {
  Region region;
  LightSpace light;
  RowPlane plane;
  Splits splits;
  RowLayout layout;
  Status status;
};

void make(const Frame& frame, const RowSettings& settings, Made& made) {
  int index = 0;
  double value = 0.0;
  ASSERT_EQ(makeRegion(frame, made.region, index, value), Status::ok);
  ASSERT_EQ(makeLightSpace(frame.light, made.region, FitMode::tight, made.light), Status::ok);
  makeRowPlane(made.region, made.light, made.plane);
  made.status = splitRows(made.region, made.light, made.plane, settings, frame.budget.partitions, made.splits, made.layout);
}

// Any view, light and scene: rolled, off-axis, orthographic and cut views; light along the view or nearly.
Frame anyFrame(Random& random, int k, std::vector<Box>& boxes, glm::dvec4& plane) {
  Frame frame = usualFrame();
  frame.camera.forwardWs = random.direction();
  frame.camera.upWs = random.direction();
  frame.camera.far = random.logUniform(1.0, 1e4);
  const Axes axes(frame.camera);
  frame.light.directionWs = k % 7 == 0   ? axes.forward * (random.index(2) ? 1.0 : -1.0)
                            : k % 7 == 1 ? axes.forward + random.direction() * random.logUniform(1e-15, 1e-2)
                                         : random.direction();
  if (k % 3 == 0) frame.camera.left = random.uniform(-0.5, 1.0);
  if (k % 11 == 0) frame.camera = orthographic({0, 0, 0}, random.direction(), random.direction(), 10.0, 1.5, -1.0, 50.0);
  if (k % 5 == 0) {
    plane = glm::dvec4(random.direction(), random.uniform(0.0, 5.0));
    frame.scene.planes = {&plane, 1};
  }
  if (k % 8 == 0) {
    boxes.clear();
    for (int i = 0; i <= k % 3; ++i) {
      const glm::dvec3 at =
          viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(0.1, 50.0)) + frame.camera.positionWs;
      const glm::dvec3 half = glm::abs(random.direction()) * random.logUniform(0.01, 10.0);
      boxes.push_back({at - half, at + half});
    }
    frame.scene.receivers = boxes;
  }
  frame.budget.partitions = 1 + random.index(16);
  return frame;
}

// What is cut from the region's hull is the hull of what each rectangle holds: as far in every direction.
TEST(Rows, HullsCutFromTheWholeAreEachTheirOwn) {
  Random random(504);
  std::vector<Box> boxes;
  glm::dvec4 plane(0.0);
  auto made = std::make_unique<Made>();
  std::array<Footprint, kMaxPartitions> cut, own;
  std::array<Served, kMaxPartitions> served;
  int compared = 0;
  for (int k = 1; k < 4000; ++k) {
    if (k % 7 < 2) continue;  // along the light a region's sides may be lines
    const Frame frame = anyFrame(random, k, boxes, plane);
    const RowSettings settings{.rule = k % 2 ? RowRule::error : RowRule::fitted, .maxColumns = 1 + random.index(4)};
    make(frame, settings, *made);
    ASSERT_EQ(made->status, Status::ok);
    if (made->splits.count < 2 || frame.scene.receivers.size() > 1) continue;
    const auto find = [&](const Footprint* whole, std::array<Footprint, kMaxPartitions>& footprints) {
      makeFootprints(made->region, made->light, made->splits, frame.margin, false, false, footprints.data(), served.data(), whole);
    };
    find(&made->plane.whole, cut);
    find(nullptr, own);
    for (std::size_t i = 0; i < static_cast<std::size_t>(made->splits.count); ++i) {
      ASSERT_EQ(cut[i].count > 0, own[i].count > 0);
      for (int d = 0; d < 16; ++d) {
        const glm::dvec2 way(std::cos(d * kPi / 8.0), std::sin(d * kPi / 8.0));
        const auto reachOf = [&](const Footprint& footprint) {
          double reach = -kInfinity;
          for (int v = 0; v < footprint.count; ++v) reach = std::max(reach, glm::dot(way, footprint.hull[v]));
          return reach;
        };
        if (cut[i].count == 0) continue;
        ASSERT_NEAR(reachOf(cut[i]), reachOf(own[i]), 1e-9 * own[i].reach) << k;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 10000);
}

// No overlap and no gap, exactly: rows share their ends and columns their sides, bit for bit, and nothing bounds the outer ones, so
// that each point of the plane lies in exactly one rectangle. A hundred thousand views; rho keeps to zeta where no limit on rows binds.
TEST(Rows, RectanglesTileThePlane) {
  Random random(503);
  std::vector<Box> boxes;
  glm::dvec4 plane(0.0);
  auto made = std::make_unique<Made>();
  int answered = 0, withColumns = 0;
  for (int k = 0; k < 100000; ++k) {
    const Frame frame = anyFrame(random, k, boxes, plane);
    const RowSettings settings{.rule = static_cast<RowRule>(k % 3),
                               .zeta = random.uniform(0.01, 0.49),
                               .sigma = random.logUniform(0.1, 3.0),
                               .maxRows = 1 + random.index(16),
                               .maxColumns = 1 + random.index(4)};
    make(frame, settings, *made);
    const Splits& splits = made->splits;
    if (made->status == Status::rowsReach) {
      ASSERT_EQ(settings.rule, RowRule::paper);
      ASSERT_EQ(splits.count, 0);
      continue;
    }
    ASSERT_EQ(made->status, Status::ok);
    if (splits.count == 0) continue;  // an empty region
    ++answered;
    ASSERT_LE(splits.count, frame.budget.partitions);
    ASSERT_LE(splits.rows.count, settings.maxRows);
    if (settings.rule != RowRule::error && splits.rows.count < std::min(settings.maxRows, frame.budget.partitions)) {
      ASSERT_LE(made->layout.waste, settings.zeta * (1.0 + 1e-9)) << k;
    }
    int next = 0;
    for (int r = 0; r < splits.rows.count; ++r) {
      const Rows::Row& row = splits.rows.rows[r];
      ASSERT_EQ(row.first, next);
      ASSERT_LE(row.columns, settings.maxColumns);
      withColumns += row.columns > 1;
      for (int c = 0; c < row.columns; ++c) {
        const Wedge& wedge = splits.wedges[next++];
        ASSERT_EQ(wedge.axis.normal, splits.rows.along.normal);
        ASSERT_EQ(wedge.start, r == 0 ? -kInfinity : row.start);
        ASSERT_EQ(wedge.end, r + 1 == splits.rows.count ? kInfinity : splits.rows.rows[r + 1].start);
        ASSERT_TRUE(wedge.end > wedge.start || made->layout.shape.length == 0.0) << k;
        if (c == 0) {
          ASSERT_EQ(wedge.left.normal, glm::dvec3(0.0));
        } else {
          const Wedge& before = splits.wedges[next - 2];
          ASSERT_EQ(wedge.left.normal, -before.right.normal);
          ASSERT_EQ(wedge.left.offset, -before.right.offset);
          ASSERT_TRUE(c == 1 || before.right.offset > -before.left.offset);
        }
      }
      ASSERT_EQ(splits.wedges[next - 1].right.normal, glm::dvec3(0.0));
    }
    ASSERT_EQ(next, splits.count);
  }
  EXPECT_GT(answered, 60000);
  EXPECT_GT(withColumns, 10000);
}

// A triangle's tip starts at the least pixel: a view from above its own near end, nearly a point.
TEST(Rows, ATipStartsAtThePixel) {
  Frame frame = usualFrame();
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 1e-9, 10.0);
  frame.light.directionWs = {0, -1, 0};
  frame.budget.partitions = 16;
  auto made = std::make_unique<Made>();
  make(frame, {}, *made);
  ASSERT_EQ(made->status, Status::ok);
  EXPECT_GE(made->layout.shape.base, pixelAt(frame, 1e-9));
  EXPECT_EQ(made->layout.count, 16);
}

// Rows by error hold equal shares of the integral of 1 / w: for an overhead light and a level view, slices of equal ratio.
TEST(Rows, ErrorRowsOfALevelViewAreOfEqualRatio) {
  Frame frame = usualFrame();
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 1.0, 256.0);
  frame.light.directionWs = {0, -1, 0};
  auto made = std::make_unique<Made>();
  make(frame, {.rule = RowRule::error, .maxColumns = 1}, *made);
  ASSERT_EQ(made->splits.count, 4);
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(made->splits.wedges[i].start, std::pow(4.0, i), 1e-9 * std::pow(4.0, i));
}

}  // namespace
}  // namespace gnomon::test
