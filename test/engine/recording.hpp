// A scalar that records what is done with it, and the tape that can be simplified and played again on other numbers: what
// a generator of code needs of the engine.
#pragma once

#include "ksl/engine/lanes/sine_cosine.hpp"

#include <cmath>
#include <map>
#include <tuple>
#include <vector>

enum class operation {
  constant,
  input,
  add,
  subtract,
  multiply,
  divide,
  negate,
  less,
  at_most,
  equal,
  select,
  root,
  absolute,
  sine,
  cosine,
  arctangent
};

/// One operation on earlier steps; a constant's number, or which input it is.
struct step {
  operation what;
  int a = -1, b = -1, c = -1;
  double number = 0;

  bool operator<(const step &o) const {
    return std::tie(what, a, b, c, number) < std::tie(o.what, o.a, o.b, o.c, o.number);
  }
};

inline double result_of(const step &s, double a, double b, double c) {
  double sine, cosine;
  switch (s.what) {
  case operation::constant:
  case operation::input: return s.number;
  case operation::add: return a + b;
  case operation::subtract: return a - b;
  case operation::multiply: return a * b;
  case operation::divide: return a / b;
  case operation::negate: return -a;
  case operation::less: return a < b;
  case operation::at_most: return a <= b;
  case operation::equal: return a == b;
  case operation::select: return a != 0 ? b : c;
  case operation::root: return std::sqrt(a);
  case operation::absolute: return std::fabs(a);
  case operation::sine: return ksl::sine_cosine(a, sine, cosine), sine;
  case operation::cosine: return ksl::sine_cosine(a, sine, cosine), cosine;
  case operation::arctangent: return std::atan2(a, b);
  }
  return 0;
}

struct tape {
  std::vector<step> steps;
  std::vector<int> outputs;

  int add(const step &s) { return steps.push_back(s), static_cast<int>(steps.size()) - 1; }

  /// The outputs for other inputs.
  std::vector<double> play(const std::vector<double> &inputs) const {
    std::vector<double> value(steps.size()), out;
    const auto at = [&](int i) { return i < 0 ? 0.0 : value[static_cast<std::size_t>(i)]; };
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const step &s = steps[i];
      value[i] = s.what == operation::input ? inputs[static_cast<std::size_t>(s.number)]
                                            : result_of(s, at(s.a), at(s.b), at(s.c));
    }
    for (int i : outputs)
      out.push_back(at(i));
    return out;
  }

  /// Additions, subtractions, multiplications and divisions; negations; sines and cosines.
  struct count { int arithmetic = 0, negations = 0, sines = 0; };
  count counted() const {
    count n;
    for (const step &s : steps) {
      n.arithmetic += s.what >= operation::add && s.what <= operation::divide;
      n.negations += s.what == operation::negate;
      n.sines += s.what == operation::sine || s.what == operation::cosine;
    }
    return n;
  }

  /// The same results with fewer steps: constants are computed, factors 1 and terms 0 left out, equal steps recorded once,
  /// and what no output depends on dropped.  Only signs of zeros may differ.
  tape simplified() const {
    tape merged;
    std::map<step, int> known;
    std::vector<int> place(steps.size()); // of each step in merged
    for (std::size_t i = 0; i < steps.size(); ++i) {
      step s = steps[i];
      for (int *operand : {&s.a, &s.b, &s.c})
        if (*operand >= 0)
          *operand = place[static_cast<std::size_t>(*operand)];
      place[i] = merged.shorter(s, known);
    }
    for (int i : outputs)
      merged.outputs.push_back(place[static_cast<std::size_t>(i)]);
    return merged.without_unused();
  }

