#include "scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace gnomon::offscreen {
namespace {

// ---- built-in scenes ----

class BuiltInTest : public testing::TestWithParam<std::string> {};

std::uint64_t hashOf(const Mesh& mesh) {  // FNV-1a over the bytes
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&](const void* data, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ static_cast<const unsigned char*>(data)[i]) * 0x100000001b3u;
  };
  add(mesh.positionsWs.data(), mesh.positionsWs.size() * sizeof(glm::vec3));
  add(mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
  return hash;
}

TEST_P(BuiltInTest, IsTheSameEveryTime) {
  const BuiltIn a = makeBuiltIn(GetParam()), b = makeBuiltIn(GetParam());
  EXPECT_EQ(a.mesh.name, GetParam());
  EXPECT_EQ(hashOf(a.mesh), hashOf(b.mesh));
}

TEST_P(BuiltInTest, HasSoundTriangles) {
  const Mesh mesh = makeBuiltIn(GetParam()).mesh;
  ASSERT_EQ(mesh.indices.size() % 3, 0u);
  EXPECT_GT(mesh.indices.size() / 3, 10000u);
  EXPECT_LT(mesh.indices.size() / 3, 150000u);
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high = -low;
  for (const glm::vec3& p : mesh.positionsWs) {
    ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    low = glm::min(low, glm::dvec3(p));
    high = glm::max(high, glm::dvec3(p));
  }
  EXPECT_EQ(low, mesh.min);
  EXPECT_EQ(high, mesh.max);
  std::size_t degenerate = 0;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) ASSERT_LT(mesh.indices[t + k], mesh.positionsWs.size());
    const glm::dvec3 a(mesh.positionsWs[mesh.indices[t]]), b(mesh.positionsWs[mesh.indices[t + 1]]),
        c(mesh.positionsWs[mesh.indices[t + 2]]);
    const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
    // Height over the longest side, relative to where the triangle lies: a few float32 steps at least.
    const double height = glm::length(glm::cross(b - a, c - a)) / longest;
    if (!(height > 4.0 * 6e-8 * std::max(1.0, glm::length(a)))) ++degenerate;
  }
  EXPECT_EQ(degenerate, 0u);
}

