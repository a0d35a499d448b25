// Force elements as the engine computes them, elements::with_forces and elements::forces, with recorded calls in place of kernels.  Their choices,
// stops that are reached or points that coincide, are selects of steps, and a state without a force gets NaN.
#include "generate/recorded_elements.hpp"

#include "engine/elements/with_forces.hpp"
#include "generate/empty_memory.hpp"
#include "generate/recorded_calls.hpp"

#include <cstddef>

namespace ksl::generate {

/// Is it known to be zero, whatever the inputs are?
static bool is_zero(recording x) {
  const graph &g = *recording::current;
  return x.place() >= 0 && g.is_constant(x.place()) && g.number(x.place()) == 0;
}

namespace {

double rounding_in(bool single) { return single ? elements::rounding_of<float> : elements::rounding_of<double>; }

class one_state {
public:
  explicit one_state(const state_view<recording> &s)
      : memory_(laid_out([&](arena &pieces) { one_.lay_out(pieces, s.external.n, s.reactions_n); })),
        batch_(one_.of(s)) {}
  const batch_view<recording> &batch() const { return batch_; }

private:
  one_as_batch<recording> one_;
  empty_memory memory_;
  batch_view<recording> batch_;
};

} // namespace

void record_with_elements(const recorded_mechanism &of, const algorithm_row &row, const state_view<recording> &given) {
  const algorithm_row &by = computed(row);
  state_view<recording> s = given;
  const reaction_result<recording> reactions = {s.joints, by.results < most_results ? s.result[by.results] : nullptr};
  if (by.request == request_kind::reactions)
    s.reactions_n = 1, s.reactions = &reactions;
  const one_state state(s);
  elements::with_forces<recording, recorded_calls> work(row, of.m, rounding_in(of.single), recorded_calls(of));
  const empty_memory memory = laid_out([&](arena &pieces) { work.lay_out(pieces, state.batch(), 1); });
  work.run(state.batch(), 0, 1);
}

/// The external wrenches of a closed mechanism: those given, and two for each element, all in the axes of links.
recorded_forces::recorded_forces(const recorded_mechanism &of, const recording *q, const recording *v,
                                 const external_wrenches<recording> &given) {
  links_.assign(given.link, given.link + given.n);
  wrenches_.assign(given.wrench, given.wrench + 6 * given.n);
  if (of.m.acting_force_elements() == 0)
    return;
  state_view<recording> s;
  s.q = q, s.v = v, s.external = given, s.external.axes = expressed_in::frame;
  const one_state state(s);
  elements::forces<recording, recorded_calls> forces(of.m, of.m.acting_force_elements(), rounding_in(of.single),
                                                     recorded_calls(of));
  const empty_memory memory = laid_out([&](arena &pieces) { forces.lay_out(pieces, given.n, 1); });
  forces.set(state.batch(), 0, 1);
  for (int e = given.n; e < given.n + forces.ends(); ++e) {
    const external_rows<recording> &row = forces.external()[e];
    links_.push_back(row.link);
    wrenches_.insert(wrenches_.end(), row.wrench.first, row.wrench.first + 6);
  }
}

external_wrenches<recording> recorded_forces::all() const {
  return {static_cast<int>(links_.size()), links_.data(), wrenches_.data(), expressed_in::frame};
}

} // namespace ksl::generate
