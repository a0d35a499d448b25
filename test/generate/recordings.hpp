// Recordings played with numbers, and what they are of: for tests.
#pragma once

#include "generate/record.hpp"
#include "generate/recording.hpp"

#include "ksl/dynamics.hpp"
#include "robot_files.hpp"
#include "states.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

namespace recordings {

using namespace robots;
using ksl::generate::graph;
using ksl::generate::operation;
using ksl::generate::recorded;
using ksl::generate::recording;
using ksl::generate::step;

/// What a program of the steps computes, in the precision S.
template <class S> numbers<S> play(const graph &g, const numbers<S> &inputs) {
  numbers<S> value, out;
  for (const step &s : g.steps()) {
    const auto of = [&](int i) { return i < 0 ? S(0) : value[static_cast<std::size_t>(i)]; };
    const S a = of(s.a), b = of(s.b), c = of(s.c);
    S sine = 0, cosine = 0;
    if (s.what == operation::sine || s.what == operation::cosine)
      ksl::sine_cosine(a, sine, cosine);
    switch (s.what) {
    case operation::constant: value.push_back(static_cast<S>(s.number)); break;
    case operation::input: value.push_back(inputs[static_cast<std::size_t>(s.number)]); break;
    case operation::add: value.push_back(a + b); break;
    case operation::subtract: value.push_back(a - b); break;
    case operation::multiply: value.push_back(a * b); break;
    case operation::divide: value.push_back(a / b); break;
    case operation::negate: value.push_back(-a); break;
    case operation::less: value.push_back(a < b); break;
    case operation::at_most: value.push_back(a <= b); break;
    case operation::equal: value.push_back(a == b); break;
    case operation::select: value.push_back(a != S(0) ? b : c); break;
    case operation::root: value.push_back(std::sqrt(a)); break;
    case operation::absolute: value.push_back(std::fabs(a)); break;
    case operation::sine: value.push_back(sine); break;
    case operation::cosine: value.push_back(cosine); break;
    case operation::arctangent: value.push_back(std::atan2(a, b)); break;
    }
  }
  for (const int i : g.outputs())
    out.push_back(i < 0 ? S(NAN) : value[static_cast<std::size_t>(i)]);
  return out;
}

template <class S> numbers<S> in(const numbers<double> &x) { return {x.begin(), x.end()}; }

template <class S> state_over<S> rounded(const state &s) {
  return {in<S>(s.q),   in<S>(s.v),    in<S>(s.a),
          in<S>(s.tau), in<S>(s.push), in<S>(s.q1),
          s.pushed,     s.axes,        static_cast<S>(s.fraction)};
}

/// The inputs of a row in the order of a recording.
template <class S> numbers<S> inputs_of(const ksl::algorithm_row &row, const state_over<S> &s) {
  numbers<S> all;
  const auto add = [&](const numbers<S> &x) { all.insert(all.end(), x.begin(), x.end()); };
  for (int i = 0; i < row.inputs; ++i)
    switch (row.input_list[i]) {
    case ksl::input::q: add(s.q); break;
    case ksl::input::v: add(s.v); break;
    case ksl::input::a: add(s.a); break;
    case ksl::input::tau: add(s.tau); break;
    case ksl::input::q1: add(s.q1); break;
    case ksl::input::fraction: all.push_back(s.fraction); break;
    }
  if (row.external != ksl::external_use::none)
    add(s.push);
  return all;
}

template <class Step, class... Algorithms> void for_each(std::tuple<Algorithms...>, Step step) {
  (step(Algorithms()), ...);
}

/// Largest difference over the largest number; NaN is what both don't write.
template <class S> double apart(const numbers<S> &x, const numbers<S> &y) {
  REQUIRE(x.size() == y.size());
  double worst = 0, size = 1e-300;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(std::isnan(x[i]) && std::isnan(y[i]))) {
      const double d = std::fabs(static_cast<double>(x[i]) - static_cast<double>(y[i]));
      worst = d <= worst ? worst : d, size = std::fmax(size, std::fabs(static_cast<double>(y[i])));
    }
  return worst / size;
}

/// What a call of a row names, and the request for its recording.
struct requests {
  request asked;
  ksl::generate::request wanted;
};
inline requests requests_of(const ksl::algorithm_row &row, const ksl::model &m, const state &s, bool single) {
  requests both = {of_links(m, row.request == ksl::request_kind::reactions ? 1 : 2), {}}; // welded ones, too
  if (row.request == ksl::request_kind::relative)
    both.asked.links = {m.view().links - 1, m.view().links / 2};
  both.wanted.row = row.name, both.wanted.links = both.asked.links, both.wanted.single = single;
  both.wanted.joints.n = static_cast<int>(both.asked.links.size());
  if (row.external != ksl::external_use::none)
    both.wanted.external_links = s.pushed;
  return both;
}

inline state state_with_pushes(const ksl::model &m, std::mt19937 &random) {
  state s = random_state(m, random);
  s.axes = ksl::expressed_in::frame;
  return s;
}

} // namespace recordings
