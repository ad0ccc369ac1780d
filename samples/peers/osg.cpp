// OpenSceneGraph 3.6: what its own shadow techniques make of each case, as lines of JSON.  osg CASE.json...
//
// Culled, not drawn: a cull traversal places the shadow cameras and needs no context. The scene is a box around the view.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <vector>

#include <nlohmann/json.hpp>
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/LightSource>
#include <osg/View>
#include <osgShadow/LightSpacePerspectiveShadowMap>
#include <osgShadow/ParallelSplitShadowMap>
#include <osgShadow/ShadowedScene>
#include <osgUtil/SceneView>

namespace {

using Json = nlohmann::ordered_json;

osg::Vec3d vectorOf(const Json& v) { return {v[0].get<double>(), v[1].get<double>(), v[2].get<double>()}; }

// The cameras that see the scene in a cull traversal.
struct Watcher : osg::NodeCallback {
  std::vector<osg::ref_ptr<osg::Camera>> cameras;
  void operator()(osg::Node* node, osg::NodeVisitor* visitor) override {
    if (osgUtil::CullVisitor* cull = visitor->asCullVisitor())
      if (osg::Camera* camera = cull->getCurrentCamera(); std::find(cameras.begin(), cameras.end(), camera) == cameras.end())
        cameras.push_back(camera);
    traverse(node, visitor);
  }
};

struct Splits : osgShadow::ParallelSplitShadowMap {
  explicit Splits(int count) : ParallelSplitShadowMap(nullptr, count) {}
  osg::Camera* camera(unsigned int i) { return _PSSMShadowSplitTextureMap.at(i)._camera.get(); }
  // Where its shader takes the next map: clip depth over w.
  float endOf(unsigned int i) {
    float ndcZ = 0.0f;
    _PSSMShadowSplitTextureMap.at(i)._farDistanceSplit->get(ndcZ);
    return ndcZ;
  }
};

Json partitionOf(double near, double far, const osg::Camera& camera, int side) {
  const osg::Matrixd clip = camera.getViewMatrix() * camera.getProjectionMatrix();  // of row vectors
  Json matrix = Json::array();
  for (int k = 0; k < 16; ++k) matrix.push_back(clip(k % 4, k / 4));
  return {{"near", near}, {"far", far}, {"world_to_clip", matrix}, {"size", {side, side}}};
}

}  // namespace

int main(int argc, char** argv) {
  for (int c = 1; c < argc; ++c) {
    std::ifstream file(argv[c]);
    const Json input = Json::parse(file);
    const Json &view = input["camera"], &budget = input["budget"];
    if (!view.contains("fov_y")) continue;
    const int maps = budget["partitions"], side = budget["resolution"];
    const double near = view["near"], far = view["far"], pi = 3.14159265358979323846;
    const osg::Vec3d eye = vectorOf(view["position"]);
    const osg::Matrixd viewMatrix = osg::Matrixd::lookAt(eye, eye + vectorOf(view["forward"]), vectorOf(view["up"])),
                       projection = osg::Matrixd::perspective(view["fov_y"].get<double>() * 180.0 / pi, view["aspect"], near, far);
    const osg::Matrixd worldFromClip = osg::Matrixd::inverse(viewMatrix * projection);
    osg::BoundingBoxd box;
    for (int i = 0; i < 8; ++i) box.expandBy(osg::Vec3d(i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0) * worldFromClip);

    const auto solve = [&](osgShadow::ShadowTechnique* technique, const char* settings, auto&& write) {
      osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
      osg::ref_ptr<osg::Vec3Array> corners = new osg::Vec3Array;
      for (unsigned int i = 0; i < 8; ++i) corners->push_back(box.corner(i));
      geometry->setVertexArray(corners);
      geometry->addPrimitiveSet(new osg::DrawArrays(GL_POINTS, 0, 8));
      osg::ref_ptr<osg::Geode> geode = new osg::Geode;
      geode->addDrawable(geometry);
      geode->setCullingActive(false);  // of the scene there is nothing but its bounds
      osg::ref_ptr<Watcher> watcher = new Watcher;
      geode->setCullCallback(watcher);
      osg::ref_ptr<osg::LightSource> light = new osg::LightSource;
      light->getLight()->setPosition(osg::Vec4(-vectorOf(input["light"]["direction"]), 0.0));
      light->getLight()->setDirection(vectorOf(input["light"]["direction"]));
      osg::ref_ptr<osgShadow::ShadowedScene> scene = new osgShadow::ShadowedScene(technique);
      scene->addChild(geode);
      scene->addChild(light);
      osg::ref_ptr<osgUtil::SceneView> sceneView = new osgUtil::SceneView;
      sceneView->setDefaults(osgUtil::SceneView::NO_SCENEVIEW_LIGHT);
      sceneView->setSceneData(scene);
      sceneView->getCamera()->setViewport(0, 0, input["image"]["width"], input["image"]["height"]);
      sceneView->getCamera()->setViewMatrix(viewMatrix);
      sceneView->getCamera()->setProjectionMatrix(projection);
      sceneView->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
      osg::ref_ptr<osg::View> owner = new osg::View;  // it asks the view for its camera
      owner->setCamera(sceneView->getCamera());
      sceneView->getRenderInfo().setView(owner);
      sceneView->update();
      std::vector<double> times;
      for (int repetition = 0; repetition < 51; ++repetition) {
        const auto start = std::chrono::steady_clock::now();
        sceneView->cull();
        times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      }
      std::nth_element(times.begin(), times.begin() + 25, times.end());
      std::erase(watcher->cameras, sceneView->getCamera());
      std::cout << Json{{"system", "OpenSceneGraph 3.6"},
                        {"settings", settings},
                        {"case", argv[c]},
                        {"partitions", write(*watcher)},
                        {"solve_us", times[25]}}
                       .dump()
                << "\n";
    };

    osg::ref_ptr<Splits> splits = new Splits(maps);
    splits->setTextureResolution(static_cast<unsigned int>(side));
    solve(splits, "parallel splits", [&](const Watcher&) {
      Json partitions = Json::array();
      double from = near;
      for (unsigned int i = 0; i < static_cast<unsigned int>(maps); ++i) {
        const double to = i + 1 == static_cast<unsigned int>(maps)
                              ? far
                              : 1.0 / ((1.0 + splits->endOf(i)) / 2.0 / far + (1.0 - splits->endOf(i)) / 2.0 / near);
        partitions.push_back(partitionOf(from, to, *splits->camera(i), side));
        from = to;
      }
      return partitions;
    });
    const int whole = static_cast<int>(std::lround(side * std::sqrt(maps)));
    osg::ref_ptr<osgShadow::LightSpacePerspectiveShadowMapVB> one = new osgShadow::LightSpacePerspectiveShadowMapVB;
    one->setTextureSize(osg::Vec2s(static_cast<short>(whole), static_cast<short>(whole)));
    solve(one, "LiSPSM, one map",
          [&](const Watcher& watcher) { return Json::array({partitionOf(near, far, *watcher.cameras.at(0), whole)}); });
  }
}
