// Where a point lies in its map, how large a texel is there and how far the bias moves it: the shaders against the C++ functions and
// against formulas in double.
#include "parity.h"

namespace gnomon::test {
namespace {

TEST_P(Parity, Lookup) {
  Gpu gpu(GetParam());
  int counted = 0, outside = 0;
  double worst = 0.0;
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const Frame& frame = setting.frame;
    const auto solution = solve(frame, setting.settings);
    ASSERT_EQ(solution->status, Status::ok);
    const glm::dvec2 atlas(solution->atlas);
    Random random(92);
    std::vector<glm::vec4> points;  // w: partition
    for (int i = 0; i < 700; ++i) {
      const int k = random.index(solution->partitionCount);
      const Partition& map = solution->partitions[k];
      const double z = i % 50 == 0 ? map.near : (i % 50 == 1 ? map.far : random.uniform(map.near, map.far));
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
    }
    const std::size_t inView = points.size();
    for (int i = 0; i < 200; ++i) {  // anywhere, behind the eye too
      const int k = random.index(solution->partitionCount);
      points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.1, 4.0 * std::abs(solution->partitions[k].far))),
                          static_cast<float>(k));
    }
    const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", solution->block, points);
    const auto casts = gpu.run("  result = gnomonCastPosition(gnomon, index, world);\n", solution->block, points);
    const auto wholes = gpu.run("  result = gnomonCastAtlas(gnomon, index, world);\n", solution->block, points);
    const auto clips = gpu.run("  result = gnomonCastClip(gnomon, index, world);\n", solution->block, points);
    const auto flats = gpu.run("  result = gnomonCastFlat(gnomonCastPosition(gnomon, index, world));\n", solution->block, points);
    const auto others = gpu.run(
        "  float depth = gnomonCastWindowDepth(gnomon, index, world);\n  result = vec4(float(gnomonCastLayer(gnomon, index)), depth, "
        "gnomonCastDepth(depth), "
        "gnomonGrid(gnomon, index, world));\n",
        solution->block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const Partition& map = solution->partitions[k];
      const glm::dvec3 world(points[i]);
      const glm::dvec3 reference = texelReference(frame, map, world);
      const glm::dvec4 cpp = atlasPosition(solution->block, k, world);
      const glm::dvec2 texel = glm::dvec2(lookups[i].x, lookups[i].y) * atlas;
      const glm::dvec2 least(map.viewport.x, map.viewport.y), size(map.viewport.z, map.viewport.w);
      const glm::dvec2 past = glm::max(least - glm::dvec2(reference), glm::dvec2(reference) - least - size);
      const double out = std::max(past.x, past.y);  // texels outside the map; negative inside
      constexpr double kSlack = 1.0 / 64.0;
      if (std::abs(out - 1.0) > kSlack) {
        EXPECT_EQ(lookups[i].w, out < 1.0 ? 1.0f : 0.0f) << out;
        EXPECT_EQ(cpp.w, out < 1.0 ? 1.0 : 0.0) << out;
      }
      outside += out > 1.0;
      EXPECT_EQ(others[i].x, static_cast<float>(frame.shadowMap.layout == MapLayout::layers ? k : 0));
      if (i >= inView && out > 0.0) continue;
      if (frame.scene.receivers.empty() && i < inView) {
        EXPECT_EQ(lookups[i].w, 1.0f);
      }
      if (out > size.x) continue;  // no receiver; far from what the map's numbers are good for
      ++counted;
      constexpr double kTexel = 1.0 / 256.0;
      for (int c = 0; c < 2; ++c) {
        worst = std::max({worst, std::abs(texel[c] - cpp[c] * atlas[c]), std::abs(texel[c] - reference[c])});
        EXPECT_NEAR(texel[c], cpp[c] * atlas[c], kTexel);
        EXPECT_NEAR(texel[c], reference[c], kTexel);
      }
      constexpr double kDepth = 2e-6;
      EXPECT_NEAR(lookups[i].z, cpp.z, kDepth);
      EXPECT_NEAR(lookups[i].z, std::clamp(reference.z, 0.0, 1.0), kDepth);
      EXPECT_NEAR(others[i].y, reference.z, kDepth * (1.0 + std::abs(reference.z)));
      EXPECT_EQ(others[i].z, std::clamp(others[i].y, 0.0f, 1.0f));
      // The draw side, through the map's own viewport and through the whole atlas as one viewport, lands on the same texel.
      // Direct3D alone has row 0 at clip y = +1, so there the host negates y of gnomonCastAtlas; both signs cancel in `one`.
      const double up = frame.shadowMap.style == ClipStyle::direct3d ? -1.0 : 1.0;
      const glm::dvec4 cast(casts[i]), whole(wholes[i]), clip(clips[i]);
      const glm::dvec2 own = least + (glm::dvec2(cast.x, up * cast.y) / cast.w * 0.5 + 0.5) * size,
                       one = (glm::dvec2(whole) / whole.w * 0.5 + 0.5) * atlas;
      for (int c = 0; c < 2; ++c) {
        EXPECT_NEAR(own[c], reference[c], kTexel);
        EXPECT_NEAR(one[c], reference[c], 2.0 * kTexel);
      }
      const glm::dvec4 exact = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(cast[c], exact[c], 4.0 * kDepth);
      EXPECT_EQ(whole.z, cast.z);
      EXPECT_EQ(whole.w, cast.w);
      const glm::dvec4 sides{1.0 + exact.x, 1.0 - exact.x, 1.0 + exact.y, 1.0 - exact.y};  // w is 1 for a directional light
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(clip[c], sides[c], 4.0 * kDepth);
      EXPECT_EQ(glm::vec2(flats[i]), glm::vec2(casts[i]));
      EXPECT_EQ(flats[i].w, casts[i].w);
      EXPECT_EQ(flats[i].z, 0.5f * casts[i].w);  // inside the depth range of every convention
      const glm::dvec2 inTexel = glm::abs(glm::fract(glm::dvec2(reference)) - 0.5);
      if (const double border = std::max(inTexel.x, inTexel.y); std::abs(border - 0.45) > 2.0 * kTexel && border < 0.5 - 2.0 * kTexel) {
        EXPECT_EQ(others[i].w, border > 0.45 ? 1.0f : 0.0f);
      }
    }
  }
  EXPECT_GT(counted, 25000);
  EXPECT_GT(outside, 1000);
  RecordProperty("worstTexels", std::to_string(worst));
}

