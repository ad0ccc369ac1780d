// colonnade: an avenue of columns from a few metres away to the horizon, in ruins here and there. Depth of what is seen: about 1 to 600.
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "shapes.h"

namespace gnomon::offscreen {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kBeyond = 900.0;  // metres down the avenue
constexpr double kSpacing = 6.0;  // metres between columns
constexpr double kTop = 9.15;  // metres, of the capitals

// Fewer sides and rings where they would not be seen.
int sidesAt(double distance) { return distance < 90.0 ? 24 : distance < 260.0 ? 14 : 8; }

void addColumn(Shapes& shapes, const glm::dvec3& at, double distance) {
  const int sides = sidesAt(distance);
  shapes.box(at + glm::dvec3(-0.82, 0.2, -0.82), at + glm::dvec3(0.82, 0.52, 0.82));
  shapes.box(at + glm::dvec3(-0.84, 8.83, -0.84), at + glm::dvec3(0.84, kTop, 0.84));
  if (distance < 260.0) {
    shapes.lathe(standing(at),
                 {{0.72, 0.48},
                  {0.78, 0.6},
                  {0.78, 0.7},
                  {0.7, 0.8},
                  {0.6, 0.86},
                  {0.56, 1.1},
                  {0.56, 3.4},
                  {0.52, 6.0},
                  {0.46, 8.2},
                  {0.52, 8.26},
                  {0.52, 8.36},
                  {0.47, 8.42},
                  {0.6, 8.66},
                  {0.76, 8.9}},
                 sides);
  } else {
    shapes.lathe(standing(at), {{0.74, 0.48}, {0.74, 0.75}, {0.56, 0.9}, {0.56, 3.4}, {0.46, 8.4}, {0.76, 8.9}}, sides);
  }
}

void addStump(Shapes& shapes, const glm::dvec3& at, double height, double turn, int sides) {
  shapes.box(at + glm::dvec3(-0.82, 0.2, -0.82), at + glm::dvec3(0.82, 0.52, 0.82));
  shapes.lathe(standing(at, turn), {{0.76, 0.48}, {0.76, 0.74}, {0.57, 0.88}, {0.56, 0.5 * height + 0.5}, {0.53, height}}, sides,
               {0.7, 0.35});
}

// A length of shaft that lies on the ground.
void addDrum(Shapes& shapes, const glm::dvec3& at, double length, double turn, int sides) {
  const glm::dvec3 axis(std::cos(turn), 0.0, std::sin(turn));
  const glm::dvec3 low = at + glm::dvec3(0.0, 0.48, 0.0) - 0.5 * length * axis;
  shapes.lathe(along(low, low + axis), {{0.54, 0.0}, {0.55, 0.3 * length}, {0.52, length}}, sides, {0.25, -0.4});
}

}  // namespace

