// y = sin(x₀ x₁):
//
//     step      0: input 0     1: input 1     2: 0 × 1                3: sine(2), the output
//     rates     x₀'            x₁'            r₂ = x₀' x₁ + x₀ x₁'     r₃ = r₂ cosine(2)            from the first step on
//     weights   x̄₀ = w₂ x₁     x̄₁ = w₂ x₀     w₂ = w₃ cosine(2)       w₃ = ȳ                       from the last step back
#include "generate/differentiate.hpp"

#include <cstddef>

namespace ksl::generate {
namespace {

bool is_zero(const recording &x) {
  const graph &g = *recording::current;
  return x.place() >= 0 && g.is_constant(x.place()) && g.number(x.place()) == 0;
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

recording at(const recordings &of, int i) { return i < 0 ? recording() : of[index(i)]; }

recording::condition condition(const recording &of) { return recording::condition(of.place()); }

recording twice(const recording &x) { return x + x; }

} // namespace

recordings joined(recordings x, const recordings &y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

/// values_[i] is step i of the graph `of`, on the graph in force, where it may be shorter: an input there may be a constant here.
differentiation::differentiation(const graph &of, const recordings &inputs) : of_(of), inputs_(inputs.size()) {
  for (const step &s : of.steps()) {
    if (s.what == operation::constant)
      values_.push_back(s.number);
    else if (s.what == operation::input)
      values_.push_back(inputs[static_cast<std::size_t>(s.number)]);
    else
      values_.push_back(s.c >= 0   ? recording::of(s.what, value(s.a), value(s.b), value(s.c))
                        : s.b >= 0 ? recording::of(s.what, value(s.a), value(s.b))
                                   : recording::of(s.what, value(s.a)));
  }
}

recordings differentiation::results() const {
  recordings out;
  for (const int i : of_.outputs())
    out.push_back(at(values_, i));
  return out;
}

// y = f(a, b):  y' = ∂f/∂a a' + ∂f/∂b b'.  Roots and quotients take y again, and where an algorithm has the sine of an angle
// it has its cosine, too.
recordings differentiation::rates(const recordings &of_inputs) const {
  using m = math<recording>;
  const recording zero = 0.0;
  recordings rate;
  for (std::size_t i = 0; i < of_.steps().size(); ++i) {
    const step &s = of_.steps()[i];
    if (s.what == operation::input) {
      rate.push_back(of_inputs[static_cast<std::size_t>(s.number)]);
      continue;
    }
    // in the order of steps, so that rates of operands are known
    const recording y = values_[i], a = at(values_, s.a), b = at(values_, s.b), da = at(rate, s.a), db = at(rate, s.b),
                    dc = at(rate, s.c);
    const auto still = [](int operand, const recording &d) { return operand < 0 || is_zero(d); };
    if (still(s.a, da) && still(s.b, db) && still(s.c, dc)) { // of constants, too; and 0 / b is no step
      rate.push_back(zero);
      continue;
    }
    switch (s.what) {
    case operation::add: rate.push_back(da + db); break;
    case operation::subtract: rate.push_back(da - db); break;
    case operation::multiply: rate.push_back(da * b + a * db); break;
    case operation::divide: rate.push_back((da - y * db) / b); break;
    case operation::negate: rate.push_back(-da); break;
    case operation::select: rate.push_back(m::select(condition(a), db, dc)); break;
    // y = √a: y' = a' / 2y, by the root that is there already
    case operation::root: rate.push_back(da / twice(y)); break;
    case operation::absolute: rate.push_back(m::select(a < zero, -da, da)); break;
    case operation::sine: rate.push_back(da * recording::of(operation::cosine, a)); break;
    case operation::cosine: rate.push_back(-(da * recording::of(operation::sine, a))); break;
    case operation::arctangent: rate.push_back((b * da - a * db) / (a * a + b * b)); break;
    case operation::constant:
    case operation::input:
    case operation::less:
    case operation::at_most:
    case operation::equal: rate.push_back(zero); break;
    }
  }
  recordings out;
  for (const int i : of_.outputs())
    out.push_back(at(rate, i));
  return out;
}

// ā += ȳ ∂f/∂a, b̄ += ȳ ∂f/∂b, the transposes of rates(): one walk gives the derivatives of one number by all inputs.
recordings differentiation::weights(const recordings &of_outputs) const {
  using m = math<recording>;
  const recording zero = 0.0;
  recordings weight(values_.size(), zero), out(inputs_, zero);
  const auto give = [&](int to, const recording &w) {
    if (!of_.is_constant(to))
      weight[index(to)] = weight[index(to)] + w;
  };
  for (std::size_t k = 0; k < of_outputs.size(); ++k)
    if (of_.outputs()[k] >= 0)
      give(of_.outputs()[k], of_outputs[k]);
  // From the last step to the first, each step has all of its weight when it is met, since only later steps read it.
  for (std::size_t i = of_.steps().size(); i-- > 0;) {
    const step &s = of_.steps()[i];
    const recording w = weight[i], y = values_[i], a = at(values_, s.a), b = at(values_, s.b);
    if (is_zero(w)) // what a known condition leaves out may be infinite
      continue;
    switch (s.what) {
    case operation::input: out[static_cast<std::size_t>(s.number)] = w; break;
    case operation::add: give(s.a, w), give(s.b, w); break;
    case operation::subtract: give(s.a, w), give(s.b, -w); break;
    case operation::multiply: give(s.a, w * b), give(s.b, w * a); break;
    case operation::divide: give(s.a, w / b), give(s.b, -(w / b * y)); break;
    case operation::negate: give(s.a, -w); break;
    case operation::select:
      give(s.b, m::select(condition(a), w, zero)), give(s.c, m::select(condition(a), zero, w));
      break;
    case operation::root: give(s.a, w / twice(y)); break;
    case operation::absolute: give(s.a, m::select(a < zero, -w, w)); break;
    case operation::sine: give(s.a, w * recording::of(operation::cosine, a)); break;
    case operation::cosine: give(s.a, -(w * recording::of(operation::sine, a))); break;
    case operation::arctangent: {
      const recording t = w / (a * a + b * b);
      give(s.a, t * b), give(s.b, -(t * a));
      break;
    }
    case operation::constant:
    case operation::less:
    case operation::at_most:
    case operation::equal: break;
    }
  }
  return out;
}

} // namespace ksl::generate
