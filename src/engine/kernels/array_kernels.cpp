// Array functions for one instruction set.  W items are read into packs, the algebra computes them at once, and the results
// are stored back into rows.  Compiled once for each set (CMakeLists.txt), with KSL_ISA naming the set and KSL_TABLE the symbol.
#include "engine/kernels/array_kernels.hpp"

#include "ksl/engine/lanes/transpose.hpp"

#include <cstdint>
#include <cstring>

namespace ksl {
inline namespace KSL_ISA {
namespace {

template <class P> using real = P;

/// Numbers in an item of a type.
template <template <class> class Type> constexpr int numbers = sizeof(Type<char>);

/// Copies the rows of a last block that is not full, in either direction.  Missing rows repeat the last one.
template <class T> void copy_rows(int columns, int rows, int last, const T *from, ptrdiff_t from_stride, T *to,
                                  ptrdiff_t to_stride) {
  for (int i = 0; i < rows; ++i)
    for (int c = 0; c < columns; ++c)
      to[i * to_stride + c] = from[(i < last ? i : last) * from_stride + c];
}

/// out = f(a, b) for blocks of W items.  same: a is one item for all.  Each block is read before the previous one is stored:
/// out-of-order execution reaches no further than a block or two, and so can compute while the next rows are loaded.
template <class Function, bool same, class T, int W, template <class> class A, template <class> class B,
          template <class> class O>
void blocks_2(size_t blocks, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out,
              ptrdiff_t out_stride) {
  using P = pack<T, W>;
  A<P> x;
  B<P> y;
  O<P> z;
  if constexpr (same)
    load_same<numbers<A>>(a, reinterpret_cast<P *>(&x));
  else
    load_rows<numbers<A>>(a, a_stride, W, reinterpret_cast<P *>(&x));
  load_rows<numbers<B>>(b, b_stride, W, reinterpret_cast<P *>(&y));
  for (; blocks > 1; --blocks) {
    Function::apply(&x, &y, &z);
    a += W * a_stride;
    b += W * b_stride;
    if constexpr (!same)
      load_rows<numbers<A>>(a, a_stride, W, reinterpret_cast<P *>(&x));
    load_rows<numbers<B>>(b, b_stride, W, reinterpret_cast<P *>(&y));
    store_rows<numbers<O>>(reinterpret_cast<const P *>(&z), W, out, out_stride);
    out += W * out_stride;
  }
  Function::apply(&x, &y, &z);
  store_rows<numbers<O>>(reinterpret_cast<const P *>(&z), W, out, out_stride);
}

//     │ W items │ W items │ … │ rest         whole blocks where they lie; the rest copied to a block of its own, whose missing rows repeat the last
/// n items.  Not inlined for results that bypass the caches, since that would double the code.
template <class Function, class T, int W, template <class> class A, template <class> class B, template <class> class O>
__attribute__((noinline)) void rows_2(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out,
                                      ptrdiff_t out_stride) {
  const size_t full = n / W, done = full * W;
  const int rest = static_cast<int>(n % W);
  if (full && a_stride == 0)
    blocks_2<Function, true, T, W, A, B, O>(full, a, 0, b, b_stride, out, out_stride);
  else if (full)
    blocks_2<Function, false, T, W, A, B, O>(full, a, a_stride, b, b_stride, out, out_stride);
  if (rest) {
    T x[W * numbers<A>], y[W * numbers<B>], z[W * numbers<O>];
    const ptrdiff_t at = static_cast<ptrdiff_t>(done);
    copy_rows(numbers<A>, W, rest - 1, a + at * a_stride, a_stride, x, numbers<A>);
    copy_rows(numbers<B>, W, rest - 1, b + at * b_stride, b_stride, y, numbers<B>);
    blocks_2<Function, false, T, W, A, B, O>(1, x, numbers<A>, y, numbers<B>, z, numbers<O>);
    copy_rows(numbers<O>, rest, rest - 1, z, numbers<O>, out + at * out_stride, out_stride);
  }
}

#if defined(__x86_64__)
constexpr size_t cache_line = 64;

/// Size of a result in bytes from which on no cache is expected to hold it until it is read.
constexpr size_t large = size_t(8) << 20;

/// As rows_2, for a contiguous result that is not an input.  Whole cache lines are written by stores that bypass the caches,
/// which then need not read these lines first.  Saves 8 to 13 %.
template <class Function, class T, int W, template <class> class A, template <class> class B, template <class> class O>
///
///     out      │ ·foreign· x x x │ x x x x x x │ x x x x x x │ x x         each cell a cache line, of which `to` is the first that isn't full
///     buffer   │           x x x │ x x x x x x │ x x x x x x │ x x
///                       copied          past the caches        waiting     for the items to come, at the beginning of the buffer
///
/// What is foreign was there before, and isn't written.
void streamed_2(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out) {
  constexpr size_t some = 128;
  alignas(cache_line) char buffer[cache_line + some * numbers<O> * sizeof(T)]; // begins where a line begins in `out`
  size_t foreign = reinterpret_cast<std::uintptr_t>(out) % cache_line, waiting = foreign;
  char *to = reinterpret_cast<char *>(out) - foreign;
  for (size_t i = 0; i < n; i += some) {
    const size_t count = n - i < some ? n - i : some;
    rows_2<Function, T, W, A, B, O>(count, a, a_stride, b, b_stride, reinterpret_cast<T *>(buffer + waiting),
                                    numbers<O>);
    a += static_cast<ptrdiff_t>(some) * a_stride;
    b += static_cast<ptrdiff_t>(some) * b_stride;
    const size_t end = waiting + count * numbers<O> * sizeof(T), whole = end - end % cache_line;
    size_t at = 0;
    if (foreign && whole) {
      std::memcpy(to + foreign, buffer + foreign, cache_line - foreign);
      foreign = 0;
      at = cache_line;
    }
    for (; at < whole; at += sizeof(__m128i))
      _mm_stream_si128(reinterpret_cast<__m128i *>(to + at), *reinterpret_cast<const __m128i *>(buffer + at));
    waiting = end - whole;
    to += whole;
    std::memcpy(buffer, buffer + whole, waiting);
  }
  std::memcpy(to + foreign, buffer + foreign, waiting - foreign);
  _mm_sfence();
}
#endif

template <class Function, class T, int W, template <class> class A, template <class> class B, template <class> class O>
void any_size_2(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out, ptrdiff_t out_stride,
                [[maybe_unused]] size_t whole) {
#if defined(__x86_64__)
  if (whole >= large / (sizeof(T) * numbers<O>) && out_stride == numbers<O> && a != out && b != out)
    return streamed_2<Function, T, W, A, B, O>(n, a, a_stride, b, b_stride, out);
#endif
  rows_2<Function, T, W, A, B, O>(n, a, a_stride, b, b_stride, out, out_stride);
}

template <class Function, class T, template <class> class A, template <class> class B, template <class> class O>
void array_2(size_t n, const T *a, ptrdiff_t a_stride, const T *b, ptrdiff_t b_stride, T *out, ptrdiff_t out_stride,
             size_t whole) {
#if defined(__AVX512F__)
  if (half_registers())
    return any_size_2<Function, T, native_lanes<T> / 2, A, B, O>(n, a, a_stride, b, b_stride, out, out_stride, whole);
#endif
  any_size_2<Function, T, native_lanes<T>, A, B, O>(n, a, a_stride, b, b_stride, out, out_stride, whole);
}

/// Blocks of functions of one input.
template <class Function, class T, int W, template <class> class A, template <class> class O>
void blocks_1(size_t blocks, const T *a, ptrdiff_t a_stride, T *out, ptrdiff_t out_stride) {
  using P = pack<T, W>;
  A<P> x;
  O<P> z;
  for (; blocks > 0; --blocks) {
    load_rows<numbers<A>>(a, a_stride, W, reinterpret_cast<P *>(&x));
    Function::apply(&x, &z);
    store_rows<numbers<O>>(reinterpret_cast<const P *>(&z), W, out, out_stride);
    a += W * a_stride;
    out += W * out_stride;
  }
}

template <class Function, class T, int W, template <class> class A, template <class> class O>
void rows_1(size_t n, const T *a, ptrdiff_t a_stride, T *out, ptrdiff_t out_stride) {
  const size_t full = n / W, done = full * W;
  const int rest = static_cast<int>(n % W);
  if (full)
    blocks_1<Function, T, W, A, O>(full, a, a_stride, out, out_stride);
  if (rest) {
    T x[W * numbers<A>], z[W * numbers<O>];
    const ptrdiff_t at = static_cast<ptrdiff_t>(done);
    copy_rows(numbers<A>, W, rest - 1, a + at * a_stride, a_stride, x, numbers<A>);
    blocks_1<Function, T, W, A, O>(1, x, numbers<A>, z, numbers<O>);
    copy_rows(numbers<O>, rest, rest - 1, z, numbers<O>, out + at * out_stride, out_stride);
  }
}

template <class Function, class T, template <class> class A, template <class> class O>
void array_1(size_t n, const T *a, ptrdiff_t a_stride, T *out, ptrdiff_t out_stride) {
#if defined(__AVX512F__)
  if (half_registers())
    return rows_1<Function, T, native_lanes<T> / 2, A, O>(n, a, a_stride, out, out_stride);
#endif
  rows_1<Function, T, native_lanes<T>, A, O>(n, a, a_stride, out, out_stride);
}

/// A type for each function, for use as a template argument.
namespace functions {
#define KSL_FUNCTION_1(name, namef, A, a, O)                                                                           \
  struct name {                                                                                                        \
    template <class P> static KSL_LANES void apply(const A<P> *a, O<P> *out) { algebra<P>::name(a, out); }             \
  };
#define KSL_FUNCTION_2(name, namef, A, a, B, b, O)                                                                     \
  struct name {                                                                                                        \
    template <class P> static KSL_LANES void apply(const A<P> *a, const B<P> *b, O<P> *out) {                          \
      if constexpr (sizeof(*out) == sizeof(P))                                                                         \
        *out = algebra<P>::name(a, b);                                                                                 \
      else                                                                                                             \
        algebra<P>::name(a, b, out);                                                                                   \
    }                                                                                                                  \
  };
KSL_ARRAY_FUNCTIONS(KSL_FUNCTION_1, KSL_FUNCTION_2)
} // namespace functions

} // namespace
} // namespace KSL_ISA
} // namespace ksl

#define KSL_ENTRY_1(name, namef, A, a, O)                                                                              \
  ksl::array_1<ksl::functions::name, double, ksl::A, ksl::O>, ksl::array_1<ksl::functions::name, float, ksl::A, ksl::O>,
#define KSL_ENTRY_2(name, namef, A, a, B, b, O)                                                                        \
  ksl::array_2<ksl::functions::name, double, ksl::A, ksl::B, ksl::O>,                                                  \
      ksl::array_2<ksl::functions::name, float, ksl::A, ksl::B, ksl::O>,

extern "C" const ksl::array_kernel_table KSL_TABLE = {KSL_ARRAY_FUNCTIONS(KSL_ENTRY_1, KSL_ENTRY_2)};
