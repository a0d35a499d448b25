// KSL: the first derivatives of the centroidal momentum and of its rate.
//
// The rate (f, n) about a fixed point is the sum of the wrenches that the motion of the trees on the ground needs without gravity.  So
// it changes with a coordinate as the wrench through that coordinate's joint does (wrench_derivatives.hpp (3); the relation is that of
// Carpentier and Mansard, "Analytical derivatives of rigid body dynamics algorithms", RSS 2018, to centroidal dynamics).  About the
// centre of mass c
//
//     n_c = n − c × f,   ∂n_c = ∂n − c × ∂f − ∂c × f,   mass × ∂c/∂q_k = linear half of I S_k,                     (1)
//
// I being the inertia of the subtree of k.  By v and by a, ∂c is zero.
//
// The rate is A a + Ȧ v, A being the centroidal momentum matrix: its derivative by a is A.  At v = 0 the rate is A a.  So the
// derivatives of the momentum A v are those of the rate, for the accelerations v at rest.                            (2)
#pragma once

#include "ksl/engine/algorithms/derivatives/wrench_derivatives.hpp"
#include "ksl/engine/steps/subtree_moment.hpp"
#include "ksl/engine/steps/twist_columns.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> using centroidal_momentum_rate_derivatives_workspace = wrench_derivatives_workspace<T>;

template <class T> struct centroidal_momentum_derivatives_workspace {
  wrench_derivatives_workspace<T> wrenches;
  array_of<T> rest; ///< velocities, all zero

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    wrenches.lay_out(memory, model);
    rest.lay_out(memory, model.nv);
  }
};

/// Sums over all trees, in the world's axes; the moment of mass is about the reference point.
template <class T> struct sum_of_trees {
  vec3<T> reference; ///< the origin of body 1
  mass_moment<T> moment;
  vec3<T> force;
};

template <class T>
KSL_LANES sum_of_trees<T> sum_trees(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w) {
  using A = algebra<T>;
  const vec3<T> zero = {T(0), T(0), T(0)};
  sum_of_trees<T> sum = {zero, {T(0), zero}, zero};
  for (int i = 1; i < model.bodies; ++i) {
    if (model.body[i].parent > 0)
      continue;
    const SE3<T> tree = tree_pose(model, w, i);
    if (i == 1)
      sum.reference = tree.t;
    const subtree_dynamics<T> d = w.subtree.get(last_coordinate(model, i));
    vec3<T> h, f, origin = tree.t;
    A::product_drv(&tree.R, &d.I.h, &h);
    A::product_drv(&tree.R, &d.f.lin, &f);
    A::nxpy_vv(&sum.reference, &origin);
    A::axpy_vv(d.I.m, &origin, &h);
    sum.moment = added(sum.moment, {d.I.m, h});
    A::xpy_vv(&f, &sum.force);
  }
  return sum;
}

/// Moves the columns of one tree to the centre of mass and to the world's axes (1).  Vectors are in the tree's common axes, from its
/// common point.
template <class P> struct to_center {
  mat3x3<P> R;           ///< the tree's axes in the world
  vec3<P> center, force; ///< c, and the sum of all forces f
  P per_mass;            ///< 1 / mass of all trees

  /// (∂f, ∂n − c × ∂f) in the world's axes.
  KSL_LANES screw<P> moved(const coscrew<P> &f) const {
    using A = algebra<P>;
    screw<P> out = {f.lin, f.ang};
    vec3<P> moment;
    A::cross_vv(&center, &f.lin, &moment);
    A::nxpy_vv(&moment, &out.ang);
    A::product_drv(&R, &out.lin, &out.lin);
    A::product_drv(&R, &out.ang, &out.ang);
    return out;
  }
  /// The derivative by q, from which ∂c × f is subtracted as well; `momentum` is I S of the coordinate.
  KSL_LANES screw<P> moved(coscrew<P> f, const coscrew<P> &momentum) const {
    using A = algebra<P>;
    vec3<P> center_by = momentum.lin, moment;
    A::vec3_scale(&center_by, per_mass);
    A::cross_vv(&center_by, &force, &moment);
    A::nxpy_vv(&moment, &f.ang);
    return moved(f);
  }
};

/// Sets the columns (6, nv) of each result (1), from the derivatives of the wrenches through the joints.  by_v may be null.
template <class T> void set_centroidal_columns(const model_view<scalar_of<T>> &model,
                                               const wrench_derivatives_workspace<T> &w, component_order order, T *by_q,
                                               T *by_v, T *by_a) {
  using A = algebra<T>;
  const sum_of_trees<T> all = sum_trees(model, w);
  const vec3<T> center = point_of_momentum(all.moment);
  const T per_mass = T(1) / mass_divisor(all.moment);
  const bool first = order == component_order::angular_first;
  const twist_columns<T> of_q = {by_q, model.nv, first}, of_v = {by_v, model.nv, first}, of_a = {by_a, model.nv, first};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if (b.parent > 0)
      continue;
    const SE3<T> tree = tree_pose(model, w, i);
    to_center<T> by = {tree.R, all.reference, all.force, per_mass};
    A::xpy_vv(&center, &by.center);
    A::nxpy_vv(&tree.t, &by.center);
    A::product_drinvv(&by.R, &by.center, &by.center);
    A::product_drinvv(&by.R, &by.force, &by.force);
    for_columns<T>(b.v_index, b.v_end, [&]<class P>(columns_at<P> k) KSL_INLINED {
      const to_center<P> there = in_all_lanes<P, to_center>(by);
      const wrench_derivative<P> d = w.derivative.template get<P>(k.c);
      of_q.set(k, there.moved(d.by_q, d.by_a));
      of_a.set(k, there.moved(d.by_a));
      if (by_v)
        of_v.set(k, there.moved(d.by_v));
    });
  }
}

/// The derivatives of centroidal_momentum_rate(q, v, a), each (6, nv), row-major: by q along q ⊕ s e_k with v and a held componentwise,
/// by v, and by a, which is the centroidal momentum matrix.  O(bodies).
template <class T>
void centroidal_momentum_rate_derivatives(const model_view<scalar_of<T>> &model,
                                          const centroidal_momentum_rate_derivatives_workspace<T> &w, const T *q,
                                          const T *v, const T *a, component_order order, T *by_q, T *by_v, T *by_a) {
  const T o = T(0);
  forward_motions<T>(model, w, {o, o, o}, q, v, a, {});
  sum_subtrees(model, w);
  set_centroidal_columns(model, w, order, by_q, by_v, by_a);
}

/// The derivatives of centroidal_momentum(q, v), each (6, nv), row-major: by q along q ⊕ s e_k with v held componentwise, and by v,
/// which is the centroidal momentum matrix.  O(bodies).
template <class T>
void centroidal_momentum_derivatives(const model_view<scalar_of<T>> &model,
                                     const centroidal_momentum_derivatives_workspace<T> &w, const T *q, const T *v,
                                     component_order order, T *by_q, T *by_v) {
  const T o = T(0);
  for (int k = 0; k < model.nv; ++k)
    w.rest[k] = o;
  forward_motions<T>(model, w.wrenches, {o, o, o}, q, &w.rest[0], v, {});
  sum_subtrees(model, w.wrenches);
  set_centroidal_columns<T>(model, w.wrenches, order, by_q, nullptr, by_v);
}

} // namespace KSL_ISA
} // namespace ksl
