// OGRE 1.12: the cascades of its own PSSMShadowCameraSetup for each case, as lines of JSON.  gnomon_peers_ogre CASE.json...
//
// Nothing is drawn: the bounds that OGRE would take from what it rendered are given to it, a box that holds the whole view.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <limits>

#include <Ogre.h>
#include <OgreDefaultHardwareBufferManager.h>
#include <OgreShadowCameraSetupPSSM.h>
#include <nlohmann/json.hpp>

namespace {

using Json = nlohmann::ordered_json;

class Scene : public Ogre::SceneManager {
 public:
  Scene() : SceneManager("peers") {}
  const Ogre::String& getTypeName() const override {
    static const Ogre::String name = "peers";
    return name;
  }
  void see(Ogre::Camera* camera, const Ogre::AxisAlignedBox& box, const Ogre::Camera& from) {
    Ogre::VisibleObjectsBoundsInfo info;
    Ogre::Sphere sphere(box.getCenter(), box.getHalfSize().length());
    info.merge(box, sphere, &from, true);
    mCamVisibleObjectsMap[camera] = info;
  }
};

Ogre::Vector3 vectorOf(const Json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

}  // namespace

int main(int argc, char** argv) {
  Ogre::LogManager logs;
  logs.createLog("", true, false, true);
  Ogre::Root root("", "", "");
  Ogre::DefaultHardwareBufferManager buffers;
  Ogre::MaterialManager::getSingleton().initialise();
  Scene scene;
  const struct {
    const char* name;
    float lambda, factor, padding;
  } kinds[] = {{"default", 0.95f, 0.1f, 1.0f}, {"lambda 1, LiSPSM 1", 1.0f, 1.0f, 0.0f}};
  int count = 0;
  for (int c = 1; c < argc; ++c) {
    std::ifstream file(argv[c]);
    const Json input = Json::parse(file);
    const Json &view = input["camera"], &budget = input["budget"];
    const int maps = budget["partitions"], side = budget["resolution"];
    if (!view.contains("fov_y") || maps < 2) continue;  // it has no splits of one
    const float near = view["near"], far = view["far"];
    for (const auto& kind : kinds) {
      const std::string name = std::to_string(++count);
      Ogre::Camera* camera = scene.createCamera("c" + name);
      Ogre::SceneNode* node = scene.getRootSceneNode()->createChildSceneNode(vectorOf(view["position"]));
      node->attachObject(camera);
      node->setFixedYawAxis(true, vectorOf(view["up"]));
      node->setDirection(vectorOf(view["forward"]), Ogre::Node::TS_WORLD);
      camera->setNearClipDistance(near);
      camera->setFarClipDistance(far);
      camera->setFOVy(Ogre::Radian(view["fov_y"].get<float>()));
      camera->setAspectRatio(view["aspect"].get<float>());
      Ogre::Light* light = scene.createLight("l" + name);
      light->setType(Ogre::Light::LT_DIRECTIONAL);
      Ogre::SceneNode* lightNode = scene.getRootSceneNode()->createChildSceneNode();
      lightNode->attachObject(light);
      lightNode->setDirection(vectorOf(input["light"]["direction"]), Ogre::Node::TS_WORLD);
      scene.getRootSceneNode()->_update(true, true);

      Ogre::AxisAlignedBox box;
      for (int i = 0; i < 8; ++i) box.merge(camera->getWorldSpaceCorners()[i]);
      Ogre::PSSMShadowCameraSetup setup;
      setup.setSplitPadding(kind.padding);
      std::vector<Ogre::Camera*> lights;
      for (int i = 0; i < maps; ++i) {
        lights.push_back(scene.createCamera("s" + name + "-" + std::to_string(i)));
        scene.getRootSceneNode()->createChildSceneNode()->attachObject(lights.back());
        scene.see(lights.back(), box, *camera);
      }
      scene.see(camera, box, *camera);
      std::vector<double> times;
      for (int repetition = 0; repetition < 50; ++repetition) {
        const auto start = std::chrono::steady_clock::now();
        setup.calculateSplitPoints(static_cast<Ogre::uint>(maps), near, far, kind.lambda);
        for (int i = 0; i < maps; ++i) {
          setup.setOptimalAdjustFactor(static_cast<std::size_t>(i), kind.factor);
          setup.getShadowCamera(&scene, camera, nullptr, light, lights[static_cast<std::size_t>(i)], static_cast<std::size_t>(i));
        }
        times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
      }
      std::nth_element(times.begin(), times.begin() + 25, times.end());
      Json partitions = Json::array();
      for (int i = 0; i < maps; ++i) {
        const Ogre::Matrix4 clip =
            lights[static_cast<std::size_t>(i)]->getProjectionMatrix() * lights[static_cast<std::size_t>(i)]->getViewMatrix();
        Json matrix = Json::array();
        for (int k = 0; k < 16; ++k) matrix.push_back(static_cast<double>(clip[k / 4][k % 4]));
        const Ogre::PSSMShadowCameraSetup::SplitPointList& ends = setup.getSplitPoints();
        partitions.push_back({{"near", ends[static_cast<std::size_t>(i)]},
                              {"far", ends[static_cast<std::size_t>(i) + 1]},
                              {"world_to_clip", matrix},
                              {"size", {side, side}}});
      }
      std::cout
          << Json{{"system", "OGRE 1.12"}, {"settings", kind.name}, {"case", argv[c]}, {"partitions", partitions}, {"solve_us", times[25]}}
                 .dump()
          << "\n";
    }
  }
  std::cout.flush();
  std::_Exit(0);  // its own teardown wants a render system
}
