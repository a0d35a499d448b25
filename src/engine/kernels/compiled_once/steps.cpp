// Motions of bodies, mass matrices, and transpositions.
#include "engine/kernels/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_COMMON_STEPS, template)
KSL_FOR_LANES(KSL_TRANSPOSITIONS, template)

} // namespace KSL_ISA
} // namespace ksl
