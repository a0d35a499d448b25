// KSL: many states in one call: one state in each lane of a register, ranges of states on several threads.
//
// Every call takes a batch_view with the rows of its inputs and results.  threads: the most threads to use; 0 is all
// cores that the process may use, by its affinity (taskset) and the quotas of its control groups (containers), and more
// than these are never used.  The system is asked once.  Memory is allocated when a thread makes its first batch, or a
// larger one than before, and never again.  Results are the same bits as those of the one-state calls.  They don't
// depend on the number of threads, on the position of a state in the batch, or on the instruction set.  Throws
// std::bad_alloc, std::runtime_error for an unusable KSL_ISA, std::invalid_argument if the robot has mimic joints and
// the algorithm is not available for them, and result_error if results are not finite although the arguments are;
// nothing else.
#pragma once

#include "ksl/batch_calls.hpp"
#include "ksl/dynamics.hpp"
