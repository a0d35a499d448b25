// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), table 6.2: inertias of all that hangs on each joint are summed from the tips on, in the joints'
// own axes.  Of their momentum at unit velocity of a joint, seen in the axes of the base and about the joint's origin, every
// ancestor's joint takes its share.
#pragma once

#include "ksl/engine/base_axes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

using index = std::ptrdiff_t; ///< of elements: as wide as addresses, so that none is widened

/// The momentum of what hangs on a joint at unit velocity of one of its coordinates, about the joint's origin, and where
/// that is, in the frame of the base.
template <class T> struct unit_momentum {
  coscrew<T> momentum;
  vec3<T> origin;
};

/// Coordinate c of a joint in its body's axes: 0 … 2 along them, 3 … 5 about them.
template <class T> KSL_LANES coscrew<T> momentum_of(int c, const spatial_inertia<T> &I) {
  const T o = T(0);
  const vec3<T> &h = I.h;
  switch (c) {
  case 0: return {{I.m, o, o}, {o, h.z, -h.y}};
  case 1: return {{o, I.m, o}, {-h.z, o, h.x}};
  case 2: return {{o, o, I.m}, {h.y, -h.x, o}};
  case 3: return {{o, -h.z, h.y}, {I.Ixx, I.Ixy, I.Izx}};
  case 4: return {{h.z, o, -h.x}, {I.Ixy, I.Iyy, I.Iyz}};
  default: return {{-h.y, h.x, o}, {I.Izx, I.Iyz, I.Izz}};
  }
}

/// M[row][column] of the upper triangle; for plain numbers of the lower one, too.
template <class T> KSL_LANES void put_element(const T &x, index nv, index row, index column, T *M) {
  M[row * nv + column] = x;
  if constexpr (plain<T>)
    M[column * nv + row] = x;
}

/// Zeros in a row of M from a column to another, where joints don't share a way to the ground; of packs they are there.
template <class T> KSL_LANES void clear(index nv, index row, index from, index end, T *M) {
  if constexpr (plain<T>)
    for (index k = from; k < end; k += native_lanes<T>)
      store_first<T>(native_pack<T>(T(0)), M + row * nv + k, static_cast<int>(end - k));
}

/// The moment of a momentum about another point.
template <class T> KSL_LANES vec3<T> moment_about(const vec3<T> &point, const unit_momentum<T> &u) {
  using A = algebra<T>;
  vec3<T> arm, moment;
  A::subtract_vv(&u.origin, &point, &arm);
  A::cross_vv(&arm, &u.momentum.lin, &moment);
  A::xpy_vv(&u.momentum.ang, &moment);
  return moment;
}

/// What a joint that turns feels of a momentum.
template <class T> KSL_LANES T share_of_turn(const joint_axis<T> &axis, const unit_momentum<T> &u) {
  const vec3<T> moment = moment_about(axis.origin, u);
  return algebra<T>::dot_vv(&axis.z, &moment);
}

