// How often memory was allocated in this program so far; stays 0 where malloc can't be counted (allocation_test.cpp).
#pragma once

#include <atomic>

extern std::atomic<long> allocations;
