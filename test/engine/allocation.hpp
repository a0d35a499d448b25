// How often memory was allocated in this program so far; stays 0 where malloc can't be counted.
#pragma once

#include <atomic>
#include <cstdlib> // defines __GLIBC__

#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__)
#define COUNTS_MALLOC
#endif

extern std::atomic<long> allocations;
