// With y(x) a recording, J = ∂y/∂x, and P the derivative of its numbers by what moves them (moving_inputs.hpp):
//
//     matrix             J                                     of numbers as they are
//     adjoint            x̄ = Jᵀ ȳ, of inputs x and ȳ
//     adjoints_matrix    ∂x̄/∂x = Σ ȳ_k ∂²y_k/∂x², ∂x̄/∂ȳ = Jᵀ   the matrix of the adjoint
//     rates              J P ẋ                                 along joint velocities, or along a closed mechanism
//     weights            Pᵀ Jᵀ ȳ
//
// A derivative is a recording like another: its steps begin with those of y, on a graph of its own, and needed() drops what no derivative reads.
#include "generate/record_derivative.hpp"

#include "generate/differentiate.hpp"
#include "generate/moving_inputs.hpp"
#include "generate/recorded_inputs.hpp"
#include "generate/recorded_loops.hpp"

#include <algorithm>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace ksl::generate {
namespace {

void refuse_friction(const std::string &what, const model &m, const recorded &of) {
  const auto is_root = [](const step &s) { return s.what == operation::root; }; // as the law of friction has
  if (m.exact_friction() && std::any_of(of.steps.steps().begin(), of.steps.steps().end(), is_root))
    throw std::invalid_argument(what + ": " + model::exact_friction_text());
}

void refuse(const model &m, const request &asked, const recorded &of, derivative kind) {
  const std::string what = "derivatives of " + asked.row;
  const bool by_velocities = kind == derivative::rates || kind == derivative::weights;
  // positions are results, or two are inputs
  if (by_velocities && (asked.row == "integrate" || of.inputs.front().name != "q"))
    throw std::invalid_argument(what + " can't be generated: take integrate_jacobians or difference_jacobians");
  if (!m.loops().empty() && !by_velocities)
    throw std::invalid_argument(
        what + " can't be generated for a closed mechanism, whose coordinates depend on each other; cut the loops");
  refuse_along(what, m, asked.single);
  refuse_friction(what, m, of);
}

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

void write(const recordings &x, graph &to) {
  for (const recording &y : x)
    to.output(y.place());
}

/// For each number of the results its derivatives by all numbers of the inputs: forward, input by input, or backward, result by result, whichever is less.
std::vector<recordings> rows_of_matrix(const differentiation &steps, std::size_t inputs, std::size_t outputs) {
  std::vector<recordings> rows(outputs, recordings(inputs, recording(0.0)));
  const auto unit = [](std::size_t k, std::size_t n) {
    recordings e(n, recording(0.0));
    e[k] = 1.0;
    return e;
  };
  // one walk backward gives a row of the matrix, one forward a column
  if (outputs < inputs)
    for (std::size_t i = 0; i < outputs; ++i)
      rows[i] = steps.weights(unit(i, outputs));
  else
    for (std::size_t k = 0; k < inputs; ++k) {
      const recordings column = steps.rates(unit(k, inputs));
      for (std::size_t i = 0; i < outputs; ++i)
        rows[i][k] = column[i];
    }
  return rows;
}

recordings take_all(const recorded &of, recorded_inputs &in) {
  recordings given;
  for (const recorded_input &x : of.inputs)
    given = joined(std::move(given), in.take(x.name, x.numbers));
  return given;
}

//                    x₀ (n₀)       x₁ (n₁)
//     y₀ (m₀)      jac_y₀_x₀     jac_y₀_x₁        each block is a result of its own, row-major; they come row by row
//     y₁ (m₁)      jac_y₁_x₀     jac_y₁_x₁
recorded matrix(const recorded &of, bool single) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const recordings given = take_all(of, in);
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

/// Inputs: those of y, then adj_… with a weight for each number of the results; results: a weight for each number of the inputs.
recorded adjoint(const recorded &of, bool single) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const recordings given = take_all(of, in);
  recordings weights;
  for (const recorded_result &y : of.results)
    weights = joined(std::move(weights), in.take("adj_" + y.name, size_of(y)));
  write(differentiation(of.steps, given).weights(weights), out.steps);
  for (const recorded_input &x : of.inputs)
    out.results.push_back({"adj_" + x.name, shape_of(x, x.numbers)});
  out.steps = out.steps.needed();
  return out;
}

