#include "simulate/runs/event_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ksl::simulating {

// A step is cut into parts; where a function of q, v and t may pass zero in one of them, its first zero there is located.  The event of the step
// is the first zero of all functions.
//
//     share         0         1/8        2/8         …          1        parts() = 8: dop853, whose steps are long
//     samples       f₀─────────f₁─────────f₂──────── … ─────────f₈
//     in a part:    f₀ > 0 ≥ f₁                        it passes: locate
//                   f₀, f₁ > 0, tangents meet below 0  it may dip: lowest, then locate before the lowest point
//                   f₀ = 0, after an event             which side did it begin on: other_side, then as above
//
// Of two zeros in one part those are found between which the tangents at its ends meet on the other side (docs/simulation.md).

/// The width, as a share of the step, to which a zero is located.
constexpr double resolution = 1e-14;
/// Zeros of the user's functions that are no further apart are at the same instant.
constexpr double same_instant = 4 * resolution;
/// Of a step, before a function that begins at zero is taken to have been on no other side than at its end: 2⁻⁴⁶ is that width.  Where not
/// even the side is known it begins with, less: in so small a part of a step values may be rounding.
constexpr int most_halvings = 46, halvings_of_unknown = 26;
/// Of the values of a function near a zero: one that is less is the zero.
constexpr double rounding_of_zero = 1e-12;

event_functions::event_functions(system &of, const simulation &task)
    : of_(of), task_(task), q_(of.nq()), v_(of.nv()), a_(of.nv()) {}

/// By modes: what is held may let go; what slides may stop; what isn't held may strike a limit that throws back, if there is one on that side.
void event_functions::list() {
  list_.clear();
  const held_joints *const held = of_.held();
  if (!held)
    return;
  using mode = held_joints::mode;
  for (int k = 0; k < static_cast<int>(of_.nv()); ++k) {
    const mode now = held->at(k);
    if (held->holds(k))
      list_.push_back({kind::lets_go, k});
    if (now == mode::slides_down || now == mode::slides_up)
      list_.push_back({kind::stops, k});
    const exact_laws &laws = held->laws();
    if (laws.restitution && laws.restitution[k] >= 0 && !held->holds(k)) {
      if (std::isfinite(laws.lower[k]))
        list_.push_back({kind::lower, k});
      if (std::isfinite(laws.upper[k]))
        list_.push_back({kind::upper, k});
    }
  }
}

std::optional<int> event_functions::side_at_start(std::size_t i) const {
  const function f = (*this)[i];
  for (const zero &z : at_zero_)
    if (f.what == kind::user && f.number == z.number)
      return z.side;
  return std::nullopt;
}

event_functions::function event_functions::operator[](std::size_t i) const {
  return i < list_.size() ? list_[i] : function{kind::user, static_cast<int>(i - list_.size())};
}

int event_functions::direction(std::size_t i) const {
  return i < list_.size() ? -1 : task_.events[i - list_.size()].direction;
}

outcome event_functions::values(continuous_step &step, double share, double *out, double *rates) {
  double work, power;
  if (const outcome how = step.at(share, q_.data(), v_.data(), &work); how != outcome::done)
    return how;
  double opened;
  if (of_.closed() && task_.project && share > 0) // where the run would be, were this the event
    of_.project(q_.data(), v_.data(), opened);
  const double t = step.t() + share * step.h();
  bool needs_a = false;
  for (const function &f : list_)
    needs_a |= f.what == kind::lets_go || (rates && f.what == kind::stops);
  if (rates)
    std::fill_n(rates, size(), 0.0);
  if (needs_a && !of_.accelerate(t, run_, 1, q_.data(), v_.data(), a_.data(), &power))
    return outcome::stopped;
  for (std::size_t i = 0; i < list_.size(); ++i) {
    const int k = list_[i].number;
    const held_joints &held = *of_.held();
    const std::size_t at_k = static_cast<std::size_t>(k), number = static_cast<std::size_t>(of_.space().number_in_q(k));
    // above zero as long as nothing happens: the way to a limit, the speed of what slides, what holds a coordinate beyond what it needs
    switch (list_[i].what) {
    case kind::lower: out[i] = q_[number] - held.laws().lower[at_k]; break;
    case kind::upper: out[i] = held.laws().upper[at_k] - q_[number]; break;
    case kind::stops: out[i] = held.at(k) == held_joints::mode::slides_up ? v_[at_k] : -v_[at_k]; break;
    case kind::lets_go: out[i] = held.margin(k); break;
    case kind::user: break;
    }
    if (rates && list_[i].what == kind::stops)
      rates[i] = step.h() * (held.at(k) == held_joints::mode::slides_up ? a_[at_k] : -a_[at_k]);
    else if (rates && list_[i].what != kind::lets_go)
      rates[i] = step.h() * (list_[i].what == kind::lower ? v_[at_k] : -v_[at_k]);
  }
  if (task_.events_n == 0)
    return outcome::done;
  double *const users = out + list_.size();
  if (!task_.event_values(task_.event_context, run_, t, q_.data(), v_.data(), users))
    return outcome::stopped;
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(users, users + task_.events_n, finite) ? outcome::done : outcome::not_finite;
}

