// KSL: derivatives of the dynamics of mechanisms with loops along the mechanism, by the plan of the model (loop_view.hpp).
//
// Independent coordinates q_i, v_i and a_i vary, one at a time, and the others follow: dq = G dq_i, K dv = −∂(K v)/∂q dq, and da likewise.  With
// b(q, v, a) the efforts of the tree and λ the multipliers,
//
//     Gᵀ dτ = Gᵀ (∂b/∂q dq + ∂b/∂v dv + M da − ∂(Kᵀ λ)/∂q dq).                                                      (1)
//
// src/engine/loops/derivatives.hpp and variation.hpp say how, and compute the states that have NaN here.  Here all is in world axes.
#pragma once

#include "ksl/engine/algorithms/derivatives/inverse_dynamics_derivatives.hpp"
#include "ksl/engine/algorithms/loops/closed_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// A coordinate of a loop: its column, and X, Y and J × U of variation.hpp.
template <class T> struct varied_column { screw<T> J, X, Y, rate; };

/// What a universal joint's last equation is made of: N = u₁ × u₂ and its rate, and 1 / |N|.
template <class T> struct varied_normal {
  vec3<T> first, second, across, rate;
  T inverse;
};

/// Matrices with a row for each coordinate, or equation, and a column for each freedom, padded to `width` where they are several.
template <class T> struct closed_derivatives_workspace {
  closed_inverse_dynamics_workspace<T> dynamics; ///< with the equations and the multipliers
  inverse_dynamics_derivatives_workspace<T> tree;
  array_of<T> by_q, by_v, M; ///< (nv, nv) of the tree's efforts
  array_of<varied_column<T>> column;
  array_of<T> rates_by_v; ///< (rows, columns of a loop) ∂(K̇ v)/∂v
  array_of<T> G, v_by_q, a_by_q, a_by_v;
  array_of<T> velocity, by_position, by_velocity; ///< (rows): right sides, which their solutions replace
  array_of<T> of_q, of_v, of_a;                   ///< (1) before Gᵀ
  array_of<T> projected;                          ///< (freedoms): what Gᵀ makes of one of them
  array_of<T> efforts;                            ///< (nv)
  int most, width;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    if (!model.loops)
      return;
    dynamics.lay_out(memory, model);
    lay_out_variations(memory, model);
  }
  /// All but `dynamics`.
  KSL_LANES void lay_out_variations(arena &memory, const model_view<scalar_of<T>> &model) {
    const auto *loops = model.loops;
    const int n = model.nv, rows = loops->rows;
    most = 0;
    for (int l = 0; l < loops->loops; ++l)
      if (const int own = loops->joint[l].columns_end - loops->joint[l].columns_begin; own > most)
        most = own;
    width = loops->freedoms == 1 ? 1 : padded_columns<T>(loops->freedoms);
    tree.lay_out(memory, model);
    tree.wrenches.pose = dynamics.equations.world.pose;
    memory.lay_out(n * n, by_q, by_v, M);
    column.lay_out(memory, most), rates_by_v.lay_out(memory, rows * most);
    memory.lay_out(n * width, G, v_by_q, a_by_q, a_by_v, of_q, of_v, of_a);
    memory.lay_out(rows * width, velocity, by_position, by_velocity);
    projected.lay_out(memory, loops->freedoms * width);
    efforts.lay_out(memory, n);
  }
};

/// to += x from, for `width` numbers, padded, at least one.
template <class T> KSL_LANES void add_row(const T &x, const T *from, T *to, int width) {
  if (width == 1) {
    to[0] = to[0] + x * from[0];
  } else if constexpr (is_number<T>) {
    using P = native_pack<T>;
    const P spread(x);
    int j = 0;
    do { // one register is the usual width
      P own, sum;
      body_lanes::read(from + j, own);
      body_lanes::read(to + j, sum);
      body_lanes::write(sum + spread * own, to + j);
    } while ((j += columns_at_a_time<T>) < width);
  } else {
    for (int j = 0; j < width; ++j)
      to[j] = to[j] + x * from[j];
  }
}

