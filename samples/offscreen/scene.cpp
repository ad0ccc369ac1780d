#include "scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <tiny_gltf.h>

#include "gnomon/camera.h"

namespace gnomon::offscreen {
namespace {

constexpr double kFovY = std::numbers::pi / 3.0;  // radians: every view's
// What is seen lies between these shares of the nearest and farthest depth: planes close to it, touching nothing.
constexpr double kNearShare = 0.8;
constexpr double kFarShare = 1.05;
constexpr double kLeastNearOverFar = 1e-4;  // a mesh that reaches the camera leaves a depth range that 32-bit depth still resolves

// Reads one glTF file into a mesh.
class Loader {
 public:
  explicit Loader(const std::string& file) : path(file) {}

  Mesh load() {
    readModel();
    const std::size_t sceneCount = model.scenes.size();
    if (sceneCount > 0) {
      const auto wanted = static_cast<std::size_t>(std::max(model.defaultScene, 0));
      for (const int root : model.scenes[std::min(wanted, sceneCount - 1)].nodes) addNode(root, glm::dmat4(1.0), 0);
    } else {
      std::vector<bool> isChild(model.nodes.size(), false);
      for (const tinygltf::Node& node : model.nodes) {
        for (const int child : node.children) isChild.at(checked(child, isChild.size(), "node")) = true;
      }
      for (std::size_t i = 0; i < isChild.size(); ++i) {
        if (!isChild[i]) addNode(static_cast<int>(i), glm::dmat4(1.0), 0);
      }
    }
    if (mesh.indices.empty()) fail("no triangles");
    mesh.min = glm::dvec3(std::numeric_limits<double>::infinity());
    mesh.max = -mesh.min;
    for (const std::uint32_t index : mesh.indices) {
      mesh.min = glm::min(mesh.min, glm::dvec3(mesh.positionsWs[index]));
      mesh.max = glm::max(mesh.max, glm::dvec3(mesh.positionsWs[index]));
    }
    const std::size_t slash = path.find_last_of('/');
    mesh.name = path.substr(slash == std::string::npos ? 0 : slash + 1);
    mesh.name = mesh.name.substr(0, mesh.name.find_last_of('.'));
    return std::move(mesh);
  }

 private:
  // Where an accessor's elements lie.
  struct Elements {
    const unsigned char* data;
    std::size_t count, stride;
    int componentType;
    bool normalized;
  };

  [[noreturn]] void fail(const std::string& reason) const { throw std::runtime_error(path + ": " + reason); }

  std::size_t checked(int index, std::size_t size, const char* what) const {
    if (index < 0 || static_cast<std::size_t>(index) >= size) fail(std::string("refers to a ") + what + " that it does not have");
    return static_cast<std::size_t>(index);
  }

  void readModel() {
    char magic[4] = {};
    {
      std::ifstream file(path, std::ios::binary);
      if (!file) fail("cannot be opened");
      file.read(magic, sizeof magic);
    }
    tinygltf::TinyGLTF reader;
    // Pictures are not needed: what they hold is never decoded.
    reader.SetImageLoader(
        [](tinygltf::Image*, int, std::string*, std::string*, int, int, const unsigned char*, int, void*) { return true; }, nullptr);
    std::string error, warning;
    bool read = false;
    try {
      read = std::memcmp(magic, "glTF", sizeof magic) == 0 ? reader.LoadBinaryFromFile(&model, &error, &warning, path)
                                                           : reader.LoadASCIIFromFile(&model, &error, &warning, path);
    } catch (const std::out_of_range&) {  // tinygltf looks up some references before it checks them
      error = "refers to an element that it does not have";
    }
    if (!read) {
      const std::string line = error.substr(0, error.find('\n'));
      fail("is not readable glTF" + (line.empty() ? std::string() : ": " + line));
    }
  }

