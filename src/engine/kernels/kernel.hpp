// The kernels of an algorithm for one instruction set: one state, and states in lanes.  Included by the files of
// src/engine/kernels/algorithms/, each of which is compiled once for each set.  Don't use std containers here: their functions are
// weak symbols, which the linker would merge between the sets.
//
// A batch lies in rows, a state each; a block of W states lies in packs, a state in each lane.  Blocks are computed one after the other in the same
// memory, [ workspace | inputs of a block | results of a block ], every number of it a pack:
//
//     rows                          packs of W = 4
//     state k      q0 q1 q2 …       q0 of the states k … k + 3
//     state k + 1  q0 q1 q2 …   ⇄   q1 of these
//     …                             …                           transposed by load_rows and store_rows (ksl/engine/lanes/transpose.hpp)
#pragma once

#include "engine/kernels/algorithm.hpp"
#include "engine/kernels/one_state.hpp"
#include "ksl/engine/lanes/transpose.hpp"
#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Sums of results, which are not finite if a result isn't.  For algorithms that need mass they are sums of squares, which are also
/// large if a result is: accelerations at a joint that moves almost no mass are large before they are infinite.  A sum takes one or
/// two operations for each result, while it is in a register or an inner cache.
template <class T> struct sums {
  explicit sums(bool of_squares) : squared(of_squares) {}

  KSL_LANES void add(const T *x, std::ptrdiff_t n) {
    if (squared)
      add_each(x, n, [](const T &y) { return y * y; });
    else
      add_each(x, n, [](const T &y) { return y; });
  }
  /// The sum of numbers that are in registers, or of their squares.
  template <int K> KSL_LANES T sum_in_registers(const T (&x)[K]) const {
    if (squared)
      return sum_of<0, K>(x, [](const T &y) { return y * y; });
    return sum_of<0, K>(x, [](const T &y) { return y; });
  }
  KSL_LANES void add_sum(const T &x) { sum[0] = sum[0] + x; }
  /// Are the results ordinary (engine/kernels/algorithm.hpp)?  This may be false for finite results whose sum is too large; the caller then looks
  /// at each result.
  bool ordinary() const {
    using S = scalar_of<T>;
    // squares of large_result (states/ordinary_results.hpp), or what is near the end of the range, where sums of finite numbers may overflow
    const S most = squared ? S(1e20) : sizeof(S) == 8 ? S(1e300) : S(1e38);
    const T all = (sum[0] + sum[1]) + (sum[2] + sum[3]);
    bool found = true;
    for (int lane = 0; lane < static_cast<int>(sizeof(T) / sizeof(S)); ++lane)
      found &= at(all, lane) < most && at(all, lane) > -most; // false for NaN
    return found;
  }

private:
  template <int first, int K, int N, class Of> KSL_LANES static T sum_of(const T (&x)[N], const Of &of) {
    if constexpr (K == 1)
      return of(x[first]);
    else
      return sum_of<first, K / 2>(x, of) + sum_of<first + K / 2, K - K / 2>(x, of);
  }
  template <class Of> KSL_LANES void add_each(const T *x, std::ptrdiff_t n, const Of &of) {
    constexpr int count = 16; // scalars in independent sums, which fill registers and hide the latency of an addition
    if constexpr (sizeof(T) == sizeof(scalar_of<T>))
      if (n >= 2 * count) {
        T many[count] = {};
        for (; n >= count; n -= count, x += count)
          for (int i = 0; i < count; ++i)
            many[i] = many[i] + of(x[i]);
        for (int i = 0; i < count; ++i)
          sum[i & 3] = sum[i & 3] + many[i];
      }
    for (; n >= 4; n -= 4, x += 4) {
      sum[0] = sum[0] + of(x[0]), sum[1] = sum[1] + of(x[1]);
      sum[2] = sum[2] + of(x[2]), sum[3] = sum[3] + of(x[3]);
    }
    for (int i = 0; i < n; ++i)
      sum[i] = sum[i] + of(x[i]);
  }
  static scalar_of<T> at(const T &x, int lane) {
    if constexpr (sizeof(T) == sizeof(scalar_of<T>))
      return x;
    else
      return x[lane];
  }
  bool squared;
  T sum[4] = {};
};

/// Columns that are stored are summed while they are in registers, on their way into rows.  The sum is a number of its own, which stays
/// in a register: rows that are written could be the sums in memory, for all that the compiler knows.
template <class P> struct summed_columns {
  sums<P> *seen = nullptr;
  P sum = P(scalar_of<P>(0));
  template <int K> KSL_LANES void look(const P (&x)[K]) { sum = sum + seen->sum_in_registers(x); }
  KSL_LANES void finish() const { seen->add_sum(sum); }
};