/// A derivative of what a graph computes, along joint velocities or along a closed mechanism.
///
/// y = f(x), x = x(ε) by moving_inputs: rates are f′ (x′ ε̇), weights x′ᵀ (f′ᵀ ȳ).  Neither matrix is made.
class varied {
public:
  varied(const model &m, const recorded &of, recorded_inputs &in, bool single)
      : given_(take_all(of, in)), moving_(m, of, given_, single), steps_(of.steps, given_),
        is_closed_(!m.loops().empty()) {}

  const std::vector<int> &sizes() const { return moving_.sizes(); }
  recordings rates(const std::vector<recordings> &of_inputs) const {
    return marked(steps_.rates(moving_.rates(of_inputs)));
  }
  std::vector<recordings> weights(const recordings &of_results) const {
    std::vector<recordings> by = moving_.weights(steps_.weights(of_results));
    for (recordings &x : by)
      x = marked(std::move(x));
    return by;
  }

private:
  /// Where a closed mechanism has no results, NaN.
  recordings marked(recordings x) const {
    if (!is_closed_)
      return x;
    recording sum = moving_.fault();
    for (const recording &y : steps_.results())
      if (y.place() >= 0)
        sum = sum + y;
    mark_missing(sum, x.data(), static_cast<std::ptrdiff_t>(x.size()));
    return x;
  }

  recordings given_;
  moving_inputs moving_;
  differentiation steps_;
  bool is_closed_;
};

recorded along_velocities(const model &m, const recorded &of, bool single, derivative kind) {
  recorded out = {graph(single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const varied by(m, of, in, single);
  if (kind == derivative::rates) {
    std::vector<recordings> rates;
    for (std::size_t k = 0; k < of.inputs.size(); ++k)
      rates.push_back(in.take(of.inputs[k].name + "_dot", by.sizes()[k]));
    write(by.rates(rates), out.steps);
    for (const recorded_result &y : of.results)
      out.results.push_back({y.name + "_dot", y.shape});
  } else {
    recordings weights;
    for (const recorded_result &y : of.results)
      weights = joined(std::move(weights), in.take(y.name + "_bar", size_of(y)));
    for (const recordings &x : by.weights(weights))
      write(x, out.steps);
    for (std::size_t k = 0; k < of.inputs.size(); ++k)
      out.results.push_back({of.inputs[k].name + "_bar", shape_of(of.inputs[k], by.sizes()[k])});
  }
  out.steps = out.steps.needed();
  return out;
}

/// Its results are named as those of the row.
/// Result r is ∂y / ∂x_r, x_r being input r, q, v, and a or τ: column j is the rate of y where number j of x_r has the rate 1 and all others stay.
recorded record_along(const model &m, const request &asked, const algorithm_row &row) {
  request whole = asked;
  whole.row = differentiated_along(row, m), whole.pivots = false;
  refuse_along(row.name, m, asked.single);
  const recorded of = record(m, whole);
  refuse_friction(row.name, m, of);
  recorded out = {graph(asked.single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  const varied by(m, of, in, asked.single);
  for (int r = 0; r < row.results; ++r) { // by q, v, and a or efforts
    const auto size = static_cast<std::size_t>(by.sizes()[static_cast<std::size_t>(r)]);
    std::vector<recordings> columns;
    for (std::size_t j = 0; j < size; ++j) {
      std::vector<recordings> rates;
      for (const int n : by.sizes())
        rates.emplace_back(static_cast<std::size_t>(n), recording(0.0));
      rates[static_cast<std::size_t>(r)][j] = 1.0;
      columns.push_back(by.rates(rates));
    }
    for (std::size_t i = 0; i < of.steps.outputs().size(); ++i)
      for (const recordings &column : columns)
        out.steps.output(column[i].place());
    std::vector<int> shape = of.results.front().shape;
    shape.push_back(static_cast<int>(size));
    out.results.push_back({row.result[r].name, shape});
  }
  out.steps = out.steps.needed();
  return out;
}

} // namespace

recorded record_or_differentiate(const model &m, const request &asked) {
  for (const algorithm_row *row : rows::all)
    if (asked.row == row->name && differentiated_along(*row, m))
      return record_along(m, asked, *row);
  return record(m, asked);
}

recorded record_derivative(const model &m, const request &asked, derivative kind) {
  const recorded of = record_or_differentiate(m, asked);
  refuse(m, asked, of, kind);
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
