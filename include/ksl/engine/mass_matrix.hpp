// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), section 6.2, with all bodies in the axes of the base and each about its own origin: an inertia
// is shifted to its parent, not turned, and an element of the matrix is the power of a momentum along a unit twist.
#pragma once

#include "ksl/engine/base_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Inertias (data.inertia) of each body and all that hangs on it, about its origin; after express_in_base.
template <class T> void composite_inertias(const model_view<scalar_of<T>> &model, const data_view<T> &data) {
  using A = algebra<T>;
  for_bodies<T>(model.bodies, [&](auto k) {
    k.put(turned(k.inertia(model), k.template get<mat3x3>(data.rotation)), data.inertia);
  });
  for (int i = model.bodies - 1; i > 0; --i) {
    const int parent = model.body[i].parent;
    if (parent == 0)
      continue;
    auto moved = body_at<T>(i).template get<spatial_inertia>(data.inertia);
    auto sum = body_at<T>(parent).template get<spatial_inertia>(data.inertia);
    A::spatial_inertia_translated(&moved, &data.offset[i], &moved);
    A::spatial_inertia_added(&sum, &moved, &sum);
    body_at<T>(parent).put(sum, data.inertia);
  }
}

/// The momentum of all that hangs on a joint with one coordinate, at unit velocity, about the joint's origin.
template <class T> KSL_LANES coscrew<T> momentum_along(joint_kind kind, const vec3<T> &z, const spatial_inertia<T> &I) {
  using A = algebra<T>;
  coscrew<T> p;
  if (kind == joint_kind::prismatic) {
    A::product_av(I.m, &z, &p.lin);
    A::cross_vv(&I.h, &z, &p.ang);
  } else {
    mat3x3<T> J;
    A::spatial_inertia_getMatrix(&I, &J);
    A::cross_vv(&z, &I.h, &p.lin);
    A::product_drv(&J, &z, &p.ang);
  }
  return p;
}

/// Coordinates of joint i (data.coordinate), and the momentum (data.momentum) at unit velocity of each.
template <class T>
KSL_LANES void start_coordinates(const body<scalar_of<T>> &b, const data_view<T> &data, int i) {
  using A = algebra<T>;
  const T zero = T(0);
  const vec3<T> none = {zero, zero, zero}, origin = data.origin[i];
  const auto I = body_at<T>(i).template get<spatial_inertia>(data.inertia);
  if (b.kind == joint_kind::floating) {
    const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
    vec3<T> axis[3];
    A::mat3x3_toVectors(&R, axis, axis + 1, axis + 2);
    for (int c = 0; c < 6; ++c) {
      const screw<T> s = c < 3 ? screw<T>{axis[c], none} : screw<T>{none, axis[c - 3]};
      A::product_Ms(&I, &s, &data.momentum[b.v_index + c]);
      body_at<T>(b.v_index + c).put(coordinate<T>{s.lin, s.ang, origin}, data.coordinate);
    }
    return;
  }
  const vec3<T> z = axis_of(data, i);
  const bool slides = b.kind == joint_kind::prismatic;
  data.momentum[b.v_index] = momentum_along(b.kind, z, I);
  body_at<T>(b.v_index).put(coordinate<T>{slides ? z : none, slides ? none : z, origin}, data.coordinate);
}

/// Sᵀ p of a momentum about the origin o.  The added zero turns −0 into 0, whatever the sum came from.
template <class P> KSL_LANES P along(const coordinate<P> &k, const coscrew<P> &p, const vec3<P> &o) {
  using A = algebra<P>;
  vec3<P> arm, moment;
  A::subtract_vv(&o, &k.origin, &arm);
  A::cross_vv(&arm, &p.lin, &moment);
  A::xpy_vv(&p.ang, &moment);
  return (A::dot_vv(&k.lin, &p.lin) + A::dot_vv(&k.ang, &moment)) + P(0);
}

/// Row i of the mass matrix up to the diagonal, one element after another.
template <class T>
void lower_row(const model_view<scalar_of<T>> &model, const data_view<T> &data, int row_body, int i, T *row) {
  const vec3<T> origin = data.origin[row_body];
  for (int k = 0; k < i; ++k)
    row[k] = T(0);
  for (int j = row_body; j > 0; j = model.body[j].parent) { // whatever is not on the way to the base stays zero
    const body<scalar_of<T>> &b = model.body[j];
    for (int k = b.v_index; k < b.v_index + row_of(b.kind).nv && k <= i; ++k)
      row[k] = along(body_at<T>(k).template get<coordinate>(data.coordinate), data.momentum[i], origin);
  }
}

/// The same for a plain number, with elements in lanes: all of them, then zeros where the other joint is on another
/// branch, its subtree having ended before.  Writes whole registers while `room` numbers are left.
template <class S>
void lower_row_in_lanes(const model_view<S> &model, const data_view<S> &data, int row_body, int i, S *row, int room) {
  using P = native_pack<S>;
  constexpr int lanes = native_lanes<S>;
  const coscrew<P> momentum = spread<P>(data.momentum[i]);
  const vec3<P> origin = spread<P>(data.origin[row_body]);
  for (int k = 0; k <= i; k += lanes) {
    const bodies_at<P, S> some{k};
    const P element = along(some.template get<coordinate>(data.coordinate), momentum, origin);
    const P kept = math<P>::select(some.get_number(model.v_end) > P(static_cast<S>(i)), element, P(0));
    const int left = room - k;
    __builtin_memcpy(row + k, &kept, sizeof(S) * static_cast<std::size_t>(left < lanes ? left : lanes));
  }
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  Both triangles are written.  O(bodies²).
template <class T> void mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  const int nv = model.nv;
  express_in_base(model, data, q);
  composite_inertias(model, data);
  data.origin[0] = {T(0), T(0), T(0)};
  for (int j = 1; j < model.bodies; ++j) {
    const body<scalar_of<T>> &b = model.body[j];
    algebra<T>::add_vv(&data.origin[b.parent], &data.offset[j], &data.origin[j]);
    start_coordinates(b, data, j);
  }
  for (int j = 1; j < model.bodies; ++j) {
    const body<scalar_of<T>> &b = model.body[j];
    for (int i = b.v_index; i < b.v_index + row_of(b.kind).nv; ++i) {
      T *row = M + i * nv;
      if constexpr (plain<T>)
        lower_row_in_lanes(model, data, j, i, row, (nv - i) * nv); // what it writes beyond is overwritten below
      else
        lower_row(model, data, j, i, row);
      for (int k = 0; k < i; ++k)
        M[k * nv + i] = row[k];
    }
  }
}

} // namespace KSL_ISA
} // namespace ksl
