#include "generate/record_derivative.hpp"

#include "generate/differentiate.hpp"
#include "generate/recorded_inputs.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace ksl::generate {
namespace {

using numbers = std::vector<recording>;

numbers joined(numbers x, const numbers &y) {
  x.insert(x.end(), y.begin(), y.end());
  return x;
}

void refuse(const model &m, const std::string &row, const recorded &of, derivative kind) {
  const bool by_velocities = kind == derivative::rates || kind == derivative::weights;
  if (by_velocities &&
      (row == "integrate" || of.inputs.front().name != "q")) // positions are results, or two are inputs
    throw std::invalid_argument("derivatives of " + row +
                                " can't be generated: take integrate_jacobians or difference_jacobians");
  if (!m.loops().empty())
    throw std::invalid_argument(
        "derivatives of " + row +
        " can't be generated for a closed mechanism, whose coordinates depend on each other; cut the loops");
  const auto is_root = [](const step &s) { return s.what == operation::root; }; // as the law of friction has
  if (m.exact_friction() && std::any_of(of.steps.steps().begin(), of.steps.steps().end(), is_root))
    throw std::invalid_argument("derivatives of " + row + ": " + model::exact_friction_text());
}

/// How numbers of q change along joint velocities: q ⊕ δ at δ = 0.
class positions {
public:
  positions(const model &m, bool single, const numbers &q, const numbers &still)
      : zeros_(q.size(), recording(0.0)), moved_(record(m, integration(single))),
        along_(moved_.steps, joined(q, still)) {}
  numbers rates(const numbers &of_motion) const { return along_.rates(joined(zeros_, of_motion)); }
  numbers weights(const numbers &of_positions) const {
    const numbers all = along_.weights(of_positions);
    return {all.begin() + static_cast<std::ptrdiff_t>(zeros_.size()), all.end()};
  }

private:
  static request integration(bool single) {
    request asked;
    asked.row = "integrate", asked.single = single;
    return asked;
  }

  numbers zeros_;
  recorded moved_;
  differentiation along_;
};

/// How the numbers of an input are listed where they are a result.
std::vector<int> shape_of(const recorded_input &of, int size) {
  const int columns = of.name == "external" ? 6 : of.name == "payload" || of.name == "parameters" ? 10 : size;
  return size > columns ? std::vector<int>{size / columns, columns} : std::vector<int>{size};
}

int size_of(const recorded_result &of) {
  int size = 1;
  for (const int k : of.shape)
    size *= k;
  return size;
}

void write(const numbers &x, graph &to) {
  for (const recording &y : x)
    to.output(y.place());
}

/// For each number of the results its derivatives by all numbers of the inputs: forward, input by input, or backward, result by result, whichever is less.
std::vector<numbers> rows_of_matrix(const differentiation &steps, std::size_t inputs, std::size_t outputs) {
  std::vector<numbers> rows(outputs, numbers(inputs, recording(0.0)));
  const auto unit = [](std::size_t k, std::size_t n) {
    numbers e(n, recording(0.0));
    e[k] = 1.0;
    return e;
  };
  if (outputs < inputs)
    for (std::size_t i = 0; i < outputs; ++i)
      rows[i] = steps.weights(unit(i, outputs));
  else
    for (std::size_t k = 0; k < inputs; ++k) {
      const numbers column = steps.rates(unit(k, inputs));
      for (std::size_t i = 0; i < outputs; ++i)
        rows[i][k] = column[i];
    }
  return rows;
}

numbers take_all(const recorded &of, recorded_inputs &in) {
  numbers given;
  for (const recorded_input &x : of.inputs)
    given = joined(std::move(given), in.take(x.name, x.numbers));
  return given;
}

recorded matrix(const recorded &of, bool single) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const numbers given = take_all(of, in);
  const auto rows = rows_of_matrix(differentiation(of.steps, given), given.size(), of.steps.outputs().size());
  auto first = rows.begin();
  for (const recorded_result &y : of.results) {
    const int size = size_of(y);
    std::ptrdiff_t begin = 0;
    for (const recorded_input &x : of.inputs) {
      for (auto row = first; row != first + size; ++row)
        write({row->begin() + begin, row->begin() + begin + x.numbers}, out.steps);
      out.results.push_back({"jac_" + y.name + "_" + x.name, {size, x.numbers}});
      begin += x.numbers;
    }
    first += size;
  }
  out.steps = out.steps.needed();
  return out;
}

recorded adjoint(const recorded &of, bool single) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const numbers given = take_all(of, in);
  numbers weights;
  for (const recorded_result &y : of.results)
    weights = joined(std::move(weights), in.take("adj_" + y.name, size_of(y)));
  write(differentiation(of.steps, given).weights(weights), out.steps);
  for (const recorded_input &x : of.inputs)
    out.results.push_back({"adj_" + x.name, shape_of(x, x.numbers)});
  out.steps = out.steps.needed();
  return out;
}

recorded along_velocities(const model &m, const recorded &of, bool single, derivative kind) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const numbers given = take_all(of, in);
  const int nq = m.nq(), nv = m.nv(); // q is the first input of every algorithm
  const positions motion(m, single, {given.begin(), given.begin() + nq}, in.zeros(nv));
  const differentiation steps(of.steps, given);
  const recorded_input *const q = &of.inputs.front();
  if (kind == derivative::rates) {
    numbers rates;
    for (const recorded_input &x : of.inputs) {
      const numbers &dot = in.take(x.name + "_dot", &x == q ? nv : x.numbers);
      rates = joined(std::move(rates), &x == q ? motion.rates(dot) : dot);
    }
    write(steps.rates(rates), out.steps);
    for (const recorded_result &y : of.results)
      out.results.push_back({y.name + "_dot", y.shape});
  } else {
    numbers weights;
    for (const recorded_result &y : of.results)
      weights = joined(std::move(weights), in.take(y.name + "_bar", size_of(y)));
    const numbers by = steps.weights(weights);
    write(motion.weights({by.begin(), by.begin() + nq}), out.steps);
    write({by.begin() + nq, by.end()}, out.steps);
    for (const recorded_input &x : of.inputs)
      out.results.push_back({x.name + "_bar", shape_of(x, &x == q ? nv : x.numbers)});
  }
  out.steps = out.steps.needed();
  return out;
}

} // namespace

recorded record_derivative(const model &m, const request &asked, derivative kind) {
  const recorded of = record(m, asked);
  refuse(m, asked.row, of, kind);
  switch (kind) {
  case derivative::matrix: return matrix(of, asked.single);
  case derivative::adjoint: return adjoint(of, asked.single);
  case derivative::adjoints_matrix: return matrix(adjoint(of, asked.single), asked.single);
  case derivative::rates:
  case derivative::weights: break;
  }
  return along_velocities(m, of, asked.single, kind);
}

} // namespace ksl::generate
