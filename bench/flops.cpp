// Counts the additions, multiplications and divisions of each algorithm for one state, by running it with a counting
// scalar: `flops NAME=PATH[:floating]...` prints JSON.  Sines and cosines are counted as the operations of their
// polynomials.
#include "algebra/counting.hpp"

#include "ksl/dynamics.hpp"
#include "ksl/pack.hpp"

/// Models hold plain numbers, which are converted to counting ones, as for packs.
template <> struct ksl::scalar_of_trait<counting> { using type = double; };

#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/inverse/inverse_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/algorithms/mass/mass_matrix.hpp"
#include "ksl/engine/lanes/owned_workspace.hpp"

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

using numbers = std::vector<counting>;

/// Flops of compute(model, workspace, q, v, a, out).
template <class Workspace, class Compute> int count(const ksl::model &m, Compute compute) {
  const numbers q(static_cast<std::size_t>(m.nq()), counting(0.5)), v(static_cast<std::size_t>(m.nv()), counting(0.25));
  numbers out(v.size() * v.size());
  const ksl::model_view<double> model = m.view();
  const ksl::owned_workspace<Workspace> w(model);
  counting::reset();
  compute(model, *w, q.data(), v.data(), v.data(), out.data());
  const int flops = counting::flops + counting::roots, pairs = counting::sines / 2;
  return flops + pairs * count_pair();
}

void print(const char *name, const ksl::model &m) {
  using T = counting;
  const auto rnea = count<ksl::inverse_dynamics_workspace<T>>(
      m, [](const auto &model, const auto &w, const T *q, const T *v, const T *a, T *out) {
        ksl::inverse_dynamics<T>(model, w, q, v, a, {}, out);
      });
  const auto aba = count<ksl::forward_dynamics_workspace<T>>(
      m, [](const auto &model, const auto &w, const T *q, const T *v, const T *tau, T *out) {
        ksl::forward_dynamics<T>(model, w, q, v, tau, {}, out);
      });
  const auto crba =
      count<ksl::mass_matrix_workspace<T>>(m, [](const auto &model, const auto &w, const T *q, const T *, const T *,
                                                 T *out) { ksl::mass_matrix_tree<T>(model, w, q, out); });
  const auto fk =
      count<ksl::forward_kinematics_workspace<T>>(m, [](const auto &model, const auto &w, const T *q, const T *,
                                                        const T *, T *) { ksl::forward_kinematics<T>(model, w, q); });
  const auto sines = count<ksl::pose_workspace<T>>(m, [](const auto &model, const auto &w, const T *q, const T *,
                                                         const T *, T *) { ksl::sines_and_cosines<T>(model, w, q); });
  std::printf("\"%s\": {\"rnea\": %d, \"aba\": %d, \"crba\": %d, \"fk\": %d, \"sines_and_cosines\": %d}", name, rnea,
              aba, crba, fk, sines);
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
          ksl::load(word.substr(equals + 1, word.size() - equals - 1 - (floating ? suffix.size() : 0)), options,
                    {.mimic_independent = true}));
  }
  std::printf("}\n");
}
