// job: one picture from start to end: render a solution, trace the truth, count wrong pixels, predict its error, write the files of the
// contract.
//
// Test: tests/job_test.cpp
#pragma once

#include <memory>
#include <string>

#include "gnomon/samples.h"
#include "predicted.h"
#include "render.h"
#include "truth.h"
#include "wrong.h"

namespace gnomon::offscreen {

// What a view of the renderer's mesh samples, and the storage behind it: it stays where it is made.
struct ViewSamples {
  // Draws the view's depth buffer and reduces it. Throws std::runtime_error.
  ViewSamples(Renderer& renderer, const Frame& frame, int width, int height);
  ViewSamples(const ViewSamples&) = delete;
  ViewSamples& operator=(const ViewSamples&) = delete;

  Samples samples;

 private:
  SampleStore m_store;
};

struct Picture {
  RenderOutput image;
  std::vector<std::uint8_t> truth, counted;
  WrongPixels wrong;
  PredictedError predicted;  // over the counted pixels
  double acrossEdges = 0.0;  // pixels that a texel is wide across true shadow edges, the only places where it shows (texelAcrossEdges)
};

// What should be seen of a drawn view: a ray for each of its points.
[[nodiscard]] std::vector<std::uint8_t> traceTruth(const Tracer& tracer, const Frame& frame, const Solution& solution,
                                                   const RenderOutput& image);

// Judges a drawn view against a truth that holds for any solution of the same view and light.
[[nodiscard]] Picture judgePicture(RenderOutput image, std::vector<std::uint8_t> truth, const Frame& frame, const Solution& solution);

// Draws and judges one view of the mesh that renderer and tracer hold. Throws std::runtime_error.
[[nodiscard]] Picture makePicture(Renderer& renderer, const Tracer& tracer, const Frame& frame, const Solution& solution,
                                  const RenderOptions& options);

// shaded.png, tinted.png, difference.png, maps.png into a folder, made where it is not there.
void writePictures(const Picture& picture, const std::string& folder);

// position.npy, normal.npy, lit.npy, index.npy.
void writeArrays(const Picture& picture, const std::string& folder);

}  // namespace gnomon::offscreen
