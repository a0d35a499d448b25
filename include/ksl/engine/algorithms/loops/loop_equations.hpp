// KSL: the equations of loops, K x = b, and their elimination by a plan (loop_view.hpp).
//
// All is in world axes.  J_c is the column of a coordinate about the origin of the joint's frame on the successor.  With W = Σ ± J_c v_c
// the twist of the successor relative to the predecessor, seen from the successor,
//
//     Ẇ = Σ ± (J_c a_c + (J_c × U_c) v_c),   U_c = V_s − V_c,                                                        (1)
//
// where V_c is the twist of the body behind coordinate c (src/engine/loops/variation.hpp).  Rows are the products of W and Ẇ with unit
// forces and moments that are fixed in the successor.  Where the motion of all bodies is known, Ẇ is cheaper by theirs:
//
//     Ẇ = (a_s − a_p − (ω_s + ω_p) × W.lin, α_s − α_p − ω_s × W.ang), with accelerations of points at that origin.      (2)
#pragma once

#include "ksl/engine/algorithms/loops/tolerances.hpp"
#include "ksl/engine/lanes/body_lanes.hpp"
#include "ksl/engine/lanes/of_precision.hpp"
#include "ksl/engine/model/loop_view.hpp"
#include "ksl/engine/steps/world_axes.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// How many numbers of a row of K are computed at a time, with plain numbers.
template <class T> constexpr int columns_at_a_time = 1;
template <> inline constexpr int columns_at_a_time<double> = native_lanes<double>;
template <> inline constexpr int columns_at_a_time<float> = native_lanes<float>;
/// Room for so many numbers of a row.
template <class T> constexpr int padded_columns(int n) {
  constexpr int some = columns_at_a_time<T>;
  return (n + some - 1) / some * some;
}

/// x[columns] −= factor y[columns], for the elements that differ from zero; with plain numbers for all of [begin, end) and for what is beside
/// them in the same registers, which takes less time than to look for them.  Nothing of x before `begin` may be needed any more.
template <class T>
KSL_LANES void subtract_columns(const T &factor, const T *y, T *x, const int *columns, int n, int begin, int end) {
  if constexpr (is_number<T>) {
    using P = native_pack<T>;
    const P spread(factor);
    for (int j = begin / columns_at_a_time<T> * columns_at_a_time<T>; j < end; j += columns_at_a_time<T>) {
      P from, to;
      body_lanes::read(y + j, from);
      body_lanes::read(x + j, to);
      body_lanes::write(to - spread * from, x + j);
    }
  } else {
    for (int j = 0; j < n; ++j)
      x[columns[j]] = x[columns[j]] - factor * y[columns[j]];
  }
}

template <class T> struct loop_equations_workspace {
  world_axes<T> world;
  array_of<screw<T>> J;     ///< of each column of a loop
  array_of<SE3<T>> joint;   ///< of each loop: the joint's frame on the successor in the world
  array_of<screw<T>> twist; ///< W of each loop
  array_of<T> moved;        ///< of each loop: the sum of the terms of W as lengths
  array_of<vec3<T>> normal; ///< of each universal joint: that of its axes, in its frame on the successor
  array_of<T> bent;         ///< of each: what its turning adds to the rate of its last equation
  array_of<int> place;      ///< of each column of a loop: where it is in K
  array_of<T> K;            ///< (rows, pitch): pivots in their order, independent coordinates, b, and zeros
  array_of<T> L;            ///< (rows, pivots), for plain numbers alone: lower() reads it
  array_of<T> solved;       ///< (pivots, freedoms + 1): dependent coordinates by independent ones, and for b
  T fault;                  ///< NaN where a state is not one of the closed mechanism, else 0
  int pitch, pivots;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    const auto *loops = model.loops;
    int most = 0;
    for (int l = 0; loops && l < loops->loops; ++l)
      most = most > loops->joint[l].columns_end - loops->joint[l].columns_begin
                 ? most
                 : loops->joint[l].columns_end - loops->joint[l].columns_begin;
    world.lay_out(memory, model);
    J.lay_out(memory, most), place.lay_out(memory, most);
    const int n = loops ? loops->loops : 0;
    joint.lay_out(memory, n), twist.lay_out(memory, n), moved.lay_out(memory, n);
    normal.lay_out(memory, n), bent.lay_out(memory, n);
    pitch = padded_columns<T>(model.nv + 1), pivots = loops ? loops->pivots : 0;
    K.lay_out(memory, loops ? loops->rows * pitch : 0);
    L.lay_out(memory, loops && is_number<T> ? loops->rows * loops->pivots : 0);
    solved.lay_out(memory, loops ? loops->pivots * (loops->freedoms + 1) : 0);
  }
  KSL_LANES T *row(int i) const { return &K[i * pitch]; }
  /// The factor of row i below a pivot, or in the pivot's row its inverse.  Lanes keep it where K has no more use for its element, since what a
  /// group of states needs is about as much as the nearest cache has; with plain numbers, subtract_columns passes over that place.
  KSL_LANES T &lower(int i, int step) const {
    if constexpr (is_number<T>)
      return L[i * pivots + step];
    else
      return K[i * pitch + step];
  }
};