namespace {

bool passes(double before, double after, int direction) {
  return (direction <= 0 && before > 0 && after <= 0) || (direction >= 0 && before < 0 && after >= 0);
}

/// The zero of one function between two shares with values of different signs: regula falsi, halving the value that stays (Illinois).
/// The zero stays in [low, high].  Plain regula falsi would move one end alone where f is curved; halving the value at the end that has stayed
/// twice running moves the chord's zero towards it: order 1.44 (Dowell and Jarratt, A modified regula falsi method, 1971).
outcome locate(event_functions &functions, continuous_step &step, std::size_t i, double low, double of_low, double high,
               double of_high, std::vector<double> &values, double &share) {
  int side = 0;
  while (high - low > resolution) {
    // where the chord passes zero; the middle where rounding leads out of the interval
    double middle = (low * of_high - high * of_low) / (of_high - of_low);
    if (!(middle > low && middle < high))
      middle = 0.5 * (low + high);
    if (const outcome how = functions.values(step, middle, values.data()); how != outcome::done)
      return how;
    const double x = values[i];
    if (x == 0) {
      high = middle;
      break;
    }
    if ((x > 0) == (of_low > 0)) {
      of_high = side == -1 ? of_high / 2 : of_high;
      low = middle, of_low = x, side = -1;
    } else {
      of_low = side == 1 ? of_low / 2 : of_low;
      high = middle, of_high = x, side = 1;
    }
  }
  share = high; // beyond the zero, so that it has been passed
  return outcome::done;
}

/// A function that begins at zero and ends on one side may have been on the other between, as the height after an impact.  A share at which
/// its value times sign is above zero, or low if there is none.
outcome other_side(event_functions &functions, continuous_step &step, std::size_t i, double sign, int most, double low,
                   double high, std::vector<double> &values, double &share) {
  for (int halvings = 1; halvings < most; ++halvings) {
    share = low + std::ldexp(high - low, -halvings);
    if (const outcome how = functions.values(step, share, values.data()); how != outcome::done || sign * values[i] > 0)
      return how;
  }
  share = low;
  return outcome::done;
}

/// The lowest share of a function between low and high, or the first at which it is found below zero: golden section.
outcome lowest(event_functions &functions, continuous_step &step, std::size_t i, double sign, double low, double high,
               std::vector<double> &values, double &share, double &value) {
  // (3 − √5) / 2: at[0] and at[1] cut [low, high] so that the one that is kept cuts what is left in the same way, and each turn costs one value
  constexpr double golden = 0.381966011250105, narrow = 1e-6;
  const double end = narrow * (high - low);
  const auto look = [&](double at, double &found) {
    const outcome how = functions.values(step, at, values.data());
    found = sign * values[i];
    return how;
  };
  double at[2] = {low + golden * (high - low), high - golden * (high - low)}, found[2];
  for (int k = 0; k < 2; ++k)
    if (const outcome how = look(at[k], found[k]); how != outcome::done)
      return how;
  for (;;) {
    const int better = found[1] < found[0];
    share = at[better], value = sign * found[better];
    if (found[better] < 0 || high - low < end)
      return outcome::done;
    (better ? low : high) = at[1 - better];
    at[1 - better] = at[better], found[1 - better] = found[better];
    at[better] = better ? high - golden * (high - low) : low + golden * (high - low);
    if (const outcome how = look(at[better], found[better]); how != outcome::done)
      return how;
  }
}

/// Values of all functions at the ends of the parts of a step, as far as they are asked for, and their derivatives by the share: known ones
/// where the step is one part, differences where there are more.
class sampled_functions {
public:
  sampled_functions(event_functions &functions, continuous_step &step)
      : functions_(functions), step_(step), n_(functions.size()), parts_(step.parts()),
        values_(static_cast<std::size_t>(parts_ + 1) * n_), rates_(parts_ == 1 ? values_.size() : 0) {}

  outcome up_to(int part) {
    for (; sampled_ < std::min(part, parts_) + 1; ++sampled_) {
      const std::size_t first = static_cast<std::size_t>(sampled_) * n_;
      const outcome how = functions_.values(step_, share(sampled_), values_.data() + first,
                                            rates_.empty() ? nullptr : rates_.data() + first);
      if (how != outcome::done)
        return how;
    }
    if (part <= 2)
      set_zeros();
    return outcome::done;
  }

  double share(int part) const { return static_cast<double>(part) / parts_; }
  double value(std::size_t i, int part) const { return values_[static_cast<std::size_t>(part) * n_ + i]; }

