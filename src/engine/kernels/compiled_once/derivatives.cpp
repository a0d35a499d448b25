// Derivatives that others contain.
#include "engine/kernels/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_COMMON_DERIVATIVES, template)

} // namespace KSL_ISA
} // namespace ksl