/// NaN in the lanes where |x| is above the limit, or NaN; 0 elsewhere.
template <class T> KSL_LANES T fault_beyond(const T &x, const T &limit) {
  const T nan(__builtin_nan(""));
  return math<T>::select(math<T>::fabs(x) <= limit, T(0), nan);
}

/// The smallest pivot, and what may be left of equations that follow from others, relative to lengths.
template <class S> inline S least_pivot() { return S(loop_tolerance::plan_pivot); }
template <class S> inline S largest_rest() {
  return of_precision<S>(loop_tolerance::plan_rest, loop_tolerance::plan_rest_single);
}
/// How much of its square the vectors before it must leave to a vector, in Gram and Schmidt's method, before it counts as theirs.
template <class S> inline S least_share() { return S(1e-6); }

/// The column of a coordinate of body i about a point, which `arm` leads to from the body's origin.
template <class T> KSL_LANES screw<T> column_about(const mat3x3<T> &R, int coordinate, const T &pitch,
                                                   const vec3<T> &arm) {
  const int axis = coordinate == helical_coordinate ? 2 : coordinate % 3;
  const vec3<T> z = axis == 0   ? vec3<T>{R.m00, R.m10, R.m20}
                    : axis == 1 ? vec3<T>{R.m01, R.m11, R.m21}
                                : vec3<T>{R.m02, R.m12, R.m22};
  screw<T> s;
  if (coordinate < 3)
    return {z, {T(0), T(0), T(0)}};
  s.ang = z;
  algebra<T>::cross_vv(&z, &arm, &s.lin);
  if (coordinate == helical_coordinate)
    algebra<T>::axpy_vv(pitch, &z, &s.lin);
  return s;
}

/// Column c of all loops' about a point.
template <class T> KSL_LANES screw<T> column_of_loop(const loop_view<scalar_of<T>> &loops,
                                                     const loop_equations_workspace<T> &w, int c, const vec3<T> &at) {
  const loop_column &of = loops.column[c];
  const vec3<T> o = w.world.origin[of.body], arm = {at.x - o.x, at.y - o.y, at.z - o.z};
  return column_about(w.world.rotation[of.body], of.coordinate, T(loops.pitch[c]), arm);
}

template <class T> KSL_LANES void add_scaled(const T &x, const screw<T> &s, screw<T> &sum) {
  algebra<T>::axpy_vv(x, &s.lin, &sum.lin);
  algebra<T>::axpy_vv(x, &s.ang, &sum.ang);
}

/// s × u of twists.
template <class T> KSL_LANES screw<T> twist_product(const screw<T> &s, const screw<T> &u) {
  vec3<T> a, b;
  screw<T> out;
  algebra<T>::cross_vv(&s.ang, &u.lin, &a);
  algebra<T>::cross_vv(&s.lin, &u.ang, &b);
  out.lin = {a.x + b.x, a.y + b.y, a.z + b.z};
  algebra<T>::cross_vv(&s.ang, &u.ang, &out.ang);
  return out;
}

