// relief: seven kilometres of ridges, rocks and spires. Depth of what is seen: about 1 to 750.
#include <cmath>
#include <numbers>
#include <vector>

#include <glm/geometric.hpp>

#include "shapes.h"

namespace gnomon::offscreen {
namespace {

constexpr double kBeyond = 7000.0;  // metres in front of the camera
constexpr double kBehind = 260.0;  // metres behind it

// Metres, at a point on the map. The camera stands at the origin and looks along -z, down a valley between ridges.
double heightAt(double x, double z) {
  const glm::dvec2 p(x, z);
  const double away = std::sqrt(x * x + z * z);
  const double valley = 0.12 + 0.88 * (1.0 - std::exp(-std::pow(std::abs(x + 0.12 * z + 90.0) / 1000.0, 2.0)));
  const double mountains = 900.0 * ridgedNoise(p / 2100.0, 5, 3) * valley * (1.0 - std::exp(-away / 900.0));
  const double hills = 46.0 * ridgedNoise(p / 240.0, 3, 23) * (1.0 - 0.6 * std::exp(-away / 150.0));
  const double crags = 15.0 * ridgedNoise(p / 64.0, 2, 33) * (1.0 - std::exp(-away / 160.0));
  const double bumps = 3.2 * smoothNoise(p / 21.0, 41) + 0.7 * smoothNoise(p / 5.5, 43);
  const double shoulder = 60.0 * std::exp(-away * away / 8000.0);  // what the camera stands on
  return mountains + hills + crags + bumps + shoulder;
}

// Half the terrain's width: the view's, and room at the sides for what casts into it.
double halfWidth(double away) { return 420.0 + 1.5 * (away + kBehind); }

}  // namespace

BuiltIn makeRelief() {
  Shapes shapes("relief");
  Random random(5);

  // A fan: cells grow with distance and stay about square.
  constexpr int kColumns = 208, kRows = 200;
  constexpr double kFirst = 70.0;  // metres: how soon cells begin to grow
  std::vector<glm::dvec3> points;
  for (int r = 0; r <= kRows; ++r) {
    const double t = static_cast<double>(r) / kRows;
    // Rows are even behind the camera's feet, then geometric.
    const double away = t < 0.1 ? -kBehind * (1.0 - t / 0.1) : kFirst * (std::pow(1.0 + kBeyond / kFirst, (t - 0.1) / 0.9) - 1.0);
    for (int c = 0; c <= kColumns; ++c) {
      const double u = 2.0 * c / kColumns - 1.0;
      const double x = halfWidth(away) * (0.25 * u + 0.75 * u * u * u);  // finer ahead of the camera than at its sides
      points.emplace_back(x, heightAt(x, -away), -away);
    }
  }
  shapes.sheet(points, kColumns, kRows);

  // Spires and boulders, as many in each doubling of the distance.
  for (int i = 0; i < 230; ++i) {
    const double away = 28.0 * std::pow(200.0, random.unit());
    const double x = random.between(-1.0, 1.0) * away;
    const double height = random.between(0.5, 1.0) * (7.0 + 0.075 * away) * (random.unit() < 0.2 ? 1.8 : 1.0);
    const double radius = height * random.between(0.09, 0.2);
    const glm::dvec3 foot(x, heightAt(x, -away) - 0.3 * height, -away);
    const glm::dvec3 lean(random.between(-0.12, 0.12), 1.0, random.between(-0.12, 0.12));
    const double h = 1.3 * height;
    shapes.lathe(along(foot, foot + lean),
                 {{1.3 * radius, 0.0},
                  {1.05 * radius, 0.3 * h},
                  {random.between(0.7, 1.1) * radius, 0.5 * h},
                  {random.between(0.5, 0.9) * radius, 0.72 * h},
                  {random.between(0.35, 0.6) * radius, 0.88 * h},
                  {0.1 * radius, h}},
                 7, {0.3, 0.2});
  }
  for (int i = 0; i < 420; ++i) {
    const double away = 9.0 * std::pow(400.0, random.unit());
    const double x = random.between(-1.05, 1.05) * away;
    const double radius = random.between(0.35, 1.0) * (0.8 + 0.011 * away);
    const glm::dvec3 radii = radius * glm::dvec3(random.between(0.7, 1.2), random.between(0.6, 1.2), random.between(0.7, 1.2));
    shapes.boulder({x, heightAt(x, -away) + random.between(-0.1, 0.35) * radius, -away}, radii, 1000 + static_cast<std::uint64_t>(i));
  }

  BuiltIn scene{shapes.take(), {}};
  const glm::dvec3 eye(0.0, heightAt(0.0, 0.0) + 9.0, 0.0);
  const gnomon::Camera camera = builtInCamera(scene.mesh, eye, eye + glm::dvec3(-12.0, -15.0, -100.0), 6550.0);
  scene.views = {{"shoulder", "low", camera, glm::normalize(glm::dvec3(0.86, -0.36, 0.36))},
                 {"shoulder", "steep", camera, glm::normalize(glm::dvec3(-0.72, -0.5, 0.5))}};
  return scene;
}

}  // namespace gnomon::offscreen