/// out = Σ x[i stride] rows[i], i < n, of `width` numbers each, padded.
template <class T>
KSL_LANES void combine_rows(const T *x, int stride, int n, const T *rows, int width, const T &sign, T *out) {
  if (width == 1) {
    T sum = x[0] * rows[0];
    for (int i = 1; i < n; ++i)
      sum = sum + x[i * stride] * rows[i];
    out[0] = sign * sum;
  } else if constexpr (is_number<T>) {
    using P = native_pack<T>;
    for (int j = 0; j < width; j += columns_at_a_time<T>) {
      P own, sum;
      body_lanes::read(rows + j, own);
      sum = P(x[0]) * own;
      for (int i = 1; i < n; ++i) {
        body_lanes::read(rows + i * width + j, own);
        sum = sum + P(x[i * stride]) * own;
      }
      body_lanes::write(P(sign) * sum, out + j);
    }
  } else {
    for (int j = 0; j < width; ++j) {
      T sum = x[0] * rows[j];
      for (int i = 1; i < n; ++i)
        sum = sum + x[i * stride] * rows[i * width + j];
      out[j] = sign * sum;
    }
  }
}
template <class T> KSL_LANES void clear(T *x, int n) {
  for (int i = 0; i < n; ++i)
    x[i] = T(scalar_of<T>(0));
}

/// step(row, column) for the elements of a matrix (nv, nv) that the shape of the tree lets differ from zero.
template <class S, class Step> KSL_LANES void for_tree_elements(const model_view<S> &model, Step step) {
  for (int i = 1; i < model.bodies; ++i)
    for (int c = 0; c < model.body[i].nv; ++c) {
      const int v = model.body[i].v_index + c;
      step(v, v);
      for_each_ancestor(model, i, c, [&](index ancestor, index) KSL_INLINED {
        step(v, static_cast<int>(ancestor));
        step(static_cast<int>(ancestor), v);
      });
    }
}

/// The elements of G, after solve_by_plan.
template <class T>
KSL_LANES void set_G(const loop_view<scalar_of<T>> &loops, int nv, const closed_derivatives_workspace<T> &w) {
  clear(&w.G[0], nv * w.width);
  for (int v = 0; v < nv; ++v)
    for (int j = 0; j < loops.freedoms; ++j)
      w.G[v * w.width + j] = element_of_G(loops, w.dynamics.equations, v, j);
}

/// X, Y and J × U of the coordinates [begin, end) of a loop, which move the same body, from the sums before them.  own: are they on the
/// side of the predecessor.
template <class T>
KSL_LANES void pass_body(const loop_view<scalar_of<T>> &loops, const closing_joint<scalar_of<T>> &joint,
                         varied_column<T> *at, const screw<T> &W, int begin, int end, bool own, const T *v, const T *a,
                         screw<T> &X, screw<T> &Y) {
  using S = scalar_of<T>;
  const T sign(S(own ? -1 : 1));
  // X and Y end before a body's coordinates on the side of s, and behind them on that of p: coordinates of one body move each other as it does.
  // U_c = V_s − V_c = W less what lies on the way from p to the body c.
  const screw<T> X_before = X, Y_before = Y;
  const auto coordinate = [&](int c) KSL_INLINED { return loops.column[joint.columns_begin + c].v; };
  for (int c = begin; c < end; ++c)
    add_scaled(sign * v[coordinate(c)], at[c].J, X);
  screw<T> U = W;
  add_scaled(T(S(-1)), own ? X_before : X, U);
  for (int c = begin; c < end; ++c) {
    at[c].rate = twist_product(at[c].J, U);
    add_scaled(sign * a[coordinate(c)], at[c].J, Y);
    add_scaled(sign * v[coordinate(c)], at[c].rate, Y);
  }
  for (int c = begin; c < end; ++c)
    at[c].X = own ? X : X_before, at[c].Y = own ? Y : Y_before;
}

/// Where the coordinates end, or begin, that move the same body as number c of a loop.
template <class S> KSL_LANES int end_of_body(const loop_view<S> &loops, const closing_joint<S> &joint, int c, int end) {
  const loop_column *const of = loops.column + joint.columns_begin;
  const int body = of[c].body;
  while (c < end && of[c].body == body)
    ++c;
  return c;
}
template <class S>
KSL_LANES int begin_of_body(const loop_view<S> &loops, const closing_joint<S> &joint, int c, int begin) {
  const loop_column *const of = loops.column + joint.columns_begin;
  while (c > begin && of[c - 1].body == of[c].body)
    --c;
  return c;
}

