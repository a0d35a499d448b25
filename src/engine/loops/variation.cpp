#include "engine/loops/variation.hpp"

#include "engine/loops/joint_position.hpp"
#include "engine/loops/vectors.hpp"

#include <algorithm>

namespace ksl::loops {

namespace {
constexpr screw<double> nothing = {{0, 0, 0}, {0, 0, 0}};
}

void variation::lay_out(arena &memory) {
  const int nv = m_.nv(), rows = t_.rows;
  int most = 0;
  for (const loop &l : t_.loops)
    most = std::max(most, l.support_end - l.support_begin);
  at_ = memory.take<element>(most);
  velocity_by_q_ = memory.take<double>(rows * nv), acceleration_by_q_ = memory.take<double>(rows * nv);
  acceleration_by_v_ = memory.take<double>(rows * nv), wrench_by_q_ = memory.take<double>(nv * nv);
}

/// p_ck of (1); 0 where k is not on the way.  Coordinates of one group move the body c together.
/// With the groups of the picture below, 1 and 2 on the side of s, 5 and 6 on that of p:
///
///     c \ k    1   2   5   6
///     1        0   1   0   0        between a body on the side of s and s are the coordinates behind it
///     2        0   0   0   0
///     5        1   1  −1   0        on the side of p all of those on the side of s, and back to the common body its own and those before it
///     6        1   1  −1  −1
double variation::sign(int c, int k) const {
  const element &from = at_[c], &by = at_[k];
  if (from.sigma > 0)
    return by.sigma > 0 && by.group > from.group ? 1 : 0;
  return by.sigma > 0 ? 1 : by.group <= from.group ? -1 : 0;
}

/// The sums of (3), group by group on the way from the predecessor to the successor.  A coordinate moves its own group where that lies before
/// it, which is on the side of the predecessor; what J × U has to do with lies on its other side.
///
///     at_ = [ side of s, outwards: groups 1, 2, … | side of p, outwards: groups 5, 6, … ]
///            0                                     middle                              n_
///
///     p ── 6 ── 5 ── common ── 1 ── 2 ── s      the walk: from n_ down to middle, then from 0 up to it
void variation::set_sums() {
  int middle = 0; // where coordinates on the side of the predecessor begin
  while (middle < n_ && at_[middle].sigma > 0)
    ++middle;
  W_ = nothing;
  for (int c = 0; c < n_; ++c)
    W_ = sum(W_, scaled(at_[c].sigma * at_[c].v, at_[c].J));
  screw<double> X = nothing, Y = nothing;
  const auto pass = [&](int begin, int end) {
    const screw<double> X_before = X, Y_before = Y;
    const bool own = at_[begin].sigma < 0;
    for (int c = begin; c < end; ++c)
      X = sum(X, scaled(at_[c].sigma * at_[c].v, at_[c].J));
    // V_s − V_c is the part of W between the body c and s.  On the side of p the coordinate c itself is in between; on the side of s it isn't.
    const screw<double> U = difference(W_, own ? X_before : X);
    for (int c = begin; c < end; ++c) {
      element &e = at_[c];
      e.rate = cross(e.J, U);
      Y = sum(Y, scaled(e.sigma, sum(scaled(e.a, e.J), scaled(e.v, e.rate))));
    }
    for (int c = begin; c < end; ++c)
      at_[c].X = own ? X : X_before, at_[c].Y = own ? Y : Y_before;
  };
  for (int end = n_, c; end > middle; end = c) {
    for (c = end - 1; c > middle && at_[c - 1].group == at_[end - 1].group; --c)
      ;
    pass(c, end);
  }
  for (int begin = 0, c; begin < middle; begin = c) {
    for (c = begin + 1; c < middle && at_[c].group == at_[begin].group; ++c)
      ;
    pass(begin, c);
  }
  rate_ = Y;
}

void variation::set_loop(const geometry &g, int loop, const double *v, const double *a) {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  n_ = l.support_end - l.support_begin;
  for (int c = 0; c < n_; ++c) {
    const support &side = t_.supports[static_cast<std::size_t>(l.support_begin + c)];
    const column &of = t_.columns[static_cast<std::size_t>(side.column)];
    at_[c] = {};
    at_[c].J = scaled(of.factor, g.column_at_successor(loop, side.column));
    at_[c].sigma = side.sign, at_[c].v = v[of.v], at_[c].a = a[of.v];
    at_[c].coordinate = of.v, at_[c].group = side.group;
  }
  set_sums();
  normal_ = {};
  if (row_has_two_axes(l.kind)) {
    const vec3<double> u1 = g.first_axis(loop), N = cross(u1, l.axis2);
    normal_ = {u1, N, cross(cross(u1, W_.ang), l.axis2), length(N)};
  }
}

/// Adds what a coordinate changes in the equations of the loop in hand.
void variation::vary(const geometry &g, int loop, const element &by) {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  const coscrew<double> *const T = g.wrenches_of(loop);
  const int nv = m_.nv();
  // (3), and by v_k: ∂(K̇ v)/∂v_k = σ (J × U + X × J), since v_k moves all U behind it, too
  const screw<double> bent = cross(by.X, cross(difference(W_, by.X), by.J));
  const screw<double> dW = scaled(by.sigma, cross(by.X, by.J)),
                      dRate = scaled(by.sigma, difference(cross(by.Y, by.J), bent)),
                      by_v = sum(scaled(by.sigma, by.rate), dW);
  const auto put = [&](double *matrix, int i, double x) { matrix[(l.first_row + i) * nv + by.coordinate] += x; };
  const bool turns = row_has_two_axes(l.kind);
  for (int i = 0; i < (turns ? 3 : l.rows); ++i) {
    put(velocity_by_q_, i, work(T[i], dW));
    put(acceleration_by_q_, i, work(T[i], dRate));
    put(acceleration_by_v_, i, work(T[i], by_v));
  }
  if (!turns || !(normal_.length > 0))
    return;
  // N · ω = 0 and N · ω̇ + Ṅ · ω = 0, N = u₁ × u₂ and Ṅ = (u₁ × ω) × u₂, as s sees them; dN = (u₁ × θ) × u₂
  const double unit = 1 / normal_.length;
  const vec3<double> turning = scaled(by.sigma, by.J.ang), du1 = cross(normal_.u1, turning), dN = cross(du1, l.axis2);
  // dN · ω + N · dω;  dN · ω̇ + N · dω̇ + dṄ · ω + Ṅ · dω, by position; by velocity N · dω̇ + dṄ · ω + Ṅ · dω with what v_k moves in each
  const vec3<double> dN_rate = cross(sum(cross(du1, W_.ang), cross(normal_.u1, dW.ang)), l.axis2),
                     dN_rate_by_v = cross(cross(normal_.u1, turning), l.axis2);
  put(velocity_by_q_, 3, unit * (dot(dN, W_.ang) + dot(normal_.N, dW.ang)));
  put(acceleration_by_q_, 3,
      unit * (dot(dN, rate_.ang) + dot(normal_.N, dRate.ang) + dot(dN_rate, W_.ang) + dot(normal_.rate, dW.ang)));
  put(acceleration_by_v_, 3,
      unit * (dot(normal_.N, by_v.ang) + dot(dN_rate_by_v, W_.ang) + dot(normal_.rate, turning)));
}

/// Adds what coordinate k changes in Kᵀ λ: f · dJ_c, f the wrench of the loop in hand; of a universal joint, whose normal turns, its
/// multiplier over the normal's length as well.
void variation::vary_wrenches(const coscrew<double> &f, double normal, const vec3<double> &axis2, int k) {
  const element &by = at_[k];
  // f · (J_c × J_k) = (J_k ×* f) · J_c
  const coscrew<double> turned = {cross(by.J.ang, f.lin), sum(cross(by.J.lin, f.lin), cross(by.J.ang, f.ang))};
  const vec3<double> turning = scaled(by.sigma * normal, by.J.ang), df = cross(cross(normal_.u1, turning), axis2);
  for (int c = 0; c < n_; ++c)
    wrench_by_q_[at_[c].coordinate * m_.nv() + by.coordinate] +=
        at_[c].sigma * (sign(c, k) * work(turned, at_[c].J) + dot(df, at_[c].J.ang));
}

void variation::set(const geometry &g, const double *v, const double *a, const double *lambda) {
  const int nv = m_.nv();
  for (double *matrix : {velocity_by_q_, acceleration_by_q_, acceleration_by_v_})
    std::fill_n(matrix, t_.rows * nv, 0.0);
  std::fill_n(wrench_by_q_, nv * nv, 0.0);
  for (int loop = 0; loop < static_cast<int>(t_.loops.size()); ++loop) {
    set_loop(g, loop, v, a);
    const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
    // the multiplier belongs to the unit normal N / |N|
    const bool turns = row_has_two_axes(l.kind) && normal_.length > 0;
    for (int k = 0; k < n_; ++k) {
      vary(g, loop, at_[k]);
      vary_wrenches(g.wrench(loop, lambda), turns ? lambda[l.first_row + 3] / normal_.length : 0, l.axis2, k);
    }
  }
}

} // namespace ksl::loops
