// Functions that several kernels call, declared: each is compiled once for an instruction set, in a file of this folder.
//
// Every kernel would otherwise compile its own, and the linker would keep any one of them.  That is a third of all code that is compiled,
// and options of one file (CMakeLists.txt) would hold or not as the linker happens to choose.
#pragma once

#include "engine/kernels/kernel.hpp"
#include "ksl/engine/algorithms/derivatives/forward_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/frame_motion_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/derivatives/inverse_dynamics_second_derivatives.hpp"
#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix_factor.hpp"
#include "ksl/engine/algorithms/mass/solve_mass_matrix.hpp"

// `word` is `extern template` or `template`; T is a number, or a pack of them with a state in each lane.
#define KSL_MODEL(T) const model_view<scalar_of<T>> &

#define KSL_RECURSIONS(word, T)                                                                                        \
  word void inverse_dynamics<T>(KSL_MODEL(T), const inverse_dynamics_workspace<T> &, const T *, const T *, const T *,  \
                                const external_wrenches<T> &, T *);                                                    \
  word void start_articulated<T>(KSL_MODEL(T), const forward_dynamics_workspace<T> &, const T *, const T *,            \
                                 const external_wrenches<T> &);                                                        \
  word void eliminate_joints<T>(KSL_MODEL(T), const forward_dynamics_workspace<T> &, const T *);                       \
  word void accelerate_joints<T>(KSL_MODEL(T), const forward_dynamics_workspace<T> &, T *);                            \
  word void forward_dynamics<T>(KSL_MODEL(T), const forward_dynamics_workspace<T> &, const T *, const T *, const T *,  \
                                const external_wrenches<T> &, T *);

#define KSL_RECURSIONS_OF_PAIRS(word, S)                                                                               \
  word void accelerate_joints_of_two<batch_pack<S>>(                                                                   \
      KSL_MODEL(S), const forward_dynamics_workspace<batch_pack<S>> &, batch_pack<S> *,                                \
      const forward_dynamics_workspace<batch_pack<S>> &, batch_pack<S> *);

#define KSL_POSES(word, T)                                                                                             \
  word void forward_kinematics<T>(KSL_MODEL(T), const forward_kinematics_workspace<T> &, const T *);

#define KSL_COMMON_STEPS(word, T)                                                                                      \
  word void sines_and_cosines<T>(KSL_MODEL(T), const pose_workspace<T> &, const T *);                                  \
  word void sines_and_cosines_of_supports<T>(KSL_MODEL(T), const pose_workspace<T> &, const T *, int, int);            \
  word void joint<general_kind>::compute_pose<T>(const pose_workspace<T> &, const T *, general_pose<T> &);             \
  word void joint<general_kind>::reload_pose<T>(const pose_workspace<T> &, general_pose<T> &);                         \
  word void compose_poses<T>(KSL_MODEL(T), const pose_workspace<T> &, const array_of<SE3<T>> &);                       \
  word mat3x3<T> axes_in_world<T>(KSL_MODEL(T), const pose_workspace<T> &, int);                                       \
  word void frame_velocities<T>(KSL_MODEL(T), const frame_velocities_workspace<T> &, const T *, const T *, int,        \
                                const int *, const frame_options &, T *);                                              \
  word void frame_accelerations<T>(KSL_MODEL(T), const frame_accelerations_workspace<T> &, const T *, const T *,       \
                                   const T *, int, const int *, const frame_options &, T *);                           \
  word void mass_matrix_tree<T>(KSL_MODEL(T), const mass_matrix_workspace<T> &, const T *, T *);                       \
  word void rows_of_mass_matrix<T>(KSL_MODEL(T), const mass_matrix_workspace<T> &, const tree_rows<T> &, const T *);   \
  word void start_at_rest<T>(KSL_MODEL(T), const forward_dynamics_workspace<T> &, const T *,                           \
                             const external_wrenches<T> &);

#define KSL_COMMON_DERIVATIVES(word, T)                                                                                \
  word void motions_of_supports<T>(KSL_MODEL(T), const frame_velocities_derivatives_workspace<T> &, const T *,         \
                                   const T *, const T *, int, const int *);                                            \
  word void forward_dynamics_derivatives<T>(KSL_MODEL(T), const forward_dynamics_derivatives_workspace<T> &,           \
                                            const T *, const T *, const T *, const external_wrenches<T> &, T *, T *,   \
                                            T *);                                                                      \
  word void elements_of_inverse_dynamics_derivatives<T>(                                                               \
      KSL_MODEL(T), const inverse_dynamics_derivatives_workspace<T> &, const T *, const T *, const T *,                \
      const external_wrenches<T> &, T *, T *, T *);                                                                    \
  word void elements_of_inverse_dynamics_second_derivatives<T>(                                                        \
      KSL_MODEL(T), const inverse_dynamics_second_derivatives_workspace<T> &, const T *, const T *, const T *,         \
      const external_wrenches<T> &, T *, T *, T *, T *);

// Rows of numbers S into lanes, and back.
#define KSL_TRANSPOSITIONS(word, S)                                                                                    \
  word void load_rows<S, batch_lanes<S>>(const S *, std::ptrdiff_t, int, int, batch_pack<S> *);                        \
  word void store_next_of<S, batch_lanes<S>>(std::size_t, next_columns<batch_pack<S>> &, std::ptrdiff_t, int, S *,     \
                                             std::ptrdiff_t);

#ifdef KSL_BATCHES_BY_STATE
#define KSL_FOR_SCALARS(list, word) list(word, double) list(word, float)
#define KSL_FOR_LANES(list, word)
#else
#define KSL_FOR_SCALARS(list, word)                                                                                    \
  list(word, double) list(word, float) list(word, batch_pack<double>) list(word, batch_pack<float>)
#define KSL_FOR_LANES(list, word) list(word, double) list(word, float)
#endif

namespace ksl {
inline namespace KSL_ISA {

#ifdef KSL_COMPILED_ONCE // in the objects of a set; others, such as tests, compile what they use
KSL_FOR_SCALARS(KSL_RECURSIONS, extern template)
KSL_FOR_SCALARS(KSL_POSES, extern template)
KSL_FOR_SCALARS(KSL_COMMON_STEPS, extern template)
KSL_FOR_SCALARS(KSL_COMMON_DERIVATIVES, extern template)
KSL_FOR_LANES(KSL_RECURSIONS_OF_PAIRS, extern template)
KSL_FOR_LANES(KSL_TRANSPOSITIONS, extern template)
#endif

} // namespace KSL_ISA
} // namespace ksl
