// KSL: the mass matrix, by the composite-rigid-body algorithm.
//
// Featherstone, RBDA (2008), section 6.2, with all bodies in the axes of the base and each about its own origin: an inertia
// is shifted to its parent, not turned, and an element of the matrix is the power of a momentum along a unit twist.  What
// hangs on a joint has consecutive coordinates, so that elements of a row can lie in lanes.
#pragma once

#include "ksl/engine/base_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Number c of the unit momentum of coordinate k lies at [c × between_numbers + k × between_momenta]: for plain numbers those
/// of neighbours side by side, with room for a register that begins at the last.
template <class T> constexpr int between_numbers(int nv) { return plain<T> ? padded(nv + padded(1)) : 1; }
template <class T> inline constexpr int between_momenta = plain<T> ? 1 : numbers_in<unit_momentum<T>, T>;
template <class T> constexpr int room_for_momenta(int nv) {
  return numbers_in<unit_momentum<T>, T> * (plain<T> ? between_numbers<T>(nv) : nv);
}

/// Unit momenta from coordinate k on, as many as P has lanes.
template <class P, class T> KSL_LANES unit_momentum<P> momenta_at(const data_view<T> &data, int nv, int k) {
  unit_momentum<P> u;
  P *const numbers = reinterpret_cast<P *>(&u);
  for (int c = 0; c < numbers_in<unit_momentum<P>, P>; ++c)
    body_lanes::read(data.unit_momentum + c * between_numbers<T>(nv) + k * between_momenta<T>, numbers[c]);
  return u;
}

/// Of all that hangs on a joint with one coordinate, at unit velocity, about the joint's origin.
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

/// The unit momentum of coordinate k of joint i; I: of all that hangs on the joint.
template <class T>
KSL_LANES void put_momentum(const data_view<T> &data, int nv, int i, int k, joint_kind kind, const vec3<T> &axis,
                            const spatial_inertia<T> &I) {
  const coscrew<T> p = momentum_along(kind, axis, I);
  const vec3<T> o = data.origin[i];
  T *const to = data.unit_momentum + k * between_momenta<T>;
  const int step = between_numbers<T>(nv);
  to[0] = p.lin.x, to[step] = p.lin.y, to[2 * step] = p.lin.z;
  to[3 * step] = p.ang.x, to[4 * step] = p.ang.y, to[5 * step] = p.ang.z;
  to[6 * step] = o.x, to[7 * step] = o.y, to[8 * step] = o.z;
}

/// The axes of a body in those of the base, one by one.
template <class T> struct three_axes { vec3<T> axis[3]; };
template <class T> KSL_LANES three_axes<T> axes_of(const data_view<T> &data, int i) {
  const mat3x3<T> R = body_at<T>(i).template get<mat3x3>(data.rotation);
  return {{{R.m00, R.m10, R.m20}, {R.m01, R.m11, R.m21}, {R.m02, R.m12, R.m22}}};
}

/// The unit momenta of joint i.
template <class T>
KSL_LANES void put_momenta(const model_view<scalar_of<T>> &model, const data_view<T> &data, int i, const spatial_inertia<T> &I) {
  const body<scalar_of<T>> &b = model.body[i];
  if (b.kind != joint_kind::floating)
    return put_momentum(data, model.nv, i, b.v_index, b.kind, axis_of(data, i), I);
  const three_axes<T> axes = axes_of(data, i);
  for (int c = 0; c < 6; ++c)
    put_momentum(data, model.nv, i, b.v_index + c, c < 3 ? joint_kind::prismatic : joint_kind::revolute, axes.axis[c % 3], I);
}

/// Unit momenta of all coordinates, from the inertias of each body and all that hangs on it (data.inertia), and where the
/// bodies are (data.origin) in the frame of the base.
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
    put_momenta(model, data, i, I);
    if (b.parent == 0)
      continue;
    auto sum = body_at<T>(b.parent).template get<spatial_inertia>(data.inertia);
    A::spatial_inertia_translated(&I, &data.offset[i], &I);
    A::spatial_inertia_added(&sum, &I, &sum);
    body_at<T>(b.parent).put(sum, data.inertia);
  }
}

/// Elements of a row of M from the k-th on, as many as P has lanes; zeros from `end` on.  The added zero turns −0 into 0.
template <class T, class P> KSL_LANES void put_elements(const P &x, int nv, int row, int k, int end, T *M) {
  if constexpr (!plain<T>) {
    M[row * nv + k] = x + P(0);
  } else {
    P index;
    for (int lane = 0; lane < native_lanes<T>; ++lane)
      index.set(lane, static_cast<T>(lane));
    const P kept = math<P>::select(index < P(static_cast<T>(end - k)), x, P(0)) + P(0);
    store_first<T>(kept, M + row * nv + k, nv - k);
  }
}

