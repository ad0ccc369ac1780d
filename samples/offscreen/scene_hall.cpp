// hall: an indoor hall of sixty metres; the sun enters through barred windows at the sides and a glassless strip in the roof.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "shapes.h"

namespace gnomon::offscreen {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHalfWidth = 10.0;  // metres, to the inner faces of the walls
constexpr double kFront = 4.0, kEnd = -62.0;  // metres, where the end walls stand
constexpr double kBay = 5.5;  // metres

// Walls are made of bands and piers of different thickness that run into each other: closed, and no two faces in one plane.
void addSideWall(Shapes& shapes, double side) {
  const auto band = [&](double inner, double outer, double y0, double y1, double z0, double z1) {
    shapes.box({side > 0.0 ? inner : -outer, y0, z0}, {side > 0.0 ? outer : -inner, y1, z1});
  };
  band(kHalfWidth, kHalfWidth + 0.7, -0.6, 1.1, kEnd - 0.3, kFront + 0.3);
  band(kHalfWidth + 0.02, kHalfWidth + 0.68, 6.6, 9.1, kEnd - 0.28, kFront + 0.28);
  for (double z = kFront - 0.5; z > kEnd - 0.2; z -= kBay) {
    band(kHalfWidth - 0.12, kHalfWidth + 0.82, -0.5, 9.0, z - 0.55, z + 0.55);
    if (z - kBay < kEnd - 0.2) break;
    for (int bar = 1; bar < 4; ++bar) {
      const double at = z - 0.55 - (kBay - 1.1) * bar / 4.0;
      band(kHalfWidth + 0.3, kHalfWidth + 0.38, 1.0, 6.7, at - 0.04, at + 0.04);
    }
    for (const double y : {2.5, 3.9, 5.3}) band(kHalfWidth + 0.31, kHalfWidth + 0.37, y - 0.03, y + 0.03, z - kBay + 0.5, z - 0.5);
  }
}

void addTable(Shapes& shapes, const glm::dmat4& frame, double length) {
  shapes.box(frame, {-0.45, 0.72, -0.5 * length}, {0.45, 0.78, 0.5 * length});
  for (const double x : {-0.38, 0.38}) {
    for (const double z : {-0.5 * length + 0.15, 0.5 * length - 0.15})
      shapes.box(frame, {x - 0.035, -0.05, z - 0.035}, {x + 0.035, 0.75, z + 0.035});
  }
  for (const double x : {-0.95, 0.95}) {
    shapes.box(frame, {x - 0.16, 0.42, -0.46 * length}, {x + 0.16, 0.46, 0.46 * length});
    for (const double z : {-0.4 * length, 0.4 * length}) shapes.box(frame, {x - 0.12, -0.05, z - 0.03}, {x + 0.12, 0.44, z + 0.03});
  }
}

void addChair(Shapes& shapes, const glm::dmat4& frame) {
  shapes.box(frame, {-0.22, 0.42, -0.22}, {0.22, 0.46, 0.22});
  for (const double x : {-0.19, 0.19}) {
    shapes.box(frame, {x - 0.018, -0.05, 0.17}, {x + 0.018, 0.44, 0.206});
    shapes.box(frame, {x - 0.019, -0.05, -0.207}, {x + 0.019, 1.0, -0.17});
  }
  for (const double y : {0.62, 0.78, 0.92}) shapes.box(frame, {-0.18, y, -0.2}, {0.18, y + 0.05, -0.178});
}

}  // namespace

