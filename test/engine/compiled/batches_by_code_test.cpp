// Batches by code that was made for a model: which calls it answers, and what is computed otherwise.
#include "engine/compiled/algorithms.hpp"
#include "ksl/batch.hpp"
#include "robots.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <vector>

namespace {

constexpr int lanes = 4;

/// Writes 1000 + q[0] into efforts, four states at a time, until a block has a first position above 100.
std::size_t marked(std::size_t n, const ksl::code_rows *inputs, const ksl::code_rows *results, void *) {
  const auto q = [&](std::size_t k) {
    return static_cast<const double *>(inputs[0].first)[static_cast<std::ptrdiff_t>(k) * inputs[0].stride];
  };
  for (std::size_t first = 0; first < n; first += lanes) {
    const std::size_t end = std::min(first + lanes, n);
    for (std::size_t k = first; k < end; ++k)
      if (q(k) > 100)
        return first;
    for (std::size_t k = first; results[0].first && k < end; ++k)
      static_cast<double *>(results[0].first)[static_cast<std::ptrdiff_t>(k) * results[0].stride] = 1000 + q(k);
  }
  return n;
}

ksl::model pendulum() {
  ksl::robot_description r;
  r.links = {robots::link("ceiling"), robots::link("bar", robots::solid(2, {0.1, 0, -0.5}, 0.2, 0.2, 0.01))};
  r.joints = {robots::joint("pin", ksl::joint_kind::continuous, 0, 1, {0, 0, 0}, {0, 1, 0})};
  return ksl::model(r);
}

ksl::model marked_model(const std::vector<int> &externals = {}) {
  const auto code = std::make_shared<ksl::machine_code>();
  ksl::requested_code &of = code->rows.emplace_back();
  of.asked = "inverse_dynamics", of.row = &ksl::rows::inverse_dynamics, of.run = marked, of.lanes = lanes;
  of.externals = externals;
  return pendulum().with_code(code);
}

struct states {
  std::vector<double> q, v, a, tau;
  ksl::batch_view<double> batch;
  explicit states(std::size_t n) : q(n), v(n, 0.5), a(n, -0.25), tau(n, -1) {
    for (std::size_t k = 0; k < n; ++k)
      q[k] = 0.1 * static_cast<double>(k);
    batch.n = n, batch.q = {q.data(), 1}, batch.v = {v.data(), 1}, batch.a = {a.data(), 1};
    batch.result[0] = {tau.data(), 1};
  }
};

} // namespace

TEST_CASE("a block that the code leaves is computed by the engine, and those after it by the code again") {
  const ksl::model m = marked_model();
  states with(21), without(21);
  with.q[9] = without.q[9] = 200;
  ksl::inverse_dynamics_batch(m, with.batch, 1);
  ksl::inverse_dynamics_batch(pendulum(), without.batch, 1);
  for (std::size_t k = 0; k < 21; ++k)
    CHECK(with.tau[k] == (k / lanes == 2 ? without.tau[k] : 1000 + with.q[k]));
}

TEST_CASE("one state, other precisions, wrenches and other mechanisms are the engine's") {
  const ksl::model m = marked_model();
  states one(1), alone(1);
  ksl::inverse_dynamics_batch(m, one.batch, 1);
  ksl::inverse_dynamics_batch(pendulum(), alone.batch, 1);
  CHECK(one.tau == alone.tau);

  CHECK(ksl::compiled::answers(ksl::rows::inverse_dynamics, m, states(5).batch));
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::forward_dynamics, m, states(5).batch));
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, m, ksl::batch_view<float>{}));
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, m.with_gravity({0, 0, -1}), states(5).batch));
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, m.with_inertias({{1, m.links()[1].inertia}}),
                                     states(5).batch));

  const double push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_rows<double> on_bar = {1, {push, 0}}, on_ceiling = {0, {push, 0}};
  states pushed(5);
  pushed.batch.external_n = 1, pushed.batch.external = &on_bar;
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, m, pushed.batch));
  CHECK(ksl::compiled::answers(ksl::rows::inverse_dynamics, marked_model({1}), pushed.batch));
  pushed.batch.external_axes = ksl::expressed_in::world;
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, marked_model({1}), pushed.batch));
  pushed.batch.external_axes = ksl::expressed_in::frame, pushed.batch.external = &on_ceiling;
  CHECK_FALSE(ksl::compiled::answers(ksl::rows::inverse_dynamics, marked_model({1}), pushed.batch));
}

TEST_CASE("inputs that a batch lacks are zeros") {
  const ksl::model m = marked_model();
  states some(6);
  some.batch.q = {};
  ksl::inverse_dynamics_batch(m, some.batch, 1);
  CHECK(some.tau == std::vector<double>(6, 1000));
}
