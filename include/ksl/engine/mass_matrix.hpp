// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), section 6.2, with all bodies in the axes of the base and each about its own origin: an inertia
// is shifted to its parent, not turned, and an element of the matrix is the power of a momentum along a unit twist.
#pragma once

#include "ksl/engine/base_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

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

/// The momentum (data.momentum) of all that hangs on joint i, at unit velocity of each of its coordinates.
template <class T>
KSL_LANES void unit_momenta(const body<scalar_of<T>> &b, const data_view<T> &data, int i, const spatial_inertia<T> &I) {
  if (b.kind != joint_kind::floating) {
    data.momentum[b.v_index] = momentum_along(b.kind, axis_of(data, i), I);
    return;
  }
  const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
  const vec3<T> axis[3] = {{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}};
  for (int c = 0; c < 3; ++c) {
    data.momentum[b.v_index + c] = momentum_along(joint_kind::prismatic, axis[c], I);
    data.momentum[b.v_index + 3 + c] = momentum_along(joint_kind::revolute, axis[c], I);
  }
}

/// Inertias of each body and all that hangs on it (data.inertia), what they are at unit velocities (data.momentum), and
/// where the bodies are (data.origin), in the frame of the base.
template <class T>
void composite_momenta(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q) {
  using A = algebra<T>;
  data.origin[0] = {T(0), T(0), T(0)};
  const auto locate = [&](int i) { A::add_vv(&data.origin[model.body[i].parent], &data.offset[i], &data.origin[i]); };
  express_in_base(model, data, q, locate, [&](auto k) {
    k.put(turned(k.inertia(model), k.template get<mat3x3>(data.rotation)), data.inertia);
  });
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    auto I = body_at<T>(i).template get<spatial_inertia>(data.inertia);
    unit_momenta(b, data, i, I);
    if (b.parent == 0)
      continue;
    auto sum = body_at<T>(b.parent).template get<spatial_inertia>(data.inertia);
    A::spatial_inertia_translated(&I, &data.offset[i], &I);
    A::spatial_inertia_added(&sum, &I, &sum);
    body_at<T>(b.parent).put(sum, data.inertia);
  }
}

/// Sᵀ p for a coordinate that slides along or turns about an axis through `origin`, and a momentum about the point o.  The
/// added zero turns −0 into 0, as the sum of both does.
template <class T> KSL_LANES T sliding(const vec3<T> &axis, const coscrew<T> &p) { return algebra<T>::dot_vv(&axis, &p.lin) + T(0); }
template <class T>
KSL_LANES T turning(const vec3<T> &axis, const vec3<T> &origin, const coscrew<T> &p, const vec3<T> &o) {
  using A = algebra<T>;
  vec3<T> arm, moment;
  A::subtract_vv(&o, &origin, &arm);
  A::cross_vv(&arm, &p.lin, &moment);
  A::xpy_vv(&p.ang, &moment);
  return A::dot_vv(&axis, &moment) + T(0);
}

/// Elements of row i of the mass matrix, up to the diagonal, for the joints on the way from body j to the base.  Others stay
/// as they are.
template <class T>
KSL_LANES void lower_row(const model_view<scalar_of<T>> &model, const data_view<T> &data, int j, int i, T *row) {
  const coscrew<T> p = data.momentum[i];
  const vec3<T> o = data.origin[j];
  for (; j > 0; j = model.body[j].parent) {
    const body<scalar_of<T>> &b = model.body[j];
    if (b.kind == joint_kind::prismatic)
      row[b.v_index] = sliding(axis_of(data, j), p);
    else if (b.kind != joint_kind::floating)
      row[b.v_index] = turning(axis_of(data, j), data.origin[j], p, o);
    else {
      const mat3x3<T> R = body_at<T>(j).template get<mat3x3>(data.rotation);
      const vec3<T> axis[3] = {{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}};
      for (int c = 0; c < 3; ++c) {
        row[b.v_index + c] = sliding(axis[c], p);
        row[b.v_index + 3 + c] = turning(axis[c], data.origin[j], p, o);
      }
    }
  }
}

/// The same for plain numbers, with elements in lanes: all of them, then zeros where the other joint is on another branch,
/// its subtree having ended before.  Writes whole registers while `room` numbers are left.
template <class S>
KSL_LANES void lower_row_in_lanes(const model_view<S> &model, const data_view<S> &data, int j, int i, S *row, int room) {
  using P = native_pack<S>;
  constexpr int lanes = native_lanes<S>;
  const coscrew<P> p = spread<P>(data.momentum[i]);
  const vec3<P> o = spread<P>(data.origin[j]);
  for (int k = 0; k <= i; k += lanes) {
    const bodies_at<P, S> some{k};
    const auto c = some.template get<coordinate>(data.coordinate);
    const P element = sliding(c.lin, p) + turning(c.ang, c.origin, p, o);
    const P kept = math<P>::select(some.get_number(model.v_end) > P(static_cast<S>(i)), element, P(0));
    store_first(kept, row + k, room - k);
  }
}

/// Coordinates of all joints (data.coordinate).
template <class T> void lay_out_coordinates(const model_view<scalar_of<T>> &model, const data_view<T> &data) {
  const vec3<T> none = {T(0), T(0), T(0)};
  for (int j = 1; j < model.bodies; ++j) {
    const body<scalar_of<T>> &b = model.body[j];
    const vec3<T> o = data.origin[j];
    const auto slide = [&](int k, const vec3<T> &axis) { body_at<T>(k).put(coordinate<T>{axis, none, o}, data.coordinate); };
    const auto turn = [&](int k, const vec3<T> &axis) { body_at<T>(k).put(coordinate<T>{none, axis, o}, data.coordinate); };
    if (b.kind == joint_kind::prismatic)
      slide(b.v_index, axis_of(data, j));
    else if (b.kind != joint_kind::floating)
      turn(b.v_index, axis_of(data, j));
    else {
      const mat3x3<T> R = body_at<T>(j).template get<mat3x3>(data.rotation);
      const vec3<T> axis[3] = {{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}};
      for (int c = 0; c < 3; ++c)
        slide(b.v_index + c, axis[c]), turn(b.v_index + 3 + c, axis[c]);
    }
  }
}

/// The lower triangle of M (nv, nv), row-major, for q (nq): what is no zero by the shape of the tree.  Above the diagonal,
/// within a floating joint, elements are written too.
template <class T> void lower_mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  composite_momenta(model, data, q);
  for (int j = 1; j < model.bodies; ++j)
    for (int i = model.body[j].v_index; i < model.body[j].v_index + row_of(model.body[j].kind).nv; ++i)
      lower_row(model, data, j, i, M + i * model.nv);
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies²).
template <class T> void mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  const int nv = model.nv;
  if constexpr (plain<T>) {
    composite_momenta(model, data, q);
    lay_out_coordinates(model, data);
  } else {
    for (int k = 0; k < nv * nv; ++k)
      M[k] = T(0);
    lower_mass_matrix(model, data, q, M);
  }
  for (int j = 1; j < model.bodies; ++j) {
    const body<scalar_of<T>> &b = model.body[j];
    for (int i = b.v_index; i < b.v_index + row_of(b.kind).nv; ++i) {
      if constexpr (plain<T>)
        lower_row_in_lanes(model, data, j, i, M + i * nv, (nv - i) * nv); // what it writes too far is overwritten
      for (int k = 0; k < i; ++k)
        M[k * nv + i] = M[i * nv + k];
    }
  }
}

} // namespace KSL_ISA
} // namespace ksl
