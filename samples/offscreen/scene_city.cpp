// city: a street with railings, lamp posts and cables a few centimetres thin, between houses, and towers as far as 900 metres.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <glm/geometric.hpp>

#include "shapes.h"

namespace gnomon::offscreen {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kHalfRoad = 6.0;  // metres from the street's middle to the kerb
constexpr double kPavement = 3.6;  // metres wide
constexpr double kHalfStreet = kHalfRoad + kPavement;
constexpr double kBlockLength = 64.0, kCrossing = 15.0;  // metres
constexpr double kBeyond = 860.0;  // metres

// A house that fills [x0, x1] x [z0, z1] at most; its front, with ledges and balconies, looks along +x or -x.
void addHouse(Shapes& shapes, Random& random, double x0, double x1, double z0, double z1, double height, double front, bool detailed) {
  shapes.box({x0, -0.5, z0}, {x1, height, z1});
  const double over = random.between(0.25, 0.7);  // metres that the cornice stands out
  shapes.box({x0 - over, height - 0.45, z0 - 0.12}, {x1 + over, height + 0.3, z1 + 0.12});
  const double xm = 0.5 * (x0 + x1), zm = 0.5 * (z0 + z1);
  // On the roof: a hut, a chimney and a mast.
  shapes.box({xm - 1.9, height + 0.1, zm - 1.4}, {xm + 1.3, height + 2.9, zm + 1.6});
  shapes.box({xm + 2.2, height + 0.1, zm - 2.6}, {xm + 2.9, height + 3.6, zm - 1.8});
  shapes.rod({xm - 1.0, height + 2.5, zm}, {xm - 1.0, height + random.between(5.0, 9.0), zm}, 0.05, 5);
  if (!detailed) return;

  const double wall = front > 0.0 ? x1 : x0;
  const auto slab = [&](double reach, double y0, double y1, double a, double b) {  // from 0.2 m inside the wall to `reach` in front of it
    shapes.box({std::min(wall - 0.2 * front, wall + reach * front), y0, a}, {std::max(wall - 0.2 * front, wall + reach * front), y1, b});
  };
  slab(0.16, -0.4, random.between(0.7, 1.1), z0 - 0.05, z1 + 0.05);  // plinth
  slab(1.5, 3.55, 3.7, z0 + 1.2, z1 - 1.2);  // canopy over the shops
  const int windows = std::max(2, static_cast<int>((z1 - z0) / 3.2));
  const double bay = (z1 - z0) / windows;
  for (double y = 4.6; y + 2.4 < height - 0.6; y += 3.3) {
    for (int w = 0; w < windows; ++w) {
      const double a = z0 + (w + 0.22) * bay, b = z0 + (w + 0.78) * bay;
      slab(0.18, y, y + 0.11, a, b);  // sill
      slab(0.24, y + 1.95, y + 2.1, a - 0.1, b + 0.1);  // hood
    }
    if (random.unit() < 0.5) {  // a balcony with bars
      const int w = random.below(windows);
      const double a = z0 + (w + 0.1) * bay, b = z0 + (w + 0.9) * bay;
      slab(1.1, y - 0.36, y - 0.21, a, b);
      const double rail = wall + 1.05 * front;
      shapes.box({rail - 0.03, y + 0.7, a + 0.02}, {rail + 0.03, y + 0.75, b - 0.02});
      for (double z = a + 0.06; z < b - 0.05; z += 0.22) shapes.box({rail - 0.012, y - 0.3, z}, {rail + 0.012, y + 0.72, z + 0.024});
    }
  }
}

void addLamp(Shapes& shapes, double x, double z, double reach, int sides) {
  shapes.lathe(standing({x, 0.0, z}), {{0.14, 0.0}, {0.13, 0.9}, {0.07, 1.0}, {0.045, 6.4}}, sides);
  shapes.rod({x - 0.1 * reach, 6.3, z}, {x + reach, 6.75, z}, 0.03, 5);
  shapes.box({x + reach - 0.32, 6.6, z - 0.12}, {x + reach + 0.32, 6.72, z + 0.12});
}

void addCar(Shapes& shapes, const glm::dvec3& at, double turn) {
  const glm::dmat4 frame = standing(at, turn);
  shapes.box(frame, {-0.88, 0.32, -2.1}, {0.88, 0.86, 2.1});
  shapes.box(frame, {-0.74, 0.8, -1.5}, {0.74, 1.42, 0.8});
  for (const double x : {-0.8, 0.8}) {
    for (const double z : {-1.3, 1.35}) {
      const glm::dvec3 low(frame * glm::dvec4(x - 0.12, 0.3, z, 1.0)), high(frame * glm::dvec4(x + 0.12, 0.3, z, 1.0));
      shapes.rod(low, high, 0.315, 10);
    }
  }
}

}  // namespace

