// What every outside project compiles: one solve with a known answer, and the block's bytes, which must not depend on how the solver
// was taken.
#ifdef ONE_FILE
#include "gnomon.hpp"
#else
#include <gnomon/gnomon.h>
#endif

#include <cmath>
#include <cstdio>
#include <cstring>

int main() {
  gnomon::Frame frame;
  frame.camera = gnomon::perspective({3.0, 1.7, -2.0}, {0.3, -0.1, -1.0}, {0.0, 1.0, 0.0}, 1.05, 16.0 / 9.0, 0.1, 500.0);
  frame.light.directionWs = {-0.5, -1.0, -0.3};
  gnomon::Solution solution;
  if (gnomon::solvePssm(frame, {}, solution) != gnomon::Status::ok || solution.partitionCount != 4) return 1;
  for (int i = 0; i < 4; ++i)  // logarithmic planes  [Zhang 2006, eq. 4]
    if (!(std::abs(solution.partitions[i].near / (0.1 * std::pow(5000.0, i / 4.0)) - 1.0) < 1e-12)) return 1;

  std::printf("%d x %d texels, error %.17g\n", solution.atlas.x, solution.atlas.y, solution.maxError);
  unsigned char bytes[sizeof solution.block];
  std::memcpy(bytes, &solution.block, sizeof bytes);
  const std::size_t used = sizeof bytes - static_cast<std::size_t>(GNOMON_MAX_PARTITIONS - 4) * sizeof(gnomon::GnomonPartition);
  for (std::size_t i = 0; i < used; ++i) std::printf("%02x%s", static_cast<unsigned>(bytes[i]), i % 32 == 31 ? "\n" : "");
  return 0;
}
