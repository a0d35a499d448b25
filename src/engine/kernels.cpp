// Instantiates the engine for one instruction set.  Compiled once for each (CMakeLists.txt), with KSL_ISA naming the set
// and KSL_TABLE the symbol.  No std containers here: their code would be shared, weakly, between the sets.
#include "engine/kernels.hpp"

#include "batch/finite.hpp"
#include "batch/lane_kernels.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class P>
constexpr batch_kernels<scalar_of<P>> batch_of = {
    static_cast<int>(sizeof(P) / sizeof(scalar_of<P>)),
    inverse_dynamics_lanes<P>,
    forward_dynamics_lanes<P>,
    mass_matrix_lanes<P>,
    external_power_lanes<P>,
    frame_poses_lanes<P>,
    energy_lanes<P>,
};

} // namespace KSL_ISA
} // namespace ksl

extern "C" const ksl::kernel_table KSL_TABLE = {
    ksl::inverse_dynamics<double>,
    ksl::reactions<double>,
    ksl::inverse_dynamics_with_reactions<double>,
    ksl::forward_kinematics<double>,
    ksl::mass_matrix<double>,
    ksl::forward_dynamics<double>,
    ksl::energy<double>,
    ksl::external_power<double>,
    ksl::finite<double>,
    ksl::finite<float>,
    ksl::batch_of<double>,
    ksl::batch_of<ksl::native_pack<double>>,
    ksl::batch_of<float>,
    ksl::batch_of<ksl::native_pack<float>>,
};
