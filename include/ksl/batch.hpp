// KSL: many states in one call, a state in each lane of the registers and ranges of states on several threads.
//
// Every call takes a batch_view, which says where the rows of its inputs and results are.  threads: how many; 0 is all cores.
// Results don't depend on the number of threads, on the place of a state in the batch, nor on the instruction set: they are
// the bits of the one-state calls.  Throws std::bad_alloc, and std::runtime_error for an unusable KSL_ISA; nothing else.
#pragma once

#include "ksl/batch_calls.hpp"
#include "ksl/dynamics.hpp"