/// Sets the normal of the axes of a universal joint, from the rotations of its frame on both sides and the motion of the successor relative to
/// the predecessor.  Returns what their angle differs by.
template <class T>
KSL_LANES T set_normal(const closing_joint<scalar_of<T>> &joint, const mat3x3<T> &from, const mat3x3<T> &to,
                       const vec3<T> &turning, vec3<T> &normal, T &bent) {
  using A = algebra<T>;
  const vec3<T> own = spread<T>(joint.axis), own2 = spread<T>(joint.axis2);
  vec3<T> first, second, across, x, y;
  A::product_drv(&from, &own, &first);
  A::product_drv(&to, &own2, &second);
  A::cross_vv(&first, &second, &across);
  const T inverse = T(scalar_of<T>(1)) / math<T>::sqrt(A::dot_vv(&across, &across));
  across = {across.x * inverse, across.y * inverse, across.z * inverse};
  A::product_drinvv(&to, &across, &normal);
  A::cross_vv(&turning, &first, &x);
  A::cross_vv(&turning, &second, &y);
  bent = A::dot_vv(&x, &y) * inverse;
  return (A::dot_vv(&first, &second) - T(joint.cosine)) * inverse;
}

/// How far a helical joint is from the travel of its turn, `travel` being along its axis.  NaN where it is on the other side.
template <class T>
KSL_LANES T error_of_screw(const closing_joint<scalar_of<T>> &joint, const mat3x3<T> &from, const mat3x3<T> &to,
                           const T &travel) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const vec3<T> x = spread<T>(joint.across), z = spread<T>(joint.axis);
  vec3<T> y, of_successor, ahead, beside;
  A::cross_vv(&z, &x, &y);
  A::product_drv(&to, &x, &of_successor);
  A::product_drv(&from, &x, &ahead);
  A::product_drv(&from, &y, &beside);
  T sine, cosine;
  sine_cosine(travel * T(S(1) / joint.pitch), sine, cosine);
  const T c = A::dot_vv(&ahead, &of_successor), s = A::dot_vv(&beside, &of_successor);
  return (sine * c - cosine * s) * T(joint.pitch) +
         fault_beyond(math<T>::select(cosine * c + sine * s > T(S(0)), T(S(0)), T(S(1))), T(S(0.5)));
}

/// The direction of equation i of a joint, in its frame on the successor.
template <class T>
KSL_LANES vec3<T> direction_of(const closing_joint<scalar_of<T>> &joint, const vec3<T> &normal, int i) {
  return joint.has_two_axes && i == joint.forces ? normal : spread<T>(joint.direction[i]);
}

/// The direction of equation i, where the frame has axes R.
template <class T>
KSL_LANES vec3<T> direction_along(const closing_joint<scalar_of<T>> &joint, const mat3x3<T> &R, const vec3<T> &normal,
                                  int i) {
  switch (joint.along[i]) {
  case 0: return {R.m00, R.m10, R.m20};
  case 1: return {R.m01, R.m11, R.m21};
  case 2: return {R.m02, R.m12, R.m22};
  default: break;
  }
  vec3<T> d = direction_of<T>(joint, normal, i);
  algebra<T>::product_drv(&R, &d, &d);
  return d;
}

/// NaN where |x| is above the limit, or NaN, or there is a fault already; else `fault`, which is 0.
template <class T> KSL_LANES T kept_within(const T &fault, const T &x, const T &limit) {
  return math<T>::select(math<T>::fabs(x) <= limit, fault, T(__builtin_nan("")));
}

/// A joint's frame on one of its bodies in the world: its origin, and its axes.
template <class T>
KSL_LANES vec3<T> origin_in_world(const loop_equations_workspace<T> &w, int body, const SE3<scalar_of<T>> &in_body) {
  const mat3x3<T> R = w.world.rotation[body];
  const vec3<T> t = spread<T>(in_body.t), o = w.world.origin[body];
  vec3<T> at;
  algebra<T>::product_drv(&R, &t, &at);
  algebra<T>::xpy_vv(&o, &at);
  return at;
}
template <class T>
KSL_LANES mat3x3<T> axes_in_world(const loop_equations_workspace<T> &w, int body, const SE3<scalar_of<T>> &in_body) {
  const mat3x3<T> R = w.world.rotation[body], at = spread<T>(in_body.R);
  mat3x3<T> out;
  algebra<T>::product_drdr(&R, &at, &out);
  return out;
}
template <class T>
KSL_LANES SE3<T> successor_in_world(const loop_equations_workspace<T> &w, const closing_joint<scalar_of<T>> &joint) {
  return {joint.is_turned ? axes_in_world(w, joint.successor, joint.on_successor) : w.world.rotation[joint.successor],
          origin_in_world(w, joint.successor, joint.on_successor)};
}

