// The faces of every algorithm where memory runs out: C++ and C, one state and batches.  Calls for one state need none.  The first batch
// of a thread needs some; where it gets none it says so and writes nothing, or computes alone what threads would have shared.
// Then it needs no more.
#pragma once

#include "../engine/faces.hpp"
#include "starve.hpp"
#include "robot_files.hpp"

namespace starved {

using starve::end;

/// A call for each state succeeds although no allocation does.
template <class S> void without_memory(faces::check<S> &faces, faces::one_call<S> call,
                                       const faces::results<S> &expected) {
  const auto starving = [&](faces::one<S> &s) {
    fail_allocation(1, true);
    call(s);
    stop_failing_allocations();
  };
  CHECK(faces.states(starving) == expected);
}

/// Every allocation of the first batch of a thread fails in turn.
template <class S>
void first_batch(faces::check<S> &faces, faces::batch_call<S> call, std::size_t n, int threads,
                 const faces::results<S> &expected) {
  faces::results<S> untouched = expected;
  for (std::vector<S> &x : untouched.numbers)
    std::fill(x.begin(), x.end(), S(-7));
  for (const bool all_after : {false, true}) {
    long nth = 0, failed = 0;
    do {
      ++nth;
      CAPTURE(nth);
      CAPTURE(all_after);
      end found = end::other;
      const auto starving = [&](faces::many<S> &s) {
        std::thread([&] {
          fail_allocation(nth, all_after);
          found = starve::of_call([&] { call(s); });
          if (found == end::usual)
            found = starve::of_status(s.status);
          failed = stop_failing_allocations();
        }).join();
        s.status = KSL_OK;
      };
      const faces::results<S> given = faces.batch(starving, n, threads);
      CHECK(found != end::other);
      CHECK(given == (found == end::usual ? expected : untouched));
      ++starve::all().calls, starve::all().failures += found == end::no_memory;
    } while (failed > 0);
  }
  // the thread has what it needs: no allocation need succeed
  faces.batch(call, n, threads);
  const auto starving = [&](faces::many<S> &s) {
    fail_allocation(1, true);
    call(s);
    stop_failing_allocations();
  };
  CHECK(faces.batch(starving, n, threads) == expected);
}

template <class S>
void check_robot(faces::robot &r, const ksl::algorithm_row &row, faces::one_call<S> cpp, faces::one_call<S> c,
                 faces::batch_call<S> cpp_batch, faces::batch_call<S> c_batch) {
  // threads are the same for all algorithms: of most, one part of a batch is enough
  const bool shared = &row == &ksl::rows::inverse_dynamics_with_reactions || &row == &ksl::rows::forward_dynamics;
  const std::size_t n = shared ? 2 * ksl::least_states(r.m.moving_joints()) : 5;
  faces::check<S> faces(row, r, n);
  faces::results<S> expected = faces.states(cpp);
  without_memory<S>(faces, cpp, expected);
  without_memory<S>(faces, c, expected);
  for (std::vector<S> &x : expected.numbers)
    x.pop_back(); // the number that nobody writes
  for (const auto &[states, threads] : {std::pair<std::size_t, int>{1, 1}, {n, 2}}) {
    const std::size_t count = states;
    CAPTURE(count);
    first_batch<S>(faces, cpp_batch, count, threads, faces.first(expected, count));
    first_batch<S>(faces, c_batch, count, threads, faces.first(expected, count));
  }
}

} // namespace starved

namespace faces {

/// What algorithms_test.cpp calls for each algorithm, each with its faces.
template <class S>
void starve_all(const ksl::algorithm_row &row, one_call<S> cpp, one_call<S> c, batch_call<S> cpp_batch,
                batch_call<S> c_batch, bool = false) {
  ksl::assume_cores(2);
  static robot every_kind(every_kind_file, false), coupled(coupled_file, false);
  starved::check_robot<S>(every_kind, row, cpp, c, cpp_batch, c_batch);
  if (row.mimic != ksl::mimic_by::refusal)
    starved::check_robot<S>(coupled, row, cpp, c, cpp_batch, c_batch);
}

} // namespace faces
#define agree starve_all