// Solids share their vertices: each directed edge occurs once, and its opposite does too, save at the rim of the ground.
TEST_P(BuiltInTest, IsClosedAndWoundAlike) {
  const Mesh mesh = makeBuiltIn(GetParam()).mesh;
  std::vector<std::uint64_t> edges;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) edges.push_back((std::uint64_t{mesh.indices[t + k]} << 32) | mesh.indices[t + (k + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  EXPECT_EQ(std::adjacent_find(edges.begin(), edges.end()), edges.end());
  std::size_t open = 0;
  for (const std::uint64_t edge : edges) open += std::binary_search(edges.begin(), edges.end(), (edge << 32) | (edge >> 32)) ? 0 : 1;
  EXPECT_LT(open, 1000u);  // the rim of one sheet
  EXPECT_GT(open, 0u);

  // Outward: by the divergence theorem, the volume of every connected closed solid is positive. The ground alone is open.
  std::vector<std::uint32_t> parent(mesh.positionsWs.size());
  for (std::size_t i = 0; i < parent.size(); ++i) parent[i] = static_cast<std::uint32_t>(i);
  const auto root = [&](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const std::uint64_t edge : edges) parent[root(static_cast<std::uint32_t>(edge >> 32))] = root(static_cast<std::uint32_t>(edge));
  std::map<std::uint32_t, double> volumes;
  std::set<std::uint32_t> openOnes;
  for (const std::uint64_t edge : edges) {
    if (!std::binary_search(edges.begin(), edges.end(), (edge << 32) | (edge >> 32)))
      openOnes.insert(root(static_cast<std::uint32_t>(edge)));
  }
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    const std::uint32_t r = root(mesh.indices[t]);
    const glm::dvec3 o(mesh.positionsWs[r]);
    const auto at = [&](std::size_t k) { return glm::dvec3(mesh.positionsWs[mesh.indices[t + k]]) - o; };
    volumes[r] += glm::dot(at(0), glm::cross(at(1), at(2))) / 6.0;
  }
  EXPECT_EQ(openOnes.size(), 1u);
  std::size_t inverted = 0;
  for (const auto& [r, volume] : volumes) inverted += openOnes.count(r) == 0 && !(volume > 0.0) ? 1 : 0;
  EXPECT_EQ(inverted, 0u);
  EXPECT_GT(volumes.size(), 100u);
}

// No two faces that look the same way lie in one plane and overlap: which one is seen would be chance.
TEST_P(BuiltInTest, HasNoOverlappingCoplanarFaces) {
  const Mesh mesh = makeBuiltIn(GetParam()).mesh;
  struct Face {
    std::array<glm::dvec3, 3> p;
    glm::dvec3 n;
    double d;
  };
  std::map<std::tuple<long, long, long>, std::vector<Face>> byNormal;
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    Face f;
    for (std::size_t k = 0; k < 3; ++k) f.p[k] = glm::dvec3(mesh.positionsWs[mesh.indices[t + k]]);
    f.n = glm::normalize(glm::cross(f.p[1] - f.p[0], f.p[2] - f.p[0]));
    f.d = glm::dot(f.n, f.p[0]);
    byNormal[{std::lround(f.n.x * 500.0), std::lround(f.n.y * 500.0), std::lround(f.n.z * 500.0)}].push_back(f);
  }
  std::size_t overlaps = 0;
  for (auto& [key, faces] : byNormal) {
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.d < b.d; });
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (std::size_t j = i + 1; j < faces.size() && faces[j].d - faces[i].d < 1e-3; ++j) {
        const Face &a = faces[i], &b = faces[j];
        bool inOnePlane = true;  // the other's corners within a millimetre of the plane
        for (const glm::dvec3& p : b.p) inOnePlane = inOnePlane && std::abs(glm::dot(a.n, p) - a.d) < 1e-3;
        if (!inOnePlane) continue;
        bool apart = false;  // separated along a normal of one of the six sides
        for (const auto& [f, g] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
          for (std::size_t k = 0; k < 3 && !apart; ++k) {
            const glm::dvec3 out = glm::normalize(glm::cross(f->p[(k + 1) % 3] - f->p[k], a.n));
            double nearest = std::numeric_limits<double>::infinity();
            for (const glm::dvec3& p : g->p) nearest = std::min(nearest, glm::dot(out, p - f->p[k]));
            apart = nearest > -1e-3;
          }
        }
        if (!apart && ++overlaps <= 6) {
          ADD_FAILURE() << "at " << a.p[0].x << " " << a.p[0].y << " " << a.p[0].z << " and " << b.p[0].x << " " << b.p[0].y << " "
                        << b.p[0].z << " normal " << a.n.x << " " << a.n.y << " " << a.n.z;
        }
      }
    }
  }
  EXPECT_EQ(overlaps, 0u);
}

TEST_P(BuiltInTest, HasViewsWorthLookingAt) {
  const BuiltIn scene = makeBuiltIn(GetParam());
  std::set<std::string> lights, names;
  double steepest = 0.0, lowest = 1.0;
  for (const View& view : scene.views) {
    lights.insert(view.light);
    names.insert(view.camera + "/" + view.light);
    EXPECT_NEAR(glm::length(view.lightDirectionWs), 1.0, 1e-12);
    steepest = std::max(steepest, -view.lightDirectionWs.y);
    lowest = std::min(lowest, -view.lightDirectionWs.y);
    EXPECT_NEAR(view.cam.up, 0.5773502691896258, 1e-12);  // tan 30 degrees
    EXPECT_NEAR(view.cam.down, view.cam.up, 1e-12);
    EXPECT_NEAR(view.cam.right, view.cam.up * 16.0 / 9.0, 1e-12);
    EXPECT_NEAR(view.cam.left, view.cam.right, 1e-12);
    // Close around the geometry in view: brute force over the vertices that lie inside the side planes.
    const glm::dvec3 f = glm::normalize(view.cam.forwardWs), r = glm::normalize(glm::cross(f, view.cam.upWs)), u = glm::cross(r, f);
    double nearest = std::numeric_limits<double>::infinity();
    for (const glm::vec3& p : scene.mesh.positionsWs) {
      const glm::dvec3 d = glm::dvec3(p) - view.cam.positionWs;
      const double z = glm::dot(d, f);
      if (z > 0.0 && std::abs(glm::dot(d, r)) < view.cam.right * z && std::abs(glm::dot(d, u)) < view.cam.up * z)
        nearest = std::min(nearest, z);
    }
    EXPECT_GT(view.cam.near, 0.0);
    EXPECT_LT(view.cam.near, nearest);
    EXPECT_GT(view.cam.near, 0.25 * nearest);
    EXPECT_GT(view.cam.far, 30.0 * view.cam.near);
    EXPECT_EQ(view.cam.shadowDistance, gnomon::kInfinity);
  }
  EXPECT_GE(lights.size(), 2u);
  EXPECT_EQ(names.size(), scene.views.size());
  EXPECT_GT(steepest, lowest + 0.08);
}

