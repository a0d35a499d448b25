// KSL: what external wrenches that are held in the world's axes add to derivatives by q.
//
// The derivatives of wrench_derivatives.hpp hold wrenches in their links' axes: they turn with the links.  A wrench (f, τ) about its
// link's origin that is held in the world doesn't turn.  So, with a coordinate k that carries the link, what those derivatives assume
// is too much by (ω_k × f, ω_k × τ), where ω_k is the angular half of S_k.  The efforts −Jᵀ (f, τ) that balance the wrench then
// change in addition by
//
//     S_j · (ω_k × f, ω_k × τ),      S_j about the link's origin, j and k carrying the link.                       (1)
#pragma once

#include "ksl/engine/algorithms/derivatives/coordinate_motions.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/twist_columns.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// A wrench f about its link's origin, and the position of this origin from the common point; both in common axes.
template <class T> struct held_wrench {
  vec3<T> point;
  coscrew<T> f;
};

/// External wrench e, given in the world's axes.
template <class T>
inline held_wrench<T> held_in_common_axes(const model_view<scalar_of<T>> &model,
                                          const coordinate_motions_workspace<T> &w,
                                          const external_wrenches<T> &external, int e) {
  const T *x = external.wrench + 6 * e;
  const int link = external.link[e];
  const SE3<T> tree = tree_pose(model, w, tree_of(model, model.link[link].body));
  held_wrench<T> held = {link_in_tree(model, w, link).t, {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}}};
  algebra<T>::product_CoAdrinvc(&tree.R, &held.f, &held.f);
  return held;
}

/// The unit twist S about another point than the common one.
template <class T> KSL_LANES screw<T> about(screw<T> S, const vec3<T> &point) {
  vec3<T> turning;
  algebra<T>::cross_vv(&S.ang, &point, &turning);
  algebra<T>::xpy_vv(&turning, &S.lin);
  return S;
}

/// out[k] += g · ω_k for the coordinates [first, end).
template <class T>
KSL_LANES void add_along_turns(const coordinate_motions_workspace<T> &w, const vec3<T> &g, int first, int end, T *out) {
  for_columns<T>(first, end, [&]<class P>(columns_at<P> k) KSL_INLINED {
    const vec3<P> turn = w.coordinate.template part<vec3, P, 3>(k.c);
    const P change = P(g.x) * turn.x + P(g.y) * turn.y + P(g.z) * turn.z;
    if constexpr (is_number<T>)
      store_first<T>(load_first(out + k.c, k.end - k.c) + change, out + k.c, k.end - k.c);
    else
      out[k.c] = out[k.c] + change;
  });
}

/// Adds (1) to the derivative (nv, nv) of joint efforts by q.  It is g_j · ω_k, g_j = f × lin_j + τ × ang_j for S_j = (lin_j, ang_j).
template <class T>
void add_turning_of_external(const model_view<scalar_of<T>> &model, const coordinate_motions_workspace<T> &w,
                             const external_wrenches<T> &external, T *dtau_dq) {
  using A = algebra<T>;
  for (int e = 0; e < external.n; ++e) {
    const int i = model.link[external.link[e]].body;
    if (i == 0)
      continue;
    const held_wrench<T> held = held_in_common_axes(model, w, external, e);
    for_carriers(model, i, [&](int rows, int rows_end) {
      for (int j = rows; j < rows_end; ++j) {
        const screw<T> S = about(w.coordinate.template part<screw, T>(j), held.point);
        vec3<T> g, moment;
        A::cross_vv(&held.f.lin, &S.lin, &g);
        A::cross_vv(&held.f.ang, &S.ang, &moment);
        A::xpy_vv(&moment, &g);
        for_carriers(model, i, [&](int first, int end) {
          add_along_turns(w, g, first, end, dtau_dq + std::ptrdiff_t(j) * model.nv);
        });
      }
    });
  }
}

/// A column of the Jacobian of a link's origin, in axes that don't turn, and the body of its joint.
template <class T> struct jacobian_column {
  screw<T> S;
  int joint;
};

/// Both halves of S turned: (turn × S.lin, turn × S.ang).
template <class T> inline screw<T> turned(const vec3<T> &turn, const screw<T> &S) {
  screw<T> out;
  algebra<T>::cross_vv(&turn, &S.lin, &out.lin);
  algebra<T>::cross_vv(&turn, &S.ang, &out.ang);
  return out;
}

/// The derivative of column c by the coordinate of column `by`.  If that coordinate carries the joint of c, or is of the same joint, it
/// turns the column.  Otherwise it moves the link's origin, about which the column is.
template <class T> inline screw<T> column_by(const jacobian_column<T> &c, const jacobian_column<T> &by) {
  if (by.joint <= c.joint)
    return turned(by.S.ang, c.S);
  const T o = T(0);
  return turned(c.S.ang, screw<T>{by.S.lin, {o, o, o}});
}

/// The derivative of column_by(j, k) by the coordinate of column m.
template <class T>
inline screw<T> column_by(const jacobian_column<T> &j, const jacobian_column<T> &k, const jacobian_column<T> &m) {
  const screw<T> dj = column_by(j, m), dk = column_by(k, m);
  const T o = T(0);
  screw<T> one, other;
  if (k.joint <= j.joint)
    one = turned(dk.ang, j.S), other = turned(k.S.ang, dj);
  else
    one = turned(dj.ang, screw<T>{k.S.lin, {o, o, o}}), other = turned(j.S.ang, screw<T>{dk.lin, {o, o, o}});
  algebra<T>::xpy_ss(&other, &one);
  return one;
}

/// Adds −∂²(Jᵀ f) / ∂q_k ∂q_m of the wrenches f, which are held in the world, to the second derivatives (nv, nv, nv) of joint efforts.
/// O(depth³) for each wrench.
template <class T>
void add_second_derivatives_of_held(const model_view<scalar_of<T>> &model, const coordinate_motions_workspace<T> &w,
                                    const external_wrenches<T> &external, T *d2tau_dqdq) {
  const std::ptrdiff_t n = model.nv;
  for (int e = 0; e < external.n; ++e) {
    const int i = model.link[external.link[e]].body;
    const held_wrench<T> held = held_in_common_axes(model, w, external, e);
    const auto for_columns_of_link = [&](auto step) {
      for (int b = i; b > 0; b = model.body[b].parent)
        for (int k = model.body[b].v_index; k < model.body[b].v_index + model.body[b].nv; ++k)
          step(k, jacobian_column<T>{about(w.coordinate.template part<screw, T>(k), held.point), b});
    };
    for_columns_of_link([&](int j, const jacobian_column<T> &of_j) {
      for_columns_of_link([&](int k, const jacobian_column<T> &of_k) {
        for_columns_of_link([&](int m, const jacobian_column<T> &of_m) {
          const screw<T> change = column_by(of_j, of_k, of_m);
          T &x = d2tau_dqdq[(j * n + k) * n + m];
          x = x - algebra<T>::dot_cs(&held.f, &change);
        });
      });
    });
  }
}

} // namespace KSL_ISA
} // namespace ksl