BuiltIn makeHall() {
  Shapes shapes("hall");
  Random random(17);

  // Ground outside, floor inside above it.
  std::vector<glm::dvec3> ground;
  for (int r = 0; r <= 8; ++r) {
    for (int c = 0; c <= 8; ++c) ground.emplace_back(-64.0 + 16.0 * c, -0.4, 30.0 - 16.0 * r);
  }
  shapes.sheet(ground, 8, 8);
  for (double z = kFront + 0.1; z > kEnd; z -= kBay) shapes.box({-kHalfWidth - 0.2, -0.55, z - kBay}, {kHalfWidth + 0.2, 0.0, z});

  for (const double side : {-1.0, 1.0}) addSideWall(shapes, side);
  // End walls: behind the camera closed; the far one has a tall door and two slits.
  shapes.box({-kHalfWidth - 0.5, -0.58, kFront - 0.15}, {kHalfWidth + 0.5, 9.05, kFront + 0.45});
  for (const double side : {-1.0, 1.0}) {
    const auto pier = [&](double a, double b, double thick) {
      shapes.box({side > 0.0 ? a : -b, -0.58, kEnd - thick}, {side > 0.0 ? b : -a, 9.04, kEnd + thick});
    };
    pier(1.9, 4.4, 0.32);
    pier(5.6, 10.4, 0.31);
  }
  shapes.box({-10.3, 6.2, kEnd - 0.3}, {10.3, 9.03, kEnd + 0.3});

  // Columns carry two long beams; beams across carry the roof, which leaves a strip open over the middle, with rafters.
  for (double z = kFront - 0.5 - kBay; z > kEnd + 2.0; z -= kBay) {
    for (const double x : {-5.2, 5.2}) {
      shapes.box({x - 0.5, -0.1, z - 0.5}, {x + 0.5, 0.28, z + 0.5});
      shapes.lathe(standing({x, 0.0, z}), {{0.42, 0.24}, {0.44, 0.36}, {0.34, 0.48}, {0.32, 3.0}, {0.27, 6.6}, {0.32, 6.68}, {0.45, 7.05}},
                   z > -30.0 ? 20 : 12);
      shapes.box({x - 0.5, 7.0, z - 0.5}, {x + 0.5, 7.24, z + 0.5});
    }
    shapes.box({-kHalfWidth - 0.3, 7.86, z - 0.16}, {kHalfWidth + 0.3, 8.44, z + 0.16});
    // A tie with a lamp on a thin cord.
    shapes.rod({-5.2, 6.9, z}, {5.2, 6.9, z}, 0.025, 6);
    shapes.rod({0.0, 6.9, z}, {0.0, 4.35, z}, 0.012, 4);
    shapes.lathe(standing({0.0, 0.0, z}), {{0.46, 4.0}, {0.4, 4.12}, {0.12, 4.34}, {0.05, 4.45}}, 12);
  }
  for (const double x : {-5.2, 5.2}) shapes.box({x - 0.28, 7.2, kEnd + 0.1}, {x + 0.28, 7.9, kFront + 0.1});
  for (const double side : {-1.0, 1.0}) {
    const double a = side * 4.4, b = side * (kHalfWidth + 1.3);
    shapes.box({a - 0.12, 8.3, kEnd - 0.8}, {a + 0.12, 9.0, kFront + 0.8});
    // Over the aisles every third bay is open; what is left of the slabs rests on the beams.
    int bay = 0;
    for (double z = kFront - 0.5; z > kEnd; z -= kBay, ++bay) {
      if ((bay + (side > 0.0 ? 1 : 0)) % 3 == 2) continue;
      const double grow = 0.005 * (bay % 2);  // neighbours reach into one another, none face in the plane of another's
      const double inner = a - side * grow, outer = b + side * grow;
      shapes.box({std::min(inner, outer), 8.4 - grow, z - kBay - 0.1}, {std::max(inner, outer), 8.7 + grow, z + 0.1});
    }
  }
  for (double z = kFront - 1.0; z > kEnd; z -= 1.3) shapes.box({-4.8, 8.55, z - 0.05}, {4.8, 8.68, z + 0.05});

  // A gallery along the left wall, with a railing and thin posts below.
  shapes.box({-kHalfWidth - 0.1, 3.35, kEnd + 4.0}, {-7.1, 3.55, -7.0});
  shapes.box({-7.22, 4.5, kEnd + 4.1}, {-7.16, 4.56, -7.1});
  for (double z = -7.2; z > kEnd + 4.2; z -= 0.32) shapes.box({-7.205, 3.5, z - 0.012}, {-7.175, 4.53, z + 0.012});
  for (double z = -7.6; z > kEnd + 4.2; z -= kBay) shapes.rod({-7.3, -0.1, z}, {-7.3, 3.4, z}, 0.05, 8);

  // Furniture: tables and benches, chairs about, crates in stacks, shelves by the right wall.
  for (double z = -4.5; z > kEnd + 6.0; z -= 4.6) {
    if (random.unit() < 0.85)
      addTable(shapes, standing({random.between(-2.2, -1.4), 0.0, z}, random.between(-0.12, 0.12)), random.between(2.4, 3.4));
    if (random.unit() < 0.85)
      addTable(shapes, standing({random.between(1.6, 2.6), 0.0, z - 1.0}, random.between(-0.12, 0.12)), random.between(2.2, 3.2));
    for (int i = 0; i < 2; ++i)
      addChair(shapes, standing({random.between(4.1, 4.4), 0.0, z + 1.5 * i - 0.6}, random.between(0.0, 2.0 * kPi)));
  }
  for (double z = -3.0; z > kEnd + 4.0; z -= 3.7) {
    const double x = random.between(7.4, 8.9);
    double y = -0.05;
    for (int i = random.below(4); i >= 0; --i) {
      const double half = random.between(0.35, 0.62), height = random.between(0.5, 0.9);
      shapes.box(standing({x + random.between(-0.1, 0.1), y, z}, random.between(-0.5, 0.5)), {-half, 0.0, -half}, {half, height, half});
      y += height - 0.01;
    }
    // A ladder against the wall now and then.
    if (random.unit() < 0.4) {
      const double lz = z - 1.9;
      for (const double off : {-0.22, 0.22}) shapes.rod({8.6, -0.05, lz + off}, {9.95, 5.2, lz + off}, 0.03, 6);
      for (int rung = 1; rung < 15; ++rung) {
        const double t = rung / 15.0;
        shapes.rod({8.6 + 1.35 * t, -0.05 + 5.25 * t, lz - 0.24}, {8.6 + 1.35 * t, -0.05 + 5.25 * t, lz + 0.24}, 0.018, 5);
      }
    }
  }

  BuiltIn scene{shapes.take(), {}};
  const gnomon::Camera camera = builtInCamera(scene.mesh, {3.3, 1.75, 1.5}, {-1.2, 2.6, -30.0}, 104.0);
  scene.views = {{"aisle", "steep", camera, glm::normalize(glm::dvec3(-0.28, -1.0, -0.3))},
                 {"aisle", "low", camera, glm::normalize(glm::dvec3(-0.9, -0.42, -0.3))},
                 {"aisle", "dueling", camera, glm::normalize(glm::dvec3(0.36, -0.72, 0.62))}};
  return scene;
}

}  // namespace gnomon::offscreen
