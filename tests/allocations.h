// allocations: counts the test program's heap allocations, so that a solve can be seen to make none.
#pragma once

#include <cstddef>

namespace gnomon::test {

[[nodiscard]] std::size_t allocationCount();

}  // namespace gnomon::test
