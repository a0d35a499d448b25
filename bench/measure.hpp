// Checks that the libraries agree, then measures times.  All peers evaluate the same states, in turns.
#pragma once

#include "limits.hpp"
#include "peers.hpp"
#include "quantities.hpp"
#include "states.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

inline double median(std::vector<double> x) {
  std::sort(x.begin(), x.end());
  return x.empty() ? std::numeric_limits<double>::quiet_NaN() : 0.5 * (x[(x.size() - 1) / 2] + x[x.size() / 2]);
}

/// One operation of one peer on one robot.
struct entry {
  const bench_peer *peer;
  void *self;
  int operation;
  size_t n;                  ///< states in one run
  double error = 0;          ///< greatest difference from the reference, relative to the largest number of a state
  std::vector<double> times; ///< ns per state, one for each repetition

  const bench_operation &op() const { return peer->operation[operation]; }
  const quantity &what() const { return quantity_of(op().name); }
};

/// A robot, its states, and all that the peers can do with it.
class contest {
public:
  using choice = std::function<bool(const bench_peer &, const bench_operation &)>;

  contest(const bench_model &model, const std::vector<const bench_peer *> &peers, size_t few, size_t many,
          const choice &wanted)
      : model_(model), few_(model, few, 1), many_(model, many, 2) {
    fill_efforts(*peers.front());
    const bench_states one = few_.view(), batch = many_.view();
    for (const bench_peer *peer : peers) {
      const bool any = std::any_of(peer->operation, peer->operation + peer->operations,
                                   [&](const bench_operation &o) { return wanted(*peer, o); });
      void *self = any ? peer->create(&model_, &one, &batch) : nullptr; // some workspaces are large
      if (!self)
        continue;
      created_.push_back({peer, self});
      for (int i = 0; i < peer->operations; ++i)
        if (wanted(*peer, peer->operation[i]))
          entries.push_back({peer, self, i, peer->operation[i].batch ? many : few, 0, {}});
    }
    std::stable_sort(entries.begin(), entries.end(), [](const entry &a, const entry &b) {
      return std::string(a.op().name) + char(a.op().batch) < std::string(b.op().name) + char(b.op().batch);
    });
  }
  contest(const contest &) = delete;
  ~contest() {
    for (const auto &[peer, self] : created_)
      peer->destroy(self);
  }

  /// Compares all results; prints a message and returns false if two libraries don't agree.  One-state results are
  /// compared with the first peer that is not KSL, batches with KSL's one-state results, which have been compared
  /// before.
  bool agree() {
    bool good = true;
    std::erase_if(entries, [&](const entry &e) { // a peer doesn't write results for which it has no algorithm
      return nothing(results(e));
    });
    for (entry &e : entries) {
      const std::vector<double> found = results(e), expected = witness(e);
      if (expected.empty())
        continue;
      e.error = difference(e, found, expected);
      const double allowed = tolerance(e);
      if (!(e.error <= allowed)) {
        std::fprintf(stderr, "DISAGREEMENT: %s, %s %s%s%s: relative difference %.2g, allowed %.0e\n", model_.urdf,
                     e.peer->name, e.op().name, e.op().batch ? " batch" : "", e.op().single ? " float" : "", e.error,
                     allowed);
        good = false;
      }
    }
    return good;
  }

  /// Measures times.  Each repetition runs every entry once, right after an untimed run that loads its code and data
  /// into the caches.  If they take less than some seconds, there are more repetitions than requested, since a machine
  /// may be slow for a while.
  void measure(int repetitions, double least_seconds, const std::function<void()> &in_each_turn) {
    const double begin = seconds();
    for (int r = 0; r < repetitions || seconds() - begin < least_seconds; ++r) {
      in_each_turn();
      for (entry &e : entries) {
        const auto clock = e.op().threads == 1 ? own_seconds : seconds;
        e.peer->run(e.self, e.operation, nullptr);
        const double start = clock();
        e.peer->run(e.self, e.operation, nullptr);
        e.times.push_back((clock() - start) / static_cast<double>(e.n) * 1e9);
      }
    }
  }

