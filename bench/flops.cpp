// How many additions, multiplications and divisions each algorithm does for one state, counted by running it on a
// scalar that counts: `flops NAME=PATH[:floating]...` prints JSON.  Sines and cosines are counted as the polynomials
// that they are.
#include "algebra/counting.hpp"

#include "ksl/dynamics.hpp"
#include "ksl/pack.hpp"

/// Models hold plain numbers, from which the counting ones are made: as for packs.
template <> struct ksl::scalar_of_trait<counting> { using type = double; };

inline void load_rows(const double *row, std::ptrdiff_t, int columns, int, counting *out) {
  for (int c = 0; c < columns; ++c)
    out[c] = counting(row[c]);
}
inline void store_rows(const counting *, int, int, double *, std::ptrdiff_t) {}
inline void store_symmetric(const counting *, int, int, double *, std::ptrdiff_t) {}

#include "batch/lane_kernels.hpp"

#include <cstdio>
#include <string>
#include <vector>

namespace {

/// Flops of a sine and cosine within fast_range.
int count_pair() {
  counting sine, cosine;
  counting::reset();
  ksl::sine_cosine_in_fast_range(counting(0.5), sine, cosine);
  return counting::flops;
}

/// Flops of a kernel of lane_kernels.hpp for one state.
template <class Kernel> int count(const ksl::model &m, Kernel kernel) {
  std::vector<double> q(static_cast<std::size_t>(m.nq()), 0.5), v(static_cast<std::size_t>(m.nv()), 0.25), out(1);
  ksl::batch_view<double> batch;
  batch.n = 1;
  batch.q = {q.data(), 0};
  batch.v = batch.a = batch.tau = {v.data(), 0};
  batch.out = {out.data(), 0}; // nothing is written
  std::vector<double> memory(kernel(m.view(), batch, nullptr) / sizeof(double) + 8);
  const std::size_t misplaced = reinterpret_cast<std::size_t>(memory.data()) % 64;
  counting::reset();
  kernel(m.view(), batch, memory.data() + (misplaced ? (64 - misplaced) / sizeof(double) : 0));
  const int flops = counting::flops + counting::roots, pairs = counting::sines / 2;
  return flops + pairs * count_pair();
}

int count_poses(const ksl::model &m) {
  return count(m, [](const auto &view, const auto &batch, void *memory) {
    return ksl::for_each_block<counting>(view, batch, memory, 0, [&](std::size_t, int, const auto &w, const auto &) {
      ksl::forward_kinematics(view, w.data, w.q);
    });
  });
}

int count_sines(const ksl::model &m) {
  return count(m, [](const auto &view, const auto &batch, void *memory) {
    return ksl::for_each_block<counting>(view, batch, memory, 0, [&](std::size_t, int, const auto &w, const auto &) {
      ksl::sines_and_cosines(view, w.data, w.q);
    });
  });
}

void print(const char *name, const ksl::model &m) {
  const auto rnea = [](const auto &view, const auto &batch, void *memory) {
    return ksl::inverse_dynamics_lanes<counting>(view, batch, 0, nullptr, memory);
  };
  std::printf("\"%s\": {\"rnea\": %d, \"aba\": %d, \"crba\": %d, \"fk\": %d, \"sines_and_cosines\": %d}", name,
              count(m, rnea), count(m, ksl::forward_dynamics_lanes<counting>),
              count(m, ksl::mass_matrix_lanes<counting>), count_poses(m), count_sines(m));
}

} // namespace

int main(int argc, char **argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i], suffix = ":floating";
    const std::size_t equals = word.find('=');
    const bool floating = word.ends_with(suffix);
    ksl::model_options options;
    options.floating_base = floating;
    std::printf(i == 1 ? "{" : ",\n ");
    print(word.substr(0, equals).c_str(),
          ksl::load(word.substr(equals + 1, word.size() - equals - 1 - (floating ? suffix.size() : 0)), options, true));
  }
  std::printf("}\n");
}