/// The columns of a loop, and the sums along it.  Returns Ẇ.
template <class T>
KSL_LANES screw<T> vary_along(const model_view<scalar_of<T>> &model, const closed_derivatives_workspace<T> &w, int loop,
                              const T *v, const T *a) {
  const loop_view<scalar_of<T>> &loops = *model.loops;
  const closing_joint<scalar_of<T>> &joint = loops.joint[loop];
  varied_column<T> *const at = &w.column[0];
  const int n = joint.columns_end - joint.columns_begin, middle = joint.columns_middle - joint.columns_begin;
  for (int c = 0; c < n; ++c)
    at[c].J = column_of_loop(loops, w.dynamics.equations, joint.columns_begin + c, w.dynamics.equations.joint[loop].t);
  const screw<T> W = w.dynamics.equations.twist[loop];
  screw<T> X = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}}, Y = X;
  // from p to s: its columns from the outermost to the common body, then those of s outwards
  for (int end = n; end > middle;) {
    const int begin = begin_of_body(loops, joint, end - 1, middle);
    pass_body(loops, joint, at, W, begin, end, true, v, a, X, Y);
    end = begin;
  }
  for (int begin = 0; begin < middle;) {
    const int end = end_of_body(loops, joint, begin, middle);
    pass_body(loops, joint, at, W, begin, end, false, v, a, X, Y);
    begin = end;
  }
  return Y;
}

template <class S> KSL_LANES bool is_redundant(const loop_view<S> &loops, int row) {
  bool found = false;
  for (int k = 0; k < loops.rows - loops.pivots; ++k)
    found |= loops.redundant[k] == row;
  return found;
}

/// The equations of a loop that have pivots: their wrenches, in world axes, and their sum with the multipliers; those of others are zero.
template <class T> struct loop_rows_of {
  int n = 0, number[6]; ///< among those of the joint
  bool has_force[6], has_moment[6];
  coscrew<T> wrench[6], all;

  KSL_LANES T along(int r, const screw<T> &s) const {
    if (!has_moment[r])
      return algebra<T>::dot_vv(&wrench[r].lin, &s.lin);
    if (!has_force[r])
      return algebra<T>::dot_vv(&wrench[r].ang, &s.ang);
    return algebra<T>::dot_cs(&wrench[r], &s);
  }
};
template <class T> KSL_LANES void set_rows_of(const loop_view<scalar_of<T>> &loops,
                                              const closed_derivatives_workspace<T> &w, int loop,
                                              loop_rows_of<T> &out) {
  using A = algebra<T>;
  const closing_joint<scalar_of<T>> &joint = loops.joint[loop];
  const mat3x3<T> R = w.dynamics.equations.joint[loop].R;
  const vec3<T> none = {T(0), T(0), T(0)}, turn = spread<T>(joint.turn);
  out.all = {none, none};
  for (int i = 0; i < joint.forces + joint.moments; ++i) {
    if (is_redundant(loops, joint.first_row + i))
      continue;
    const int r = out.n++;
    const bool force = i < joint.forces;
    out.number[r] = i, out.has_force[r] = force, out.has_moment[r] = !force || i == joint.mixed;
    coscrew<T> &f = out.wrench[r];
    f = {none, none};
    (force ? f.lin : f.ang) = direction_along(joint, R, w.dynamics.equations.normal[loop], i);
    if (i == joint.mixed)
      A::product_drv(&R, &turn, &f.ang);
    const T lambda = w.dynamics.multiplier[joint.first_row + i];
    A::axpy_vv(lambda, &f.lin, &out.all.lin);
    A::axpy_vv(lambda, &f.ang, &out.all.ang);
  }
}

