// Poses of all bodies, with compiler options of their own (CMakeLists.txt).
#include "engine/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_POSES, template)

} // namespace KSL_ISA
} // namespace ksl