/// Returns columns in lanes, one after the other.
template <class P> struct next_columns : summed_columns<P> {
  const P *in;
  next_columns(const P *columns, sums<P> &stored) : summed_columns<P>{&stored}, in(columns) {}
  KSL_LANES const P &operator()() { return *in++; }
};

/// The states k, k + 1, ... of a batch, `valid` in number, one in each lane.
template <class P> struct block {
  using S = scalar_of<P>;
  const batch_view<S> &batch;
  std::size_t k;
  int valid;
  sums<P> &stored; ///< sums of the results of all blocks

  /// Loads rows into lanes; zeros if there are no rows.
  void load(const rows_view<const S> &rows, int columns, P *out) const {
    if (rows.first)
      return load_rows(row(rows, k), rows.stride, columns, valid, out);
    for (int i = 0; i < columns; ++i)
      out[i] = P(S(0));
  }
  /// Stores lanes into rows, if the result is wanted.
  void store(const P *in, std::ptrdiff_t columns, const rows_view<S> &rows) const {
    if (!rows.first)
      return;
    next_columns<P> next(in, stored);
    store_next_of<S, transposition::width_of<P>>(batch.n, next, columns, valid, row(rows, k), rows.stride);
    next.finish();
  }
};

/// The workspace of an algorithm over T.
template <class Algorithm, class T> using workspace_of = typename Algorithm::template workspace<T>;

namespace forms {

/// The usual form: results are computed whole and then stored.  Other forms are in engine/kernels/forms.hpp.
template <class Algorithm> struct whole_results {
  template <class T>
  static void state(const model_view<scalar_of<T>> &model, const workspace_of<Algorithm, T> &w,
                    const state_view<T> &s) {
    Algorithm::compute(model, w, s);
  }
  /// Adds the results that were written to the sums.
  template <class T> static void add_results(const model_view<scalar_of<T>> &model, const state_view<T> &s,
                                             sums<T> &written) {
    for (int r = 0; r < Algorithm::row.results; ++r)
      if (s.result[r])
        written.add(s.result[r], numbers_of(Algorithm::row.result[r], extents_of(model, s)));
  }

  /// The results of a block in lanes, and its computation.
  template <class P> struct lanes {
    P *result[most_results];

    void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch) {
      for (int r = 0; r < Algorithm::row.results; ++r)
        result[r] = memory.take<P>(numbers_of(Algorithm::row.result[r], extents_of(model, batch)));
    }
    void compute(const model_view<scalar_of<P>> &model, const workspace_of<Algorithm, P> &w, state_view<P> &s,
                 const block<P> &b) {
      for (int r = 0; r < Algorithm::row.results; ++r)
        s.result[r] = result[r];
      Algorithm::compute(model, w, s);
      for (int r = 0; r < Algorithm::row.results; ++r)
        b.store(result[r], numbers_of(Algorithm::row.result[r], extents_of(model, b.batch)), b.batch.result[r]);
    }
  };
};

} // namespace forms

template <class Algorithm, class S> std::size_t state_workspace_bytes(const model_view<S> &model) {
  arena measure(nullptr);
  workspace_of<Algorithm, S>().lay_out(measure, model);
  return measure.used();
}

template <class Algorithm, class S> bool one_state(const model_view<S> &model, void *memory, const state_view<S> &s) {
  if (!memory)
    __builtin_unreachable(); // so that addresses are sums, without a question at each
  arena pieces(memory);
  workspace_of<Algorithm, S> w;
  w.lay_out(pieces, model);
  Algorithm::form::state(model, w, s);
  if constexpr (!Algorithm::row.needs_mass) {
    return true; // a sum would take up to a tenth of the time for a small robot; the calls of C and Python look at the results
  } else {
    sums<S> written(true);
    Algorithm::form::add_results(model, s, written);
    return written.ordinary();
  }
}