template <class T>
KSL_LANES varied_normal<T> normal_of(const model_view<scalar_of<T>> &model, const closed_derivatives_workspace<T> &w,
                                     int loop) {
  using A = algebra<T>;
  const closing_joint<scalar_of<T>> &joint = model.loops->joint[loop];
  const loop_equations_workspace<T> &equations = w.dynamics.equations;
  const mat3x3<T> R = equations.world.rotation[joint.predecessor], on = spread<T>(joint.on_predecessor.R);
  const vec3<T> axis = spread<T>(joint.axis), axis2 = spread<T>(joint.axis2), turning = equations.twist[loop].ang;
  varied_normal<T> n;
  A::product_drv(&on, &axis, &n.first);
  A::product_drv(&R, &n.first, &n.first);
  A::product_drv(&equations.joint[loop].R, &axis2, &n.second);
  A::cross_vv(&n.first, &n.second, &n.across);
  A::cross_vv(&n.first, &turning, &n.rate);
  A::cross_vv(&n.rate, &n.second, &n.rate);
  n.inverse = T(scalar_of<T>(1)) / math<T>::sqrt(A::dot_vv(&n.across, &n.across));
  return n;
}

/// What a coordinate changes in an equation: in K v by q, and in K a + K̇ v by q and by v.
template <class T> struct varied_rates { T velocity, acceleration, by_v; };

/// What a coordinate changes in a universal joint's last equation.
template <class T>
KSL_LANES varied_rates<T> vary_normal(const varied_normal<T> &n, const vec3<T> &turning, const vec3<T> &W,
                                      const vec3<T> &rate, const vec3<T> &dW, const vec3<T> &dRate,
                                      const vec3<T> &by_v) {
  using A = algebra<T>;
  vec3<T> du1, dN, x, y, dN_rate;
  // d(N · W) = dN · W + N · dW, dN = (u₁ × θ) × u₂; its rate N · Ẇ + Ṅ · W likewise, Ṅ = (u₁ × ω) × u₂.  1 / |N| stays: what it
  // multiplies is zero where the equation holds.
  A::cross_vv(&n.first, &turning, &du1);
  A::cross_vv(&du1, &n.second, &dN);
  A::cross_vv(&du1, &W, &x);
  A::cross_vv(&n.first, &dW, &y);
  A::xpy_vv(&y, &x);
  A::cross_vv(&x, &n.second, &dN_rate);
  return {n.inverse * (A::dot_vv(&dN, &W) + A::dot_vv(&n.across, &dW)),
          n.inverse * (A::dot_vv(&dN, &rate) + A::dot_vv(&n.across, &dRate) + A::dot_vv(&dN_rate, &W) +
                       A::dot_vv(&n.rate, &dW)),
          n.inverse * (A::dot_vv(&n.across, &by_v) + A::dot_vv(&dN, &W) + A::dot_vv(&n.rate, &turning))};
}

/// Subtracts from of_q what coordinate k of a loop changes in Kᵀ λ: f · dJ_c, f the wrench of the loop's joint.
template <class T>
KSL_LANES void vary_wrench(const loop_view<scalar_of<T>> &loops, const closed_derivatives_workspace<T> &w,
                           const closing_joint<scalar_of<T>> &joint, const coscrew<T> &f, int k) {
  using A = algebra<T>;
  const varied_column<T> *const at = &w.column[0];
  const screw<T> J = at[k].J;
  const int n = joint.columns_end - joint.columns_begin, middle = joint.columns_middle - joint.columns_begin,
            begin = begin_of_body(loops, joint, k, k < middle ? 0 : middle);
  // f · dJ_c = f · (J_c × J_k) = (J_k ×* f) · J_c: one wrench for all columns that coordinate k moves as s sees them, with the sign of p_ck
  coscrew<T> turned;
  vec3<T> moment;
  A::cross_vv(&J.ang, &f.lin, &turned.lin);
  A::cross_vv(&J.lin, &f.lin, &turned.ang);
  A::cross_vv(&J.ang, &f.ang, &moment);
  A::xpy_vv(&moment, &turned.ang);
  const T *const G = &w.G[loops.column[joint.columns_begin + k].v * w.width];
  const auto subtract = [&](int c, const coscrew<T> &by) KSL_INLINED {
    add_row(-A::dot_cs(&by, &at[c].J), G, &w.of_q[loops.column[joint.columns_begin + c].v * w.width], w.width);
  };
  for (int c = 0; c < begin && k < middle; ++c) // (1) of variation.hpp
    subtract(c, turned);
  if (k < middle)
    A::coscrew_invert(&turned);
  for (int c = k < middle ? middle : begin; c < n; ++c)
    subtract(c, turned);
}

