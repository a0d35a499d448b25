// Algorithms of the tree that carries the loops, for one state in double precision, in memory that is given.
#pragma once

#include "engine/elements/algorithms.hpp"
#include "engine/mimic/mechanism_kernel.hpp"

namespace ksl::loops {

class tree_calls {
public:
  explicit tree_calls(const model &m) : m_(m) {}

  const model &of() const { return m_; }

  /// Bytes that a call of the row needs for requests of so many links and joints, with so many external wrenches.
  std::size_t bytes(const algorithm_row &row, int links, int joints, int externals) const {
    return calls_in(elements::ways<double>, row, m_).state_bytes(row, m_, {externals, links, joints, 1});
  }

  void call(const algorithm_row &row, void *memory, const state_view<double> &s) const {
    calls_in(elements::ways<double>, row, m_).run_state(row, m_, memory, s);
  }

  /// A call without gravity, without joint physics and without force elements.
  void call_weightless(const algorithm_row &row, void *memory, const state_view<double> &s) const {
    model_view<double> view = m_.view();
    view.gravity = {0, 0, 0};
    view.physics = nullptr;
    mimic::mechanism_kernel<double>{row, m_, view}.state(memory, s);
  }

private:
  const model &m_;
};

} // namespace ksl::loops