/// The inputs of a block in lanes.
template <class Algorithm, class P> struct input_lanes {
  static constexpr algorithm_row row = Algorithm::row;
  P *numbers[most_inputs], *external; ///< numbers: those of each input that the row lists
  int *external_link;

  void lay_out(arena &memory, const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch) {
    for (int i = 0; i < row.inputs; ++i)
      numbers[i] = memory.take<P>(length_of(row.input_list[i], model.nq, model.nv));
    external = memory.take<P>(row.external != external_use::none ? 6 * batch.external_n : 0);
    external_link = memory.take<int>(row.external != external_use::none ? batch.external_n : 0);
  }

  state_view<P> load(const model_view<scalar_of<P>> &model, const block<P> &b) const {
    state_view<P> s;
    s.links = b.batch.links, s.frame = b.batch.frame, s.joints = b.batch.joints;
    for (int i = 0; i < row.inputs; ++i) {
      const input x = row.input_list[i];
      input_of(s, x) = numbers[i];
      b.load(input_of(b.batch, x), length_of(x, model.nq, model.nv), numbers[i]);
    }
    if constexpr (row.external != external_use::none) {
      for (int e = 0; e < b.batch.external_n; ++e) {
        external_link[e] = b.batch.external[e].link;
        b.load(b.batch.external[e].wrench, 6, external + 6 * e);
      }
      s.external = {b.batch.external_n, external_link, external, b.batch.external_axes};
    }
    return s;
  }
};

/// Computes a batch block by block, so that the workspace of a block stays in the inner caches.
template <class Algorithm, class P>
batch_outcome states_in_lanes(const model_view<scalar_of<P>> &model, const batch_view<scalar_of<P>> &batch,
                              std::size_t first, std::size_t end, void *memory) {
  constexpr std::size_t lanes = sizeof(P) / sizeof(scalar_of<P>);
  arena pieces(memory);
  workspace_of<Algorithm, P> w;
  input_lanes<Algorithm, P> inputs;
  typename Algorithm::form::template lanes<P> results;
  w.lay_out(pieces, model);
  inputs.lay_out(pieces, model, batch);
  results.lay_out(pieces, model, batch);
  sums<P> stored(Algorithm::row.needs_mass);
  for (std::size_t k = first; memory && k < end; k += lanes) {
    const block<P> b = {batch, k, static_cast<int>(end - k < lanes ? end - k : lanes), stored};
    state_view<P> s = inputs.load(model, b);
    results.compute(model, w, s, b);
  }
  if constexpr (requires { results.finish(model, batch, end, stored); })
    results.finish(model, batch, end, stored);
  finish_streams();
  return {pieces.used(), stored.ordinary()};
}

/// Computes a batch state by state, with the kernel for one state.  The baseline does so: it is for processors of 2009, and code for
/// lanes would double what is compiled for it.
template <class Algorithm, class S>
batch_outcome states_one_by_one(const model_view<S> &model, const batch_view<S> &batch, std::size_t first,
                                std::size_t end, void *memory) {
  arena pieces(memory);
  workspace_of<Algorithm, S> w;
  w.lay_out(pieces, model);
  copied_state<S> one;
  const extents of = extents_of(model, batch);
  one.lay_out(pieces, Algorithm::row, of, batch);
  sums<S> written(Algorithm::row.needs_mass);
  for (std::size_t k = first; memory && k < end; ++k) {
    const state_view<S> s = one.load(Algorithm::row, of, batch, k);
    Algorithm::form::state(model, w, s);
    Algorithm::form::add_results(model, s, written);
  }
  return {pieces.used(), written.ordinary()};
}

#ifdef KSL_BATCHES_BY_STATE
template <class Algorithm, class S>
constexpr kernels_in<S> kernels_in_precision = {1, state_workspace_bytes<Algorithm, S>, one_state<Algorithm, S>,
                                                states_one_by_one<Algorithm, S>};
#else
template <class Algorithm, class S>
constexpr kernels_in<S> kernels_in_precision = {batch_lanes<S>, state_workspace_bytes<Algorithm, S>,
                                                one_state<Algorithm, S>, states_in_lanes<Algorithm, batch_pack<S>>};
#endif

template <class Algorithm>
constexpr algorithm_kernels kernels_of = {
    .in_double = kernels_in_precision<Algorithm, double>,
    .in_float = kernels_in_precision<Algorithm, float>,
};

} // namespace KSL_ISA
} // namespace ksl

/// The symbol of an algorithm's kernels for the set that is compiled for.  An object file exports those of its algorithms alone.
#define KSL_KERNELS_OF_SET(name, set) ksl_kernels_##name##_##set
#define KSL_KERNELS_IN(name, set) KSL_KERNELS_OF_SET(name, set)
#define KSL_KERNELS(name) extern "C" const ksl::algorithm_kernels KSL_KERNELS_IN(name, KSL_ISA)
