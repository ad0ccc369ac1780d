// figures: writes the figures of [Lloyd 2006] as tables and pictures into a folder; plot.gp draws the tables.
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <numbers>
#include <stdexcept>

#include <glm/glm.hpp>

#include "drawn.h"
#include "picture.h"

namespace {

using namespace gnomon::figures;
namespace offscreen = gnomon::offscreen;

void write(const std::string& folder, const Table& table) {
  const std::string path = folder + "/" + table.name + ".csv";
  std::ofstream file(path);
  file << csv(table);
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

void writeTables(const std::string& folder) {
  struct Figure {
    const char* title;
    Table (*make)();
  };
  constexpr Figure kFigures[] = {{"Fig. 5: error along the view", errorAlongView},
                                 {"Fig. 6: error against the warp", errorAgainstWarp},
                                 {"Fig. 7: storage over all lights", storageOverLights},
                                 {"Fig. 10: storage against slices", storageAgainstSlices},
                                 {"Fig. 12: storage against maps", storageAgainstMaps},
                                 {"Fig. 13: faces against slices", facesAgainstSlices},
                                 {"Sec. 5.3: the worst light", [] { return worstOverLights(2.5); }},
                                 {"Sec. 4.3: warps as the light turns", warpsAgainstLight}};
  for (const Figure& figure : kFigures) {
    std::cerr << figure.title << "\n";
    write(folder, figure.make());
  }
}

// The panels side by side, white between them.
void writePanels(const std::string& path, const std::vector<GridPicture>& panels) {
  constexpr int kGap = 8;
  const int side = panels[0].side, width = static_cast<int>(panels.size()) * (side + kGap) - kGap;
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < side; ++y)
    for (std::size_t i = 0; i < panels.size(); ++i) {
      const auto row = panels[i].pixels.begin() + 3 * y * side;
      pixels.insert(pixels.end(), row, row + 3 * side);
      if (i + 1 < panels.size()) pixels.insert(pixels.end(), 3 * kGap, 255);
    }
  offscreen::writePng(path, width, side, 3, pixels);
}

// sponza: the Atrium as a glTF file, or empty.
void draw(const std::string& folder, const std::string& sponza) {
  offscreen::Renderer renderer;
  std::cerr << "rendering on " << renderer.device() << "\n";
  constexpr int kMaps[] = {1, 2, 3, 4, 6, 8, 12, 16}, kRuns = 9;
  const offscreen::BuiltIn relief = offscreen::makeBuiltIn("relief");
  write(folder,
        shadowTimes(renderer, relief.mesh, relief.views[0], kMaps, kRuns, [](const std::string& text) { std::cerr << text << "\n"; }));
  const auto grids = [&](const std::string& name, const offscreen::Mesh& mesh, const offscreen::View& view) {
    const offscreen::Tracer tracer(mesh);
    renderer.load(mesh);
    std::vector<GridPicture> panels;
    struct Scheme {
      const char* name;
      gnomon::LloydScheme scheme;
      int maps;
    };
    for (const Scheme& each : {Scheme{"W", gnomon::LloydScheme::w, 1}, Scheme{"FP+W", gnomon::LloydScheme::fpw, 5},
                               Scheme{"ZP4+W", gnomon::LloydScheme::zpw, 4}}) {
      std::cerr << "Fig. 15: " << name << ", " << view.light << ", " << each.name << "\n";
      panels.push_back(texelGrid(renderer, tracer, view, each.scheme, each.maps));
      std::printf("%s, %s, f/n %.0f, %s: %d maps, max error %.2f, wrong %.3f %%\n", name.c_str(), view.light.c_str(),
                  view.cam.far / view.cam.near, each.name, panels.back().maps, panels.back().maxError, 100.0 * panels.back().wrongShare);
    }
    writePanels(folder + "/grid-" + name + "-" + view.light + ".png", panels);
  };
  for (const char* name : {"colonnade", "city"}) {
    const offscreen::BuiltIn scene = offscreen::makeBuiltIn(name);
    for (const offscreen::View& view : scene.views) grids(name, scene.mesh, view);
  }
  if (sponza.empty()) return;
  const glm::dvec3 eye(11.0, 3.2, 0.3), target(-12.0, 4.5, -0.3);
  const gnomon::Camera camera = gnomon::perspective(eye, target - eye, {0, 1, 0}, std::numbers::pi / 3.0, 1.0, 0.8, 31.0);
  grids("sponza", offscreen::loadGlb(sponza), {"atrium", "steep", camera, glm::normalize(glm::dvec3(0.2, -1.0, 0.15))});
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: gnomon_figures FOLDER [SPONZA.glb]\n");
    return 2;
  }
  try {
    const std::string folder = argv[1];
    std::filesystem::create_directories(folder);
    writeTables(folder);
    draw(folder, argc == 3 ? argv[2] : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gnomon_figures: %s\n", error.what());
    return 1;
  }
  return 0;
}
