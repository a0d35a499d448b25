// Runs a call again and again, and lets its first, second, third, … allocation fail, once and with all that follow: until none of its
// allocations is left.  It must then have done what it does, or have said that memory ran out; have left nothing behind; and succeed
// when there is memory again.
#pragma once

#include "../engine/allocation.hpp"

#include "ksl/engine.h"
#include "ksl/model.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <new>
#include <string>
#include <thread>

namespace starve {

/// How a call ended: as with memory enough, for want of memory, or otherwise.
enum class end { usual, no_memory, other };

/// The outcome of a call from C.  A refusal stays one where only its message found no memory.
inline end of_status(ksl_status_t status, ksl_status_t usual = KSL_OK) {
  if (status == usual)
    return end::usual;
  return status == KSL_FAILED && std::strcmp(ksl_error_message(), "out of memory") == 0 ? end::no_memory : end::other;
}

/// The outcome of a call from C++; with `refused`, the usual end is a description_error.
template <class Call> end of_call(Call call, bool refused = false) {
  try {
    call();
    return refused ? end::other : end::usual;
  } catch (const std::bad_alloc &) {
    return end::no_memory;
  } catch (const ksl::description_error &) {
    return refused ? end::usual : end::other;
  } catch (...) {
    return end::other;
  }
}

/// On the thread that calls it, or on one of its own, which has called nothing before: first uses are part of the call then.
enum class thread { this_one, new_one };

/// What has been tried, for the last test.
struct totals { long calls = 0, failures = 0; };
inline totals &all() {
  static totals t;
  return t;
}

template <class Run> end run_with_failure(Run &run, thread where, long nth, bool all_after, long &failed) {
  end found = end::other;
  const auto here = [&] {
    if (nth > 0)
      fail_allocation(nth, all_after);
    found = run();
    failed = stop_failing_allocations();
  };
  if (where == thread::new_one)
    std::thread(here).join();
  else
    here();
  return found;
}

/// run() makes the call and returns how it ended; then after(end) checks what it left, and frees it.  Neither run() nor the objects
/// around it may allocate on their own account.
template <class Run, class After> void call(const std::string &name, thread where, Run run, After after) {
  CAPTURE(name);
  long failed = 0;
  const auto again = [&] {
    const end found = run_with_failure(run, where, 0, false, failed);
    after(found);
    return found;
  };
  REQUIRE(again() == end::usual);
  const long live = live_blocks;
  REQUIRE(again() == end::usual);
  CHECK(live_blocks == live);
  for (const bool all_after : {false, true})
    for (long nth = 1;; ++nth) {
      CAPTURE(nth);
      CAPTURE(all_after);
      const end found = run_with_failure(run, where, nth, all_after, failed);
      if (found == end::other)
        MESSAGE(name << ": " << std::string(ksl_error_message()));
      CHECK(found != end::other);
      after(found);
      ++all().calls, all().failures += found == end::no_memory;
      CHECK(again() == end::usual);
      CHECK(live_blocks == live);
      if (failed == 0)
        break;
    }
}

} // namespace starve