  Elements elements(int index, int wantedType) const {
    const tinygltf::Accessor& accessor = model.accessors[checked(index, model.accessors.size(), "accessor")];
    if (accessor.sparse.isSparse) fail("sparse accessors are not supported");
    if (accessor.bufferView < 0) fail("compressed geometry is not supported");
    if (accessor.type != wantedType) fail("an accessor has the wrong type");
    const tinygltf::BufferView& view = model.bufferViews[checked(accessor.bufferView, model.bufferViews.size(), "buffer view")];
    const std::vector<unsigned char>& buffer = model.buffers[checked(view.buffer, model.buffers.size(), "buffer")].data;
    const int stride = accessor.ByteStride(view);
    const int componentSize = tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor.componentType));
    if (stride <= 0 || componentSize <= 0) fail("an accessor has the wrong type");
    const std::size_t size = static_cast<std::size_t>(componentSize) *
                             static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(wantedType)));
    const std::size_t end = std::min(buffer.size(), view.byteOffset <= buffer.size() && view.byteLength <= buffer.size() - view.byteOffset
                                                        ? view.byteOffset + view.byteLength
                                                        : std::size_t{0});
    const std::size_t begin = view.byteOffset + accessor.byteOffset;
    const auto step = static_cast<std::size_t>(stride);
    if (accessor.count > 0 && (begin > end || size > end - begin || accessor.count - 1 > (end - begin - size) / step)) {
      fail("an accessor points outside its buffer");
    }
    return {buffer.data() + begin, accessor.count, step, accessor.componentType, accessor.normalized};
  }

  template <class T>
  static T read(const unsigned char* data) {
    T value;
    std::memcpy(&value, data, sizeof value);
    return value;
  }

  // KHR_mesh_quantization allows integers, normalised or not, for positions.
  double component(const Elements& e, std::size_t element, std::size_t c) const {
    const unsigned char* at = e.data + element * e.stride;
    const auto scaled = [&](double value, double full) { return e.normalized ? std::max(value / full, -1.0) : value; };
    switch (e.componentType) {
      case TINYGLTF_COMPONENT_TYPE_FLOAT: return static_cast<double>(read<float>(at + 4 * c));
      case TINYGLTF_COMPONENT_TYPE_BYTE: return scaled(read<std::int8_t>(at + c), 127.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return scaled(read<std::uint8_t>(at + c), 255.0);
      case TINYGLTF_COMPONENT_TYPE_SHORT: return scaled(read<std::int16_t>(at + 2 * c), 32767.0);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return scaled(read<std::uint16_t>(at + 2 * c), 65535.0);
      default: fail("positions of an unknown type");
    }
  }

  std::uint32_t index(const Elements& e, std::size_t element) const {
    const unsigned char* at = e.data + element * e.stride;
    switch (e.componentType) {
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return read<std::uint8_t>(at);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return read<std::uint16_t>(at);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT: return read<std::uint32_t>(at);
      default: fail("indices of an unknown type");
    }
  }

  glm::dmat4 parentFromNode(const tinygltf::Node& node) const {
    if (node.matrix.size() == 16) return glm::make_mat4(node.matrix.data());
    glm::dmat4 matrix(1.0);
    if (node.rotation.size() == 4)
      matrix = glm::mat4_cast(glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
    if (node.scale.size() == 3) {
      for (int c = 0; c < 3; ++c) matrix[c] *= node.scale[static_cast<std::size_t>(c)];
    }
    if (node.translation.size() == 3) matrix[3] = glm::dvec4(node.translation[0], node.translation[1], node.translation[2], 1.0);
    return matrix;
  }

  void addNode(int nodeIndex, const glm::dmat4& worldFromParent, std::size_t level) {
    if (level > model.nodes.size()) fail("nodes form a loop");
    const tinygltf::Node& node = model.nodes[checked(nodeIndex, model.nodes.size(), "node")];
    const glm::dmat4 worldFromNode = worldFromParent * parentFromNode(node);
    if (node.mesh >= 0) {
      for (const tinygltf::Primitive& primitive : model.meshes[checked(node.mesh, model.meshes.size(), "mesh")].primitives) {
        if (primitive.mode == TINYGLTF_MODE_TRIANGLES || primitive.mode == -1) addTriangles(primitive, worldFromNode);
      }
    }
    for (const int child : node.children) addNode(child, worldFromNode, level + 1);
  }

  void addTriangles(const tinygltf::Primitive& primitive, const glm::dmat4& worldFromNode) {
    const auto attribute = primitive.attributes.find("POSITION");
    if (attribute == primitive.attributes.end()) return;
    const Elements positions = elements(attribute->second, TINYGLTF_TYPE_VEC3);
    const std::size_t first = mesh.positionsWs.size();
    if (positions.count > std::numeric_limits<std::uint32_t>::max() - first) fail("too many vertices");
    for (std::size_t i = 0; i < positions.count; ++i) {
      const glm::dvec4 local(component(positions, i, 0), component(positions, i, 1), component(positions, i, 2), 1.0);
      const glm::vec3 world(worldFromNode * local);
      if (!std::isfinite(world.x) || !std::isfinite(world.y) || !std::isfinite(world.z)) fail("non-finite positions");
      mesh.positionsWs.push_back(world);
    }

    const bool mirrored = glm::determinant(glm::dmat3(worldFromNode)) < 0.0;
    const auto addCorners = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (std::max({a, b, c}) >= positions.count) fail("an index beyond the vertices");
      const auto offset = static_cast<std::uint32_t>(first);
      mesh.indices.insert(mesh.indices.end(), {offset + a, offset + (mirrored ? c : b), offset + (mirrored ? b : c)});
    };
    if (primitive.indices >= 0) {
      const Elements indices = elements(primitive.indices, TINYGLTF_TYPE_SCALAR);
      for (std::size_t i = 0; i + 2 < indices.count; i += 3) addCorners(index(indices, i), index(indices, i + 1), index(indices, i + 2));
    } else {
      for (std::uint32_t i = 0; i + 2 < positions.count; i += 3) addCorners(i, i + 1, i + 2);
    }
  }

  const std::string& path;
  tinygltf::Model model;
  Mesh mesh;
};

