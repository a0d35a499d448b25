// How often memory was allocated in this program so far, by any thread; and allocations that fail when a test says so.
//
// With glibc and no sanitizer, malloc and all its relatives are counted, mmap too.  Elsewhere operator new is replaced, which leaves
// malloc to the sanitizer; what C libraries allocate is then not counted.
#pragma once

#include "sanitizer.hpp"

#include <atomic>
#include <cstdlib> // defines __GLIBC__

#if defined(__GLIBC__) && !defined(KSL_TEST_SANITIZER)
#define COUNTS_MALLOC
#endif

extern std::atomic<long> allocations;     ///< calls so far
extern std::atomic<long> allocated_bytes; ///< that they asked for
extern std::atomic<long> live_blocks;     ///< not freed yet; only where malloc is counted

/// From now on the nth allocation fails, the first being 1, in whatever thread it is; and all later ones with `all_after`.
void fail_allocation(long nth, bool all_after);
/// No allocation fails any more.  Returns how many have failed.
long stop_failing_allocations();
