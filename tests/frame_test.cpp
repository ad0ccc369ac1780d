#include "support.h"

#include "gnomon/frame.h"

namespace gnomon::test {
namespace {

TEST(Frame, ReportsTheValueRefused) {
  Frame frame = usualFrame();
  double value = 0.0;
  frame.camera.near = -3.0;
  EXPECT_EQ(validate(frame, value), Status::cameraNear);
  EXPECT_EQ(value, -3.0);
  frame = usualFrame();
  frame.margin.blend = 7.0;
  EXPECT_EQ(validate(frame, value), Status::marginBlend);
  EXPECT_EQ(value, 7.0);
  frame = usualFrame();
  frame.budget.texels = 2.0;
  EXPECT_EQ(validate(frame, value), Status::budgetTexels);
  EXPECT_EQ(value, 2.0);
  frame = usualFrame();
  frame.margin.motion[kMaxPartitions - 1] = -3.0;  // of no map that the budget allows: what more maps would need is asked for, too
  EXPECT_EQ(validate(frame, value), Status::marginMotion);
  EXPECT_EQ(value, -3.0);
  EXPECT_EQ(validate(usualFrame(), value), Status::ok);
}

TEST(Frame, ARefusalLeavesALitBlock) {
  const auto solution = solve(usualFrame());
  ASSERT_EQ(solution->block.info.x, 4u);
  solution->refusedValue = 5.0;
  EXPECT_EQ(refuse(*solution, Status::imageSize), Status::imageSize);
  EXPECT_EQ(solution->status, Status::imageSize);
  EXPECT_EQ(solution->refusedValue, 5.0);
  EXPECT_EQ(solution->partitionCount, 0);
  EXPECT_EQ(solution->block.info.x, 0u);
  for (const float z : {0.0f, 0.5f, 1.0f, 1e6f}) {
    EXPECT_EQ(selectByViewDepth(solution->block, z), -1);
    EXPECT_EQ(selectByWindowDepth(solution->block, z), -1);
  }
}

}  // namespace
}  // namespace gnomon::test
