// What all files of the C interface share: the handles, and the wrapper that turns exceptions into a status.
#pragma once

#include "ksl/dynamics.hpp"
#include "ksl/engine.h"

#include <new>
#include <stdexcept>
#include <string>
#include <vector>

struct ksl_model_t {
  ksl::model model;
};

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
inline std::string &last_message() {
  thread_local std::string message;
  return message;
}

struct bad_argument : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs a call and turns an exception into a status and a message.
template <class Call> ksl_status_t guarded(Call &&call) {
  try {
    call();
    return KSL_OK;
  } catch (const bad_argument &e) {
    last_message() = e.what();
    return KSL_BAD_ARGUMENT;
  } catch (const result_error &e) {
    last_message() = e.what();
    return KSL_NOT_FINITE;
  } catch (const description_error &e) {
    last_message() = e.what();
    return KSL_BAD_DESCRIPTION;
  } catch (const std::bad_alloc &) {
    last_message() = "out of memory";
  } catch (const std::exception &e) {
    last_message() = e.what();
  }
  return KSL_FAILED;
}

inline void require(bool condition, const char *sentence) {
  if (!condition)
    throw bad_argument(sentence);
}

/// Checks n indices of links; n may be 0.
inline void require_links(const ksl_model_t *m, int n, const int *links) {
  require(n >= 0 && (links || n == 0), "links must not be null, and their number not negative");
  for (int k = 0; k < n; ++k)
    require(links[k] >= 0 && static_cast<std::size_t>(links[k]) < m->model.links().size(), "a link is out of range");
}

} // namespace ksl::c_api
