// KSL: one joint for the kinds that few robots have.  Which coordinates it has is data, read at run time.  Algorithms have code for it once,
// where code for each such kind would make up half of them.  It computes what the struct of the kind computes, to the bit.
#pragma once

#include "ksl/engine/model/joints/several_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// The kind of general_joint in by_kind().  No joint of a model has it.
inline constexpr joint_kind general_kind = static_cast<joint_kind>(-1);

/// One column of its motion subspace: a joint_column whose form follows from the number of its coordinate.
template <class T> struct general_column {
  vec3<T> z;
  T pitch;
  int coordinate;

  KSL_LANES T effort(const coscrew<T> &f) const {
    T found = T(0);
    by_form([&](const auto &column) KSL_INLINED { found = column.effort(f); });
    return found;
  }
  KSL_LANES screw<T> twist(const vec3<T> &r) const {
    screw<T> s = {z, z};
    by_form([&](const auto &column) KSL_INLINED { s = column.twist(r); });
    return s;
  }
  KSL_LANES void add(const T &x, screw<T> &a) const {
    by_form([&](const auto &column) KSL_INLINED { column.add(x, a); });
  }
  KSL_LANES screw<T> about(const vec3<T> &origin) const {
    screw<T> s = {z, z};
    by_form([&](const auto &column) KSL_INLINED { s = column.about(origin); });
    return s;
  }
  KSL_LANES coscrew<T> momentum(const articulated_inertia<T> &A) const {
    coscrew<T> U = {z, z};
    by_form([&](const auto &column) KSL_INLINED { U = column.momentum(A); });
    return U;
  }

private:
  template <class Step> KSL_LANES void by_form(Step step) const {
    if (coordinate == helical_coordinate)
      step(joint_column<true, true, T>{z, pitch});
    else if (coordinate >= 3)
      step(joint_column<true, false, T>{z, pitch});
    else
      step(joint_column<false, true, T>{z, pitch});
  }
};

/// A pose in the parent: an axis_pose, or a free_pose.
template <class T> struct general_pose {
  const body<scalar_of<T>> &b;
  bool has_axis;
  plane_rotation<T> theta; ///< of an axis_pose
  mat3x3<T> R;             ///< of a free_pose
  vec3<T> t;

  void set(const axis_pose<T> &D) { has_axis = true, theta = D.theta, t = D.t; }
  void set(const free_pose<T> &D) { has_axis = false, R = D.R, t = D.t; }

  template <class... V> KSL_LANES void to_body(V &...v) const {
    by_form([&](const auto &D) KSL_INLINED { D.to_body(v...); });
  }
  template <class... V> KSL_LANES void to_parent(V &...v) const {
    by_form([&](const auto &D) KSL_INLINED { D.to_parent(v...); });
  }
  KSL_LANES mat3x3<T> axes() const {
    mat3x3<T> found;
    by_form([&](const auto &D) KSL_INLINED { found = D.axes(); });
    return found;
  }
  KSL_LANES void rotate_axes(mat3x3<T> &parent) const {
    by_form([&](const auto &D) KSL_INLINED { D.rotate_axes(parent); });
  }
  KSL_LANES void rotate_axes_back(mat3x3<T> &body) const {
    by_form([&](const auto &D) KSL_INLINED { D.rotate_axes_back(body); });
  }

private:
  template <class Step> KSL_LANES void by_form(Step step) const {
    if (has_axis)
      step(axis_pose<T>{b, theta, t});
    else
      step(free_pose<T>{R, t});
  }
};

/// What differs between the kinds.
struct general_joint_row {
  int coordinate[6] = {}; ///< of each number in v (column.hpp)
  bool slides = false, turns = false, shifts_origin = false;
};

/// A row for each kind, at its value.
template <joint_kind... kinds> struct general_joint_rows {
  static constexpr int end = [] {
    int last = 0;
    ((last = static_cast<int>(kinds) > last ? static_cast<int>(kinds) : last), ...);
    return last + 1;
  }();
  general_joint_row of[end];

  constexpr general_joint_rows() { (set<kinds>(of[static_cast<int>(kinds)]), ...); }

private:
  template <joint_kind K> static constexpr void set(general_joint_row &row) {
    row.shifts_origin = joint<K>::shifts_origin;
    for (int k = 0; k < joint<K>::nv; ++k) {
      const int c = row.coordinate[k] = joint<K>::coordinate[k];
      row.slides = row.slides || c < 3 || c == helical_coordinate;
      row.turns = row.turns || c >= 3;
    }
  }
};

