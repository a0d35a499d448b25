// A scalar that records what is done with it on the graph in force.  It is its own scalar: what models hold is recorded, too, so that gravity and
// inertias may be inputs.
//
// Steps may not depend on inputs: where an algorithm would branch by a number it has math<T>::select, which becomes a step with both values.  A
// condition becomes a bool only where constants decide it, and there a recording takes one branch alone.
#pragma once

#include "generate/graph.hpp"
#include "ksl/engine/lanes/of_precision.hpp"
#include "ksl/engine/lanes/scalar.hpp"

#include <vector>

namespace ksl::generate {

class recording {
public:
  /// What a comparison gives: a step, which is known before the program runs if it is one of constants.
  class condition {
  public:
    explicit condition(int place) : place_(place) {}
    int place() const { return place_; }
    /// Throws recording_error where it depends on an input.
    explicit operator bool() const {
      if (place_ < 0 || !current->is_constant(place_))
        throw recording_error("an algorithm chooses its steps by a number that is known at run time alone");
      return current->number(place_) != 0;
    }

  private:
    int place_;
  };

  /// Of this thread: scalars of templates can't be told where to record.
  static inline thread_local graph *current = nullptr;

  recording() : place_(-1) {} ///< of no step, as is all that is computed from it
  recording(double number) : place_(current->constant(number)) {}
  recording(float number) : recording(static_cast<double>(number)) {}
  recording(int number) : recording(static_cast<double>(number)) {}
  static recording step_of(int place) {
    recording r;
    r.place_ = place;
    return r;
  }
  static recording of(operation what, recording a) { return step_of(current->add({what, a.place_})); }
  static recording of(operation what, recording a, recording b) {
    return step_of(current->add({what, a.place_, b.place_}));
  }
  static recording of(operation what, recording a, recording b, recording c) {
    return step_of(current->add({what, a.place_, b.place_, c.place_}));
  }
  int place() const { return place_; }

  friend recording operator-(recording a) { return of(operation::negate, a); }
  friend recording operator+(recording a, recording b) { return of(operation::add, a, b); }
  friend recording operator-(recording a, recording b) { return of(operation::subtract, a, b); }
  friend recording operator*(recording a, recording b) { return of(operation::multiply, a, b); }
  friend recording operator/(recording a, recording b) { return of(operation::divide, a, b); }
  friend recording &operator+=(recording &a, recording b) { return a = a + b; }
  friend recording &operator-=(recording &a, recording b) { return a = a - b; }
  friend condition operator<(recording a, recording b) { return condition(of(operation::less, a, b).place_); }
  friend condition operator>(recording a, recording b) { return b < a; }
  friend condition operator<=(recording a, recording b) { return condition(of(operation::at_most, a, b).place_); }
  friend condition operator>=(recording a, recording b) { return b <= a; }
  friend condition operator==(recording a, recording b) { return condition(of(operation::equal, a, b).place_); }
  friend condition operator!=(recording a, recording b) { return step_of((a == b).place()) == recording(0.0); }

private:
  int place_;
};

/// Some numbers of a recording, in an order.
using recordings = std::vector<recording>;

/// Records on a graph while it lives.
class recording_on {
public:
  explicit recording_on(graph &g) : before_(recording::current) { recording::current = &g; }
  ~recording_on() { recording::current = before_; }
  recording_on(const recording_on &) = delete;
  recording_on &operator=(const recording_on &) = delete;

private:
  graph *before_;
};

} // namespace ksl::generate

template <> struct ksl::math<ksl::generate::recording> {
  using recording = ksl::generate::recording;
  using operation = ksl::generate::operation;

  /// The unit roundoff of the recording's precision.
  struct unit_roundoff {
    operator recording() const { return recording::current->single() ? double(FLT_EPSILON) : DBL_EPSILON; }
  };
  static constexpr unit_roundoff epsilon = {};
  static recording select(recording::condition c, recording a, recording b) {
    return recording::of(operation::select, recording::step_of(c.place()), a, b);
  }
  static recording fabs(recording x) { return recording::of(operation::absolute, x); }
  static recording sqrt(recording x) { return recording::of(operation::root, x); }
  static recording sin(recording) { return not_own(); }
  static recording cos(recording) { return not_own(); }
  static recording atan2(recording y, recording x) { return recording::of(operation::arctangent, y, x); }
  static void sine_cosine(recording x, recording &sine, recording &cosine) { // KSL's own, as of numbers and packs
    sine = recording::of(operation::sine, x), cosine = recording::of(operation::cosine, x);
  }

private:
  static recording not_own() {
    throw ksl::generate::recording_error("it takes sines of the C library, whose bits code can't have");
  }
};

namespace ksl {
inline namespace KSL_ISA {

template <> inline generate::recording of_precision<generate::recording>(double in_double, double in_single) {
  return generate::recording::current->single() ? in_single : in_double;
}

} // namespace KSL_ISA

static_assert(scalar<generate::recording>);

} // namespace ksl