/// fill(k, unit momenta) for coordinates in [first, end).
template <class T, class Fill> KSL_LANES void for_momenta(const data_view<T> &data, int nv, int first, int end, Fill fill) {
  if constexpr (plain<T>) {
    for (int k = first; k < end; k += native_lanes<T>)
      fill(k, momenta_at<native_pack<T>>(data, nv, k));
  } else {
    for (int k = first; k < end; ++k)
      fill(k, momenta_at<T>(data, nv, k));
  }
}

/// The moment of a momentum about another point.
template <class P> KSL_LANES vec3<P> moment_about(const vec3<P> &point, const unit_momentum<P> &u) {
  using A = algebra<P>;
  vec3<P> arm, moment;
  A::subtract_vv(&u.origin, &point, &arm);
  A::cross_vv(&arm, &u.momentum.lin, &moment);
  A::xpy_vv(&u.momentum.ang, &moment);
  return moment;
}

/// Rows of a base that floats: momenta about its origin, along its axes.
template <class T> KSL_LANES void base_rows(const model_view<scalar_of<T>> &model, const data_view<T> &data, int row, int end, T *M) {
  const int nv = model.nv;
  for_momenta(data, nv, row, end, [&]<class P>(int k, const unit_momentum<P> &u) {
    const vec3<P> p = u.momentum.lin, n = moment_about(vec3<P>{P(0), P(0), P(0)}, u);
    const P rows[6] = {p.x, p.y, p.z, n.x, n.y, n.z};
    for (int c = 0; c < 6; ++c)
      put_elements(rows[c], nv, row + c, k, end, M);
  });
}

/// Rows of joint j in the upper triangle: Sᵀ p for all that hangs on it.
template <class T>
KSL_LANES void upper_rows(const model_view<scalar_of<T>> &model, const data_view<T> &data, int j, T *M) {
  const body<scalar_of<T>> &b = model.body[j];
  const int nv = model.nv, end = b.v_end;
  const vec3<T> origin = data.origin[j];
  const auto slide = [&](int row, const vec3<T> &axis) {
    for_momenta(data, nv, row, end, [&]<class P>(int k, const unit_momentum<P> &u) {
      const vec3<P> z = spread<P>(axis);
      put_elements(algebra<P>::dot_vv(&z, &u.momentum.lin), nv, row, k, end, M);
    });
  };
  const auto turn = [&](int row, const vec3<T> &axis) {
    for_momenta(data, nv, row, end, [&]<class P>(int k, const unit_momentum<P> &u) {
      const vec3<P> z = spread<P>(axis), moment = moment_about(spread<P>(origin), u);
      put_elements(algebra<P>::dot_vv(&z, &moment), nv, row, k, end, M);
    });
  };
  if (b.kind == joint_kind::prismatic)
    return slide(b.v_index, axis_of(data, j));
  if (b.kind != joint_kind::floating)
    return turn(b.v_index, axis_of(data, j));
  if (is_base(b))
    return base_rows(model, data, b.v_index, end, M);
  const three_axes<T> axes = axes_of(data, j);
  for (int c = 0; c < 3; ++c)
    slide(b.v_index + c, axes.axis[c]), turn(b.v_index + 3 + c, axes.axis[c]);
}

/// The upper triangle of M (nv, nv), row-major, for q (nq), but for what is zero by the shape of the tree.
template <class T> void upper_mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  composite_momenta(model, data, q);
  for (int j = 1; j < model.bodies; ++j)
    upper_rows(model, data, j, M);
}

/// Copies the upper triangle to the lower one, a few rows at a time, so that columns of large matrices stay in cache.
template <class T> void mirror(int n, T *M) {
  constexpr int rows = 8;
  for (int first = 0; first < n; first += rows)
    for (int i = first + 1; i < n; ++i)
      for (int k = first; k < i && k < first + rows; ++k)
        M[i * n + k] = M[k * n + i];
}

/// M (nv, nv), row-major and symmetric, for q (nq): tau = M a + bias.  O(bodies²).
template <class T> void mass_matrix(const model_view<scalar_of<T>> &model, const data_view<T> &data, const T *q, T *M) {
  const int nv = model.nv;
  composite_momenta(model, data, q);
  for (int j = 1; j < model.bodies; ++j) {
    const body<scalar_of<T>> &b = model.body[j];
    upper_rows(model, data, j, M);
    for (int row = b.v_index; row < b.v_index + row_of(b.kind).nv; ++row) // what hangs on other joints
      for (int k = b.v_end; k < nv; k += plain<T> ? native_lanes<scalar_of<T>> : 1) {
        if constexpr (plain<T>)
          store_first<T>(native_pack<T>(T(0)), M + row * nv + k, nv - k);
        else
          M[row * nv + k] = T(0);
      }
  }
  mirror(nv, M);
}

} // namespace KSL_ISA
} // namespace ksl
