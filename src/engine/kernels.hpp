// The entry points of one instruction set's kernels.  Each object compiled from kernels.cpp exports one such table and
// nothing else (test/contract/symbols_test.py).
#pragma once

#include "ksl/engine/batch_view.hpp"

namespace ksl {

/// An algorithm over a batch.  Without memory it computes nothing and returns the bytes of workspace that it needs,
/// aligned to 64.
template <class S>
using batch_kernel = std::size_t (*)(const model_view<S> &, const batch_view<S> &, void *memory);

/// The same with reactions (n of them).
template <class S>
using batch_kernel_with_reactions = std::size_t (*)(const model_view<S> &, const batch_view<S> &, int n,
                                                    const reaction_rows<S> *, void *memory);

/// Of n links.
template <class S>
using batch_kernel_of_links = std::size_t (*)(const model_view<S> &, const batch_view<S> &, int n, const int *links,
                                              void *memory);

/// With two results, a number each for a state.
template <class S>
using batch_kernel_of_energies = std::size_t (*)(const model_view<S> &, const batch_view<S> &, const rows_view<S> &kinetic,
                                                 const rows_view<S> &potential, void *memory);

/// States are taken `lanes` at a time.
template <class S> struct batch_kernels {
  int lanes;
  batch_kernel_with_reactions<S> inverse_dynamics;
  batch_kernel<S> forward_dynamics, mass_matrix, external_power;
  batch_kernel_of_links<S> frame_poses;
  batch_kernel_of_energies<S> energy;
};

struct kernel_table {
  void (*inverse_dynamics)(const model_view<double> &, void *workspace, const double *q, const double *v,
                           const double *a, const external_wrenches<double> &, double *tau);
  void (*reactions)(const model_view<double> &, void *workspace, const external_wrenches<double> &,
                    const reaction_request &, double *out);
  void (*inverse_dynamics_with_reactions)(const model_view<double> &, void *workspace, const double *q,
                                          const double *v, const double *a, const external_wrenches<double> &, double *tau,
                                          const reaction_request &, double *out);
  void (*frame_poses)(const model_view<double> &, void *workspace, const double *q, int n, const int *links, double *out);
  void (*mass_matrix)(const model_view<double> &, void *workspace, const double *q, double *M);
  void (*forward_dynamics)(const model_view<double> &, void *workspace, const double *q, const double *v,
                           const double *tau, const external_wrenches<double> &, double *a);
  void (*energy)(const model_view<double> &, void *workspace, const double *q, const double *v,
                 double *kinetic, double *potential);
  void (*external_power)(const model_view<double> &, void *workspace, const double *q, const double *v,
                         const external_wrenches<double> &, double *power);
  bool (*finite)(const double *, std::size_t n); ///< are all n numbers?
  bool (*finite_single)(const float *, std::size_t n);
  batch_kernels<double> one_double, lanes_double;
  batch_kernels<float> one_float, lanes_float;
};

/// The table in force; chosen at the first call.  Throws std::runtime_error for an unusable KSL_ISA.
const kernel_table &kernels();

} // namespace ksl
