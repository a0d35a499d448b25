// Peak rates of the machine: multiplications and additions, and bytes copied.
#pragma once

#include <chrono>
#include <cstring>
#include <ctime>
#include <vector>

inline double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Processor time of this thread.  On an idle machine it is the elapsed time; on a shared one, the time of other programs is
/// not included.
inline double own_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

#if defined(__AVX512F__)
constexpr int register_bytes = 64;
#elif defined(__AVX__)
constexpr int register_bytes = 32;
#else
constexpr int register_bytes = 16;
#endif
typedef double double_vector __attribute__((vector_size(register_bytes)));
typedef float float_vector __attribute__((vector_size(register_bytes)));
template <class V> constexpr int lanes_of = register_bytes / static_cast<int>(sizeof(V{}[0]));

/// Returns the number, hiding its value from the optimiser.
template <class T> T opaque(T x) {
  volatile T hidden = x;
  return hidden;
}

/// Flops per second of fused multiply-adds in independent chains.
template <class V> double fused_rate() {
  constexpr int chains = 12, turns = 4000, lanes = lanes_of<V>;
  const V a = V{} + opaque(0.999f), b = V{} + opaque(1e-3f);
  V x[chains];
  for (V &chain : x)
    chain = b;
  const double start = own_seconds();
  for (int t = 0; t < turns; ++t) {
#pragma GCC unroll 12
    for (int i = 0; i < chains; ++i)
      x[i] = x[i] * a + b;
  }
  const double time = own_seconds() - start;
  for (const V &chain : x)
    opaque(chain[0]); // so that the loop is not optimised away
  return 2.0 * lanes * chains * turns / time;
}

/// The same for multiplications and additions in equal numbers, none of them fused.  Both constants and all chains must stay in registers, of
/// which AVX2 has sixteen.
template <class V> double unfused_rate() {
  constexpr int chains = register_bytes == 64 ? 8 : 7, turns = 4000, lanes = lanes_of<V>;
  const V a = V{} + opaque(0.999f), b = V{} + opaque(1e-3f);
  V x[chains], y[chains];
  for (int i = 0; i < chains; ++i)
    x[i] = y[i] = b;
  const double start = own_seconds();
  for (int t = 0; t < turns; ++t) {
#pragma GCC unroll 8
    for (int i = 0; i < chains; ++i) {
      x[i] = x[i] * a;
      y[i] = y[i] + b;
    }
  }
  const double time = own_seconds() - start;
  for (int i = 0; i < chains; ++i)
    opaque(x[i][0]), opaque(y[i][0]);
  return 2.0 * lanes * chains * turns / time;
}

/// Bytes read and written per second by memcpy on arrays larger than the caches.
inline double copy_rate() {
  constexpr size_t bytes = size_t(96) << 20;
  static std::vector<char> from(bytes, 1), to(bytes, 2);
  const double start = seconds();
  std::memcpy(to.data(), from.data(), bytes);
  return 2.0 * bytes / (seconds() - start);
}
