#include "generate/graph.hpp"

#include "ksl/engine/lanes/sine_cosine.hpp"

#include <cmath>
#include <cstring>
#include <utility>

namespace ksl::generate {
namespace {

std::uint64_t bits_of(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return bits;
}

template <class S> double sine_of(double x, bool want_cosine) {
  S s, c;
  sine_cosine(static_cast<S>(x), s, c);
  return static_cast<double>(want_cosine ? c : s);
}

// negate, and root to cosine: by the order of the enumeration
bool takes_one(operation what) {
  return what == operation::negate || (what >= operation::root && what <= operation::cosine);
}
bool commutes(operation what) {
  return what == operation::add || what == operation::multiply || what == operation::equal;
}

} // namespace

// Numbers count by their bits: 0 and −0 are two constants, and NaN is itself.  Each operand is mixed in by 2⁶⁴ / φ, and the high bits of the product
// go down to those that a table reads (Knuth, The Art of Computer Programming 3 (1998), section 6.4).
std::size_t graph::hash::operator()(const step &s) const {
  std::uint64_t h = bits_of(s.number) ^ static_cast<std::uint64_t>(s.what);
  for (const int x : {s.a, s.b, s.c})
    h = (h ^ static_cast<std::uint32_t>(x)) * 0x9e3779b97f4a7c15u, h ^= h >> 29;
  return static_cast<std::size_t>(h);
}

bool graph::same::operator()(const step &x, const step &y) const {
  return x.what == y.what && x.a == y.a && x.b == y.b && x.c == y.c && bits_of(x.number) == bits_of(y.number);
}

/// Of constants.  A double holds each number of float; a sum, product, quotient or root of two of them, rounded to double and then to float, is
/// that of float (Figueroa 1995).
/// That takes a double of 2p + 2 bits for p of float: 53 ≥ 50.
double graph::computed(const step &s) const {
  const double a = number(s.a), b = s.b < 0 ? 0 : number(s.b);
  switch (s.what) {
  case operation::add: return rounded(a + b);
  case operation::subtract: return rounded(a - b);
  case operation::multiply: return rounded(a * b);
  case operation::divide: return rounded(a / b);
  case operation::negate: return -a;
  case operation::less: return a < b;
  case operation::at_most: return a <= b;
  case operation::equal: return a == b;
  case operation::select: return a != 0 ? b : number(s.c);
  case operation::root: return rounded(std::sqrt(a));
  case operation::absolute: return std::fabs(a);
  case operation::sine:
  case operation::cosine: {
    const bool cosine = s.what == operation::cosine;
    return single_ ? sine_of<float>(a, cosine) : sine_of<double>(a, cosine);
  }
  case operation::arctangent:
    return single_ ? static_cast<double>(std::atan2(static_cast<float>(a), static_cast<float>(b))) : std::atan2(a, b);
  case operation::constant:
  case operation::input: break;
  }
  return s.number;
}

int graph::constant(double number) { return known_or_added({operation::constant, -1, -1, -1, rounded(number)}); }

/// Each step in turn: no operand without a value; constants are computed; operands that commute in order; then identities, and equal steps last,
/// since an identity may end at a step that is there already.
int graph::add(step s) {
  if (s.what == operation::constant)
    return constant(s.number);
  if (s.what == operation::input)
    return known_or_added(s);
  const int operands = s.what == operation::select ? 3 : takes_one(s.what) ? 1 : 2;
  if (s.a < 0 || (operands > 1 && s.b < 0) || (operands > 2 && s.c < 0))
    return -1;
  if (is_constant(s.a) && (operands < 2 || is_constant(s.b)) && (operands < 3 || is_constant(s.c)))
    return constant(computed(s));
  // x + y and y + x have the same bits, and are one step
  if (commutes(s.what) && s.b < s.a)
    std::swap(s.a, s.b);
  return shorter(s);
}

// Identities that keep the bits of numbers, but for the sign of zero.  Sums and products are not put in another order.
//
//     x + 0 = x         x + (−y) = x − y    x − (−y) = x + y    −(−x) = x    −(x − y) = y − x
//     x · 0 = 0         x · 1 = x           x · (−1) = −x       (−x) y = −(x y), or x (−y) where y is a constant
//     x / 1 = x         c ? x : x = x       a known c chooses
//
// Signs go outwards, to where a sum takes them up.
int graph::shorter(const step &s) {
  switch (s.what) {
  case operation::add: return shorter_sum(s);
  case operation::subtract: return shorter_difference(s);
  case operation::multiply: return shorter_product(s);
  case operation::divide:
    if (is(s.b, 1))
      return s.a;
    break;
  case operation::negate:
    if (is_negation(s.a))
      return at(s.a).a;
    if (at(s.a).what == operation::subtract) // rounding is symmetric
      return add({operation::subtract, at(s.a).b, at(s.a).a});
    break;
  case operation::select:
    if (s.b == s.c)
      return s.b;
    if (is_constant(s.a))
      return number(s.a) != 0 ? s.b : s.c;
    break;
  default: break;
  }
  return known_or_added(s);
}

int graph::shorter_sum(const step &s) {
  if (is(s.a, 0))
    return s.b;
  if (is(s.b, 0))
    return s.a;
  if (is_negation(s.b))
    return add({operation::subtract, s.a, at(s.b).a});
  if (is_negation(s.a))
    return add({operation::subtract, s.b, at(s.a).a});
  return known_or_added(s);
}

int graph::shorter_difference(const step &s) {
  if (is(s.b, 0))
    return s.a;
  if (is(s.a, 0))
    return negated(s.b);
  if (is_negation(s.b))
    return add({operation::add, s.a, at(s.b).a});
  return known_or_added(s);
}

int graph::shorter_product(const step &s) {
  for (const auto &[x, other] : {std::pair(s.a, s.b), std::pair(s.b, s.a)}) {
    if (is(x, 0) || is(other, 1)) // 0 × ∞ is no number that a model of finite ones needs
      return x;
    if (is(other, -1))
      return negated(x);
    if (is_negation(x)) { // the sign goes to the constant, or out of the product
      if (is_constant(other))
        return add({operation::multiply, at(x).a, constant(-number(other))});
      return negated(add({operation::multiply, at(x).a, other}));
    }
  }
  return known_or_added(s);
}

int graph::known_or_added(const step &s) {
  // a step that is there already is the same number: common subexpressions are computed once
  const auto [at, is_new] = known_.try_emplace(s, static_cast<int>(steps_.size()));
  if (!is_new)
    return at->second;
  if (steps_.size() >= most_)
    throw recording_error("it has more than " + std::to_string(most_) + " steps; call the library for it");
  steps_.push_back(s);
  return at->second;
}

/// place[i]: the number of step i in what is left, −1 if it isn't.
graph graph::needed() const {
  // operands lie before the steps that read them: from the last step back, what is used is known when it is met
  std::vector<bool> used(steps_.size(), false);
  for (const int i : outputs_)
    if (i >= 0)
      used[static_cast<std::size_t>(i)] = true;
  for (std::size_t i = steps_.size(); i-- > 0;)
    for (const int operand : {steps_[i].a, steps_[i].b, steps_[i].c})
      if (used[i] && operand >= 0)
        used[static_cast<std::size_t>(operand)] = true;
  graph out(single_);
  std::vector<int> place(steps_.size(), -1);
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    if (!used[i])
      continue;
    step s = steps_[i];
    for (int *operand : {&s.a, &s.b, &s.c})
      if (*operand >= 0)
        *operand = place[static_cast<std::size_t>(*operand)];
    place[i] = static_cast<int>(out.steps_.size());
    out.steps_.push_back(s);
  }
  for (const int i : outputs_)
    out.outputs_.push_back(i < 0 ? i : place[static_cast<std::size_t>(i)]);
  return out;
}

} // namespace ksl::generate