/// What a speed of a coordinate of a loop is a length of.
template <class S> KSL_LANES S size_of(const loop_view<S> &loops, const loop_column &of) {
  return of.coordinate < 3 ? S(1) : loops.length;
}

/// The columns [begin, end) of a loop, and what they add to W and `moved`.
template <class T>
KSL_LANES void add_columns(const loop_view<scalar_of<T>> &loops, loop_equations_workspace<T> &w,
                           const closing_joint<scalar_of<T>> &joint, const vec3<T> &at, int begin, int end,
                           const T &sign, const T *v, screw<T> &W, T &moved) {
  for (int c = begin; c < end; ++c) {
    const loop_column &of = loops.column[c];
    screw<T> &J = w.J[c - joint.columns_begin];
    J = column_of_loop(loops, w, c, at);
    const int place = loops.place[of.v];
    w.place[c - joint.columns_begin] = place < 0 ? -1 - place : loops.pivots + place;
    add_scaled(sign * v[of.v], J, W);
    moved = moved + math<T>::fabs(v[of.v]) * T(size_of(loops, of));
  }
}

/// What the successor's own columns add: their motion about the joint's frame, in world axes.
template <class T>
KSL_LANES screw<T> own_motion(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w,
                              const closing_joint<scalar_of<T>> &joint, const T *v, T &moved) {
  using A = algebra<T>;
  const T o(scalar_of<T>(0));
  T slides[3] = {o, o, o}, turns[3] = {o, o, o}; // about the body's origin, in its axes
  for (int c = joint.own_begin; c < joint.columns_middle; ++c) {
    const loop_column &of = loops.column[c];
    const int axis = of.coordinate == helical_coordinate ? 2 : of.coordinate % 3;
    T &sum = of.coordinate < 3 ? slides[axis] : turns[axis];
    sum = sum + v[of.v];
    if (of.coordinate == helical_coordinate)
      slides[axis] = slides[axis] + T(loops.pitch[c]) * v[of.v];
    moved = moved + math<T>::fabs(v[of.v]) * T(size_of(loops, of));
  }
  screw<T> sum = {{slides[0], slides[1], slides[2]}, {turns[0], turns[1], turns[2]}};
  const mat3x3<T> R = w.world.rotation[joint.successor];
  const vec3<T> arm = spread<T>(joint.on_successor.t);
  vec3<T> x;
  A::cross_vv(&sum.ang, &arm, &x);
  A::xpy_vv(&x, &sum.lin);
  A::product_drv(&R, &sum.lin, &sum.lin);
  A::product_drv(&R, &sum.ang, &sum.ang);
  return sum;
}

/// What columns [begin, end) of a loop add to the rates of (1), from the ends inwards: U of the bodies behind coordinates that move the same body
/// is the same.
template <class T>
KSL_LANES void add_rates(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w,
                         const closing_joint<scalar_of<T>> &joint, int begin, int end, const T &sign, screw<T> U,
                         const T *v, screw<T> &rate) {
  screw<T> own = U;
  for (int c = end - 1; c >= begin; --c) {
    const loop_column &of = loops.column[c];
    const screw<T> &J = w.J[c - joint.columns_begin];
    if (c + 1 < end && loops.column[c + 1].body != of.body)
      U = own;
    add_scaled(sign * v[of.v], twist_product(J, U), rate);
    add_scaled(v[of.v], J, own);
  }
}

/// What is open of a loop: between both frames, and what equations of rotation, of a screw and of two axes don't see there.
template <class T> struct loop_opening {
  vec3<T> gap, turned, turn;
  T screwed, tilted;
};