INSTANTIATE_TEST_SUITE_P(Every, BuiltInTest, testing::ValuesIn(builtInNames()), [](const auto& scene) { return scene.param; });

TEST(BuiltInNamesTest, UnknownOneIsRefusedWithTheNamesThereAre) {
  EXPECT_EQ(builtInNames(), (std::vector<std::string>{"colonnade", "relief", "city", "hall"}));
  try {
    (void)makeBuiltIn("sphere");
    FAIL();
  } catch (const std::runtime_error& error) {
    for (const char* word : {"sphere", "colonnade", "relief", "city", "hall"})
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos);
  }
}

// ---- depthInView ----

Mesh meshOf(std::vector<glm::vec3> positions, std::vector<std::uint32_t> indices) {
  Mesh mesh{"test", std::move(positions), std::move(indices), glm::dvec3(std::numeric_limits<double>::infinity()), {}};
  mesh.max = -mesh.min;
  for (const glm::vec3& p : mesh.positionsWs) {
    mesh.min = glm::min(mesh.min, glm::dvec3(p));
    mesh.max = glm::max(mesh.max, glm::dvec3(p));
  }
  return mesh;
}

TEST(DepthInViewTest, IsCutByTheSidePlanes) {
  gnomon::Camera camera;  // at the origin, along -z, 90 degrees both ways
  // A floor one below the eye, from behind it to 50 ahead: it enters the view at depth 1, where the lower plane meets it.
  const Mesh floor = meshOf({{-100, -1, 20}, {100, -1, 20}, {100, -1, -50}, {-100, -1, -50}}, {0, 1, 2, 0, 2, 3});
  const DepthRange seen = depthInView(floor, camera);
  EXPECT_NEAR(seen.nearest, 1.0, 1e-12);
  EXPECT_NEAR(seen.farthest, 50.0, 1e-12);
  // Orthographic, 2 x 2 wide, looking down on it from 4 above: one depth.
  camera.projection = gnomon::Projection::orthographic;
  camera.positionWs = {0, 3, 0};
  camera.forwardWs = {0, -2, 0};
  camera.upWs = {0, 0, -1};
  EXPECT_NEAR(depthInView(floor, camera).nearest, 4.0, 1e-12);
  EXPECT_NEAR(depthInView(floor, camera).farthest, 4.0, 1e-12);
  // Nothing in view.
  camera.positionWs = {500, 3, 0};
  EXPECT_GT(depthInView(floor, camera).nearest, depthInView(floor, camera).farthest);
}

// ---- framedViews ----