  /// Is function i of one sign at both ends of a part, and may it have the other between.  Samples reach one part beyond.
  bool may_dip(std::size_t i, int part) const {
    const double f0 = value(i, part - 1), f1 = value(i, part), sign = f0 < 0 ? -1 : 1;
    return simulating::may_dip(sign * f0, sign * rate(i, part - 1), sign * f1, sign * rate(i, part));
  }

private:
  /// The values with which a step begins at zeros of functions: but where an exact law has changed them.
  void set_zeros() {
    for (std::size_t i = 0; i < n_; ++i) {
      const std::optional<int> side = functions_.side_at_start(i);
      double most = 0;
      for (int part = 0; part < sampled_; ++part)
        most = std::fmax(most, std::fabs(value(i, part)));
      if (side && (*side != 0 || std::fabs(values_[i]) <= rounding_of_zero * most))
        values_[i] = 0;
    }
  }

  /// For one part.
  double rate(std::size_t i, int part) const {
    if (!rates_.empty())
      return rates_[static_cast<std::size_t>(part) * n_ + i];
    const auto f = [&](int k) { return value(i, k); };
    // three-point differences, of parts of length 1: one-sided at the ends, central between
    if (part == 0)
      return (4 * f(1) - 3 * f(0) - f(2)) / 2;
    if (part == parts_)
      return (3 * f(part) - 4 * f(part - 1) + f(part - 2)) / 2;
    return (f(part + 1) - f(part - 1)) / 2;
  }

  event_functions &functions_;
  continuous_step &step_;
  std::size_t n_;
  int parts_, sampled_ = 0;
  std::vector<double> values_, rates_; ///< (parts + 1, n)
};

/// The search for the zeros of one function in a part of a step.
struct part_search {
  event_functions &functions;
  continuous_step &step;
  std::vector<double> values;

  /// The share of the first event of function i between low and high, where it has two values, and the sign after it; a share of more
  /// than 1: there is none.
  outcome find(std::size_t i, double low, double of_low, double high, double of_high, bool is_first, bool dips,
               double &share, int &side) {
    share = 2;
    // it begins at zero, where a law has acted or an event of the user's was: it passes zero in this part if it has been on the other side
    // than at its end, as the height after an impact
    const bool of_law = functions[i].what != event_functions::kind::user;
    if (of_law ? is_first && of_low <= 0 && of_high < 0 : of_low == 0 && of_high != 0) {
      const double begin = low, sign = of_high < 0 ? 1 : -1;
      const std::optional<int> known = is_first ? functions.side_at_start(i) : std::nullopt;
      if (known && *known * sign < 0)
        return outcome::done; // it has been on one side alone
      const bool is_known = of_law || (known && *known != 0);
      if (const outcome how = other_side(functions, step, i, sign, is_known ? most_halvings : halvings_of_unknown,
                                         begin, high, values, low);
          how != outcome::done)
        return how;
      if (low == begin) { // of a law: it holds at once, or lets go at once
        share = of_law ? begin : share;
        return outcome::done;
      }
      of_low = values[i];
    }
    // a lowest point on the other side has a zero before it and one behind it: the first whose direction counts
    if (dips) {
      double between, of_between;
      if (const outcome how = lowest(functions, step, i, of_low < 0 ? -1 : 1, low, high, values, between, of_between);
          how != outcome::done || (of_between > 0) == (of_low > 0))
        return how;
      if (passes(of_low, of_between, functions.direction(i)))
        high = between, of_high = of_between;
      else
        low = between, of_low = of_between;
    }
    if (!passes(of_low, of_high, functions.direction(i)))
      return outcome::done;
    side = of_low > 0 ? -1 : 1;
    return locate(functions, step, i, low, of_low, high, of_high, values, share);
  }
};

} // namespace

/// Part by part, up to the first that has an event, and one beyond for tangents.  Of several in a part the first counts; with it, all of
/// the user's at the same instant, so that their order doesn't depend on rounding.
found_event first_event(event_functions &functions, continuous_step &step) {
  found_event found;
  sampled_functions samples(functions, step);
  part_search search = {functions, step, std::vector<double>(functions.size())};
  std::vector<double> shares(functions.size());
  std::vector<int> sides(functions.size());
  for (int part = 1; part <= step.parts() && found.share > 1; ++part) {
    if ((found.search = samples.up_to(part + 1)) != outcome::done)
      return found;
    for (std::size_t i = 0; i < functions.size(); ++i) {
      found.search = search.find(i, samples.share(part - 1), samples.value(i, part - 1), samples.share(part),
                                 samples.value(i, part), part == 1, samples.may_dip(i, part), shares[i], sides[i]);
      if (found.search != outcome::done)
        return found;
      if (shares[i] < found.share)
        found.share = shares[i], found.index = i;
    }
  }
  for (std::size_t i = 0; found.share <= 1 && i < shares.size(); ++i)
    if (shares[i] <= found.share + same_instant && functions[i].what == event_functions::kind::user)
      found.users.push_back(functions[i].number), found.sides.push_back(sides[i]);
  if (!found.users.empty()) // to where all of them have passed zero
    found.share = *std::max_element(shares.begin(), shares.end(), [&](double a, double b) {
      const auto last = [&](double share) { return share <= found.share + same_instant ? share : -1; };
      return last(a) < last(b);
    });
  return found;
}

} // namespace ksl::simulating