/// Subtracts what it changes by turning a universal joint's normal, which has the multiplier `lambda`.
template <class T>
KSL_LANES void vary_turned_normal(const loop_view<scalar_of<T>> &loops, const closed_derivatives_workspace<T> &w,
                                  const closing_joint<scalar_of<T>> &joint, const varied_normal<T> &normal,
                                  const T &lambda, int k) {
  using A = algebra<T>;
  const int n = joint.columns_end - joint.columns_begin, middle = joint.columns_middle - joint.columns_begin;
  vec3<T> turning, df;
  const T one(scalar_of<T>(1)), size = lambda * normal.inverse;
  A::product_av(k < middle ? size : -size, &w.column[k].J.ang, &turning);
  A::cross_vv(&normal.first, &turning, &df);
  A::cross_vv(&df, &normal.second, &df);
  for (int c = 0; c < n; ++c)
    add_row((c < middle ? -one : one) * A::dot_vv(&df, &w.column[c].J.ang),
            &w.G[loops.column[joint.columns_begin + k].v * w.width],
            &w.of_q[loops.column[joint.columns_begin + c].v * w.width], w.width);
}

/// One loop: the right sides by q, ∂(K̇ v)/∂v, and the loop's share of of_q.
template <class T>
KSL_LANES void vary_loop(const model_view<scalar_of<T>> &model, const closed_derivatives_workspace<T> &w, int loop,
                         const T *v, const T *a) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const closing_joint<S> &joint = loops.joint[loop];
  const loop_equations_workspace<T> &equations = w.dynamics.equations;
  const int n = joint.columns_end - joint.columns_begin, middle = joint.columns_middle - joint.columns_begin;
  const screw<T> rate = vary_along(model, w, loop, v, a), W = equations.twist[loop];
  loop_rows_of<T> equation;
  set_rows_of(loops, w, loop, equation);
  const int last = joint.has_two_axes ? joint.forces : -1;
  varied_normal<T> normal = {};
  if (last >= 0)
    normal = normal_of(model, w, loop);
  for (int k = 0; k < n; ++k) {
    const varied_column<T> &by = w.column[k];
    const T sign(S(k < middle ? 1 : -1));
    // (3): dW = σ X × J, dẆ = σ (Y × J − X × ((W − X) × J)); by v: d(K̇ v) = σ (J × U + X × J)
    const screw<T> seen = twist_product(by.X, by.J), moved = twist_product(by.Y, by.J);
    screw<T> rest = W, dW = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}}, dRate = dW, by_v = dW;
    add_scaled(T(S(-1)), by.X, rest);
    const screw<T> bent = twist_product(by.X, twist_product(rest, by.J));
    add_scaled(sign, seen, dW);
    add_scaled(sign, moved, dRate);
    add_scaled(-sign, bent, dRate);
    add_scaled(sign, by.rate, by_v);
    add_scaled(sign, seen, by_v);
    const T *const G = &w.G[loops.column[joint.columns_begin + k].v * w.width];
    for (int r = 0; r < equation.n; ++r) {
      const int i = equation.number[r];
      varied_rates<T> x = {equation.along(r, dW), equation.along(r, dRate), equation.along(r, by_v)};
      if (i == last) {
        vec3<T> turning;
        A::product_av(sign, &by.J.ang, &turning);
        x = vary_normal(normal, turning, W.ang, rate.ang, dW.ang, dRate.ang, by_v.ang);
      }
      const int at = joint.first_row + i;
      add_row(-x.velocity, G, &w.velocity[at * w.width], w.width);
      add_row(-x.acceleration, G, &w.by_position[at * w.width], w.width);
      w.rates_by_v[at * w.most + k] = x.by_v;
    }
    vary_wrench(loops, w, joint, equation.all, k);
    if (last >= 0)
      vary_turned_normal(loops, w, joint, normal, w.dynamics.multiplier[joint.first_row + last], k);
  }
}

