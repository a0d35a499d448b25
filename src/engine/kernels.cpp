// Instantiates the engine for one instruction set.  Compiled once for each (CMakeLists.txt), with KSL_ISA naming the set
// and KSL_TABLE the symbol.  No std containers here: their code would be shared, weakly, between the sets.
#include "engine/kernels.hpp"

#include "batch/finite.hpp"
#include "batch/lane_kernels.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// An algorithm that lays out its workspace in the memory given.
template <auto algorithm> struct single_state;
template <class W, class... Arguments, void (*algorithm)(const model_view<double> &, const W &, Arguments...)>
struct single_state<algorithm> {
  static void run(const model_view<double> &model, void *memory, Arguments... arguments) {
    arena pieces(memory);
    algorithm(model, pieces.take_workspace<W>(model), arguments...);
  }
};

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
    ksl::single_state<ksl::inverse_dynamics<double>>::run,
    ksl::single_state<ksl::reactions<double>>::run,
    ksl::single_state<ksl::inverse_dynamics_with_reactions<double>>::run,
    ksl::single_state<ksl::frame_poses<double>>::run,
    ksl::single_state<ksl::mass_matrix<double>>::run,
    ksl::single_state<ksl::forward_dynamics<double>>::run,
    ksl::single_state<ksl::energy<double>>::run,
    ksl::single_state<ksl::external_power<double>>::run,
    ksl::finite<double>,
    ksl::finite<float>,
    ksl::batch_of<double>,
    ksl::batch_of<ksl::native_pack<double>>,
    ksl::batch_of<float>,
    ksl::batch_of<ksl::native_pack<float>>,
};
