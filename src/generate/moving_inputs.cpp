#include "generate/moving_inputs.hpp"

#include "generate/recorded_loops.hpp"
#include "generate/recorded_model.hpp"

#include <cstddef>

// A closed mechanism moves with its independent coordinates ε of q, of v and of a (motions_along in recorded_loops.hpp):
//
//     δq = G ε_q,   δv = v_by_q ε_q + G ε_v,   δa = a_by_q ε_q + a_by_v ε_v + G ε_a                                        (1)
//
// and the numbers of q move by ∂(q ⊕ δ)/∂δ δq.  rates() is (1), weights() its transpose from the last to the first.
//
// With P = ∂(q ⊕ δ)/∂δ and weights q̄, v̄, ā of numbers, the transpose of (1) is
//
//     w_a = Gᵀ ā,   w_v = Gᵀ v̄ + a_by_vᵀ ā,   w_q = Gᵀ Pᵀ q̄ + v_by_qᵀ v̄ + a_by_qᵀ ā                                     (2)

namespace ksl::generate {
namespace {

request integration(bool single) {
  request asked;
  asked.row = "integrate", asked.single = single;
  return asked;
}

/// out += A x, A (out, x).
void add_product(const recordings &A, const recordings &x, recordings &out) {
  for (std::size_t i = 0; i < out.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j)
      out[i] = out[i] + A[i * x.size() + j] * x[j];
}
/// out += Aᵀ x, A (x, out).
void add_transposed_product(const recordings &A, const recordings &x, recordings &out) {
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < out.size(); ++j)
      out[j] = out[j] + A[i * out.size() + j] * x[i];
}

} // namespace

/// How numbers of q change along joint velocities: q ⊕ δ at δ = 0.
class moving_inputs::positions {
public:
  // ⊕ is an algorithm, too: recorded, and differentiated by its second argument at zero
  positions(const model &m, bool single, const recordings &q)
      : zeros_(q.size(), recording(0.0)), moved_(record(m, integration(single))),
        along_(moved_.steps, joined(q, recordings(static_cast<std::size_t>(m.nv()), recording(0.0)))) {}
  recordings rates(const recordings &of_motion) const { return along_.rates(joined(zeros_, of_motion)); }
  recordings weights(const recordings &of_positions) const {
    const recordings all = along_.weights(of_positions);
    return {all.begin() + static_cast<std::ptrdiff_t>(zeros_.size()), all.end()};
  }

private:
  recordings zeros_;
  recorded moved_;
  differentiation along_;
};

struct moving_inputs::along {
  recorded_model model;
  motion_along motion;

  along(const ksl::model &m, bool single, const recording *q, const recording *v, const recording *a)
      : model(m.view()), motion(found(m, single, q, v, a)) {}

  motion_along found(const ksl::model &m, bool single, const recording *q, const recording *v, const recording *a) {
    model.set_loops(*m.plan_of_loops(), false);
    return motions_along({m, single, model.view()}, q, v, a);
  }
};

moving_inputs::moving_inputs(const model &m, const recorded &of, const recordings &given, bool single) {
  // how q, v and a of a closed mechanism vary depends on v and a: zero where the algorithm has none
  const recordings still(static_cast<std::size_t>(m.nv()), recording(0.0));
  const recording *v = still.data(), *a = still.data(), *x = given.data();
  const bool is_closed = !m.loops().empty();
  const int coordinates = is_closed ? m.view().loops->freedoms : m.nv();
  for (const recorded_input &in : of.inputs) {
    const int which = static_cast<int>(sizes_.size());
    if (is_closed && in.name == "v")
      v_ = which, v = x;
    if (is_closed && in.name == "a")
      a_ = which, a = x;
    sizes_.push_back(which == 0 || which == v_ || which == a_ ? coordinates : in.numbers);
    numbers_.push_back(in.numbers);
    x += in.numbers;
  }
  positions_ = std::make_unique<positions>(m, single, recordings(given.begin(), given.begin() + m.nq()));
  if (is_closed)
    along_ = std::make_unique<along>(m, single, given.data(), v, a);
}

moving_inputs::~moving_inputs() = default;

recording moving_inputs::fault() const { return along_ ? along_->motion.fault : recording(0.0); }

recordings moving_inputs::rates(std::vector<recordings> of_inputs) const {
  if (along_) {
    const motion_along &by = along_->motion;
    const auto n = by.G.size() / static_cast<std::size_t>(by.freedoms);
    const auto varied = [&](const recordings &A, const recordings &x, const recordings &start) {
      recordings out = start;
      add_product(A, x, out);
      return out;
    };
    // ε_q and ε_v are copied before δq and δv take their places: δv and δa need them
    const recordings none(n, recording(0.0)), q = of_inputs[0];
    recordings v(static_cast<std::size_t>(by.freedoms), recording(0.0));
    of_inputs[0] = varied(by.G, q, none);
    if (v_ >= 0) {
      recordings &moving = of_inputs[static_cast<std::size_t>(v_)];
      v = moving;
      moving = varied(by.G, v, varied(by.v_by_q, q, none));
    }
    if (a_ >= 0) {
      recordings &a = of_inputs[static_cast<std::size_t>(a_)];
      a = varied(by.G, a, varied(by.a_by_v, v, varied(by.a_by_q, q, none)));
    }
  }
  of_inputs[0] = positions_->rates(of_inputs[0]);
  recordings all;
  for (const recordings &x : of_inputs)
    all = joined(std::move(all), x);
  return all;
}

std::vector<recordings> moving_inputs::weights(const recordings &of_numbers) const {
  std::vector<recordings> by;
  auto from = of_numbers.begin();
  for (const int n : numbers_)
    by.emplace_back(from, from + n), from += n;
  by[0] = positions_->weights(by[0]);
  if (!along_)
    return by;
  const motion_along &m = along_->motion;
  recordings of_q(static_cast<std::size_t>(m.freedoms), recording(0.0)), of_v = of_q, of_a = of_q;
  add_transposed_product(m.G, by[0], of_q);
  if (v_ >= 0) {
    add_transposed_product(m.v_by_q, by[static_cast<std::size_t>(v_)], of_q);
    add_transposed_product(m.G, by[static_cast<std::size_t>(v_)], of_v);
  }
  if (a_ >= 0) {
    const recordings &w = by[static_cast<std::size_t>(a_)];
    add_transposed_product(m.a_by_q, w, of_q), add_transposed_product(m.a_by_v, w, of_v);
    add_transposed_product(m.G, w, of_a);
    by[static_cast<std::size_t>(a_)] = of_a;
  }
  if (v_ >= 0)
    by[static_cast<std::size_t>(v_)] = of_v;
  by[0] = of_q;
  return by;
}

} // namespace ksl::generate
