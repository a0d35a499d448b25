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

/// Calls use(c, Σ_k p_ck of(k)) for all coordinates c, by one walk along either side.
template <class Of, class Use> void variation::for_sums(Of of, Use use) const {
  screw<double> beyond = nothing, group = nothing; // of the groups after that of c, and of its own
  int c = n_ - 1;
  while (c >= 0 && at_[c].sigma < 0)
    --c;
  const int middle = c + 1;
  for (; c >= 0; --c) { // on the side of the successor, from the end inwards
    if (c + 1 < middle && at_[c + 1].group != at_[c].group)
      beyond = sum(beyond, group), group = nothing;
    use(c, beyond);
    group = sum(group, of(c));
  }
  screw<double> left = sum(beyond, group); // V_s − V_p, less what moves c
  for (c = middle; c < n_;) {
    int end = c;
    for (; end < n_ && at_[end].group == at_[c].group; ++end)
      left = sum(left, scaled(-1, of(end)));
    for (; c < end; ++c)
      use(c, left);
  }
}

void variation::set_loop(const geometry &g, int loop, const double *v, const double *a) {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  n_ = l.support_end - l.support_begin;
  for (int c = 0; c < n_; ++c) {
    const support &side = t_.supports[static_cast<std::size_t>(l.support_begin + c)];
    const column &of = t_.columns[static_cast<std::size_t>(side.column)];
    at_[c] = {scaled(of.factor, g.column_at_successor(loop, side.column)),
              nothing,
              nothing,
              side.sign,
              v[of.v],
              a[of.v],
              of.v,
              side.group};
  }
  W_ = rate_ = nothing;
  for_sums([&](int k) { return scaled(at_[k].v, at_[k].J); }, [&](int c, const screw<double> &U) { at_[c].U = U; });
  for (int c = 0; c < n_; ++c) {
    element &e = at_[c];
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
  const auto varied = [&](int j) { return scaled(at_[j].v, dJ_[j]); };
  for_sums(varied, [&](int c, const screw<double> &dU) {
    const element &e = at_[c];
    const screw<double> bent = sum(cross(dJ_[c], e.U), cross(e.J, dU));
    dW = sum(dW, scaled(e.sigma * e.v, dJ_[c]));
    dRate = sum(dRate, scaled(e.sigma, sum(scaled(e.a, dJ_[c]), scaled(e.v, bent))));
    by_v = sum(by_v, scaled(e.sigma * e.v, dJ_[c])); // J_c × p_ck J_k
  });
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
    put(acceleration_by_v_, 3,
        unit * (dot(normal_.N, by_v.ang) + dot(dN_rate_by_v, W_.ang) + dot(normal_.rate, turning)));
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
