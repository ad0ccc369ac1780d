// The prediction at what a picture shows, and pictures against it.
#include <filesystem>

#include "gnomon/lloyd.h"
#include "job.h"
#include "predicted.h"
#include "scene.h"
#include "support.h"

namespace gnomon::test {
namespace {

using namespace gnomon::offscreen;
namespace fs = std::filesystem;

TEST(Predicted, RefusesPicturesOfDifferentSizes) {
  const Frame frame = usualFrame();
  const auto solution = solve(frame);
  const std::vector<float> position(6, 1.0f);
  const std::vector<std::uint8_t> two(2, 0), three(3, 0), far(2, 200);
  EXPECT_THROW((void)predictedError(frame, *solution, position, three, three), std::runtime_error);
  EXPECT_THROW((void)predictedError(frame, *solution, position, two, three), std::runtime_error);
  EXPECT_THROW((void)predictedError(frame, *solution, position, far, {1, 1}), std::runtime_error);  // no such partition
  EXPECT_EQ(predictedError(frame, *solution, position, two, two).served, 0u);
}

// Means over random points, by differences of the emitted matrices; what does not count or has no map is left out.
TEST(Predicted, IsTheMeanOfMeasuredTexels) {
  Random random(91);
  for (const LloydScheme scheme : {LloydScheme::zp, LloydScheme::zpw, LloydScheme::fpzpw}) {
    Frame frame = usualFrame();
    frame.budget = {.partitions = 9, .resolution = 512};
    Solution solution;
    ASSERT_EQ(solveLloyd(frame, {.scheme = scheme, .split = {}}, solution), Status::ok);
    std::vector<float> position;
    std::vector<std::uint8_t> index, counted;
    double sum = 0.0, over = 0.0;
    int served = 0;
    for (int k = 0; k < 3000; ++k) {
      const glm::dvec3 p = viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(0.1, 100.0));
      const glm::dvec3 rounded(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
      for (const double x : {p.x, p.y, p.z}) position.push_back(static_cast<float>(x));
      const int map = random.index(solution.partitionCount + 1);  // any: a map's texels go on past what it serves
      const glm::dvec4 q =
          glm::dmat4(solution.partitions[std::min(map, solution.partitionCount - 1)].clipFromWorld) * glm::dvec4(rounded, 1);
      const bool isServed = map < solution.partitionCount && q.w > 0.5;
      index.push_back(static_cast<std::uint8_t>(isServed ? map : 255));
      counted.push_back(static_cast<std::uint8_t>(k % 5 != 0));
      if (!isServed || k % 5 == 0) continue;
      const double pixel = pixelAt(frame, glm::dot(rounded, Axes(frame.camera).forward));
      const glm::dvec2 texel = measuredTexel(solution.partitions[map], rounded, frame.light.directionWs, pixel) / pixel;
      sum += std::max(texel.x, texel.y);
      over += std::max(texel.x, texel.y) > 1.0;
      ++served;
    }
    const PredictedError predicted = predictedError(frame, solution, position, index, counted);
    ASSERT_EQ(predicted.served, static_cast<std::size_t>(served));
    EXPECT_GT(served, 1000);
    EXPECT_NEAR(predicted.mean / (sum / served), 1.0, 1e-5);
    EXPECT_NEAR(predicted.overOne, over / served, 2e-3);
  }
}

struct Judgement {
  int compared = 0, contradicted = 0;
};

// [Lloyd 2006]'s schemes against PSSM at equal texels, small pictures: no more pixels are wrong wherever the mean predicted error over what
// is seen is lower by a factor of 1.5.
void compare(Renderer& renderer, const Tracer& tracer, const Mesh& mesh, const View& view, int maps, const std::string& name,
             Judgement& judgement) {
  const Box bounds{mesh.min, mesh.max};
  Frame frame;
  frame.camera = view.cam;
  frame.light.directionWs = view.lightDirectionWs;
  frame.image = {320.0, 180.0};
  frame.scene.receivers = {&bounds, 1};
  frame.budget = {.partitions = maps, .texels = maps * 256.0 * 256.0};
  const RenderOptions small{.width = 320, .height = 180, .time = false};
  auto solution = std::make_unique<Solution>();
  ASSERT_EQ(solvePssm(frame, {}, *solution), Status::ok);
  const Picture pssm = makePicture(renderer, tracer, frame, *solution, small);
  for (const LloydScheme scheme : {LloydScheme::w, LloydScheme::zpw, LloydScheme::fpw, LloydScheme::fpzpw, LloydScheme::best}) {
    ASSERT_EQ(solveLloyd(frame, {.scheme = scheme, .split = {}, .warp = {.warp = Warp::least}}, *solution), Status::ok);
    const Picture picture = makePicture(renderer, tracer, frame, *solution, small);
    if (!(picture.predicted.mean * 1.5 <= pssm.predicted.mean)) continue;
    ++judgement.compared;
    judgement.contradicted += picture.wrong.wrong > pssm.wrong.wrong;
    EXPECT_LE(picture.wrong.wrong, pssm.wrong.wrong)
        << name << ", " << view.light << ", " << maps << " maps, scheme " << static_cast<int>(scheme) << ": predicted "
        << picture.predicted.mean << " instead of " << pssm.predicted.mean;
  }
}

TEST(Predicted, PicturesOfBuiltInScenesAgree) {
  Judgement judgement;
  for (const std::string& name : builtInNames()) {
    const BuiltIn scene = makeBuiltIn(name);
    Renderer renderer;
    renderer.load(scene.mesh);
    const Tracer tracer(scene.mesh);
    for (const View& view : scene.views) compare(renderer, tracer, scene.mesh, view, 16, name, judgement);
  }
  EXPECT_GT(judgement.compared, 5);
}

TEST(Predicted, PicturesOfOutsideScenesAgree) {
  const fs::path file = fs::path(GNOMON_EXTRA_DATA) / "scenes/sponza/sponza.glb";
  if (std::string(GNOMON_EXTRA_DATA).empty() || !fs::exists(file)) GTEST_SKIP() << "GNOMON_EXTRA_DATA has no sponza";
  const Mesh mesh = loadGlb(file.string());
  Renderer renderer;
  renderer.load(mesh);
  const Tracer tracer(mesh);
  Judgement judgement;
  for (const glm::dvec3& light : {glm::dvec3(0.2, -1.0, 0.15), glm::dvec3(-0.5, -1.0, -0.3)}) {
    View view;
    view.cam = perspective({11, 3.2, 0.3}, {-23, 1.3, -0.6}, {0, 1, 0}, kPi / 3.0, 16.0 / 9.0, 0.8, 31.0);
    view.lightDirectionWs = light;
    for (const int maps : {1, 16}) compare(renderer, tracer, mesh, view, maps, "sponza", judgement);
  }
  EXPECT_GT(judgement.compared, 0);
}

}  // namespace
}  // namespace gnomon::test
