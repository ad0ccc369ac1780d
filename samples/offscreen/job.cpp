#include "job.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "picture.h"

namespace gnomon::offscreen {

ViewSamples::ViewSamples(Renderer& renderer, const Frame& frame, int width, int height) {
  const std::vector<float> depths = renderer.depths(frame, width, height);
  if (const Status status = takeSamples(frame, {depths.data(), width, height, width}, m_store, samples); status != Status::ok)
    throw std::runtime_error(std::string(statusField(status)) + ": " + statusRule(status));
}

std::vector<std::uint8_t> traceTruth(const Tracer& tracer, const Frame& frame, const Solution& solution, const RenderOutput& image) {
  std::vector<std::uint8_t> present(image.lit.size());
  std::transform(image.lit.begin(), image.lit.end(), present.begin(),
                 [](std::uint8_t lit) { return static_cast<std::uint8_t>(lit != kNothing); });
  return tracer.lit(image.position, image.normal, present, solution.originWs, frame.camera.forwardWs, frame.camera.positionWs,
                    frame.light.directionWs);
}

Picture judgePicture(RenderOutput image, std::vector<std::uint8_t> truth, const Frame& frame, const Solution& solution) {
  Picture picture;
  picture.image = std::move(image);
  picture.truth = std::move(truth);
  const RenderOutput& drawn = picture.image;
  picture.counted = countedPixels(picture.truth, drawn.normal, frame.light.directionWs);
  picture.wrong = countWrong(drawn.width, drawn.height, drawn.lit, picture.truth, picture.counted);
  picture.predicted = predictedError(frame, solution, drawn.position, drawn.index, picture.counted);
  picture.acrossEdges = texelAcrossEdges(frame, solution, drawn, picture.truth, picture.counted);
  return picture;
}

Picture makePicture(Renderer& renderer, const Tracer& tracer, const Frame& frame, const Solution& solution, const RenderOptions& options) {
  RenderOutput image = renderer.render(frame, solution, options);
  std::vector<std::uint8_t> truth = traceTruth(tracer, frame, solution, image);
  return judgePicture(std::move(image), std::move(truth), frame, solution);
}

void writePictures(const Picture& picture, const std::string& folder) {
  std::filesystem::create_directories(folder);
  const RenderOutput& image = picture.image;
  writePng(folder + "/shaded.png", image.width, image.height, 3, image.shaded);
  writePng(folder + "/tinted.png", image.width, image.height, 3, image.tinted);
  writePng(folder + "/difference.png", image.width, image.height, 3,
           differencePicture(image.width, image.height, image.lit, picture.truth, picture.counted));
  if (!image.maps.empty()) writePng(folder + "/maps.png", image.mapsWidth, image.mapsHeight, 1, image.maps);
}

void writeArrays(const Picture& picture, const std::string& folder) {
  std::filesystem::create_directories(folder);
  const RenderOutput& image = picture.image;
  writeNpy(folder + "/position.npy", image.width, image.height, image.position);
  writeNpy(folder + "/normal.npy", image.width, image.height, image.normal);
  writeNpy(folder + "/lit.npy", image.width, image.height, image.lit);
  writeNpy(folder + "/index.npy", image.width, image.height, image.index);
}

}  // namespace gnomon::offscreen
