// What kernels of closed mechanisms contain.
#include "engine/kernels/compiled_once/closed.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_CLOSED_DYNAMICS, template)
KSL_FOR_DOUBLES(KSL_CLOSED_VARIATIONS, template)

} // namespace KSL_ISA
} // namespace ksl