// The columns of the inverse Jacobian against differences of the lookup, in double.
TEST_P(Parity, TexelEdges) {
  Gpu gpu(GetParam());
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const auto solution = solve(setting.frame, setting.settings);
    Random random(97);
    const std::vector<glm::vec4> points = pointsInMaps(random, setting.frame, *solution, 60);
    const std::string body = "  vec3 edgeS, edgeT;\n  gnomonTexelEdges(gnomon, index, world, edgeS, edgeT);\n";
    const std::array<std::vector<glm::vec4>, 2> edges{gpu.run(body + "  result = vec4(edgeS, 0.0);\n", solution->block, points),
                                                      gpu.run(body + "  result = vec4(edgeT, 0.0);\n", solution->block, points)};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto measured = measuredEdges(setting.frame, *solution, static_cast<int>(points[i].w), glm::dvec3(points[i]));
      for (std::size_t e = 0; e < 2; ++e) EXPECT_LT(glm::length(glm::dvec3(edges[e][i]) - measured[e]), 1e-5 * glm::length(measured[e]));
    }
  }
}

// Bias: a point of a plane, moved as the shader moves it, clears the plane's depth anywhere in the texel, by no more than that.
TEST_P(Parity, BiasClearsAPlaneWithinTheTexel) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.bias = {.slope = 1.0, .constant = 0.0};
  const auto solution = solve(frame);
  const glm::dvec3 light = glm::normalize(frame.light.directionWs);
  Random random(93);
  std::vector<glm::vec4> points;
  std::vector<glm::vec3> normals;
  for (int i = 0; i < 400; ++i) {
    glm::dvec3 normal = random.direction();
    if (glm::dot(normal, light) > 0.0) normal = -normal;
    if (glm::dot(normal, light) > -0.05) continue;
    const int k = random.index(solution->partitionCount);
    const glm::vec3 rel(viewPoint(frame.camera, random.uniform(), random.uniform(),
                                  random.uniform(solution->partitions[k].near, solution->partitions[k].far)));
    points.emplace_back(rel, static_cast<float>(k));
    normals.emplace_back(normal);
  }
  // One program for each normal would be slow: the normal of point i follows it as point i + n.
  const std::size_t n = points.size();
  for (const glm::vec3& normal : normals) points.emplace_back(normal, 0.0f);
  const std::string body = "  int at = int(gl_FragCoord.y) * 512 + int(gl_FragCoord.x) + " + std::to_string(n) +
                           ";\n  vec3 normal = texelFetch(points, ivec2(at % 512, at / 512), 0).xyz;\n  result = vec4(gnomonBias(gnomon, "
                           "int(point.w), world, normal, 0.5) - world, 0.0);\n";
  const auto moved = gpu.run(body, solution->block, points);
  for (std::size_t i = 0; i < n; ++i) {
    const int k = static_cast<int>(points[i].w);
    const glm::dvec3 rel(points[i]), normal(normals[i]), offset(moved[i]);
    const auto [s, t] = measuredEdges(frame, *solution, k, rel);
    const double needed = 0.5 * (std::abs(glm::dot(normal, s)) +
                                 std::abs(glm::dot(normal, t)));  // height over the plane that its farthest texel corner asks for
    EXPECT_NEAR(glm::dot(offset, normal) / needed, 1.0, 1e-2);
    EXPECT_LT(glm::length(glm::cross(offset, normal)), 1e-5 * glm::length(rel) + 1e-2 * needed);
  }
}

