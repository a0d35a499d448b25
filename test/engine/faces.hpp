// Holds the faces of an algorithm against each other: C++ and C, one state and batches, lanes, threads, strides, no states.  No call
// allocates once it has been made, in any thread; calls for one state never do, and read nothing in the workspace that they have not
// written.
#pragma once

#include "allocation.hpp"
#include "batch/threads.hpp"
#include "engine/kernels/algorithm_rows.hpp"
#include "ksl/batch.hpp"
#include "ksl/engine.h"
#include "robots.hpp"
#include "robot_files.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace faces {

/// A robot for C++ and for C, with what calls ask for: two pushed links, three links, all moving joints, how a frame's motion is
/// expressed.
struct robot {
  ksl::model m;
  ksl::data d{m};
  ksl_model_t *c_model = nullptr;
  ksl_data_t *c_data = nullptr;
  std::vector<int> pushed{7, 3}, links{5, 2, 5}, joints, joint_links;
  ksl::reaction_request request;
  ksl::frame_options how;
  const ksl_frame_options_t *c_how = nullptr;             ///< the same
  ksl::expressed_in push_axes = ksl::expressed_in::frame; ///< in which wrenches push

  robot(const std::string &path, bool floating_base) : m(load(path, floating_base)) {
    ksl_model_options_t options = ksl_model_options();
    options.floating_base = floating_base;
    REQUIRE(ksl_model_load(path.c_str(), &options, &c_model) == KSL_OK);
    REQUIRE(ksl_data_create(c_model, &c_data) == KSL_OK);
    for (int i = 0; i < m.moving_joints(); ++i)
      joints.push_back(i), joint_links.push_back(m.joints()[static_cast<std::size_t>(i)].link);
    request.n = static_cast<int>(joints.size()), request.link = joint_links.data();
  }
  ~robot() {
    ksl_data_free(c_data);
    ksl_model_free(c_model);
  }
  robot(const robot &) = delete;

  ksl::component_order order() const { return order_of(how); }
  ksl_order_t c_order() const { return c_how ? c_how->order : KSL_LINEAR_FIRST; }

  static ksl::model load(const std::string &path, bool floating_base) {
    ksl::model_options options;
    options.floating_base = floating_base;
    return ksl::load(path, options);
  }
};

template <class S> struct c_types;
template <> struct c_types<double> {
  using external = ksl_external_t;
  using external_rows = ksl_external_rows_t;
  using coscrew = ksl_coscrew_t;
};
template <> struct c_types<float> {
  using external = ksl_externalf_t;
  using external_rows = ksl_external_rowsf_t;
  using coscrew = ksl_coscrewf_t;
};

/// One state, as the calls take it.
template <class S> struct one {
  robot &r;
  const S *q, *v, *a, *tau, *q1, *fraction;
  ksl::external_wrenches<S> external;
  typename c_types<S>::external c_external;
  S *result[ksl::most_results];
  S *wrenches;
  ksl_status_t status = KSL_OK; ///< of a call from C
};

/// A batch, as C takes it.
template <class S> struct many {
  robot &r;
  std::size_t n;
  ksl::batch_view<S> batch;
  typename c_types<S>::external_rows external;
  int threads;
  ksl_status_t status = KSL_OK; ///< of a call from C
};

/// What calls an algorithm.  Functions, so that what checks them is compiled once for a precision and not for each algorithm.
template <class S> using one_call = void (*)(one<S> &);
template <class S> using batch_call = void (*)(many<S> &);

/// Results of n states side by side, reactions last.
template <class S> struct results {
  std::vector<std::vector<S>> numbers;
  bool operator==(const results &) const = default;
};

