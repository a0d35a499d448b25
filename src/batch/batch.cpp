#include "ksl/batch.hpp"

#include "batch/threads.hpp"
#include "engine/kernels.hpp"

#include <memory>
#include <new>

namespace ksl {
namespace {

constexpr std::size_t alignment = 64; ///< of workspaces

/// Memory that is kept from call to call, for each thread that calls.
std::byte *scratch(std::size_t bytes) {
  struct aligned_delete {
    void operator()(std::byte *p) const { ::operator delete(p, std::align_val_t(alignment)); }
  };
  thread_local std::unique_ptr<std::byte, aligned_delete> memory;
  thread_local std::size_t size = 0;
  if (bytes > size) {
    memory.reset();
    size = 0;
    memory.reset(static_cast<std::byte *>(::operator new(bytes, std::align_val_t(alignment))));
    size = bytes;
  }
  return memory.get();
}

template <class S> struct in_precision;
template <> struct in_precision<double> {
  static model_view<double> view(const model &m) { return m.view(); }
  static const batch_kernels<double> &one() { return kernels().one_double; }
  static const batch_kernels<double> &lanes() { return kernels().lanes_double; }
};
template <> struct in_precision<float> {
  static model_view<float> view(const model &m) { return m.view_single(); }
  static const batch_kernels<float> &one() { return kernels().one_float; }
  static const batch_kernels<float> &lanes() { return kernels().lanes_float; }
};

/// The states of a batch from k on, n of them.
template <class S> batch_view<S> part_of(const batch_view<S> &all, std::size_t k, std::size_t n) {
  batch_view<S> part = all;
  part.n = n;
  for (rows_view<const S> batch_view<S>::*rows :
       {&batch_view<S>::q, &batch_view<S>::v, &batch_view<S>::a, &batch_view<S>::tau, &batch_view<S>::external})
    part.*rows = rows_from(all.*rows, k);
  part.out = rows_from(all.out, k);
  return part;
}

/// Runs compute(kernels, view, part, first state, memory) for all parts of a batch on their threads.
template <class S, class Compute> void run(const model &m, const batch_view<S> &batch, int threads, Compute compute) {
  const batch_kernels<S> &chosen = batch.n == 1 ? in_precision<S>::one() : in_precision<S>::lanes();
  const model_view<S> view = in_precision<S>::view(m);
  const partition parts(batch.n, static_cast<std::size_t>(chosen.lanes), least_states(m.moving_joints()), threads);
  const std::size_t bytes = compute(chosen, view, batch, std::size_t(0), nullptr);
  std::byte *memory = scratch(bytes * parts.threads);
  on_threads(parts, [&](std::size_t first, std::size_t end, std::size_t seat) {
    compute(chosen, view, part_of(batch, first, end - first), first, memory + bytes * seat);
  });
}

} // namespace

template <class S>
void inverse_dynamics_batch(const model &m, const batch_view<S> &batch, const std::vector<reaction_rows<S>> &reactions,
                            int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t k, void *memory) {
    std::vector<reaction_rows<S>> later;
    if (k)
      later = reactions;
    for (reaction_rows<S> &w : later)
      w.out = rows_from(w.out, k);
    const std::vector<reaction_rows<S>> &wanted = k ? later : reactions;
    return kernels.inverse_dynamics(view, part, static_cast<int>(wanted.size()), wanted.data(), memory);
  });
}

template <class S> void forward_dynamics_batch(const model &m, const batch_view<S> &batch, int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t, void *memory) {
    return kernels.forward_dynamics(view, part, memory);
  });
}

template <class S> void mass_matrix_batch(const model &m, const batch_view<S> &batch, int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t, void *memory) {
    return kernels.mass_matrix(view, part, memory);
  });
}

template <class S>
void frame_poses_batch(const model &m, const batch_view<S> &batch, int n, const int *links, int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t, void *memory) {
    return kernels.frame_poses(view, part, n, links, memory);
  });
}

template <class S>
void energy_batch(const model &m, const batch_view<S> &batch, const rows_view<S> &kinetic, const rows_view<S> &potential,
                  int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t k, void *memory) {
    return kernels.energy(view, part, rows_from(kinetic, k), rows_from(potential, k), memory);
  });
}

template <class S> void external_power_batch(const model &m, const batch_view<S> &batch, int threads) {
  run(m, batch, threads, [&](const auto &kernels, const auto &view, const batch_view<S> &part, std::size_t, void *memory) {
    return kernels.external_power(view, part, memory);
  });
}

#define KSL_INSTANTIATE(S)                                                                                             \
  template void inverse_dynamics_batch(const model &, const batch_view<S> &, const std::vector<reaction_rows<S>> &, int); \
  template void forward_dynamics_batch(const model &, const batch_view<S> &, int);                                     \
  template void mass_matrix_batch(const model &, const batch_view<S> &, int);                                          \
  template void frame_poses_batch(const model &, const batch_view<S> &, int, const int *, int);                        \
  template void energy_batch(const model &, const batch_view<S> &, const rows_view<S> &, const rows_view<S> &, int);   \
  template void external_power_batch(const model &, const batch_view<S> &, int);
KSL_INSTANTIATE(double)
KSL_INSTANTIATE(float)
#undef KSL_INSTANTIATE

} // namespace ksl
