// Counts the work of readers: with KSL_COUNT_WORK their code calls this at the beginning of each basic block
// (-fsanitize-coverage=trace-pc), so at least once for each call and for each turn of a loop.  A count is the same on every machine.
#include "work.hpp"

namespace {
long blocks_run = 0;
}

namespace ksl::test {
long blocks() { return __atomic_load_n(&blocks_run, __ATOMIC_RELAXED); }
} // namespace ksl::test

extern "C" void __sanitizer_cov_trace_pc();
/// Calls no function, not even one of std::atomic, since that would call this one.  The sum itself is not atomic, which would take some
/// times as long: with several threads a few blocks may be lost.
extern "C" void __sanitizer_cov_trace_pc() {
  __atomic_store_n(&blocks_run, __atomic_load_n(&blocks_run, __ATOMIC_RELAXED) + 1, __ATOMIC_RELAXED);
}