/// What the rates of K by velocities do to the right sides: by position by way of v_by_q, and by velocity.
template <class T>
KSL_LANES void add_rates_by_v(const loop_view<scalar_of<T>> &loops, const closed_derivatives_workspace<T> &w) {
  for (int l = 0; l < loops.loops; ++l) {
    const closing_joint<scalar_of<T>> &joint = loops.joint[l];
    for (int row = joint.first_row; row < joint.first_row + joint.forces + joint.moments; ++row) {
      if (is_redundant(loops, row))
        continue;
      for (int c = joint.columns_begin; c < joint.columns_end; ++c) {
        const T x = -w.rates_by_v[row * w.most + c - joint.columns_begin];
        const int v = loops.column[c].v;
        add_row(x, &w.v_by_q[v * w.width], &w.by_position[row * w.width], w.width);
        add_row(x, &w.G[v * w.width], &w.by_velocity[row * w.width], w.width);
      }
    }
  }
}

/// out (nv): K out = right (rows), zero at independent coordinates, by the factors of eliminate_by_plan.  Replaces `right`.
template <class T> KSL_LANES void follow(const loop_view<scalar_of<T>> &loops, const closed_derivatives_workspace<T> &w,
                                         int nv, T *right, T *out) {
  const int width = w.width;
  const loop_equations_workspace<T> &equations = w.dynamics.equations;
  // K = L U by the plan: L y = right from the first step on, then U out = y from the last, whose row has later steps alone
  clear(out, nv * width);
  for (int k = 0; k < loops.pivots; ++k) {
    const loop_pivot &p = loops.pivot[k];
    for (int i = p.rows_begin; i < p.rows_end; ++i)
      add_row(-equations.lower(loops.list[i], k), right + p.row * width, right + loops.list[i] * width, width);
  }
  for (int k = loops.pivots - 1; k >= 0; --k) {
    const loop_pivot &p = loops.pivot[k];
    T *const own = right + p.row * width;
    for (int i = p.later_begin; i < p.later_end; ++i) {
      const int step = loops.list[i];
      add_row(-equations.row(p.row)[step], out + loops.pivot[step].column * width, own, width);
    }
    add_row(equations.lower(p.row, k), own, out + p.column * width, width);
  }
}

/// projected ← sign Gᵀ x, x (nv).
template <class T>
KSL_LANES void project_rows(const loop_view<scalar_of<T>> &loops, const closed_derivatives_workspace<T> &w, int nv,
                            const T *x, const T &sign) {
  for (int j = 0; j < loops.freedoms; ++j)
    combine_rows(&w.G[j], w.width, nv, x, w.width, sign, &w.projected[j * w.width]);
}

/// How motions follow, and of_q, of_v and of_a, at motions v and a, after by_q, by_v, M, G and the multipliers have been set.
template <class T>
void vary_closed(const model_view<scalar_of<T>> &model, const closed_derivatives_workspace<T> &w, const T *v,
                 const T *a, bool by_a) {
  const loop_view<scalar_of<T>> &loops = *model.loops;
  const int nv = model.nv, width = w.width;
  T *const right[] = {&w.velocity[0], &w.by_position[0], &w.by_velocity[0]}, *const of[] = {&w.of_q[0], &w.of_v[0],
                                                                                            &w.of_a[0]};
  for (T *x : right)
    clear(x, loops.rows * width);
  for (T *x : of)
    clear(x, nv * width);
  for (int l = 0; l < loops.loops; ++l)
    vary_loop(model, w, l, v, a);
  follow(loops, w, nv, &w.velocity[0], &w.v_by_q[0]);
  add_rates_by_v(loops, w);
  follow(loops, w, nv, &w.by_position[0], &w.a_by_q[0]);
  follow(loops, w, nv, &w.by_velocity[0], &w.a_by_v[0]);
  // before Gᵀ, where vary_loop has subtracted ∂(Kᵀ λ)/∂q G:
  //     of_q += ∂b/∂q G + ∂b/∂v dv/dq_i + M da/dq_i,   of_v += ∂b/∂v G + M da/dv_i,   of_a += M G
  for_tree_elements(model, [&](int row, int column) KSL_INLINED {
    const int element = row * nv + column, to = row * width, from = column * width;
    const T by_v = w.by_v[element], M = w.M[element];
    add_row(w.by_q[element], &w.G[from], &w.of_q[to], width);
    add_row(by_v, &w.v_by_q[from], &w.of_q[to], width);
    add_row(M, &w.a_by_q[from], &w.of_q[to], width);
    add_row(by_v, &w.G[from], &w.of_v[to], width);
    add_row(M, &w.a_by_v[from], &w.of_v[to], width);
    if (by_a)
      add_row(M, &w.G[from], &w.of_a[to], width);
  });
}