// The highest point of the mesh over or under a point (x, z) of the ground plane; the mesh's lowest where there is none.
double groundAt(const Mesh& mesh, const glm::dvec2& at) {
  double highest = mesh.min.y;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    glm::dvec3 p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = glm::dvec3(mesh.positionsWs[mesh.indices[t + k]]);
    double weight[3], area = 0.0, height = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3 &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
      weight[k] = (a.x - at.x) * (b.z - at.y) - (a.z - at.y) * (b.x - at.x);
      area += weight[k];
      height += weight[k] * p[k].y;
    }
    const auto isInside = [&](double w) { return w * area >= 0.0; };
    if (area != 0.0 && isInside(weight[0]) && isInside(weight[1]) && isInside(weight[2])) highest = std::max(highest, height / area);
  }
  return highest;
}

std::vector<View> underBothLights(const std::string& name, const gnomon::Camera& camera) {
  return {{name, "steep", camera, glm::normalize(glm::dvec3(0.45, -1.0, -0.3))},
          {name, "low", camera, glm::normalize(glm::dvec3(0.8, -0.27, -0.5))}};
}

}  // namespace

Mesh loadGlb(const std::string& path) { return Loader(path).load(); }

DepthRange depthInView(const Mesh& mesh, const gnomon::Camera& camera) {
  const glm::dvec3 forward = glm::normalize(camera.forwardWs);
  const glm::dvec3 right = glm::normalize(glm::cross(forward, camera.upWs));
  const glm::dvec3 up = glm::cross(right, forward);
  std::vector<glm::dvec3> verticesVs;
  verticesVs.reserve(mesh.positionsWs.size());
  for (const glm::vec3& position : mesh.positionsWs) {
    const glm::dvec3 d = glm::dvec3(position) - camera.positionWs;
    verticesVs.emplace_back(glm::dot(d, right), glm::dot(d, up), glm::dot(d, forward));
  }
  // Side plane i keeps points with dot(normal, p) + offset >= 0. In a perspective view the four together keep z >= 0 as well.
  const bool perspective = camera.projection == Projection::perspective;
  const std::array<glm::dvec2, 4> axes{{{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}}};
  const std::array<double, 4> extents{camera.left, camera.right, camera.down, camera.up};
  const auto distance = [&](std::size_t side, const glm::dvec3& p) {
    return axes[side].x * p.x + axes[side].y * p.y + extents[side] * (perspective ? p.z : 1.0);
  };

  DepthRange range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  std::array<glm::dvec3, 8> cut, kept;  // a triangle cut by four planes has at most seven corners
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    std::size_t count = 3;
    for (std::size_t k = 0; k < 3; ++k) cut[k] = verticesVs[mesh.indices[t + k]];
    for (std::size_t side = 0; side < 4 && count > 0; ++side) {
      std::size_t keptCount = 0;
      for (std::size_t k = 0; k < count; ++k) {
        const glm::dvec3& a = cut[k];
        const glm::dvec3& b = cut[(k + 1) % count];
        const double da = distance(side, a), db = distance(side, b);
        if (da >= 0.0) kept[keptCount++] = a;
        if ((da >= 0.0) != (db >= 0.0)) kept[keptCount++] = a + (b - a) * (da / (da - db));
      }
      cut = kept;
      count = keptCount;
    }
    for (std::size_t k = 0; k < count; ++k) {
      range.nearest = std::min(range.nearest, cut[k].z);
      range.farthest = std::max(range.farthest, cut[k].z);
    }
  }
  return range;
}