BuiltIn makeColonnade() {
  Shapes shapes("colonnade");
  Random random(11);

  // The ground: cells grow with distance, so that no triangle is as long as the scene.
  std::vector<double> across, away;
  for (int i = -9; i <= 9; ++i) across.push_back(std::copysign(8.0 * (std::pow(1.75, std::abs(i)) - 1.0), static_cast<double>(i)));
  for (int i = 0; i <= 22; ++i) away.push_back(40.0 - 10.0 * (std::pow(1.229, static_cast<double>(i)) - 1.0));
  std::vector<glm::dvec3> ground;
  for (const double z : away) {
    for (const double x : across) ground.emplace_back(x, 0.0, z);
  }
  shapes.sheet(ground, static_cast<int>(across.size()) - 1, static_cast<int>(away.size()) - 1);

  for (const double side : {-1.0, 1.0}) {
    for (const double x : {7.0 * side, 20.0 * side}) {
      const bool inner = std::abs(x) < 10.0;
      // Two steps under each row, cut into lengths with a joint between them.
      for (double z = 18.0; z > -kBeyond; z -= 54.0) {
        shapes.box({x - 2.2, -0.2, z - 53.9}, {x + 2.2, 0.14, z});
        shapes.box({x - 1.5, -0.1, z - 53.8}, {x + 1.5, 0.3, z - 0.1});
      }
      bool lastStands = false;
      for (double z = 12.0; z > -kBeyond; z -= inner ? kSpacing : 2.0 * kSpacing) {
        const glm::dvec3 at(x, 0.0, z);
        const double distance = std::abs(z - 8.0);
        const double fate = random.unit();
        const int sides = sidesAt(distance);
        const bool stands = fate > (inner ? 0.22 : 0.35);
        if (stands) {
          addColumn(shapes, at, distance);
          // A beam from the last column to this one, each a little different in size from its neighbours.
          if (lastStands && inner && random.unit() < 0.7) {
            const double grow = random.between(0.0, 0.05);
            shapes.box({x - 0.6 - grow, kTop - 0.03 - 0.5 * grow, z + 0.02}, {x + 0.6 + grow, kTop + 0.85 + grow, z + kSpacing - 0.02});
          }
        } else if (fate > 0.08) {
          addStump(shapes, at, random.between(1.6, 6.5), random.between(0.0, 2.0 * kPi), sides);
          const double inwards = -side * random.between(2.8, 5.2);
          addDrum(shapes, at + glm::dvec3(inwards, 0.0, random.between(-2.0, 2.0)), random.between(1.2, 3.4), random.between(0.0, kPi),
                  sides);
        } else {
          addDrum(shapes, at + glm::dvec3(-side * 4.2, 0.0, 0.4), random.between(4.0, 5.5), random.between(-0.5, 0.5), sides);
        }
        lastStands = stands;
      }
    }
  }

  // Stones on the ground, at every distance alike: as many in each doubling of it.
  for (int i = 0; i < 420; ++i) {
    const double distance = 4.0 * std::pow(210.0, random.unit());
    const double x = random.between(-1.0, 1.0) * (3.5 + 0.35 * distance);
    const double size = random.between(0.06, 0.22) * (1.0 + 0.004 * distance);
    if (std::abs(std::abs(x) - 7.0) < 2.6 || std::abs(std::abs(x) - 20.0) < 2.6) continue;
    const glm::dvec3 at(x, 0.35 * size, 8.0 - distance);
    const glm::dmat4 frame = along(at, at + glm::dvec3(random.between(-0.4, 0.4), 1.0, random.between(-0.4, 0.4)));
    shapes.box(frame, glm::dvec3(-size, -0.8 * size, -0.7 * size), glm::dvec3(size, 0.8 * size, 0.7 * size));
  }

  // Obelisks beside the avenue, and thin poles along it.
  for (int i = 0; i < 36; ++i) {
    const double distance = 40.0 * std::pow(22.0, random.unit());
    const double x = (random.unit() < 0.5 ? -1.0 : 1.0) * (30.0 + random.between(0.0, 0.5) * distance);
    const double height = random.between(12.0, 34.0);
    shapes.lathe(standing({x, 0.0, 8.0 - distance}, random.between(0.0, kPi)), {{1.9, -0.3}, {1.1, height}, {0.08, height + 2.2}}, 4);
  }
  for (double z = 2.0; z > -400.0; z -= 15.0) {
    for (const double x : {-3.9, 3.9}) {
      shapes.lathe(standing({x, 0.0, z}), {{0.2, -0.1}, {0.18, 0.25}, {0.05, 0.32}, {0.035, 4.6}, {0.09, 4.66}, {0.02, 4.9}},
                   z > -90.0 ? 10 : 6);
    }
  }

  BuiltIn scene{shapes.take(), {}};
  const gnomon::Camera camera = builtInCamera(scene.mesh, {1.3, 1.7, 8.0}, {-4.0, 4.5, -100.0}, 890.0);
  scene.views = {{"avenue", "steep", camera, glm::normalize(glm::dvec3(0.8, -0.85, -0.3))},
                 {"avenue", "dueling", camera, glm::normalize(glm::dvec3(0.3, -0.42, 0.86))}};
  return scene;
}

}  // namespace gnomon::offscreen