TEST(FramedViewsTest, HoldTheWholeBox) {
  for (const double aspect : {16.0 / 9.0, 1.0, 0.5}) {
    for (const glm::vec3& size : {glm::vec3(1, 1, 1), glm::vec3(1000, 1, 3), glm::vec3(2, 500, 2), glm::vec3(4, 0, 4)}) {
      std::vector<glm::vec3> p;
      std::vector<std::uint32_t> indices;
      const glm::vec3 corner(100, -7, 3);
      for (int i = 0; i < 8; ++i) p.push_back(corner + size * glm::vec3(i & 1, (i >> 1) & 1, (i >> 2) & 1));
      for (std::uint32_t a = 0; a < 8; ++a) indices.insert(indices.end(), {a, (a + 3) % 8, (a + 5) % 8});
      const std::vector<View> views = framedViews(meshOf(p, indices), aspect);
      ASSERT_EQ(views.size(), 2u);
      EXPECT_NE(views[0].light, views[1].light);
      for (const View& view : views) {
        EXPECT_NEAR(view.cam.right / view.cam.up, aspect, 1e-12);
        const glm::dvec3 f = glm::normalize(view.cam.forwardWs), r = glm::normalize(glm::cross(f, view.cam.upWs)), u = glm::cross(r, f);
        double most = 0.0;
        for (const glm::vec3& v : p) {
          const glm::dvec3 d = glm::dvec3(v) - view.cam.positionWs;
          const double z = glm::dot(d, f);
          EXPECT_GT(z, view.cam.near);
          EXPECT_LT(z, view.cam.far);
          most = std::max({most, std::abs(glm::dot(d, r)) / (view.cam.right * z), std::abs(glm::dot(d, u)) / (view.cam.up * z)});
        }
        EXPECT_LT(most, 1.0);
        EXPECT_GT(most, 0.95);  // and fills the picture
        EXPECT_GE(view.cam.near, 1e-4 * view.cam.far);
        for (int axis = 0; axis < 3; ++axis) EXPECT_GT(std::abs(view.lightDirectionWs[axis]), 0.1);
      }
    }
  }
  EXPECT_THROW((void)framedViews(meshOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {0, 1, 2}), 1.0), std::runtime_error);
}

// ---- standingViews ----

TEST(StandingViewsTest, StandOverTheHighestBelowAndLookAlongTheLongerSide) {
  // A floor at 2 from x = 0 to 40 and z = 0 to 30, and over its first half a smaller one at 7 that reaches past the eye.
  const std::vector<View> views =
      standingViews(meshOf({{0, 2, 0}, {40, 2, 0}, {40, 2, 30}, {0, 2, 30}, {5, 7, 10}, {15, 7, 10}, {15, 7, 20}, {5, 7, 20}},
                           {0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7}),
                    1.5);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_NE(views[0].light, views[1].light);
  for (const View& view : views) {
    const Camera& camera = view.cam;
    EXPECT_NEAR(glm::length(camera.positionWs - glm::dvec3(10.0, 7.0 + 0.03 * 50.0, 15.0)), 0.0, 1e-6);
    EXPECT_NEAR(glm::dot(glm::normalize(camera.forwardWs), glm::dvec3(1.0, 0.0, 0.0)), 1.0, 1e-12);
    // The lower edge of the picture, 30 degrees down, meets the upper floor at 1.5 / tan 30 degrees; the far end is 30 ahead.
    EXPECT_NEAR(camera.near, 0.5 * 1.5 * std::sqrt(3.0), 1e-6);
    EXPECT_GE(camera.far, 30.0);
    EXPECT_LT(camera.far, 33.0);
  }
  EXPECT_TRUE(standingViews(meshOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {0, 1, 2}), 1.0).empty());
}

// ---- loadGlb ----

