#include "gnomon/types.h"

namespace gnomon {
namespace {

struct Text {
  const char* field;
  const char* rule;
};

Text text(Status status) noexcept {
  switch (status) {
    case Status::ok: return {"", "ok"};
    case Status::cameraPosition: return {"camera.position", "must be finite"};
    case Status::cameraForward: return {"camera.forward", "must be finite and not zero"};
    case Status::cameraUp: return {"camera.up", "must be finite, not zero and not along camera.forward"};
    case Status::cameraNear: return {"camera.near", "must be a finite number > 0"};
    case Status::cameraFar: return {"camera.far", "must be a number > camera.near"};
    case Status::cameraInfiniteFar: return {"camera.far", "may be infinite only for a perspective camera with a camera.shadow_distance"};
    case Status::cameraShadowDistance: return {"camera.shadow_distance", "must be a number, not NaN"};
    case Status::cameraFovY: return {"camera.fov_y", "must be a number in (0, pi)"};
    case Status::cameraAspect: return {"camera.aspect", "must be a finite number > 0"};
    case Status::cameraHeight: return {"camera.height", "must be a finite number > 0"};
    case Status::cameraTangents: return {"camera.tangents", "must be finite, with left + right > 0 and down + up > 0"};
    case Status::cameraViewMatrix: return {"camera.view", "must be a rigid transform (rotation, translation, perhaps a mirror)"};
    case Status::cameraProjectionMatrix:
      return {"camera.projection_matrix", "must be a perspective or orthographic projection in the depth convention of camera.depth"};
    case Status::corners:
      return {"corners", "must be eight finite points (bit 0 right, bit 1 up, bit 2 far) of a convex volume with six flat faces"};
    case Status::lightDirection: return {"light.direction", "must be finite and not zero"};
    case Status::imageSize: return {"image", "width and height must be finite numbers > 0"};
    case Status::receiverBox: return {"scene.receivers", "must be finite with min <= max"};
    case Status::casterBox: return {"scene.casters", "must be finite with min <= max"};
    case Status::halfSpace: return {"scene.planes", "must be finite with a normal that is not zero"};
    case Status::marginFilter: return {"margin.filter", "must be a finite number of texels >= 0"};
    case Status::marginNormalOffset: return {"margin.normal_offset", "must be a finite number of texels >= 0"};
    case Status::marginBlend: return {"margin.blend", "must be a number in [0, 1)"};
    case Status::marginBorder: return {"margin.border", "must be a whole number of texels in [0, 1024]"};
    case Status::marginMotion: return {"margin.motion", "must be finite numbers of world units >= 0"};
    case Status::marginTexels:
      return {"margin", "filter and normal_offset leave no texel of a map: lower them or raise the budget's texels"};
    case Status::fade: return {"fade", "must be a number in [0, 1]"};
    case Status::budgetPartitions: return {"budget.partitions", "must be a whole number in [1, 16]"};
    case Status::budgetResolution: return {"budget.resolution", "must be a whole number in [1, 16384]"};
    case Status::budgetTexels: return {"budget.texels", "must be a finite number >= budget.partitions"};
    case Status::budgetAtlas: return {"budget.atlas", "must be whole numbers in [1, 16384] that hold a texel and its border for every map"};
    case Status::budgetTargetError: return {"budget.target_error", "must be a finite number > 0"};
    case Status::splitLambda: return {"method.lambda", "must be a number in [0, 1]"};
    case Status::splitBias: return {"method.bias", "must be a finite number >= 0"};
    case Status::splitBiasOrder: return {"method.bias", "moves a split past the next one or past the far end: lower it"};
    case Status::splitExplicit:
      return {"method.splits", "must be finite and strictly increasing, with at most budget.partitions - 1 numbers"};
    case Status::splitCount: return {"method.count", "must be a whole number in [1, budget.partitions]"};
    case Status::stableAutomatic:
      return {"method.fit",
              "stable cannot hold with method.count automatic (the number of maps would change with the view): give a number"};
    case Status::stableCorners:
      return {"method.fit", "stable cannot hold with corners (the size of a map would change with them): use tight or slice"};
    case Status::stableWorldSpace:
      return {"method.fit",
              "stable cannot hold with world-space matrices this far from the origin (float32 rounds off the snapping): use "
              "camera-relative ones"};
    case Status::warpEta: return {"method.eta", "must be a number in [-1, 1]"};
    case Status::rowsZeta: return {"method.zeta", "must be a number in (0, 0.5)"};
    case Status::rowsSigma: return {"method.sigma", "must be a finite number > 0"};
    case Status::rowsMaxRows: return {"method.max_rows", "must be a whole number in [1, 16]"};
    case Status::rowsMaxColumns: return {"method.max_columns", "must be a whole number in [1, 16]"};
    case Status::rowsReach:
      return {
          "method.rows",
          "paper: method.max_rows rows of eq. 1, or the maps that the budget allows, end before what must be shadowed does: take fitted"};
    case Status::samplesMissing: return {"samples", "must be given: sdsm places its maps by what the view samples"};
    case Status::samplesNear: return {"samples.near", "must be a finite number, > 0 where there is a histogram"};
    case Status::samplesFar: return {"samples.far", "must be a finite number >= samples.near"};
    case Status::samplesHistogram: return {"samples.histogram", "must be whole numbers >= 0 that fit 32 bits"};
    case Status::samplesWeights: return {"samples.weights", "must be finite numbers >= 0, one for each bin of samples.histogram"};
    case Status::samplesBounds: return {"samples.bounds", "must be finite with near <= far and min <= max"};
    case Status::samplesLatency: return {"method.latency", "must be a finite number of world units >= 0"};
    case Status::sdsmHysteresis: return {"method.hysteresis", "must be a number in [0, 1]"};
    case Status::autoPass: return {"method.pass_ns", "must be a finite number >= 0"};
    case Status::autoTexel: return {"method.texel_ns", "must be a finite number >= 0"};
    case Status::autoFit: return {"method.fit_ns", "must be a finite number >= 0"};
    case Status::autoSearch: return {"method.search_ns", "must be a finite number >= 0"};
    case Status::autoHysteresis: return {"method.hysteresis", "must be a finite number >= 0"};
    case Status::biasSlope: return {"bias.slope", "must be a finite number >= 0"};
    case Status::biasConstant: return {"bias.constant", "must be a finite number of texels >= 0"};
    case Status::worldSpacePrecision:
      return {"camera.position", "is too far from the origin for world-space float32 matrices: use camera-relative ones"};
    case Status::floatRange:
      return {"camera", "lengths, from a pixel's width to the far end, must stay within what a float32 matrix can hold"};
  }
  return {"", "unknown status"};
}

}  // namespace

const char* statusField(Status status) noexcept { return text(status).field; }

const char* statusRule(Status status) noexcept { return text(status).rule; }

const char* warningText(Warning warning) noexcept {
  switch (warning) {
    case Warning::worldSpacePrecision:
      return "world-space float32 matrices lose more than a tenth of a texel this far from the origin: use camera-relative ones";
    case Warning::viewDepthSelection:
      return "the camera's depth buffer cannot tell neighbouring splits apart: partitions are selected by view depth";
    case Warning::targetMissed: return "budget.target_error needs more maps or texels than the budget allows";
    case Warning::atlasReduced: return "the atlas is too small for the maps: they were scaled down alike, or one is as long as it";
    case Warning::regionSimplified:
      return "more half-spaces cut the view than can be held: some were ignored, maps cover more than they need";
    case Warning::rowsWaste: return "method.zeta needs more rows than are allowed: more of each row is wasted";
    case Warning::facesMissing:
      return "face partitions need more maps than the budget allows, or the view has no faces to use: z-partitions were made instead";
  }
  return "";
}

}  // namespace gnomon
