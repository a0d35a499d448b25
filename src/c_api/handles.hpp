// What all files of the C interface share: the handles, and the wrapper that turns exceptions into a status.
//
// The caller owns both handles, and frees a workspace before its model, which it points to.  A model never changes after it is made, and may serve many
// threads; a workspace serves one at a time.
#pragma once

#include "ksl/dynamics.hpp"
#include "ksl/engine.h"

#include <new>
#include <stdexcept>
#include <string>
#include <vector>

struct ksl_model_t { ksl::model model; };

struct ksl_data_t {
  const ksl_model_t *model;
  ksl::data data;
  /// Size of a number in bytes if the last call that wrote to the workspace was inverse dynamics, which reactions need.
  /// Otherwise 0.
  std::size_t holds_wrenches = 0;
  std::vector<int> links; ///< child links of the joints of a request; as long as the list of all joints
};

namespace ksl::c_api {

/// The options of a model, checked.
model_options options_of(const ksl_model_options_t &options);
/// Throws bad_argument for a width that is no speed.
physics_options physics_of(const ksl_physics_t &from);

/// The message of this thread's last failed call.
const char *last_message() noexcept;
/// Keeps a copy of a sentence as the message.  If there is no memory for it, the message says so.
void keep_message(const char *sentence) noexcept;
/// The message is "out of memory", which needs none.
void say_out_of_memory() noexcept;

/// The warning of this thread's last call that took positions; empty if there was none.  No memory is allocated for it.
char (&last_warning() noexcept)[256];

struct bad_argument : std::runtime_error { using std::runtime_error::runtime_error; };

/// Runs a call and turns an exception into a status and a message.  No exception of C++ leaves it.  The unwinding of a thread that is
/// cancelled, which is no std::exception, passes through, as C libraries expect.
template <class Call> ksl_status_t guarded(Call &&call) {
  try {
    call();
    return KSL_OK;
  } catch (const bad_argument &e) {
    keep_message(e.what());
    return KSL_BAD_ARGUMENT;
  } catch (const result_error &e) {
    keep_message(e.what());
    return KSL_NOT_FINITE;
  } catch (const description_error &e) {
    keep_message(e.what());
    return KSL_BAD_DESCRIPTION;
  } catch (const std::bad_alloc &) {
    say_out_of_memory();
  } catch (const std::exception &e) {
    keep_message(e.what());
  }
  return KSL_FAILED;
}

inline void require(bool condition, const char *sentence) {
  if (!condition)
    throw bad_argument(sentence);
}

/// Runs `make`, which returns a new handle, with the result in *made.  Null where it fails, whatever the reason.
template <class Handle, class Make> ksl_status_t created(Handle **made, bool is_given, const char *sentence,
                                                         Make &&make) {
  if (made)
    *made = nullptr;
  return guarded([&] {
    require(made && is_given, sentence);
    *made = make();
  });
}

/// Refuses an index that the model doesn't have: sentence, the argument and its place in an array, and what is expected.
inline void require_index(int index, int count, const char *sentence, const char *argument, int place = -1) {
  if (index >= 0 && index < count)
    return;
  const std::string of = place < 0 ? "" : "[" + std::to_string(place) + "]",
                    all = count > 0 ? "expected 0 to " + std::to_string(count - 1) : "the model has none";
  throw bad_argument(std::string(sentence) + ": " + argument + of + " is " + std::to_string(index) + "; " + all);
}

/// How many links, wrenches or frames a call may name.  Six or sixteen numbers of each are then counted in an int.
constexpr int most_named = 1 << 24;

/// Checks n indices of links; n may be 0.
inline void require_links(const ksl_model_t *m, int n, const int *links, const char *argument = "links") {
  require(n >= 0 && n <= most_named && (links || n == 0),
          "links must not be null, and their number not negative, and 2^24 at most");
  for (int k = 0; k < n; ++k)
    require_index(links[k], static_cast<int>(m->model.links().size()), "a link is out of range", argument,
                  n == 1 ? -1 : k);
}

} // namespace ksl::c_api