// Files are put together here byte by byte, so that nothing is read with what wrote it.
class GlbTest : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder = std::filesystem::temp_directory_path() / (std::string("gnomon_scene_") + info->name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    document = {{"asset", {{"version", "2.0"}}},          {"scene", 0},
                {"scenes", {{{"nodes", {0}}}}},           {"nodes", {{{"mesh", 0}}}},
                {"bufferViews", nlohmann::json::array()}, {"accessors", nlohmann::json::array()}};
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  template <class T>
  int accessor(const std::vector<T>& values, int componentType, const char* type, int components, int stride = 0) {
    while (binary.size() % 4) binary += '\0';
    const std::size_t at = binary.size(), element = sizeof(T) * static_cast<std::size_t>(components);
    for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(components)) {
      binary.append(reinterpret_cast<const char*>(values.data() + i), element);
      if (stride) binary.append(static_cast<std::size_t>(stride) - element, '\x7f');
    }
    nlohmann::json view{{"buffer", 0}, {"byteOffset", at}, {"byteLength", binary.size() - at}};
    if (stride) view["byteStride"] = stride;
    document["bufferViews"].push_back(view);
    document["accessors"].push_back({{"bufferView", document["bufferViews"].size() - 1},
                                     {"componentType", componentType},
                                     {"count", values.size() / static_cast<std::size_t>(components)},
                                     {"type", type}});
    return static_cast<int>(document["accessors"].size()) - 1;
  }
  int positions(const std::vector<float>& values, int stride = 0) { return accessor(values, 5126, "VEC3", 3, stride); }

  static nlohmann::json primitive(int position, int indices = -1, int mode = -1) {
    nlohmann::json p{{"attributes", {{"POSITION", position}}}};
    if (indices >= 0) p["indices"] = indices;
    if (mode >= 0) p["mode"] = mode;
    return p;
  }

  std::string write() {
    while (binary.size() % 4) binary += '\0';
    document["buffers"] = {{{"byteLength", binary.size()}}};
    std::string json = document.dump();
    while (json.size() % 4) json += ' ';
    std::string file;
    const auto word = [&](std::size_t value) {
      const auto v = static_cast<std::uint32_t>(value);
      file.append(reinterpret_cast<const char*>(&v), 4);
    };
    file += "glTF";
    word(2);
    word(12 + 8 + json.size() + 8 + binary.size());
    word(json.size());
    file += "JSON" + json;
    word(binary.size());
    file += std::string("BIN\0", 4) + binary;
    const std::string path = (folder / "part.glb").string();
    std::ofstream(path, std::ios::binary) << file;
    return path;
  }

  void expectRefused(const std::string& path, const std::string& reason) {
    try {
      (void)loadGlb(path);
      ADD_FAILURE() << "loaded; expected: " << reason;
    } catch (const std::runtime_error& error) {
      const std::string what = error.what();
      EXPECT_EQ(what.rfind(path + ": ", 0), 0u) << what;
      EXPECT_NE(what.find(reason), std::string::npos) << what;
      EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    }
  }

  std::filesystem::path folder;
  nlohmann::json document;
  std::string binary;
  const std::vector<float> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
};

TEST_F(GlbTest, RefusesMissingFile) { expectRefused((folder / "nowhere.glb").string(), "cannot be opened"); }

TEST_F(GlbTest, RefusesWhatIsNotGltf) {
  const std::string path = (folder / "text.glb").string();
  std::ofstream(path) << "solid cube\nfacet normal 0 0 1\n";
  expectRefused(path, "not readable glTF");
  std::ofstream(path, std::ios::trunc) << "glTF";
  expectRefused(path, "not readable glTF");
  std::ofstream(path, std::ios::trunc) << "";
  expectRefused(path, "not readable glTF");
}

TEST_F(GlbTest, RefusesNoTriangles) {
  document["meshes"] = {{{"primitives", {primitive(positions(triangle), -1, 1)}}}};  // lines
  expectRefused(write(), "no triangles");
}

TEST_F(GlbTest, RefusesNonFinitePositions) {
  document["meshes"] = {{{"primitives", {primitive(positions({0, 0, 0, 1, 0, 0, 0, std::numeric_limits<float>::infinity(), 0}))}}}};
  expectRefused(write(), "non-finite");
}

TEST_F(GlbTest, RefusesPositionsThatOverflow) {
  document["meshes"] = {{{"primitives", {primitive(positions({0, 0, 0, 1e30f, 0, 0, 0, 1, 0}))}}}};
  document["nodes"][0]["scale"] = {1e20, 1, 1};
  expectRefused(write(), "non-finite");
}

TEST_F(GlbTest, RefusesIndexBeyondVertices) {
  const int p = positions(triangle);
  document["meshes"] = {{{"primitives", {primitive(p, accessor<std::uint16_t>({0, 1, 3}, 5123, "SCALAR", 1))}}}};
  expectRefused(write(), "index beyond");
}

