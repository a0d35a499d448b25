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
  at_ = memory.take<element>(most), dJ_ = memory.take<screw<double>>(most);
  velocity_by_q_ = memory.take<double>(rows * nv), acceleration_by_q_ = memory.take<double>(rows * nv);
  acceleration_by_v_ = memory.take<double>(rows * nv), wrench_by_q_ = memory.take<double>(nv * nv);
}

/// p_ck of (1); 0 where k is not on the way.  Coordinates of one group move the body c together.
double variation::sign(int c, int k) const {
  const element &from = at_[c], &by = at_[k];
  if (from.sigma > 0)
    return by.sigma > 0 && by.group > from.group ? 1 : 0;
  return by.sigma > 0 ? 1 : by.group <= from.group ? -1 : 0;
}

void variation::set_loop(const geometry &g, int loop, const double *v, const double *a) {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  n_ = l.support_end - l.support_begin;
  for (int c = 0; c < n_; ++c) {
    const support &side = t_.supports[static_cast<std::size_t>(l.support_begin + c)];
    const column &of = t_.columns[static_cast<std::size_t>(side.column)];
    at_[c] = {scaled(of.factor, g.column_at_successor(loop, side.column)), nothing, nothing, side.sign, v[of.v], a[of.v], of.v, side.group};
  }
  W_ = rate_ = nothing;
  for (int c = 0; c < n_; ++c) {
    element &e = at_[c];
    for (int k = 0; k < n_; ++k)
      if (const double p = sign(c, k); p != 0)
        e.U = sum(e.U, scaled(p * at_[k].v, at_[k].J));
    e.rate = cross(e.J, e.U);
    W_ = sum(W_, scaled(e.sigma * e.v, e.J));
    rate_ = sum(rate_, scaled(e.sigma, sum(scaled(e.a, e.J), scaled(e.v, e.rate))));
  }
  if (row_has_two_axes(l.kind)) {
    const vec3<double> u1 = g.first_axis(loop), N = cross(u1, l.axis2);
    normal_ = {u1, N, cross(cross(u1, W_.ang), l.axis2), length(N)};
  }
}

/// Adds what coordinate k of the loop in hand changes.
void variation::vary(const geometry &g, int loop, int k, const double *lambda) {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  const coscrew<double> *const T = g.wrenches_of(loop);
  const element &by = at_[k];
  const int nv = m_.nv();
  for (int c = 0; c < n_; ++c) {
    const double p = sign(c, k);
    dJ_[c] = p == 0 ? nothing : scaled(p, cross(at_[c].J, by.J));
  }
  screw<double> dW = nothing, dRate = nothing, by_v = scaled(by.sigma, by.rate);
  for (int c = 0; c < n_; ++c) {
    const element &e = at_[c];
    screw<double> dU = nothing;
    for (int j = 0; j < n_; ++j)
      if (const double p = sign(c, j); p != 0)
        dU = sum(dU, scaled(p * at_[j].v, dJ_[j]));
    const screw<double> bent = sum(cross(dJ_[c], e.U), cross(e.J, dU));
    dW = sum(dW, scaled(e.sigma * e.v, dJ_[c]));
    dRate = sum(dRate, scaled(e.sigma, sum(scaled(e.a, dJ_[c]), scaled(e.v, bent))));
    by_v = sum(by_v, scaled(e.sigma * e.v, dJ_[c])); // J_c × p_ck J_k
  }
  coscrew<double> f = {{0, 0, 0}, {0, 0, 0}};
  const auto put = [&](double *matrix, int i, double x) { matrix[(l.first_row + i) * nv + by.coordinate] += x; };
  const int constant = row_has_two_axes(l.kind) ? 3 : l.rows;
  for (int i = 0; i < l.rows; ++i) {
    const double x = lambda[l.first_row + i];
    f = {sum(f.lin, scaled(x, T[i].lin)), sum(f.ang, scaled(x, T[i].ang))};
    if (i >= constant)
      continue;
    put(velocity_by_q_, i, work(T[i], dW));
    put(acceleration_by_q_, i, work(T[i], dRate));
    put(acceleration_by_v_, i, work(T[i], by_v));
  }
  vec3<double> df = {0, 0, 0};
  if (constant < l.rows && normal_.length > 0) {
    const double unit = 1 / normal_.length;
    const vec3<double> turning = scaled(by.sigma, by.J.ang), du1 = cross(normal_.u1, turning), dN = cross(du1, l.axis2);
    const vec3<double> dN_rate = cross(sum(cross(du1, W_.ang), cross(normal_.u1, dW.ang)), l.axis2),
                       dN_rate_by_v = cross(cross(normal_.u1, turning), l.axis2);
    put(velocity_by_q_, 3, unit * (dot(dN, W_.ang) + dot(normal_.N, dW.ang)));
    put(acceleration_by_q_, 3,
        unit * (dot(dN, rate_.ang) + dot(normal_.N, dRate.ang) + dot(dN_rate, W_.ang) + dot(normal_.rate, dW.ang)));
    put(acceleration_by_v_, 3, unit * (dot(normal_.N, by_v.ang) + dot(dN_rate_by_v, W_.ang) + dot(normal_.rate, turning)));
    df = scaled(lambda[l.first_row + 3] * unit, dN);
  }
  for (int c = 0; c < n_; ++c)
    wrench_by_q_[at_[c].coordinate * nv + by.coordinate] += at_[c].sigma * (work(f, dJ_[c]) + dot(df, at_[c].J.ang));
}

void variation::set(const geometry &g, const double *v, const double *a, const double *lambda) {
  const int nv = m_.nv();
  for (double *matrix : {velocity_by_q_, acceleration_by_q_, acceleration_by_v_})
    std::fill_n(matrix, t_.rows * nv, 0.0);
  std::fill_n(wrench_by_q_, nv * nv, 0.0);
  for (int loop = 0; loop < static_cast<int>(t_.loops.size()); ++loop) {
    set_loop(g, loop, v, a);
    for (int k = 0; k < n_; ++k)
      vary(g, loop, k, lambda);
  }
}

} // namespace ksl::loops