// A block made by hand: projective, with texels longer along t, as a light with a position would have it. A directional solve has w = 1.
TEST_P(Parity, AProjectiveMapIsDividedByW) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  clearBlock(block);
  block.info.x = 1;
  const glm::dvec2 atlas(512.0, 64.0);
  block.atlas = glm::vec4(glm::dvec4(atlas, 1.0 / atlas));
  const glm::dvec3 light = glm::normalize(glm::dvec3(0.2, -0.9, 0.3));
  block.lightDirection = glm::vec4(glm::vec3(light), 0.0f);
  block.bias = {0.75f, 0.5f, 0.0f, 0.0f};
  GnomonPartition& map = block.partitions[0];
  map.atlasFromWorld =
      glm::mat4(0.11f, 0.02f, 0.01f, 0.03f, -0.02f, 0.05f, 0.04f, -0.02f, 0.03f, 0.12f, -0.02f, 0.05f, 0.5f, 0.45f, 0.4f, 1.0f);
  map.clipFromWorld = glm::mat4(0.2f, 0.1f, 0.05f, 0.03f, -0.1f, 0.3f, 0.04f, -0.02f, 0.06f, 0.2f, -0.02f, 0.05f, 0.1f, -0.1f, 0.3f, 1.0f);
  map.uvBounds = {0.0f, 0.0f, 1.0f, 1.0f};
  Random random(100);
  std::vector<glm::vec4> points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(glm::vec3(random.direction() * random.uniform(0.0, i % 4 == 0 ? 60.0 : 3.0)), 0.0f);
  const glm::dmat4 worldFromAtlas = glm::inverse(glm::dmat4(map.atlasFromWorld));
  for (int i = 0; i < 4000; ++i) {  // points behind that the division puts into the middle of the map
    const glm::dvec4 r = worldFromAtlas * glm::dvec4(random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), random.uniform(-20.0, 20.0), 1.0);
    if (r.w < -0.01 && r.w > -1.0) points.emplace_back(glm::vec3(glm::dvec3(r) / r.w), 0.0f);
  }
  const std::string body =
      "  vec3 up = vec3(0.6, 0.8, 0.0);\n  vec3 edgeS, edgeT;\n  gnomonTexelEdges(gnomon, index, world, edgeS, edgeT);\n";
  const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", block, points);
  const auto edgesS = gpu.run(body + "  result = vec4(edgeS, gnomonCastWindowDepth(gnomon, index, world));\n", block, points);
  const auto edgesT = gpu.run(body + "  result = vec4(edgeT, 0.0);\n", block, points);
  const auto biases = gpu.run(body + "  result = vec4(gnomonBias(gnomon, index, world, up, 1.5) - world, 0.0);\n", block, points);
  const auto casts = gpu.run("  result = gnomonCastAtlas(gnomon, index, world);\n", block, points);
  const auto clips = gpu.run("  result = gnomonCastClip(gnomon, index, world);\n", block, points);
  int behind = 0, behindInside = 0, inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 world(points[i]);
    const glm::dvec4 q = glm::dmat4(map.atlasFromWorld) * glm::dvec4(world, 1.0),
                     own = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
    const glm::dvec3 p = glm::dvec3(q) / q.w;
    if (q.w < -0.01) {  // behind the light, wherever the division puts it
      ++behind;
      EXPECT_EQ(lookups[i].w, 0.0f);
      EXPECT_EQ(atlasPosition(block, 0, world).w, 0.0);
      behindInside += p.x > 0.05 && p.x < 0.95 && p.y > 0.05 && p.y < 0.95;
    }
    const double out = std::max(std::max(-p.x, p.x - 1.0) * atlas.x, std::max(-p.y, p.y - 1.0) * atlas.y);
    if (q.w < 0.2 || out > 8.0) continue;
    const glm::dvec4 cpp = atlasPosition(block, 0, world);
    if (std::abs(out - 1.0) > 0.01) {
      EXPECT_EQ(lookups[i].w, out < 1.0 ? 1.0f : 0.0f);
      EXPECT_EQ(cpp.w, out < 1.0 ? 1.0 : 0.0);
    }
    ++inside;
    for (int c = 0; c < 2; ++c) {
      EXPECT_NEAR(lookups[i][c] * atlas[c], p[c] * atlas[c], 1.0 / 256.0);
      EXPECT_NEAR(cpp[c], p[c], 1e-12);
      EXPECT_NEAR(casts[i][c], 2.0 * q[c] - own.w, 1e-5);
    }
    EXPECT_NEAR(lookups[i].z, std::clamp(p.z, 0.0, 1.0), 1e-5);
    EXPECT_NEAR(edgesS[i].w, p.z, 1e-5 * (1.0 + std::abs(p.z)));
    EXPECT_NEAR(cpp.z, std::clamp(p.z, 0.0, 1.0), 1e-12);
    EXPECT_NEAR(casts[i].z, own.z, 1e-5);
    const std::array<double, 4> sides{own.w + own.x, own.w - own.x, own.w + own.y, own.w - own.y};
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(clips[i][static_cast<int>(c)], sides[c], 1e-5);
    const auto texel = [&](const glm::dvec3& at) {
      const glm::dvec4 r = glm::dmat4(map.atlasFromWorld) * glm::dvec4(at, 1.0);
      return glm::dvec2(r) / r.w * atlas;
    };
    const auto [s, t] = measuredEdges(light, texel, world, 1e-5);
    const double sine = glm::length(glm::cross(s, t)) / (glm::length(s) * glm::length(t));
    if (sine < 0.05) continue;  // texels that are nearly lines
    EXPECT_LT(glm::length(glm::dvec3(edgesS[i]) - s), 1e-3 * glm::length(s));
    EXPECT_LT(glm::length(glm::dvec3(edgesT[i]) - t), 1e-3 * glm::length(t));
    const glm::dvec3 up(0.6, 0.8, 0.0);
    // How much the stored depth of the plane through the point varies over each edge, over how much it varies along the light: differences.
    const auto stored = [&](const glm::dvec3& at) {
      const glm::dvec4 r = glm::dmat4(map.atlasFromWorld) * glm::dvec4(at, 1.0);
      return r.z / r.w;
    };
    const auto rise = [&](const glm::dvec3& step) { return (stored(world + step * 1e-4) - stored(world - step * 1e-4)) / 2e-4; };
    const auto onPlane = [&](const glm::dvec3& edge) { return edge - light * (glm::dot(up, edge) / glm::dot(up, light)); };
    if (std::abs(rise(light)) < 1e-2) continue;  // depth that hardly grows along the light
    const double apart = (std::abs(rise(onPlane(s))) + std::abs(rise(onPlane(t)))) / std::abs(rise(light));
    const double height = 0.75 * 1.5 * apart * std::abs(glm::dot(up, light)) + 0.5 * std::max(glm::length(s), glm::length(t));
    EXPECT_LT(glm::length(glm::dvec3(biases[i]) - up * height), 1e-3 * height + 1e-5);
  }
  EXPECT_GT(behind, 50);
  EXPECT_GT(behindInside, 50);
  EXPECT_GT(inside, 500);
}

