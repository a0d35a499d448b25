// Forward kinematics, with compiler options of its own (CMakeLists.txt).  compose_poses is slower with them (docs/decisions/0019-speed-everywhere.md).
#include "engine/kernels/compiled_once/compiled_once.hpp"

namespace ksl {
inline namespace KSL_ISA {

KSL_FOR_SCALARS(KSL_POSES, template)

} // namespace KSL_ISA
} // namespace ksl