BuiltIn makeCity() {
  Shapes shapes("city");
  Random random(29);

  // The ground in cells, below the pavements' tops.
  std::vector<glm::dvec3> ground;
  constexpr int kCells = 24;
  for (int r = 0; r <= kCells; ++r) {
    for (int c = 0; c <= kCells; ++c) ground.emplace_back(-420.0 + 35.0 * c, 0.0, 90.0 - (kBeyond + 150.0) * r / kCells);
  }
  shapes.sheet(ground, kCells, kCells);

  // Blocks: four columns of them on each side of the street, farther ones plainer and higher.
  for (int column = -4; column < 4; ++column) {
    const double side = column < 0 ? -1.0 : 1.0;
    const int rank = column < 0 ? -column - 1 : column;  // 0 is on the street
    const double inner = side * (kHalfRoad + rank * 70.0), outer = side * (kHalfRoad + 56.0 + rank * 70.0);
    for (double z = 46.0; z > -kBeyond; z -= kBlockLength + kCrossing) {
      shapes.box({std::min(inner, outer), -0.3, z - kBlockLength}, {std::max(inner, outer), 0.16, z});
      double front = z - 2.4;
      while (front - 9.0 > z - kBlockLength + 2.0) {
        const double length = std::min(random.between(9.0, 19.0), front - (z - kBlockLength + 2.0));
        const bool tower = rank > 0 ? random.unit() < 0.3 : random.unit() < 0.06 && front < -150.0;
        const double height = tower ? random.between(45.0, 150.0) : random.between(8.0, rank == 0 ? 21.0 : 30.0);
        const double set = random.between(0.0, 0.5);  // no two fronts in one plane
        const double x0 = inner + side * (kPavement + set), x1 = x0 + side * random.between(14.0, 22.0);
        if (rank > 0 || random.unit() > 0.13) {  // a gap lets the sun through
          addHouse(shapes, random, std::min(x0, x1), std::max(x0, x1), front - length + random.between(0.3, 0.9), front, height, -side,
                   rank == 0 && front > -190.0);
        }
        const double back = side * random.between(0.0, 0.6);
        if (random.unit() < 0.6) {  // a second row behind
          const double b0 = outer - side * 16.0 - back, b1 = outer - side * 3.0 - back;
          addHouse(shapes, random, std::min(b0, b1), std::max(b0, b1), front - length + random.between(0.3, 0.9), front - 0.2,
                   random.between(9.0, 40.0), side, false);
        }
        front -= length + (random.unit() < 0.2 ? 3.0 : 0.25);
      }
    }
  }

  // Along the kerbs: railings, with bars where they are near, lamps, bollards and cars.
  for (const double side : {-1.0, 1.0}) {
    const double x = side * (kHalfRoad + 0.4);
    for (double z = 1.0; z > -230.0; z -= 2.0) {
      const double inBlock = std::fmod(46.0 - z, kBlockLength + kCrossing);
      if (inBlock < 1.0 || inBlock > kBlockLength - 3.0) continue;
      shapes.box({x - 0.03, 0.1, z - 0.03}, {x + 0.03, 1.2, z + 0.03});
      for (const double y : {0.38, 1.1}) shapes.box({x - 0.02, y, z - 1.975}, {x + 0.02, y + 0.04, z + 0.025});
      if (z > -46.0) {
        for (int i = 1; i < 14; ++i)
          shapes.box({x - 0.009, 0.36, z - 2.0 * i / 14.0 - 0.009}, {x + 0.009, 1.13, z - 2.0 * i / 14.0 + 0.009});
      }
    }
    for (double z = -9.0; z > -700.0; z -= 23.0) {
      addLamp(shapes, side * (kHalfRoad + 0.9), z - (side > 0.0 ? 11.0 : 0.0), -side * 2.2, z > -140.0 ? 10 : 6);
    }
    for (int i = 0; i < 34; ++i) {
      const double z = -10.0 - 16.5 * i - random.between(0.0, 6.0);
      if (random.unit() < 0.75)
        addCar(shapes, {side * random.between(3.2, 4.6), 0.0, z}, random.between(-0.05, 0.05) + (side > 0.0 ? 0.0 : kPi));
    }
  }

  // Cables: across the street with a lamp on each, and two along it.
  for (double z = -6.0; z > -520.0; z -= 21.0) {
    const double y = 7.6 + random.between(-0.4, 0.8);
    shapes.rope({-kHalfStreet - 1.0, y, z}, {kHalfStreet + 1.0, y + 0.5, z - 1.2}, 0.7, 0.02, 12);
    shapes.lathe(standing({0.0, 0.0, z - 0.6}), {{0.3, y - 0.95}, {0.24, y - 0.7}, {0.05, y - 0.4}}, 8);
  }
  for (const double x : {-1.6, 1.7}) {
    for (double z = 20.0; z > -420.0; z -= 21.0) shapes.rope({x, 6.3, z - 0.01}, {x, 6.3, z - 21.0}, 0.18, 0.018, 4);
  }

  BuiltIn scene{shapes.take(), {}};
  const gnomon::Camera camera = builtInCamera(scene.mesh, {-4.3, 3.1, 6.0}, {4.0, 5.6, -60.0}, 880.0);
  scene.views = {{"street", "steep", camera, glm::normalize(glm::dvec3(-0.52, -1.0, -0.45))},
                 {"street", "dueling", camera, glm::normalize(glm::dvec3(0.12, -0.4, 0.9))}};
  return scene;
}

}  // namespace gnomon::offscreen
