// The steps of shared_steps.hpp for one instruction set.
#define KSL_COMPILES_SHARED_STEPS
#include "engine/shared_steps.hpp"

namespace ksl {
inline namespace KSL_ISA {
KSL_SHARED_STEPS()
} // namespace KSL_ISA
} // namespace ksl
