// What a recorded algorithm computes: steps on earlier steps, each of them once.
//
//     step:   0      1      2      3            4            5
//             q[0]   q[1]   0.5    sine(0)      3 × 2        4 + 1     ← output
//             ------------  -----  -----------------------------------
//             inputs        constant
//
// A step's operands are numbers of steps before it.  add() looks for a shorter way first: what has constants alone is computed, in the precision of the
// recording; terms 0 and factors 1 and −1 are left out; of equal steps there is one.  The results keep their bits, but for the signs of zeros
// (docs/decisions/0027-generated-code.md).
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace ksl::generate {

/// c of select is what it gives where the condition a is false, b where it is true.
enum class operation : std::uint8_t {
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

/// One operation.  a, b, c: its operands, −1 where it has fewer; number: of a constant, or which input it is.
struct step {
  operation what;
  int a = -1, b = -1, c = -1;
  double number = 0;
};

/// A recording can't be made: the algorithm asks for what only a number can tell.
struct recording_error : std::runtime_error { using std::runtime_error::runtime_error; };

/// So many steps a recording has at most, those that no result will need included: about a gigabyte.
constexpr std::size_t most_steps = 8'000'000;

class graph {
public:
  /// single: constants are numbers of float, and computed in float.  most: so many steps it has at most.
  explicit graph(bool single, std::size_t most = most_steps) : single_(single), most_(most) {}

  /// The step that computes s, which may be an earlier one; −1 if one of its operands is −1, a number that nothing has computed.  Algorithms may read
  /// such numbers as long as no result depends on them: those of the ground, say.
  int add(step s);
  int constant(double number);
  int input(int i) { return add({operation::input, -1, -1, -1, static_cast<double>(i)}); }

  bool single() const { return single_; }
  const std::vector<step> &steps() const { return steps_; }
  bool is_constant(int i) const { return at(i).what == operation::constant; }
  /// The number of a constant.
  double number(int i) const { return at(i).number; }

  /// Marks a step as the next number of the results; −1: one that isn't written.
  void output(int i) { outputs_.push_back(i); }
  const std::vector<int> &outputs() const { return outputs_; }

  /// The steps that outputs depend on, with `outputs` renumbered.
  graph needed() const;

private:
  struct hash { std::size_t operator()(const step &s) const; };
  struct same { bool operator()(const step &x, const step &y) const; };

  const step &at(int i) const { return steps_[static_cast<std::size_t>(i)]; }
  bool is(int i, double number) const { return is_constant(i) && at(i).number == number; }
  bool is_negation(int i) const { return at(i).what == operation::negate; }
  double rounded(double x) const { return single_ ? static_cast<double>(static_cast<float>(x)) : x; }
  double computed(const step &s) const;
  int shorter(const step &s);
  int shorter_sum(const step &s);
  int shorter_difference(const step &s);
  int shorter_product(const step &s);
  int negated(int i) { return add({operation::negate, i}); }
  int known_or_added(const step &s);

  bool single_;
  std::size_t most_;
  std::vector<step> steps_;
  std::vector<int> outputs_;
  std::unordered_map<step, int, hash, same> known_;
};

} // namespace ksl::generate
