#include "generate/recorded_mimic.hpp"

#include "engine/mimic/projection.hpp"
#include "generate/recorded_rows.hpp"

#include <cstddef>
#include <vector>

namespace ksl::generate {
namespace {

using numbers = std::vector<recording>;

/// How the expanded mechanism follows from a user's numbers, with recorded constants.
class recorded_coupling {
public:
  template <class S> explicit recorded_coupling(const coupling_view<S> &from) {
    for (const follower<S> *f = from.follower; f < from.follower + from.followers; ++f)
      followers_.push_back({f->q, f->v, f->leader_q, f->leader_v, f->multiplier, f->offset});
    view_ = {from.followers, followers_.data(), from.nq, from.nv, from.in_q, from.in_v};
  }
  const coupling_view<recording> &view() const { return view_; }

private:
  std::vector<follower<recording>> followers_;
  coupling_view<recording> view_;
};

struct mechanism {
  const model &m;
  const coupling_view<recording> &coupling;
  const model_view<recording> &view;
};

/// Inputs are expanded, the algorithm runs, and results are reduced axis by axis.
void record_projection(const mechanism &of, const algorithm_row &row, const state_view<recording> &given) {
  const extents own = extents_of(of.m, given), full = mimic::expanded(of.m, own);
  numbers inputs[most_inputs], results[most_results];
  state_view<recording> s = given;
  for (int i = 0; i < row.inputs; ++i) {
    const input x = row.input_list[i];
    if (x == input::fraction)
      continue;
    inputs[i].resize(static_cast<std::size_t>(length_of(x, full.nq, full.nv)));
    mimic::expand(of.coupling, row, x, input_of(given, x), inputs[i].data());
    input_of(s, x) = inputs[i].data();
  }
  for (int r = 0; r < row.results; ++r)
    if (mimic::is_reduced(row.result[r])) {
      results[r].resize(static_cast<std::size_t>(numbers_of(row.result[r], full)));
      s.result[r] = results[r].data();
    }
  recorder_of(row.name)(of.view, s);
  for (int r = 0; r < row.results; ++r)
    if (mimic::is_reduced(row.result[r]))
      mimic::reduce(of.coupling, row.result[r], full, own, results[r].data(), given.result[r]);
}

/// x = A⁻¹ x of a symmetric positive definite matrix (n, n), which is overwritten: the steps of linalg_ldlt and linalg_ldlt_solve.  x is NaN where a pivot
/// is not above zero.
void solve(numbers &A, recording *x, int n) {
  const auto at = [&](int i, int j) -> recording & { return A[static_cast<std::size_t>(i * n + j)]; };
  const recording zero = 0.0, nan = recording(0.0) / recording(0.0);
  recording fault = zero;
  for (int k = 0; k < n; ++k) {
    const recording d = at(k, k);
    fault = math<recording>::select(d > zero, fault, nan);
    for (int i = k + 1; i < n; ++i)
      at(k, i) = at(i, k), at(i, k) = at(i, k) / d;
    for (int i = k + 1; i < n; ++i)
      for (int j = k + 1; j <= i; ++j)
        at(i, j) = at(i, j) - at(i, k) * at(k, j);
  }
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < i; ++k)
      x[i] = x[i] - at(i, k) * x[k];
  for (int i = 0; i < n; ++i)
    x[i] = x[i] / at(i, i);
  for (int i = n - 1; i >= 0; --i)
    for (int k = i + 1; k < n; ++k)
      x[i] = x[i] - at(k, i) * x[k];
  for (int i = 0; i < n; ++i)
    x[i] = x[i] + fault;
}

/// The solution of M a = τ − bias, M⁻¹ τ, or the upper triangle of M, from M = Gᵀ M̂ G.
void record_dense(const mechanism &of, const algorithm_row &row, const state_view<recording> &given) {
  const int nv = of.m.nv();
  const auto n = static_cast<std::size_t>(nv);
  numbers M(n * n), bias(n, recording(0.0)), zero(n, recording(0.0));
  state_view<recording> s = given;
  s.a = zero.data(), s.result[0] = bias.data();
  if (row.mimic == mimic_by::solution)
    record_projection(of, rows::inverse_dynamics, s);
  s.result[0] = M.data();
  record_projection(of, rows::mass_matrix, s);
  if (row.mimic == mimic_by::upper_triangle) {
    for (std::size_t i = 0; i < n; ++i)
      std::copy_n(&M[i * n + i], n - i, given.result[0] + i * n + i);
    return;
  }
  for (int i = 0; i < nv; ++i)
    given.result[0][i] = given.tau[i] - bias[static_cast<std::size_t>(i)];
  solve(M, given.result[0], nv);
}

} // namespace

bool has_recording_with_followers(const algorithm_row &row) {
  return row.mimic == mimic_by::projection || row.mimic == mimic_by::solution || row.mimic == mimic_by::product ||
         row.mimic == mimic_by::upper_triangle;
}

void record_with_followers(const algorithm_row &row, const model &m, bool single, const model_view<recording> &view,
                           const state_view<recording> &s) {
  const recorded_coupling coupling =
      single ? recorded_coupling(m.coupling_in<float>()) : recorded_coupling(m.coupling_in<double>());
  const mechanism of = {m, coupling.view(), view};
  if (row.mimic == mimic_by::projection)
    record_projection(of, row, s);
  else
    record_dense(of, row, s);
}

} // namespace ksl::generate