/// Sets `turned`, from the axes of both sides.  Returns a number that is positive unless one side is turned over.
template <class T>
KSL_LANES T set_turned(const closing_joint<scalar_of<T>> &joint, const mat3x3<T> &from, const mat3x3<T> &to,
                       vec3<T> &turned) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  if (joint.turns == loop_turns::about) {
    const vec3<T> u = spread<T>(joint.axis);
    vec3<T> of_successor, of_predecessor;
    A::product_drv(&to, &u, &of_successor);
    A::product_drv(&from, &u, &of_predecessor);
    A::cross_vv(&of_predecessor, &of_successor, &turned);
    return A::dot_vv(&of_predecessor, &of_successor);
  }
  const vec3<T> p[] = {{from.m00, from.m10, from.m20}, {from.m01, from.m11, from.m21}, {from.m02, from.m12, from.m22}};
  const vec3<T> s[] = {{to.m00, to.m10, to.m20}, {to.m01, to.m11, to.m21}, {to.m02, to.m12, to.m22}};
  for (int i = 0; i < 3; ++i) { // half the sum of axis × axis
    vec3<T> x;
    A::cross_vv(&p[i], &s[i], &x);
    A::axpy_vv(T(S(0.5)), &x, &turned);
  }
  return A::dot_vv(&p[0], &s[0]) + A::dot_vv(&p[1], &s[1]) + A::dot_vv(&p[2], &s[2]);
}

template <class T>
KSL_LANES loop_opening<T> opening_of(loop_equations_workspace<T> &w, const closing_joint<scalar_of<T>> &joint, int loop,
                                     const SE3<T> &to, const screw<T> &W, T &fault) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const vec3<T> o = {T(S(0)), T(S(0)), T(S(0))}, t = origin_in_world(w, joint.predecessor, joint.on_predecessor);
  loop_opening<T> open = {{to.t.x - t.x, to.t.y - t.y, to.t.z - t.z}, o, o, T(S(0)), T(S(0))};
  if (joint.turns == loop_turns::freely && joint.mixed < 0 && !joint.has_two_axes)
    return open;
  const mat3x3<T> from = axes_in_world(w, joint.predecessor, joint.on_predecessor);
  if (joint.turns != loop_turns::freely) {
    const T ahead = set_turned(joint, from, to.R, open.turned);
    fault = kept_within(fault, math<T>::select(ahead > T(S(0)), T(S(0)), T(S(1))), T(S(0.5)));
  }
  if (joint.mixed >= 0) {
    const vec3<T> u = spread<T>(joint.axis), own = spread<T>(joint.turn);
    vec3<T> axis;
    A::product_drv(&to.R, &u, &axis);
    A::product_drv(&to.R, &own, &open.turn);
    open.screwed = error_of_screw(joint, from, to.R, A::dot_vv(&axis, &open.gap));
  }
  if (joint.has_two_axes)
    open.tilted = set_normal(joint, from, to.R, W.ang, w.normal[loop], w.bent[loop]);
  return open;
}

/// The elements of the successor's own columns.  The direction of a universal joint's last equation is no number of the model.
template <class T>
KSL_LANES void set_own_elements(const loop_view<scalar_of<T>> &loops, const loop_equations_workspace<T> &w,
                                const closing_joint<scalar_of<T>> &joint, int loop) {
  for (int k = joint.elements_begin; k < joint.elements_end; ++k)
    w.row(loops.element[k].row)[loops.element[k].place] = T(loops.element[k].value);
  for (int c = joint.own_begin; joint.has_two_axes && c < joint.columns_middle; ++c) {
    const int place = loops.place[loops.column[c].v];
    const vec3<T> normal = w.normal[loop], ang = spread<T>(loops.own[c].ang);
    w.row(joint.first_row + joint.forces)[place < 0 ? -1 - place : loops.pivots + place] =
        algebra<T>::dot_vv(&normal, &ang);
  }
}