std::vector<View> framedViews(const Mesh& mesh, double aspect) {
  const glm::dvec3 size = mesh.max - mesh.min;
  if (!(glm::length(size) > 0.0)) throw std::runtime_error(mesh.name + ": has no extent to look at");
  const glm::dvec3 centre = 0.5 * (mesh.min + mesh.max);
  // From the mesh to the eye: from above, past a corner, the longer side across the picture.
  const glm::dvec3 backward = glm::normalize(size.x >= size.z ? glm::dvec3(0.45, 0.6, 0.75) : glm::dvec3(0.75, 0.6, 0.45));
  const glm::dvec3 up(0.0, 1.0, 0.0);
  const glm::dvec3 right = glm::normalize(glm::cross(up, backward));
  const glm::dvec3 trueUp = glm::cross(backward, right);
  constexpr double kRoom = 1.03;  // a little air around the mesh
  const double tangentY = std::tan(0.5 * kFovY) / kRoom, tangentX = tangentY * aspect;

  // The nearest eye that sees every corner, given where it looks. With z towards the eye, the right plane keeps a corner c where
  // c.x + tangent c.z <= eye.x + tangent eye.z, and the left one where -c.x + tangent c.z <= -eye.x + tangent eye.z. Let high and
  // low be the greatest left-hand sides: adding up, 2 tangent eye.z >= high + low, and one of the two axes decides.
  std::vector<bool> isUsed(mesh.positionsWs.size(), false);
  for (const std::uint32_t index : mesh.indices) isUsed[index] = true;
  std::vector<glm::dvec3> corners;
  const double none = -std::numeric_limits<double>::infinity();
  glm::dvec2 high(none), low(none);
  const glm::dvec2 tangent(tangentX, tangentY);
  for (std::size_t i = 0; i < isUsed.size(); ++i) {
    if (!isUsed[i]) continue;
    const glm::dvec3 p = glm::dvec3(mesh.positionsWs[i]) - centre;
    const glm::dvec3& c = corners.emplace_back(glm::dot(p, right), glm::dot(p, trueUp), glm::dot(p, backward));
    high = glm::max(high, glm::dvec2(c) + tangent * c.z);
    low = glm::max(low, -glm::dvec2(c) + tangent * c.z);
  }
  const double distance = std::max((high.x + low.x) / (2.0 * tangent.x), (high.y + low.y) / (2.0 * tangent.y));
  // Along the other axis there is room to spare: as much on one side of the picture as on the other, by bisection.
  glm::dvec2 shift(0.0);
  for (int axis = 0; axis < 2; ++axis) {
    double least = high[axis] - tangent[axis] * distance, most = tangent[axis] * distance - low[axis];
    for (int step = 0; step < 40; ++step) {
      const double middle = 0.5 * (least + most);
      double above = none, below = none;
      for (const glm::dvec3& corner : corners) {
        above = std::max(above, (corner[axis] - middle) / (distance - corner.z));
        below = std::max(below, (middle - corner[axis]) / (distance - corner.z));
      }
      (above > below ? least : most) = middle;
    }
    shift[axis] = 0.5 * (least + most);
  }
  const glm::dvec3 eye = centre + backward * distance + right * shift.x + trueUp * shift.y;

  gnomon::Camera camera = gnomon::perspective(eye, -backward, up, kFovY, aspect, 1.0, 2.0);
  const DepthRange range = depthInView(mesh, camera);
  camera.far = kFarShare * range.farthest;
  camera.near = std::max(kNearShare * range.nearest, kLeastNearOverFar * camera.far);
  return underBothLights("framed", camera);
}

std::vector<View> standingViews(const Mesh& mesh, double aspect) {
  constexpr double kPlace = 0.25;  // along the longer side: the other three quarters lie ahead
  constexpr double kHeight = 0.03;  // of the horizontal diagonal, above the ground
  constexpr double kNear = 0.5;  // of the nearest depth: room to walk
  const glm::dvec3 size = mesh.max - mesh.min;
  const int along = size.x >= size.z ? 0 : 2;
  glm::dvec3 eye = 0.5 * (mesh.min + mesh.max), forward(0.0);
  forward[along] = 1.0;
  eye[along] = mesh.min[along] + kPlace * size[along];
  eye.y = groundAt(mesh, {eye.x, eye.z}) + kHeight * std::hypot(size.x, size.z);
  gnomon::Camera camera = gnomon::perspective(eye, forward, glm::dvec3(0.0, 1.0, 0.0), kFovY, aspect, 1.0, 2.0);
  const DepthRange range = depthInView(mesh, camera);
  if (!(range.nearest <= range.farthest && range.farthest > 0.0)) return {};
  camera.far = kFarShare * range.farthest;
  camera.near = std::max(kNear * range.nearest, kLeastNearOverFar * camera.far);
  std::vector<View> views = underBothLights("standing", camera);
  std::swap(views[0], views[1]);  // open ground has no shadows under a steep light
  return views;
}

}  // namespace gnomon::offscreen