/// What joint j, which is free, feels of a momentum: along and about its body's axes.
template <class T>
KSL_LANES void put_shares_of_free(const body<scalar_of<T>> &b, const data_view<T> &data, index j, const unit_momentum<T> &u,
                                  index nv, index column, T *M) {
  using A = algebra<T>;
  vec3<T> p = u.momentum.lin, n = moment_about(data.axis[j].origin, u);
  if (!is_base(b)) {
    const mat3x3<T> R = body_at<T>(static_cast<int>(j)).template get<mat3x3>(data.rotation);
    A::product_drinvv(&R, &p, &p);
    A::product_drinvv(&R, &n, &n);
  }
  const T shares[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
  for (int c = 0; c < 6; ++c)
    put_element(shares[c], nv, b.v_index + c, column, M);
}

/// What the joints that carry joint i feel of a momentum about its origin and in its axes: column `column` of M, and the row
/// left of the joint's own elements.
template <class T>
KSL_LANES void put_shares(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, coscrew<T> momentum,
                          index column, T *M) {
  const index nv = model.nv;
  const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
  algebra<T>::product_CoAdrc(&R, &momentum, &momentum);
  const unit_momentum<T> u = {momentum, data.axis[i].origin};
  index written = model.body[i].v_index; // from there on the row is
  for (index j = model.body[i].parent; j > 0;) {
    const body<scalar_of<T>> &b = model.body[j];
    clear(nv, column, b.v_index + row_of(b.kind).nv, written, M);
    if (turns(b.kind)) { // rows are neighbours down to the first of the chain
      for (index k = j, row = b.v_index; k >= b.chain; --k, --row)
        put_element(share_of_turn(data.axis[k], u), nv, row, column, M);
    } else if (b.kind == joint_kind::prismatic) {
      put_element(algebra<T>::dot_vv(&data.axis[j].z, &u.momentum.lin), nv, b.v_index, column, M);
    } else {
      put_shares_of_free(b, data, j, u, nv, column, M);
    }
    written = model.body[b.chain].v_index;
    j = model.body[b.chain].parent;
  }
  clear(nv, column, 0, written, M);
}

/// The inertia of body i and all that hangs on it; what hangs on it has been summed up.
template <class T>
KSL_LANES spatial_inertia<T> composite_inertia(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i) {
  const body<scalar_of<T>> &b = model.body[i];
  spatial_inertia<T> I = spread<T>(b.inertia);
  if (has_children(b)) {
    const auto children = body_at<T>(i).template get<spatial_inertia>(data.inertia);
    algebra<T>::spatial_inertia_added(&I, &children, &I);
  }
  return I;
}

/// Adds the inertia of body i and all that hangs on it to what hangs on its parent; bodies come from the last to the first.
template <joint_kind K, class T>
KSL_LANES void add_to_parent(spatial_inertia<T> I, const model_view<scalar_of<T>> &model, const data_view<T> &data, int i) {
  using A = algebra<T>;
  const body<scalar_of<T>> &b = model.body[i];
  if (b.parent == 0)
    return;
  const auto D = pose_in_parent<K, T>::kept(b, data, i);
  D.to_parent(I);
  A::spatial_inertia_translated(&I, &D.t, &I);
  if (b.v_end != model.body[b.parent].v_end) { // others on the same parent came before
    const auto others = body_at<T>(b.parent).template get<spatial_inertia>(data.inertia);
    A::spatial_inertia_added(&I, &others, &I);
  }
  body_at<T>(b.parent).put(I, data.inertia);
}

/// Columns of joint i, and the inertia of all that hangs on it to its parent.
template <joint_kind K, class T>
KSL_LANES void put_columns(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, T *M) {
  const body<scalar_of<T>> &b = model.body[i];
  const index nv = model.nv, first = b.v_index;
  const spatial_inertia<T> I = composite_inertia(model, data, i);
  if constexpr (K == joint_kind::floating) {
    for (int c = 0; c < 6; ++c) {
      const coscrew<T> p = momentum_of(c, I);
      const T own[6] = {p.lin.x, p.lin.y, p.lin.z, p.ang.x, p.ang.y, p.ang.z};
      for (int k = 0; k <= c; ++k)
        put_element(own[k] + T(0), nv, first + k, first + c, M); // no −0
      if (!is_base(b))
        put_shares(model, data, i, p, first + c, M);
      else
        clear(nv, first + c, 0, first, M);
      clear(nv, first + c, b.v_end, nv, M);
    }
    add_to_parent<K>(I, model, data, i);
  } else { // the inertia first: then its registers are free
    const coscrew<T> p = momentum_of(K == joint_kind::prismatic ? 2 : 5, I);
    put_element(K == joint_kind::prismatic ? p.lin.z : p.ang.z, nv, first, first, M);
    add_to_parent<K>(I, model, data, i);
    put_shares(model, data, i, p, first, M);
    clear(nv, first, b.v_end, nv, M);
  }
}

/// M (nv, nv), row-major, for q (nq); of scalars other than plain numbers the upper triangle only, and not what is zero by
/// the shape of the tree.
template <class T>
void elements_of_mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  using A = algebra<T>;
  data.axis[0].origin = {T(0), T(0), T(0)};
  const auto locate = [&](int i, const vec3<T> &offset) KSL_INLINED {
    data.axis[i].z = axis_of(data, i);
    A::add_vv(&data.axis[model.body[i].parent].origin, &offset, &data.axis[i].origin);
  };
  express_in_base(model, data, q, locate, [](auto) KSL_INLINED {});
  for (int i = model.bodies - 1; i > 0; --i)
    by_kind(model.body[i].kind, [&]<joint_kind K>() KSL_INLINED { put_columns<K>(model, data, i, M); });
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies²).
template <class T> void mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  const int nv = model.nv;
  for (int k = 0; k < nv * nv && !plain<T>; ++k)
    M[k] = T(0);
  elements_of_mass_matrix(model, data, q, M);
  for (int i = 0; i < nv && !plain<T>; ++i)
    for (int k = 0; k < i; ++k)
      M[i * nv + k] = M[k * nv + i];
}

} // namespace KSL_ISA
} // namespace ksl
