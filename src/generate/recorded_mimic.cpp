// The specialisation below stands for projection.hpp's template, so that systems.hpp computes over recordings what it computes over numbers: only
// where kernels would be called the steps of an algorithm are recorded instead, into arrays of the call.
#include "generate/recorded_mimic.hpp"

#include "engine/mimic/systems.hpp"
#include "generate/empty_memory.hpp"
#include "generate/recorded_matrix.hpp"
#include "generate/recorded_rows.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace ksl::mimic {

using generate::recording;

/// Inputs are expanded, the algorithm is recorded, and results are reduced axis by axis.
template <> struct projection<recording> {
  const algorithm_row &row;
  const model &m;
  model_view<recording> view;
  coupling_view<recording> c;

  std::size_t state_bytes(const extents &) const { return 0; } // it has memory of its own
  void state(void *, const state_view<recording> &given) const {
    const extents own = extents_of(m, given), full = expanded(m, own);
    generate::recordings inputs[most_inputs], results[most_results];
    state_view<recording> s = given;
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      if (x == input::fraction)
        continue;
      inputs[i].resize(static_cast<std::size_t>(length_of(x, full.nq, full.nv)));
      expand(c, row, x, input_of(given, x), inputs[i].data());
      input_of(s, x) = inputs[i].data();
    }
    for (int r = 0; r < row.results; ++r) {
      results[r].resize(static_cast<std::size_t>(numbers_of(row.result[r], full)));
      if (is_reduced(row.result[r]) || !given.result[r])
        s.result[r] = results[r].data();
    }
    generate::recorder_of(row.name)(view, s);
    for (int r = 0; r < row.results; ++r)
      if (is_reduced(row.result[r]) && given.result[r])
        reduce(c, row.result[r], full, own, results[r].data(), given.result[r]);
  }
};

} // namespace ksl::mimic

namespace ksl::generate {
namespace {

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

/// The solution of M a = τ − bias, M⁻¹ τ, M⁻¹, or the upper triangle of M, from M = Gᵀ M̂ G.
void record_dense(mimic_by what, const mimic::systems<recording> &of, const state_view<recording> &given) {
  const int nv = of.m.nv();
  const auto n = static_cast<std::size_t>(nv);
  // Gᵀ M̂ G by projection of the mass matrix, bias by inverse dynamics with a = 0
  recordings M(n * n), bias(n), zero(n, recording(0.0));
  state_view<recording> s = given;
  s.a = zero.data(), s.result[0] = bias.data();
  if (what == mimic_by::solution)
    of.efforts.state(nullptr, s);
  s.result[0] = M.data();
  of.inertia.state(nullptr, s);
  mimic::finish_dense(what, nv, M.data(), bias.data(), given.tau, given.result[0]);
}

recorded_coupling coupling_of(const model &m, bool single) {
  return single ? recorded_coupling(m.coupling_in<float>()) : recorded_coupling(m.coupling_in<double>());
}

} // namespace

recordings expanded_position(const model &m, bool single, const recording *q) {
  if (m.followers() == 0)
    return {q, q + m.nq()};
  recordings all(static_cast<std::size_t>(m.view().nq));
  const recorded_coupling coupling = coupling_of(m, single);
  expand_position(coupling.view(), q, all.data());
  return all;
}

recordings expanded_motion(const model &m, bool single, const recording *v) {
  if (m.followers() == 0)
    return {v, v + m.nv()};
  recordings all(static_cast<std::size_t>(m.view().nv));
  const recorded_coupling coupling = coupling_of(m, single);
  expand_motion(coupling.view(), v, all.data());
  return all;
}

/// (nv) in_v: where each coordinate of users is among the expanded ones.
std::vector<int> own_coordinates(const model &m) {
  std::vector<int> places(static_cast<std::size_t>(m.nv()));
  std::iota(places.begin(), places.end(), 0);
  if (m.followers() > 0)
    std::copy_n(m.coupling_in<double>().in_v, m.nv(), places.begin());
  return places;
}

/// As mimic::run_state, by the same column of the row: projection, systems, or M once and one right side.
void record_with_followers(const algorithm_row &row, const model &m, bool single, const model_view<recording> &view,
                           const state_view<recording> &s) {
  const recorded_coupling coupling = coupling_of(m, single);
  if (row.mimic == mimic_by::projection)
    return mimic::projection<recording>{row, m, view, coupling.view()}.state(nullptr, s);
  const mimic::systems<recording> systems = {row.mimic, m, view, coupling.view()};
  if (!mimic::has_systems(row.mimic))
    return record_dense(row.mimic, systems, s);
  empty_memory memory(systems.state_bytes(extents_of(m, s)));
  systems.state(memory.begin(), s);
}

} // namespace ksl::generate
