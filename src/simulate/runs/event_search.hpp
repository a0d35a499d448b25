// Where functions along a step pass zero.
#pragma once

#include "simulate/methods/continuous_step.hpp"
#include "simulate/runs/results.hpp"

namespace ksl::simulating {

/// Functions of the state of a run whose zeros are events: those of coordinates that exact laws hold or may come to hold, then the user's.
class event_functions {
public:
  event_functions(system &of, const simulation &task);

  void set_run(std::size_t run) { run_ = run; }

  /// The next step begins where function `number` of the user has passed zero, to the side of this sign; 0: it is not known, since an exact
  /// law has acted there.  Its value is zero but for rounding, whose sign says nothing.
  void begin_at_zero(int number, int side) { at_zero_.push_back({number, side}); }
  /// The next step begins elsewhere.
  void begin_elsewhere() { at_zero_.clear(); }
  /// Does it begin at a zero of function i: its side, as above.
  std::optional<int> side_at_start(std::size_t i) const;

  /// Lists the functions that the modes of coordinates call for.
  void list();
  std::size_t size() const { return list_.size() + static_cast<std::size_t>(task_.events_n); }

  enum class kind { lower, upper, stops, lets_go, user };
  struct function {
    kind what;
    int number; ///< coordinate, or that of the user's function
  };
  function operator[](std::size_t i) const;
  /// Is the function an event where it rises, where it falls, or in both cases: 1, −1, 0.  Those of exact laws fall.
  int direction(std::size_t i) const;

  /// All values at a share of the step; rates, if they are wanted: their derivatives by the share, 0 where they are not known.
  outcome values(continuous_step &step, double share, double *out, double *rates = nullptr);

private:
  system &of_;
  const simulation &task_;
  std::size_t run_ = 0;
  struct zero { int number, side; };
  std::vector<function> list_;
  std::vector<zero> at_zero_;
  std::vector<double> q_, v_, a_;
};

struct found_event {
  outcome search = outcome::done; ///< did a function end the run, or is there a state that can't be found
  std::size_t index = 0;          ///< of the function
  double share = 2;               ///< of the step; beyond 1: there is none
  std::vector<int> users;         ///< all of the user's functions that pass zero then
  std::vector<int> sides;         ///< the sign of each after it
};

/// May a function that is above zero at both ends be below it between: with values f and derivatives r there, it falls and rises so fast that
/// its tangents meet below zero.
inline bool may_dip(double f0, double r0, double f1, double r1) {
  // the tangents f₀ + r₀ s and f₁ − r₁ (1 − s) meet at the height (f₀ r₁ − f₁ r₀ + r₀ r₁) / (r₁ − r₀)
  return f0 > 0 && f1 > 0 && r0 < 0 && r1 > 0 && f0 * r1 - f1 * r0 + r0 * r1 < 0;
}

/// The first event in a step, after make_dense.
found_event first_event(event_functions &functions, continuous_step &step);

} // namespace ksl::simulating