  /// The fastest variant of an operation among some peers; null if there is none.
  const entry *best(const std::function<bool(const bench_peer &)> &competes, const std::string &operation,
                    int batch = 0, int single = 0, int threads = 1) const {
    const entry *found = nullptr;
    for (const entry &e : entries)
      if (competes(*e.peer) && e.op().name == operation && e.op().batch == batch && e.op().single == single &&
          e.op().threads == threads && (!found || median(e.times) < median(found->times)))
        found = &e;
    return found;
  }

  std::vector<entry> entries;

private:
  bench_model model_;
  states few_, many_;
  std::vector<std::pair<const bench_peer *, void *>> created_;
  struct witness_rows {
    std::string key;
    const bench_peer *peer;
    std::vector<double> rows;
  };
  std::vector<witness_rows> witnesses_;

  /// What solves loses digits with the condition of the mass matrix, which grows with the fourth power of a chain's
  /// length.
  double tolerance(const entry &e) const {
    const double ordinary = e.op().single ? (e.what().solves ? 3e-2 : 1e-3) : 1e-9;
    return e.what().solves ? ordinary * std::fmax(1, std::pow(model_.joints / 100.0, 4)) : ordinary;
  }

  /// Efforts that give the accelerations of the states, so that forward dynamics gets realistic numbers.
  void fill_efforts(const bench_peer &peer) {
    for (states *s : {&few_, &many_}) {
      const bench_states view = s->view();
      void *self = peer.create(&model_, &view, &view);
      if (!self)
        std::exit(1);
      peer.run(self, 0, s->tau.data());
      peer.destroy(self);
    }
  }

  static bool nothing(const std::vector<double> &rows) {
    return std::all_of(rows.begin(), rows.end(), [](double x) { return std::isnan(x); });
  }

  std::vector<double> results(const entry &e) const {
    std::vector<double> out(e.n * static_cast<size_t>(e.what().width(model_)),
                            std::numeric_limits<double>::quiet_NaN());
    e.peer->run(e.self, e.operation, out.data());
    return out;
  }

  /// One-state results of the same operation on the same states by another library, or for batches by KSL.
  std::vector<double> witness(const entry &e) {
    const bool batch = e.op().batch;
    const std::string name = batch ? e.op().name : e.what().of_others(), key = name + (batch ? " many" : " few");
    for (const witness_rows &w : witnesses_)
      if (w.key == key && (w.peer != e.peer || batch))
        return w.rows;
    for (const auto &[peer, self] : created_)
      for (int i = 0; i < peer->operations; ++i) {
        const bool fits = batch ? peer->library == std::string("KSL") : peer->library != std::string(e.peer->library);
        if (!fits || peer->operation[i].batch || peer->operation[i].name != name)
          continue;
        std::vector<double> rows = one_by_one(*peer, self, i, batch);
        if (nothing(rows))
          continue;
        witnesses_.push_back({key, peer, rows});
        return rows;
      }
    if (name == "aba") // efforts were computed from accelerations, which must be reproduced
      return batch ? many_.a : few_.a;
    return {};
  }

  std::vector<double> one_by_one(const bench_peer &peer, void *self, int operation, bool batch) const {
    if (!batch)
      return results({&peer, self, operation, few_.n, 0, {}});
    const bench_states view = many_.view();
    void *other = peer.create(&model_, &view, &view);
    std::vector<double> rows = results({&peer, other, operation, many_.n, 0, {}});
    peer.destroy(other);
    return rows;
  }

  /// The error of the worst state; for what solves, in float, the median, since states may be ill-conditioned.
  double difference(const entry &e, const std::vector<double> &found, const std::vector<double> &expected) const {
    const size_t width = found.size() / e.n;
    std::vector<double> each;
    for (size_t k = 0; k < e.n; ++k) {
      double scale = 0, worst = 0;
      for (size_t i = k * width; i < (k + 1) * width; ++i) {
        scale = std::fmax(scale, std::fabs(expected[i]));
        const double d = std::fabs(found[i] - expected[i]);
        worst = d <= worst ? worst : d; // a NaN counts
      }
      each.push_back(scale > 0 ? worst / scale : worst);
    }
    if (e.op().single && e.what().solves)
      return median(each);
    double all = 0;
    for (double x : each)
      all = x <= all ? all : x;
    return all;
  }
};