private:
  bool is(int i, double number) const {
    return steps[static_cast<std::size_t>(i)].what == operation::constant &&
           steps[static_cast<std::size_t>(i)].number == number;
  }

  int known_or_added(const step &s, std::map<step, int> &known) {
    const auto found = known.find(s);
    return found != known.end() ? found->second : known[s] = add(s);
  }

  int shorter(const step &s, std::map<step, int> &known) {
    const auto constant = [&](int i) {
      return i < 0 || steps[static_cast<std::size_t>(i)].what == operation::constant;
    };
    const auto number = [&](int i) { return i < 0 ? 0.0 : steps[static_cast<std::size_t>(i)].number; };
    if (s.what != operation::input && constant(s.a) && constant(s.b) && constant(s.c))
      return known_or_added({operation::constant, -1, -1, -1, result_of(s, number(s.a), number(s.b), number(s.c))},
                            known);
    switch (s.what) {
    case operation::add:
      if (is(s.a, 0))
        return s.b;
      if (is(s.b, 0))
        return s.a;
      break;
    case operation::subtract:
      if (is(s.b, 0))
        return s.a;
      if (is(s.a, 0))
        return known_or_added({operation::negate, s.b}, known);
      break;
    case operation::multiply:
      if (is(s.a, 0) || is(s.b, 1))
        return s.a;
      if (is(s.b, 0) || is(s.a, 1))
        return s.b;
      break;
    default: break;
    }
    return known_or_added(s, known);
  }

  tape without_unused() const {
    std::vector<bool> used(steps.size(), false);
    for (int i : outputs)
      used[static_cast<std::size_t>(i)] = true;
    for (std::size_t i = steps.size(); i-- > 0;)
      for (int operand : {steps[i].a, steps[i].b, steps[i].c})
        if (used[i] && operand >= 0)
          used[static_cast<std::size_t>(operand)] = true;
    tape out;
    std::vector<int> place(steps.size(), -1);
    for (std::size_t i = 0; i < steps.size(); ++i) {
      step s = steps[i];
      for (int *operand : {&s.a, &s.b, &s.c})
        if (used[i] && *operand >= 0)
          *operand = place[static_cast<std::size_t>(*operand)];
      if (used[i])
        place[i] = out.add(s);
    }
    for (int i : outputs)
      out.outputs.push_back(place[static_cast<std::size_t>(i)]);
    return out;
  }
};

/// A step on the current tape.
class recording {
public:
  static inline tape *current = nullptr;
  /// What a comparison gives: a step, too, since nothing is known before the tape is played.
  struct condition { int place; };

  recording() : place_(-1) {}
  recording(double number) : place_(current->add({operation::constant, -1, -1, -1, number})) {}
  static recording input(int i) { return of({operation::input, -1, -1, -1, static_cast<double>(i)}); }
  static recording of(const step &s) {
    recording r;
    r.place_ = current->add(s);
    return r;
  }
  static recording of(operation what, recording a, recording b = recording()) { return of({what, a.place_, b.place_}); }
  int place() const { return place_; }

  friend recording operator-(recording a) { return of(operation::negate, a); }
  friend recording operator+(recording a, recording b) { return of(operation::add, a, b); }
  friend recording operator-(recording a, recording b) { return of(operation::subtract, a, b); }
  friend recording operator*(recording a, recording b) { return of(operation::multiply, a, b); }
  friend recording operator/(recording a, recording b) { return of(operation::divide, a, b); }
  friend condition operator<(recording a, recording b) { return {of(operation::less, a, b).place_}; }
  friend condition operator>(recording a, recording b) { return b < a; }
  friend condition operator<=(recording a, recording b) { return {of(operation::at_most, a, b).place_}; }
  friend condition operator>=(recording a, recording b) { return b <= a; }
  friend condition operator==(recording a, recording b) { return {of(operation::equal, a, b).place_}; }

private:
  int place_;
};

template <> struct ksl::scalar_of_trait<recording> { using type = double; };

template <> struct ksl::math<recording> {
  static constexpr double epsilon = DBL_EPSILON;
  static recording select(recording::condition c, recording a, recording b) {
    return recording::of({operation::select, c.place, a.place(), b.place()});
  }
  static recording fabs(recording x) { return recording::of(operation::absolute, x); }
  static recording sqrt(recording x) { return recording::of(operation::root, x); }
  static recording sin(recording x) { return recording::of(operation::sine, x); }
  static recording cos(recording x) { return recording::of(operation::cosine, x); }
  static recording atan2(recording y, recording x) { return recording::of(operation::arctangent, y, x); }
  static void sine_cosine(recording x, recording &sine, recording &cosine) { sine = sin(x), cosine = cos(x); }
};