/// NaN where a result of the state is none, else 0: by a comparison, since a scalar that records leaves products with 0 out.
template <class T> KSL_LANES T fault_of(const T &result) {
  return fault_beyond(result, T(of_precision<scalar_of<T>>(__DBL_MAX__, static_cast<double>(__FLT_MAX__))));
}

/// Derivatives of the efforts of drives, which are the independent coordinates: (nv, freedoms) each, row-major without gaps; zeros at the other
/// coordinates.
template <class T>
KSL_LANES void vary_efforts(const model_view<scalar_of<T>> &model, const closed_derivatives_workspace<T> &w, const T *q,
                            const T *v, const T *a, const external_wrenches<T> &external, T *dtau_dq, T *dtau_dv,
                            T *dtau_da) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const int nv = model.nv, f = loops.freedoms;
  closed_inverse_dynamics(model, w.dynamics, q, v, a, external, &w.efforts[0]);
  back_through_lower(loops, w.dynamics.equations, &w.dynamics.multiplier[0]);
  solve_by_plan(model, w.dynamics.equations);
  set_G(loops, nv, w);
  elements_of_inverse_dynamics_derivatives(with_known_sines(model), w.tree, q, v, a, external, &w.by_q[0], &w.by_v[0],
                                           &w.M[0]);
  vary_closed(model, w, v, a, true);
  const T fault = fault_of(w.efforts[0]);
  const T *const found[] = {&w.of_q[0], &w.of_v[0], &w.of_a[0]};
  T *const out[] = {dtau_dq, dtau_dv, dtau_da};
  for (int kind = 0; kind < 3; ++kind) {
    clear(out[kind], nv * f);
    project_rows(loops, w, nv, found[kind], T(S(1)));
    for (int i = 0; i < f; ++i)
      for (int j = 0; j < f; ++j)
        out[kind][loops.independent[i] * f + j] = w.projected[i * w.width + j] + fault;
  }
}

template <class T> struct closed_forward_dynamics_derivatives_workspace {
  closed_forward_dynamics_workspace<T> forward;
  closed_derivatives_workspace<T> by;
  array_of<T> a, solved, row; ///< solved (freedoms, nv), padded: (Gᵀ M G)⁻¹ Gᵀ

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    if (!model.loops)
      return;
    forward.lay_out(memory, model);
    by.dynamics.equations = forward.equations, by.dynamics.inverse = forward.inverse;
    by.dynamics.lay_out_efforts(memory, model);
    by.lay_out_variations(memory, model);
    const int padded = padded_columns<T>(model.nv);
    a.lay_out(memory, model.nv), row.lay_out(memory, padded > by.width ? padded : by.width);
    solved.lay_out(memory, model.loops->freedoms * padded);
  }
};

/// x ← (Gᵀ M G)⁻¹ x, x (f, width) padded, by the factors that closed_forward_dynamics has left.
template <class T> KSL_LANES void solve_rows(const T *H, int f, T *x, int width) {
  // H has L below its diagonal and D on it: L y = x, then Lᵀ x = D⁻¹ y
  for (int i = 0; i < f; ++i)
    for (int j = 0; j < i; ++j)
      add_row(-H[i * f + j], x + j * width, x + i * width, width);
  for (int i = f - 1; i >= 0; --i) {
    const T inverse = T(scalar_of<T>(1)) / H[i * f + i];
    for (int j = 0; j < width; ++j)
      x[i * width + j] = x[i * width + j] * inverse;
    for (int j = i + 1; j < f; ++j)
      add_row(-H[j * f + i], x + j * width, x + i * width, width);
  }
}

/// The multipliers at accelerations w.a, from the efforts at those of closed_forward_dynamics.
template <class T>
KSL_LANES void multipliers_at(const model_view<scalar_of<T>> &model,
                              const closed_forward_dynamics_derivatives_workspace<T> &w, const T *tau) {
  T *const left = &w.by.efforts[0];
  for (int i = 0; i < model.nv; ++i)
    left[i] = w.forward.tree[i] - tau[i];
  for_tree_elements(model, [&](int row, int column) KSL_INLINED {
    left[row] = left[row] + w.by.M[row * model.nv + column] * (w.a[column] - w.forward.a0[column]);
  });
  project_efforts(model, w.by.dynamics, left);
  back_through_lower(*model.loops, w.by.dynamics.equations, &w.by.dynamics.multiplier[0]);
}