TEST_F(GlbTest, RefusesAccessorOutsideItsBuffer) {
  document["meshes"] = {{{"primitives", {primitive(positions(triangle))}}}};
  document["accessors"][0]["count"] = 6;
  expectRefused(write(), "outside its buffer");
}

TEST_F(GlbTest, RefusesLoopOfNodes) {
  document["meshes"] = {{{"primitives", {primitive(positions(triangle))}}}};
  document["nodes"] = {{{"children", {1}}}, {{"children", {0}}}};
  expectRefused(write(), "loop");
}

TEST_F(GlbTest, EveryIndexTypeAndNone) {
  const int p = positions({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 20);
  document["meshes"] = {{{"primitives",
                          {primitive(p, accessor<std::uint8_t>({0, 1, 2}, 5121, "SCALAR", 1)),
                           primitive(p, accessor<std::uint16_t>({1, 2, 3}, 5123, "SCALAR", 1), 4),
                           primitive(p, accessor<std::uint32_t>({2, 3, 0}, 5125, "SCALAR", 1)), primitive(positions(triangle)),
                           primitive(positions(triangle), -1, 5)}}}};  // the strip is left out
  const Mesh mesh = loadGlb(write());
  EXPECT_EQ(mesh.name, "part");
  ASSERT_EQ(mesh.indices.size(), 12u);
  const auto corner = [&](std::size_t i) { return mesh.positionsWs[mesh.indices[i]]; };
  const std::vector<glm::vec3> expected{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1},
                                        {0, 1, 0}, {0, 0, 1}, {0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(corner(i), expected[i]) << i;
  EXPECT_EQ(mesh.min, glm::dvec3(0, 0, 0));
  EXPECT_EQ(mesh.max, glm::dvec3(1, 1, 1));
}

TEST_F(GlbTest, AppliesNodeTransforms) {
  document["meshes"] = {{{"primitives", {primitive(positions({1, 0, 0, 0, 1, 0, 0, 0, 1}))}}}};
  // Child: a quarter turn about z (x -> y, y -> -x), after scaling by (2, 3, 4), then moved by (10, 0, 0).
  // Parent: moved by (0, 0, 100), as a matrix, column-major.
  const double h = std::sqrt(0.5);
  document["nodes"] = {{{"children", {1}}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 100, 1}}},
                       {{"mesh", 0}, {"rotation", {0, 0, h, h}}, {"scale", {2, 3, 4}}, {"translation", {10, 0, 0}}}};
  const Mesh mesh = loadGlb(write());
  ASSERT_EQ(mesh.indices, (std::vector<std::uint32_t>{0, 1, 2}));
  const std::vector<glm::vec3> expected{{10, 2, 100}, {7, 0, 100}, {10, 0, 104}};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT(glm::length(mesh.positionsWs[i] - expected[i]), 1e-5f) << i;
  EXPECT_NEAR(mesh.min.x, 7.0, 1e-6);
  EXPECT_NEAR(mesh.max.z, 104.0, 1e-6);
}

TEST_F(GlbTest, MirroringKeepsWindingOutward) {
  document["meshes"] = {{{"primitives", {primitive(positions(triangle))}}}};
  document["nodes"][0]["scale"] = {-1, 1, 1};
  const Mesh mesh = loadGlb(write());
  const auto corner = [&](std::size_t i) { return mesh.positionsWs[mesh.indices[i]]; };
  EXPECT_GT(glm::cross(corner(1) - corner(0), corner(2) - corner(0)).z, 0.0f);  // +z before, and a mirror in x leaves it so
}

TEST_F(GlbTest, OneMeshUnderTwoNodesAppearsTwice) {
  document["meshes"] = {{{"primitives", {primitive(positions(triangle))}}}};
  document["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {5, 0, 0}}}, {{"mesh", 0}, {"translation", {9, 0, 0}}}};
  document["scenes"] = {{{"nodes", {0, 1}}}};  // the third is not in the scene
  const Mesh mesh = loadGlb(write());
  EXPECT_EQ(mesh.indices.size(), 6u);
  EXPECT_EQ(mesh.max.x, 6.0);
}

}  // namespace
}  // namespace gnomon::offscreen