template <joint_kind... kinds> struct general_joint {
  static constexpr bool is_free = false;
  static constexpr int most_nv = [] { ///< no `nv`: how many a joint has is its body's to say
    int most = 0;
    ((most = joint<kinds>::nv > most ? joint<kinds>::nv : most), ...);
    return most;
  }();
  static constexpr bool includes(joint_kind kind) { return ((kind == kinds) || ...); }

  template <class Step> static KSL_LANES void by_kind(joint_kind kind, Step step) {
    ((kind == kinds ? step.template operator()<kinds>() : void()), ...);
  }

  template <class S> static KSL_LANES const general_joint_row &row(const body<S> &b) {
    return table.of[static_cast<int>(b.kind)];
  }

  template <class T> static KSL_LANES general_pose<T> computed_pose(const body<scalar_of<T>> &b,
                                                                    const pose_workspace<T> &w, const T *q) {
    general_pose<T> D = {.b = b, .has_axis = false, .theta = {}, .R = {}, .t = {}};
    compute_pose(w, q, D);
    return D;
  }
  template <class T> static KSL_LANES general_pose<T> kept_pose(const body<scalar_of<T>> &b,
                                                                const pose_workspace<T> &w) {
    general_pose<T> D = {.b = b, .has_axis = false, .theta = {}, .R = {}, .t = {}};
    reload_pose(w, D);
    return D;
  }

  template <class T> static KSL_LANES screw<T> twist(const body<scalar_of<T>> &b, const T *v) {
    const general_joint_row &r = row(b);
    T six[6] = {T(0), T(0), T(0), T(0), T(0), T(0)};
    if (r.coordinate[0] == helical_coordinate)
      six[2] = T(b.pitch) * v[0], six[5] = v[0];
    else
      spread_numbers(b, r, v, six);
    return {{six[0], six[1], six[2]}, {six[3], six[4], six[5]}};
  }
  template <class T> static KSL_LANES void effort(const body<scalar_of<T>> &b, const coscrew<T> &f, T *tau) {
    const general_joint_row &r = row(b);
    const T six[6] = {f.lin.x, f.lin.y, f.lin.z, f.ang.x, f.ang.y, f.ang.z};
    if (r.coordinate[0] == helical_coordinate)
      tau[0] = T(b.pitch) * f.lin.z + f.ang.z;
    else
      for (int k = 0; k < b.nv; ++k)
        tau[k] = six[r.coordinate[k]];
  }
  template <class T> static KSL_LANES coscrew<T> drive(const body<scalar_of<T>> &b, const T *tau) {
    const general_joint_row &r = row(b);
    T six[6] = {T(0), T(0), T(0), T(0), T(0), T(0)};
    if (r.coordinate[0] == helical_coordinate)
      six[5] = tau[0];
    else
      spread_numbers(b, r, tau, six);
    return {{six[0], six[1], six[2]}, {six[3], six[4], six[5]}};
  }

  template <class T>
  static KSL_LANES void add_motion(const body<scalar_of<T>> &b, const T *v, const T *dv, body_motion<T> &m) {
    const general_joint_row &r = row(b);
    if (r.coordinate[0] == helical_coordinate)
      one_axis_joint<true, true>::add_motion(b, v, dv, m);
    else
      add_relative_motion(twist(b, v), twist(b, dv), r.slides, r.turns, m);
  }
  template <class T>
  static KSL_LANES void add_steady_motion(const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation, int i,
                                          const T *v, body_motion<T> &m) {
    const general_joint_row &r = row(b);
    if (r.coordinate[0] == helical_coordinate)
      return one_axis_joint<true, true>::add_steady_motion(b, rotation, i, v, m);
    const mat3x3<T> R = rotation[i];
    screw<T> s = twist(b, v);
    algebra<T>::product_drv(&R, &s.lin, &s.lin);
    algebra<T>::product_drv(&R, &s.ang, &s.ang);
    add_relative_motion(s, {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}}, r.slides, r.turns, m);
  }

  template <class T>
  static KSL_LANES general_column<T> column(int k, const body<scalar_of<T>> &b, const per_body<mat3x3, T> &rotation,
                                            int i) {
    const int c = row(b).coordinate[k];
    return {axis_of(rotation, i, c == helical_coordinate ? 2 : c % 3), T(b.pitch), c};
  }
  template <class T> static KSL_LANES general_column<T> column(int k, const body<scalar_of<T>> &b, const mat3x3<T> &R) {
    const int c = row(b).coordinate[k], axis = c == helical_coordinate ? 2 : c % 3;
    general_column<T> S = {axis_of<2>(R), T(b.pitch), c};
    if (axis == 0)
      S.z = axis_of<0>(R);
    else if (axis == 1)
      S.z = axis_of<1>(R);
    return S;
  }
  template <class T> static KSL_LANES coscrew<T> momentum(int k, const body<scalar_of<T>> &b,
                                                          const spatial_inertia<T> &I) {
    const int c = row(b).coordinate[k];
    if (c == helical_coordinate)
      return one_axis_joint<true, true>::momentum(k, b, I);
    return unit_momentum(c, I);
  }

private:
  /// One function for all algorithms, which calls those of the kinds.
  template <class T> [[gnu::noinline]] static void compute_pose(const pose_workspace<T> &w, const T *q,
                                                                general_pose<T> &D) {
    ((D.b.kind == kinds ? D.set(joint<kinds>::computed_pose(D.b, w, q)) : void()), ...);
  }
  template <class T> [[gnu::noinline]] static void reload_pose(const pose_workspace<T> &w, general_pose<T> &D) {
    ((D.b.kind == kinds ? D.set(joint<kinds>::kept_pose(D.b, w)) : void()), ...);
  }

  template <class T> static KSL_LANES void spread_numbers(const body<scalar_of<T>> &b, const general_joint_row &r,
                                                          const T *numbers, T *six) {
    for (int k = 0; k < b.nv; ++k)
      six[r.coordinate[k]] = numbers[k];
  }

  static constexpr general_joint_rows<kinds...> table = {};
};

} // namespace KSL_ISA
} // namespace ksl