/// Derivatives of the accelerations under efforts tau (nv): by_q and by_v (nv, freedoms), by_tau (nv, nv), row-major without gaps.
template <class T>
KSL_LANES void vary_accelerations(const model_view<scalar_of<T>> &model,
                                  const closed_forward_dynamics_derivatives_workspace<T> &w, const T *q, const T *v,
                                  const T *tau, const external_wrenches<T> &external, T *da_dq, T *da_dv, T *da_dtau) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const closed_derivatives_workspace<T> &by = w.by;
  const int nv = model.nv, f = loops.freedoms, width = by.width, padded = padded_columns<T>(nv);
  const T *const H = &w.forward.H[0];
  closed_forward_dynamics(model, w.forward, q, v, tau, external, &w.a[0]);
  set_G(loops, nv, by);
  elements_of_inverse_dynamics_derivatives(with_known_sines(model), by.tree, q, v, &w.a[0], external, &by.by_q[0],
                                           &by.by_v[0], &by.M[0]);
  multipliers_at(model, w, tau);
  vary_closed(model, by, v, &w.a[0], false);
  const T fault = fault_of(w.a[0]);
  const T *const efforts[] = {&by.of_q[0], &by.of_v[0]};
  const T *const motion[] = {&by.a_by_q[0], &by.a_by_v[0]};
  T *const out[] = {da_dq, da_dv};
  for (int kind = 0; kind < 2; ++kind) {
    project_rows(loops, by, nv, efforts[kind], T(S(-1)));
    solve_rows(H, f, &by.projected[0], width);
    for (int i = 0; i < nv; ++i) {
      combine_rows(&by.G[i * width], 1, f, &by.projected[0], width, T(S(1)), &w.row[0]);
      for (int j = 0; j < f; ++j)
        out[kind][i * f + j] = motion[kind][i * width + j] + w.row[j] + fault;
    }
  }
  clear(&w.solved[0], f * padded);
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < f; ++j)
      w.solved[j * padded + i] = by.G[i * width + j];
  solve_rows(H, f, &w.solved[0], padded);
  for (int i = 0; i < nv; ++i) {
    combine_rows(&by.G[i * width], 1, f, &w.solved[0], padded, T(S(1)), &w.row[0]);
    for (int j = 0; j < nv; ++j)
      da_dtau[i * nv + j] = w.row[j] + fault;
  }
}

/// Single precision is computed in double precision: nobody asks for its kernels, which say that they fit no state.
template <class T>
inline constexpr bool has_closed_derivatives = !is_number<scalar_of<T>> || sizeof(scalar_of<T>) >= sizeof(double);

/// The derivatives of vary_efforts.
template <class T>
void closed_inverse_dynamics_derivatives(const model_view<scalar_of<T>> &model,
                                         const closed_derivatives_workspace<T> &w, const T *q, const T *v, const T *a,
                                         const external_wrenches<T> &external, T *dtau_dq, T *dtau_dv, T *dtau_da) {
  if constexpr (has_closed_derivatives<T>)
    vary_efforts(model, w, q, v, a, external, dtau_dq, dtau_dv, dtau_da);
  else
    dtau_dq[0] = dtau_dv[0] = dtau_da[0] = T(scalar_of<T>(__builtin_nan("")));
}

/// Derivatives of the accelerations: see vary_accelerations.
template <class T>
void closed_forward_dynamics_derivatives(const model_view<scalar_of<T>> &model,
                                         const closed_forward_dynamics_derivatives_workspace<T> &w, const T *q,
                                         const T *v, const T *tau, const external_wrenches<T> &external, T *da_dq,
                                         T *da_dv, T *da_dtau) {
  if constexpr (has_closed_derivatives<T>)
    vary_accelerations(model, w, q, v, tau, external, da_dq, da_dv, da_dtau);
  else
    da_dq[0] = da_dv[0] = da_dtau[0] = T(scalar_of<T>(__builtin_nan("")));
}

} // namespace KSL_ISA
} // namespace ksl
