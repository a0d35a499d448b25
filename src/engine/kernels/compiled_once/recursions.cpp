// The recursions of inverse and of forward dynamics, which have compiler options of their own (CMakeLists.txt).
#include "engine/kernels/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_RECURSIONS, template)
KSL_FOR_LANES(KSL_RECURSIONS_OF_PAIRS, template)

} // namespace KSL_ISA
} // namespace ksl