template <class S> class check {
public:
  check(const ksl::algorithm_row &row, robot &r, std::size_t n) : row_(row), r_(r), n_(n) {
    std::mt19937 random(5);
    std::uniform_real_distribution<S> number(S(-2), S(2));
    for (auto [numbers, width] :
         {std::pair{&q_, r.m.nq()}, {&v_, r.m.nv()}, {&x_, r.m.nv()}, {&w_, 12}, {&q1_, r.m.nq()}, {&fraction_, 1}}) {
      numbers->resize(n * static_cast<std::size_t>(width));
      std::generate(numbers->begin(), numbers->end(), [&] { return number(random); });
    }
    for (std::vector<S> *q : {&q_, &q1_})
      for (std::size_t k = 0; k < n; ++k)
        robots::normalize_quaternions(r.m, &(*q)[k * static_cast<std::size_t>(r.m.nq())]);
  }

  /// State after state, by a call for one state.
  template <class Call> results<S> states(Call call) {
    results<S> found = room(n_, 0);
    for (std::size_t k = 0; k < n_; ++k) {
      const S *const wrench = &w_[12 * k];
      one<S> s{r_,
               at(q_, r_.m.nq(), k),
               at(v_, r_.m.nv(), k),
               at(x_, r_.m.nv(), k),
               at(x_, r_.m.nv(), k),
               at(q1_, r_.m.nq(), k),
               at(fraction_, 1, k),
               {2, r_.pushed.data(), wrench, r_.push_axes},
               {2, r_.pushed.data(), reinterpret_cast<const typename c_types<S>::coscrew *>(wrench),
                static_cast<ksl_expressed_t>(r_.push_axes)},
               {},
               nullptr};
      for (int i = 0; i < row_.results; ++i)
        s.result[i] = &found.numbers[static_cast<std::size_t>(i)][k * width(i)];
      if (row_.request == ksl::request_kind::reactions)
        s.wrenches = &found.numbers.back()[k * width(row_.results)];
      std::memset(r_.d.memory(), k % 2 ? 0xff : 0x3f, r_.d.bytes()); // NaN, or 4.8e-4 in double and 0.75 in float
      const long before = allocations;
      call(s);
      CHECK(s.status == KSL_OK);
      if (k > 0) // the first call chooses the instruction set
        CHECK(allocations == before);
    }
    return found;
  }

  /// The first `count` states as a batch, rows `gap` numbers apart, backwards if asked for.
  template <class Call> results<S> batch(Call call, std::size_t count, int threads, std::size_t gap = 0,
                                         bool backwards = false) {
    results<S> found = room(count, gap);
    ksl::batch_view<S> b;
    b.n = count;
    const auto rows = [&](const auto &x, int columns) -> ksl::rows_view<const S> {
      return direction(x.data(), columns, count, backwards);
    };
    b.q = rows(q_, r_.m.nq()), b.v = rows(v_, r_.m.nv()), b.a = b.tau = rows(x_, r_.m.nv());
    b.q1 = rows(q1_, r_.m.nq()), b.fraction = rows(fraction_, 1);
    const auto w = rows(w_, 12);
    const ksl::external_rows<S> external[2] = {{r_.pushed[0], w}, {r_.pushed[1], {w.first + 6, w.stride}}};
    b.external_n = pushes_, b.external = external, b.external_axes = r_.push_axes;
    b.frame = r_.how;
    b.links = {links(), r_.links.data()};
    b.joints = &r_.request;
    const auto out = [&](int i) {
      return direction(found.numbers[static_cast<std::size_t>(i)].data(), static_cast<int>(width(i) + gap), count,
                       backwards);
    };
    for (int i = 0; i < row_.results; ++i)
      b.result[i] = out(i);
    ksl::reaction_rows<S> wanted{r_.request, {}};
    if (row_.request == ksl::request_kind::reactions) {
      wanted.out = out(row_.results);
      b.reactions_n = 1, b.reactions = &wanted;
    }
    many<S> all{r_,
                count,
                b,
                {pushes_, r_.pushed.data(), w.first, w.stride, static_cast<ksl_expressed_t>(r_.push_axes)},
                threads};
    const long before = allocations;
    call(all);
    allocated_ = allocations - before;
    CHECK(all.status == KSL_OK);
    return without_gaps(found, count, gap);
  }

  /// From now on nothing pushes.  C has calls of their own for that.
  void release() { pushes_ = 0; }

  /// How many allocations the last call for a batch made, in all threads.
  long allocated() const { return allocated_; }

  /// The first `count` states of what was found.
  results<S> first(const results<S> &all, std::size_t count) const {
    results<S> part;
    for (std::size_t i = 0; i < all.numbers.size(); ++i)
      part.numbers.emplace_back(all.numbers[i].begin(),
                                all.numbers[i].begin() +
                                    static_cast<std::ptrdiff_t>(count * width(static_cast<int>(i))));
    return part;
  }

private:
  std::size_t width(int i) const {
    const ksl::extents of = {
        r_.m.nq(), r_.m.nv(), links(), r_.request.n, r_.m.tree_elements(), static_cast<int>(r_.m.links().size())};
    return static_cast<std::size_t>(i < row_.results ? numbers_of(row_.result[i], of) : 6 * r_.request.n);
  }
  int links() const {
    const int least = ksl::least_links(row_.request);
    return least ? least : static_cast<int>(r_.links.size());
  }
  results<S> room(std::size_t n, std::size_t gap) const {
    results<S> made;
    for (int i = 0; i < row_.results + (row_.request == ksl::request_kind::reactions); ++i)
      made.numbers.emplace_back(n * (width(i) + gap) + 1, S(-7));
    return made;
  }
  /// Gaps, and what lies behind the last row, must not have been written.
  results<S> without_gaps(const results<S> &found, std::size_t count, std::size_t gap) const {
    results<S> rows = room(count, 0);
    for (std::size_t i = 0; i < found.numbers.size(); ++i) {
      const std::size_t w = width(static_cast<int>(i));
      CHECK(found.numbers[i].back() == S(-7));
      for (std::size_t k = 0; k < count; ++k) {
        const auto row = found.numbers[i].begin() + static_cast<std::ptrdiff_t>(k * (w + gap));
        std::copy_n(row, w, rows.numbers[i].begin() + static_cast<std::ptrdiff_t>(k * w));
        CHECK(std::count(row + static_cast<std::ptrdiff_t>(w), row + static_cast<std::ptrdiff_t>(w + gap), S(-7)) ==
              static_cast<std::ptrdiff_t>(gap));
      }
      rows.numbers[i].resize(count * w);
    }
    return rows;
  }
  template <class E> static ksl::rows_view<E> direction(E *first, int stride, std::size_t n, bool backwards) {
    return backwards && n ? ksl::rows_view<E>{first + static_cast<std::ptrdiff_t>(n - 1) * stride, -stride}
                          : ksl::rows_view<E>{first, stride};
  }
  static const S *at(const std::vector<S> &x, int width, std::size_t k) {
    return &x[k * static_cast<std::size_t>(width)];
  }

  const ksl::algorithm_row &row_;
  robot &r_;
  std::size_t n_;
  int pushes_ = 2;
  std::vector<S> q_, v_, x_, w_, q1_, fraction_; // x_: a or tau
  long allocated_ = 0;
};

