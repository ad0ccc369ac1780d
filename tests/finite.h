// finite: whether every number that a solution hands out is one.
#pragma once

#include <cmath>

#include "gnomon/types.h"

namespace gnomon::test {

inline bool isFinite(const Solution& solution) {
  bool isFine = true;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) isFine = isFine && std::isfinite(map.clipFromWorld[c][r]);
    for (const double x : {map.near, map.far, map.error.s, map.error.t, map.error.extent}) isFine = isFine && std::isfinite(x);
    for (int p = 0; p < map.cullPlaneCount; ++p)
      for (int c = 0; c < 4; ++c) isFine = isFine && std::isfinite(map.cullPlanes[p][c]);
  }
  for (const auto& partition : solution.block.partitions)  // whole: it is uploaded so
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) isFine = isFine && std::isfinite(partition.atlasFromWorld[c][r]);
  for (const double x : {solution.maxError, solution.neededTexels, solution.storageFactor, solution.limitTexels})
    isFine = isFine && std::isfinite(x);
  return isFine;
}

}  // namespace gnomon::test
