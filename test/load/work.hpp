// Basic blocks that the library has run outside its kernels, in builds with KSL_COUNT_WORK.
#pragma once

namespace ksl::test {
long blocks();
}