/// One loop: its rows of K, with −(K̇ v) as b if these rates are wanted; and whether it is closed.
template <bool rates, class T>
KSL_LANES void set_loop(const model_view<scalar_of<T>> &model, loop_equations_workspace<T> &w, int loop, const T *v) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const closing_joint<S> &joint = loops.joint[loop];
  const SE3<T> to = successor_in_world(w, joint);
  w.joint[loop] = to;
  const screw<T> none = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  T moved(S(0));
  const screw<T> own_W = own_motion(loops, w, joint, v, moved);
  screw<T> W = own_W, rate = none;
  add_columns(loops, w, joint, to.t, joint.columns_begin, joint.own_begin, T(S(1)), v, W, moved);
  add_columns(loops, w, joint, to.t, joint.columns_middle, joint.columns_end, T(S(-1)), v, W, moved);
  if constexpr (rates) {
    add_rates(loops, w, joint, joint.columns_begin, joint.own_begin, T(S(1)), own_W, v, rate);
    add_rates(loops, w, joint, joint.columns_middle, joint.columns_end, T(S(-1)), W, v, rate);
  }
  w.twist[loop] = W, w.moved[loop] = moved;

  T fault = w.fault;
  const loop_opening<T> open = opening_of(w, joint, loop, to, W, fault);
  const T allowed = T(loops.tolerance * loops.length);
  const T allowed_speed = T(loops.tolerance * S(0.25)) * moved + T(S(loop_tolerance::at_rest) * loops.length);
  for (int i = 0; i < joint.forces + joint.moments; ++i) {
    const bool force = i < joint.forces;
    const bool mixed = i == joint.mixed, about_normal = joint.has_two_axes && !force;
    const vec3<T> d = direction_along(joint, to.R, w.normal[loop], i);
    const int row = joint.first_row + i;
    const T scale(loops.row_scale[row]);
    T *const line = w.row(row);
    if constexpr (is_number<T>)
      for (int k = 0; k < w.pitch; ++k)
        line[k] = T(S(0));
    const screw<T> *const J = &w.J[0];
    const auto element = [&](int c) KSL_INLINED {
      const T x = A::dot_vv(&d, force ? &J[c].lin : &J[c].ang);
      return mixed ? x + A::dot_vv(&open.turn, &J[c].ang) : x;
    };
    for (int c = 0; c < joint.own_begin - joint.columns_begin; ++c)
      line[w.place[c]] = element(c);
    for (int c = joint.columns_middle - joint.columns_begin; c < joint.columns_end - joint.columns_begin; ++c)
      line[w.place[c]] = -element(c);
    T speed = A::dot_vv(&d, force ? &W.lin : &W.ang), apart = A::dot_vv(&d, force ? &open.gap : &open.turned);
    if constexpr (rates)
      line[model.nv] = -A::dot_vv(&d, force ? &rate.lin : &rate.ang);
    if (mixed) {
      speed = speed + A::dot_vv(&open.turn, &W.ang), apart = open.screwed;
      if constexpr (rates)
        line[model.nv] = line[model.nv] - A::dot_vv(&open.turn, &rate.ang);
    } else if (about_normal) {
      apart = open.tilted;
      if constexpr (rates)
        line[model.nv] = line[model.nv] - w.bent[loop];
    }
    fault = kept_within(fault, apart * scale, allowed);
    fault = kept_within(fault, speed * scale, allowed_speed);
  }
  w.fault = fault;
  set_own_elements(loops, w, joint, loop);
}

/// The equations of followers, v_f − r v_l = 0, whose elements are numbers of the model.
template <bool rates, class T>
KSL_LANES void set_couplings(const model_view<scalar_of<T>> &model, const loop_equations_workspace<T> &w) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  for (int i = loops.first_coupling; i < loops.rows; ++i) {
    T *const row = w.row(i);
    for (int j = 0; j < w.pitch && is_number<T>; ++j)
      row[j] = T(S(0));
    if constexpr (rates)
      row[model.nv] = T(S(0));
  }
  for (int k = loops.couplings_begin; k < loops.couplings_end; ++k)
    w.row(loops.element[k].row)[loops.element[k].place] = T(loops.element[k].value);
}

/// K of all loops, and b if rates are wanted, after the axes and origins of all bodies in the world.
template <bool rates, class T>
KSL_LANES void set_loop_equations(const model_view<scalar_of<T>> &model, loop_equations_workspace<T> &w, const T *q,
                                  const T *v) {
  express_in_world(model, w.world, q);
  w.fault = T(scalar_of<T>(0));
  if constexpr (!is_number<T>)
    for (int k = model.loops->fill_begin; k < model.loops->fill_end; k += 2)
      w.row(model.loops->list[k])[model.loops->list[k + 1]] = T(scalar_of<T>(0));
  for (int l = 0; l < model.loops->loops; ++l)
    set_loop<rates>(model, w, l, v);
  set_couplings<rates>(model, w);
}

