// The check for finite numbers.  Compiled once for each instruction set (CMakeLists.txt).
#include "engine/kernels/finite.hpp"

#include "engine/kernels/kernels.hpp"

extern "C" const ksl::finite_kernels KSL_TABLE = {.in_double = ksl::finite<double>, .in_float = ksl::finite<float>};
