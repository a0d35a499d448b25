// Functions that several kernels of closed mechanisms call, declared, as in compiled_once.hpp.  Other kernels don't read their headers.
#pragma once

#include "engine/kernels/compiled_once/compiled_once.hpp"
#include "ksl/engine/algorithms/loops/closed_derivatives.hpp"

#define KSL_CLOSED_DYNAMICS(word, T)                                                                                   \
  word void closed_inverse_dynamics<T>(KSL_MODEL(T), const closed_inverse_dynamics_workspace<T> &, const T *,          \
                                       const T *, const T *, const external_wrenches<T> &, T *);

// In double precision alone, as the derivatives.
#define KSL_CLOSED_VARIATIONS(word, T)                                                                                 \
  word void vary_closed<T>(KSL_MODEL(T), const closed_derivatives_workspace<T> &, const T *, const T *, bool);

#ifdef KSL_BATCHES_BY_STATE
#define KSL_FOR_DOUBLES(list, word) list(word, double)
#else
#define KSL_FOR_DOUBLES(list, word) list(word, double) list(word, batch_pack<double>)
#endif

namespace ksl {
inline namespace KSL_ISA {

#ifdef KSL_COMPILED_ONCE
KSL_FOR_SCALARS(KSL_CLOSED_DYNAMICS, extern template)
KSL_FOR_DOUBLES(KSL_CLOSED_VARIATIONS, extern template)
#endif

} // namespace KSL_ISA
} // namespace ksl