/// The model without angles, for algorithms that share w.world.pose: after set_loop_equations it has their sines and cosines.  Plain floats
/// compute them again.
template <class S> KSL_LANES model_view<S> with_known_sines(const model_view<S> &model) {
  model_view<S> tree = model;
  tree.angles_end = tree.first_angle;
  return tree;
}

/// The motion of a body in world axes, and the acceleration of its origin.
template <class T> struct moved_body {
  vec3<T> omega{}, alpha{}, acceleration{};
  int body = -1;

  template <class Motions> KSL_LANES void set(const loop_equations_workspace<T> &w, const Motions &motion, int of) {
    using A = algebra<T>;
    if (of == body)
      return;
    body = of;
    const auto m = motion[of];
    const mat3x3<T> R = w.world.rotation[of];
    A::product_drv(&R, &m.angular_velocity, &omega);
    A::product_drv(&R, &m.angular_acceleration, &alpha);
    A::product_drv(&R, &m.acceleration, &acceleration);
  }
  KSL_LANES vec3<T> acceleration_at(const loop_equations_workspace<T> &w, const vec3<T> &at) const {
    using A = algebra<T>;
    const vec3<T> o = w.world.origin[body], arm = {at.x - o.x, at.y - o.y, at.z - o.z};
    vec3<T> x, sum;
    A::cross_vv(&alpha, &arm, &sum);
    A::xpy_vv(&acceleration, &sum);
    A::cross_vv(&omega, &arm, &x);
    A::cross_vv(&omega, &x, &x);
    A::xpy_vv(&x, &sum);
    return sum;
  }
};

/// What a vector in the axes of a joint's frame on the successor has along the direction of equation i.
template <class T>
KSL_LANES T component_along(const closing_joint<scalar_of<T>> &joint, const vec3<T> &normal, int i, const vec3<T> &x) {
  switch (joint.along[i]) {
  case 0: return x.x;
  case 1: return x.y;
  case 2: return x.z;
  default: break;
  }
  const vec3<T> d = direction_of<T>(joint, normal, i);
  return algebra<T>::dot_vv(&d, &x);
}

/// Whether accelerations a (nv) keep the loops closed: (2), by the motions of bodies that inverse dynamics has found; after
/// set_loop_equations.
template <class T, class Motions>
KSL_LANES void check_accelerations(const model_view<scalar_of<T>> &model, loop_equations_workspace<T> &w,
                                   const Motions &motion, const T *a) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  moved_body<T> successor, predecessor; // usually the same body as of the loop before
  for (int l = 0; l < loops.loops; ++l) {
    const closing_joint<S> &joint = loops.joint[l];
    const SE3<T> to = w.joint[l];
    const screw<T> W = w.twist[l];
    successor.set(w, motion, joint.successor), predecessor.set(w, motion, joint.predecessor);
    const vec3<T> of_s = successor.acceleration_at(w, to.t), of_p = predecessor.acceleration_at(w, to.t);
    const vec3<T> both = {successor.omega.x + predecessor.omega.x, successor.omega.y + predecessor.omega.y,
                          successor.omega.z + predecessor.omega.z};
    vec3<T> x;
    A::cross_vv(&both, &W.lin, &x);
    vec3<T> lin = {of_s.x - of_p.x - x.x, of_s.y - of_p.y - x.y, of_s.z - of_p.z - x.z}, ang = {T(0), T(0), T(0)};
    A::product_drinvv(&to.R, &lin, &lin); // in the joint's axes, as the directions of its equations
    if (joint.moments > 0 || joint.mixed >= 0) {
      A::cross_vv(&successor.omega, &W.ang, &x);
      ang = {successor.alpha.x - predecessor.alpha.x - x.x, successor.alpha.y - predecessor.alpha.y - x.y,
             successor.alpha.z - predecessor.alpha.z - x.z};
      A::product_drinvv(&to.R, &ang, &ang);
    }
    T terms = w.moved[l] * w.moved[l] * T(S(1) / loops.length);
    for (int c = joint.columns_begin; c < joint.columns_end; ++c)
      terms = terms + math<T>::fabs(a[loops.column[c].v]) * T(size_of(loops, loops.column[c]));
    const T allowed = T(loops.tolerance * S(0.25)) * terms + T(S(loop_tolerance::at_rest) * loops.length);
    for (int i = 0; i < joint.forces + joint.moments; ++i) {
      T value = component_along(joint, w.normal[l], i, i < joint.forces ? lin : ang);
      if (i == joint.mixed) {
        const vec3<T> turn = spread<T>(joint.turn);
        value = value + A::dot_vv(&turn, &ang);
      }
      if (joint.has_two_axes && i == joint.forces)
        value = value + w.bent[l];
      w.fault = kept_within(w.fault, value * T(loops.row_scale[joint.first_row + i]), allowed);
    }
  }
}