/// All faces of one algorithm in one precision, for one robot.
template <class S>
void agree(robot &r, const ksl::algorithm_row &row, one_call<S> cpp, one_call<S> c, batch_call<S> cpp_batch,
           batch_call<S> c_batch) {
  // More than one part of a batch for one algorithm, since all share how a batch is divided; test/mechanism/algorithms_test.py divides those of each.
  // Matrices have hundreds of numbers for each state, and their derivatives thousands.
#ifdef KSL_TEST_MANY_STATES
  const bool few = row.result[0].axes > 1;
#else
  const bool few = &row != &ksl::rows::inverse_dynamics;
#endif
  const bool fewest = row.result[0].axes > 2;
  const std::size_t n = fewest ? 20 : few ? 40 : 1100;
  REQUIRE((few || n >= 2 * ksl::least_states(r.m.moving_joints())));
  check<S> faces(row, r, n);
  results<S> expected = faces.states(cpp);
  for (std::vector<S> &x : expected.numbers)
    x.pop_back(); // the number that nobody writes
  results<S> from_c = faces.states(c);
  for (std::vector<S> &x : from_c.numbers) {
    CHECK(x.back() == S(-7));
    x.pop_back();
  }
  CHECK(from_c == expected);
  for (std::size_t count : {0u, 1u, 2u, 7u, 8u, 9u, 15u, 16u, 17u, 33u, static_cast<unsigned>(n)})
    for (int threads : {1, 3}) {
      if (count > n || (fewest && count > 2 && count < 17))
        continue;
      CAPTURE(count);
      CHECK(faces.batch(cpp_batch, count, threads) == faces.first(expected, count));
      CHECK(faces.batch(c_batch, count, threads) == faces.first(expected, count));
      // threads and memory are there now, so that further calls allocate nothing
      CHECK(faces.batch(cpp_batch, count, threads, 3) == faces.first(expected, count));
      CHECK(faces.allocated() == 0);
      CHECK(faces.batch(c_batch, count, threads, 3, true) == faces.first(expected, count));
      CHECK(faces.allocated() == 0);
    }
  if (row.external == ksl::external_use::optional) {
    faces.release();
    CHECK(faces.batch(c_batch, 9, 1) == faces.batch(cpp_batch, 9, 1));
  }
}

/// Three robots: one that floats as a whole, one with every kind of joint, and the same with joints that follow others.  Where a
/// frame's motion is asked for, or the order of six numbers, it is asked for in every way that tells the options apart.
template <class S>
void agree(const ksl::algorithm_row &row, one_call<S> cpp, one_call<S> c, batch_call<S> cpp_batch,
           batch_call<S> c_batch, bool ordered = false) {
  ksl::assume_cores(3);
  static robot floating(robot_file("panda"), true), every_kind(every_kind_file, false), coupled(coupled_file, false);
  static constexpr ksl_frame_options_t crossed[] = {
      {KSL_IN_WORLD, KSL_IN_FRAME, KSL_LINEAR_FIRST, KSL_CLASSICAL, {0, 0, 0}},
      {KSL_IN_FRAME, KSL_IN_WORLD, KSL_ANGULAR_FIRST, KSL_SPATIAL, {0.3, -0.2, 0.1}}};
  using ksl::expressed_in;
  for (robot *r : {&floating, &every_kind, &coupled}) {
    if (r->m.followers() > 0 && row.mimic == ksl::mimic_by::refusal)
      continue;
    r->how = {}, r->c_how = nullptr;
    r->push_axes = r == &every_kind ? expressed_in::world : expressed_in::frame;
    agree<S>(*r, row, cpp, c, cpp_batch, c_batch);
    const bool of_frames = row.request == ksl::request_kind::frame || row.request == ksl::request_kind::frames ||
                           row.request == ksl::request_kind::relative;
    if (!of_frames && !ordered)
      continue;
    if (of_frames)
      r->how = {.axes = expressed_in::world, .at = expressed_in::frame, .kind = ksl::acceleration_kind::classical},
      r->c_how = &crossed[0];
    if (of_frames)
      agree<S>(*r, row, cpp, c, cpp_batch, c_batch);
    r->how = {.axes = expressed_in::frame,
              .at = expressed_in::world,
              .angular_first = true,
              .offset = {0.3, -0.2, 0.1}},
    r->c_how = &crossed[1];
    agree<S>(*r, row, cpp, c, cpp_batch, c_batch);
  }
}

} // namespace faces