// World space: the block's origin is zero and the plane of view depth has an offset.
TEST_P(Parity, WorldSpaceMatricesTakeWorldPositions) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.worldSpace = true;
  const auto solution = solve(frame);
  ASSERT_EQ(solution->status, Status::ok);
  EXPECT_EQ(glm::vec3(solution->block.origin), glm::vec3(0.0f));
  Random random(101);
  std::vector<glm::vec4> points;
  std::vector<double> depths;
  for (int i = 0; i < 2000; ++i) {
    const int k = random.index(solution->partitionCount);
    depths.push_back(random.uniform(solution->partitions[k].near, solution->partitions[k].far));
    points.emplace_back(glm::vec3(frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), depths.back())),
                        static_cast<float>(k));
  }
  const auto results =
      gpu.run("  result = vec4(gnomonAtlas(gnomon, index, world).xyw, gnomonViewDepth(gnomon, world));\n", solution->block, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 reference = texelReference(frame, solution->partitions[static_cast<int>(points[i].w)], glm::dvec3(points[i]));
    EXPECT_NEAR(results[i].x * static_cast<double>(solution->atlas.x), reference.x, 1.0 / 64.0);  // terms as large as the camera's distance
    EXPECT_NEAR(results[i].y * static_cast<double>(solution->atlas.y), reference.y, 1.0 / 64.0);
    EXPECT_EQ(results[i].z, 1.0f);
    EXPECT_NEAR(results[i].w, depths[i], 1e-6 * (glm::length(glm::dvec3(points[i])) + 4.0));
    EXPECT_NEAR(viewDepth(solution->block, glm::dvec3(points[i])), depths[i], 1e-6 * (glm::length(glm::dvec3(points[i])) + 4.0));
  }
}

}  // namespace
}  // namespace gnomon::test