/// Eliminates by the plan: K = L U, with U in the columns of K that are right of each pivot.
template <bool rates, class T>
KSL_LANES void eliminate_by_plan(const model_view<scalar_of<T>> &model, loop_equations_workspace<T> &w) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const int b = model.nv, f = loops.freedoms, pivots = loops.pivots;
  const int *const list = loops.list;
  T smallest = T(S(1)), fault = w.fault;
  for (int k = 0; k < pivots; ++k) {
    const loop_pivot p = loops.pivot[k];
    T *const row = w.row(p.row);
    const T pivot = row[k], inverse = T(S(1)) / pivot;
    w.lower(p.row, k) = inverse;
    const T scaled = math<T>::fabs(pivot) * T(loops.row_scale[p.row] * loops.column_scale[p.column]);
    smallest = math<T>::select(scaled < smallest, scaled, smallest);
    for (int i = p.rows_begin; i < p.rows_end; ++i) {
      T *const target = w.row(list[i]);
      const T factor = target[k] * inverse;
      w.lower(list[i], k) = factor;
      subtract_columns(factor, row, target, list + p.columns_begin, p.columns_end - p.columns_begin, k + 1,
                       rates ? b + 1 : b);
      if constexpr (rates && !is_number<T>)
        target[b] = target[b] - factor * row[b];
    }
  }
  fault = fault + fault_beyond(T(least_pivot<S>()), smallest);
  for (int r = 0; r < loops.rows - pivots; ++r) { // equations that follow from the others have nothing left
    const int row = loops.redundant[r];
    for (int j = 0; j < f; ++j)
      fault = fault +
              fault_beyond(w.row(row)[pivots + j] * T(loops.row_scale[row] * loops.column_scale[loops.independent[j]]),
                           T(largest_rest<S>()));
  }
  w.fault = fault;
}

/// Solves for the dependent coordinates, after the elimination with rates.
template <class T>
KSL_LANES void solve_by_plan(const model_view<scalar_of<T>> &model, const loop_equations_workspace<T> &w) {
  const loop_view<scalar_of<T>> &loops = *model.loops;
  const int b = model.nv, f = loops.freedoms;
  T *const solved = &w.solved[0];
  const int *const list = loops.list;
  for (int k = loops.pivots - 1; k >= 0; --k) {
    const loop_pivot p = loops.pivot[k];
    const T *const row = w.row(p.row);
    const T inverse = w.lower(p.row, k);
    T *const out = solved + k * (f + 1);
    if constexpr (is_number<T>) {
      for (int j = 0; j < f; ++j)
        out[j] = row[loops.pivots + j];
    } else { // in lanes elements that are zero aren't set
      for (int j = 0; j < f; ++j)
        out[j] = T(scalar_of<T>(0));
      for (int i = p.columns_begin + p.later_end - p.later_begin; i < p.columns_end; ++i)
        out[list[i] - loops.pivots] = row[list[i]];
    }
    out[f] = row[b];
    for (int i = p.later_begin; i < p.later_end; ++i) {
      const int step = list[i];
      const T factor = row[step];
      const T *const later = solved + step * (f + 1);
      for (int j = 0; j <= f; ++j)
        out[j] = out[j] - factor * later[j];
    }
    for (int j = 0; j <= f; ++j)
      out[j] = out[j] * inverse;
  }
}

} // namespace KSL_ISA
} // namespace ksl
