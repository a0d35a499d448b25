// Steps that the kernels of nearly all algorithms call.  With KSL_SHARES_STEPS, which the library's build defines, they are compiled once for each
// instruction set, in shared_steps.cpp, and not once in every unit.
#pragma once

#include "engine/kernel.hpp"

/// KSL_SHARED_STEPS(extern) says that these functions are compiled elsewhere, KSL_SHARED_STEPS() compiles them.
#define KSL_SHARED_OF_SCALAR(elsewhere, T)                                                                             \
  elsewhere template void sines_and_cosines(const model_view<scalar_of<T>> &, const pose_workspace<T> &, const T *);   \
  elsewhere template void joint<general_kind>::base::compute_pose(const pose_workspace<T> &, const T *,                \
                                                                  general_pose<T> &);                                  \
  elsewhere template void joint<general_kind>::base::reload_pose(const pose_workspace<T> &, general_pose<T> &);
#ifdef KSL_BATCHES_BY_STATE
#define KSL_SHARED_OF_LANES(elsewhere, S)
#else
#define KSL_SHARED_OF_LANES(elsewhere, S)                                                                              \
  KSL_SHARED_OF_SCALAR(elsewhere, native_pack<S>)                                                                      \
  elsewhere template void load_rows(const S *, std::ptrdiff_t, int, int, native_pack<S> *);                            \
  elsewhere template void store_next_of<S, native_lanes<S>>(std::size_t, next_columns<native_pack<S>> &,               \
                                                            std::ptrdiff_t, int, S *, std::ptrdiff_t);
#endif
#define KSL_SHARED_STEPS(elsewhere)                                                                                    \
  KSL_SHARED_OF_SCALAR(elsewhere, double)                                                                              \
  KSL_SHARED_OF_SCALAR(elsewhere, float)                                                                               \
  KSL_SHARED_OF_LANES(elsewhere, double)                                                                               \
  KSL_SHARED_OF_LANES(elsewhere, float)

#if defined(KSL_SHARES_STEPS) && !defined(KSL_COMPILES_SHARED_STEPS)
namespace ksl {
inline namespace KSL_ISA {
KSL_SHARED_STEPS(extern)
} // namespace KSL_ISA
} // namespace ksl
#endif
