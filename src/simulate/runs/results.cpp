#include "simulate/runs/results.hpp"

#include "batch/compute_batch.hpp"
#include "engine/kernels/algorithm_rows.hpp"

#include <cmath>
#include <limits>

namespace ksl::simulating {

//     row of run k of a block at times[i], in arrays (runs, times, columns):    (b.first + k) · times + i
//
// A block holds consecutive runs at one time, so that its rows lie `times` rows apart: the stride that energies and momenta are written with.
void results::store(system &of, std::size_t i, const block &b, double *closure) const {
  const std::size_t times = task_.times_n, first = b.first * times + i, nq = of.nq(), nv = of.nv();
  const auto copy = [&](const double *from, std::size_t columns, double *to) {
    for (std::size_t k = 0; to && k < b.n; ++k)
      std::copy_n(from + k * columns, columns, to + (first + k * times) * columns);
  };
  copy(b.q.data(), nq, out_.q), copy(b.v.data(), nv, out_.v), copy(b.a.data(), nv, out_.a);
  copy(of.tau(), nv, out_.tau), copy(b.work.data(), 1, out_.work);
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(times);
  if (out_.kinetic || out_.potential)
    energies(of, b, out_.kinetic ? out_.kinetic + first : nullptr, out_.potential ? out_.potential + first : nullptr,
             stride);
  if (out_.momentum) {
    batch_view<double> batch;
    batch.n = b.n, batch.q = {b.q.data(), of.of().nq()}, batch.v = {b.v.data(), of.of().nv()};
    batch.result[0] = {out_.momentum + 6 * first, 6 * stride};
    compute_states(rows::centroidal_momentum, of.of(), batch, 0, b.n);
  }
  // the most that loops have opened since the row before, this state included
  for (std::size_t k = 0; out_.closure && k < b.n; ++k) {
    out_.closure[first + k * times] = of.closed() ? std::fmax(closure[k], of.closed()->error(b.q.data() + k * nq)) : 0;
    closure[k] = 0;
  }
}

void energies(const system &of, const block &b, double *kinetic, double *potential, std::ptrdiff_t stride) {
  batch_view<double> batch;
  batch.n = b.n, batch.q = {b.q.data(), of.of().nq()}, batch.v = {b.v.data(), of.of().nv()};
  if (kinetic)
    batch.result[0] = {kinetic, stride};
  if (potential)
    batch.result[1] = {potential, stride};
  compute_states(rows::energy, of.of(), batch, 0, b.n);
}

void results::erase(const system &of, std::size_t run, std::size_t i) const {
  const std::size_t times = task_.times_n;
  const auto fill = [&](double *to, std::size_t columns) {
    if (to)
      std::fill_n(to + (run * times + i) * columns, (times - i) * columns, std::numeric_limits<double>::quiet_NaN());
  };
  fill(out_.q, of.nq());
  for (double *x : {out_.v, out_.a, out_.tau})
    fill(x, of.nv());
  for (double *x : {out_.kinetic, out_.potential, out_.work, out_.closure})
    fill(x, 1);
  fill(out_.momentum, 6);
}

int not_finite_speed(const system &of, const block &b, std::size_t k) {
  const double *const v = b.v.data() + k * of.nv();
  for (std::size_t i = 0; i < of.nv(); ++i)
    if (!std::isfinite(v[i]))
      return static_cast<int>(i);
  return -1;
}

/// The first coordinate whose velocity or acceleration isn't finite; 0 where only numbers of q aren't; −1: all are.
int not_finite(const system &of, const block &b, std::size_t k) {
  const std::size_t nv = of.nv();
  for (std::size_t i = 0; i < nv; ++i)
    if (!std::isfinite(b.v[k * nv + i]) || !std::isfinite(b.a[k * nv + i]))
      return static_cast<int>(i);
  for (std::size_t i = 0; i < of.nq(); ++i)
    if (!std::isfinite(b.q[k * of.nq() + i]))
      return 0;
  return -1;
}

} // namespace ksl::simulating
