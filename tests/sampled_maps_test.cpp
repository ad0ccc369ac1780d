// Sample distribution shadow maps made and drawn on the device: the indirect draw against the block that it was made from, read back and drawn
// by the host; the view's slices against the processor's.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include <gtest/gtest.h>

#include "gnomon/sdsm.h"
#include "job.h"
#include "scene.h"

namespace gnomon::test {
namespace {

using namespace offscreen;

constexpr DepthConvention kConventions[] = {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne,
                                            DepthConvention::reversedZeroToOne};

Frame frameOf(const View& view, DepthConvention depth) {
  Frame frame;
  frame.camera = view.cam;
  frame.camera.depth = depth;
  frame.light.directionWs = view.lightDirectionWs;
  frame.shadowMap.depth = depth;
  frame.budget = {.partitions = 4, .resolution = 512};
  return frame;
}

// Maps drawn indirectly are those that the same block draws when the host asks for everything; both reductions make it.
TEST(SampledMaps, IndirectDrawsEqualTheReadBackBlocks) {
  for (const char* name : {"hall", "city"}) {  // flat maps of a room; a mesh of many chunks
    const BuiltIn scene = makeBuiltIn(name);
    Renderer renderer;
    renderer.load(scene.mesh);
    for (const DepthConvention depth : kConventions) {
      const Frame frame = frameOf(scene.views[0], depth);
      const RenderOptions options{.width = 321, .height = 179, .castPath = CastPath::wholeAtlas, .time = false};  // no multiples of a tile
      const auto solution = std::make_unique<Solution>(), other = std::make_unique<Solution>();
      const RenderOutput drawn = renderer.renderSampled(frame, ReduceBy::fragments, *solution, options);
      ASSERT_EQ(solution->partitionCount, 4) << name;
      const RenderOutput again = renderer.render(frame, *solution, options);
      EXPECT_EQ(drawn.maps, again.maps) << name;
      EXPECT_EQ(drawn.lit, again.lit) << name;
      EXPECT_EQ(drawn.index, again.index) << name;
      EXPECT_GT(std::count(drawn.lit.begin(), drawn.lit.end(), 0), 100) << name;  // there are shadows
      EXPECT_LT(drawn.shadowTriangles, again.shadowTriangles) << name;  // and casters that were left out
      // As many as the host would draw by the maps' planes, but for a chunk at a side.
      RenderOptions byHost = options;
      byHost.castPath = CastPath::eachMap;
      const double host = static_cast<double>(renderer.render(frame, *solution, byHost).shadowTriangles);
      EXPECT_NEAR(static_cast<double>(drawn.shadowTriangles), host, 1024.0) << name;

      const RenderOutput byGroups = renderer.renderSampled(frame, ReduceBy::workgroups, *other, options);
      EXPECT_EQ(std::memcmp(&solution->block, &other->block, sizeof(GnomonBlock)), 0) << name;
      EXPECT_EQ(drawn.maps, byGroups.maps) << name;
    }
  }
}

// The processor's answer for the same depth buffer: the same slices, maps no smaller, and so much the same shadows.
TEST(SampledMaps, AgreeWithTheProcessor) {
  const BuiltIn scene = makeBuiltIn("hall");
  const Tracer tracer(scene.mesh);
  Renderer renderer;
  renderer.load(scene.mesh);
  const RenderOptions options{.width = 320, .height = 180, .time = false};
  for (const DepthConvention depth : kConventions) {
    Frame frame = frameOf(scene.views[0], depth);
    const auto made = std::make_unique<Solution>(), solved = std::make_unique<Solution>();
    const ReduceBy way = renderer.timeReductions(frame, options.width, options.height).faster();
    RenderOutput image = renderer.renderSampled(frame, way, *made, options);
    std::vector<std::uint8_t> truth = traceTruth(tracer, frame, *made, image);
    const Picture picture = judgePicture(std::move(image), std::move(truth), frame, *made);
    const ViewSamples view(renderer, frame, options.width, options.height);
    frame.samples = &view.samples;
    SdsmState state;
    ASSERT_EQ(solveSdsm(frame, {}, state, *solved), Status::ok);
    ASSERT_EQ(made->partitionCount, solved->partitionCount);
    for (int i = 0; i < solved->partitionCount; ++i) {
      EXPECT_NEAR(made->partitions[i].near, solved->partitions[i].near, 1e-4 * solved->partitions[i].near);
      EXPECT_NEAR(made->partitions[i].far, solved->partitions[i].far, 1e-4 * solved->partitions[i].far);
      EXPECT_LE(solved->partitions[i].error.s * solved->partitions[i].error.t,
                1.01 * made->partitions[i].error.s * made->partitions[i].error.t);
    }
    const Picture reference = makePicture(renderer, tracer, frame, *solved, options);
    EXPECT_LT(picture.wrong.share(), 1.5 * reference.wrong.share() + 1e-3);
    EXPECT_LT(picture.predicted.mean, 2.0 * reference.predicted.mean);
  }
}

// Nothing but sky: no map, no draw, a lit picture.
TEST(SampledMaps, AnEmptyViewHasNone) {
  const BuiltIn scene = makeBuiltIn("city");
  Renderer renderer;
  renderer.load(scene.mesh);
  Frame frame = frameOf(scene.views[0], DepthConvention::zeroToOne);
  frame.camera.forwardWs = {0.0, 1.0, 0.0};
  frame.camera.upWs = {1.0, 0.0, 0.0};
  frame.camera.positionWs = scene.mesh.max + glm::dvec3(1.0);
  for (const ReduceBy way : {ReduceBy::fragments, ReduceBy::workgroups}) {
    const auto solution = std::make_unique<Solution>();
    const RenderOutput image = renderer.renderSampled(frame, way, *solution, {.width = 1, .height = 1, .time = false});
    EXPECT_EQ(solution->partitionCount, 0);
    EXPECT_EQ(image.shadowTriangles, 0u);
    EXPECT_EQ(image.lit[0], 2);
  }
}

}  // namespace
}  // namespace gnomon::test
