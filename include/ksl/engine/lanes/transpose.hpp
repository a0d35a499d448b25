// Transposes rows of W states into packs and back: lane i of out[c] is column c of row i.
//
//   pack<double, 8> q[7];
//   load_rows(states, stride, 7, 8, q);      // or load_rows<7>(states, stride, 8, q), which is always unrolled
//   ...
//   store_rows<7>(q, 8, out, stride);        // or store_next(next, 7, 8, out, stride): next() returns one column after the other
//
// Columns are taken K at a time.  Vector j holds K consecutive columns of the rows j, K + j, 2 K + j, ..., one row in each of
// its blocks of K lanes; then the blocks are transposed within the registers.  K is half a register at most, because loading
// half a register from memory into its place costs less than a shuffle.
//
// Only the numbers of the valid rows are read and written, aligned or not.  Lanes beyond them repeat the last valid row, so
// that they cause no NaN and no floating-point exception.  Strides are in scalars and may be negative or zero.
#pragma once

#include "ksl/pack.hpp"

#include <cstddef>
#include <cstdint>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace ksl {
inline namespace KSL_ISA {
namespace transposition {

template <class P> inline constexpr int width_of = 1;
template <class T, int W> inline constexpr int width_of<pack<T, W>> = W;

/// n consecutive numbers in memory, as a vector; a single one is a scalar.
template <class T, int n> struct chunk_of { using type = typename vector_of<T, n>::type; };
template <class T> struct chunk_of<T, 1> { using type = T; };
template <class T, int n> using chunk = typename chunk_of<T, n>::type;

/// Consecutive numbers in memory, at any alignment.  (With memcpy, gcc copies 16 bytes through two integers.)
template <class V> struct __attribute__((packed, may_alias)) unaligned { V v; };

/// The numbers 0 … n − 1 as template arguments.
template <int... i> struct numbers {};
template <int n, int... i> struct count_to { using type = typename count_to<n - 1, n - 1, i...>::type; };
template <int... i> struct count_to<0, i...> { using type = numbers<i...>; };
template <int n> using first = typename count_to<n>::type;

#if defined(__clang__) || __GNUC__ >= 12
#define KSL_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define KSL_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, decltype(a < b){__VA_ARGS__})
#endif

/// a, then b.
template <class V, class H, int... l> KSL_LANES V join(const H &a, const H &b, numbers<l...>) {
  constexpr int half = sizeof...(l) / 2;
  return V{(l < half ? a[l % half] : b[l % half])...};
}

// For joining and splitting wide registers gcc emits shuffles, although one instruction can do it and access memory as well.
#if defined(__AVX__)
template <class V> KSL_LANES V join(__m128d a, __m128d b, numbers<0, 1, 2, 3>) {
  return _mm256_insertf128_pd(_mm256_castpd128_pd256(a), b, 1);
}
template <class V> KSL_LANES V join(__m128 a, __m128 b, numbers<0, 1, 2, 3, 4, 5, 6, 7>) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(a), b, 1);
}
#endif
#if defined(__AVX512F__)
template <class V> KSL_LANES V join(__m256d a, __m256d b, numbers<0, 1, 2, 3, 4, 5, 6, 7>) {
  return _mm512_maskz_insertf64x4(0xff, _mm512_castpd256_pd512(a), b, 1);
}
template <class V> KSL_LANES V join(__m256 a, __m256 b, numbers<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15>) {
  return _mm512_castpd_ps(
      _mm512_maskz_insertf64x4(0xff, _mm512_castps_pd(_mm512_castps256_ps512(a)), _mm256_castps_pd(b), 1));
}
#endif

/// Chunk i of a vector, a chunk being K consecutive lanes.
template <class C, class V> KSL_LANES C chunk_at(const V &v, int i) {
  return reinterpret_cast<const unaligned<C> *>(&v)[i].v;
}
#if defined(__AVX512F__)
template <class C> KSL_LANES C chunk_at(const __m512d &v, int i)
  requires(sizeof(C) == 32)
{
  return i == 0 ? _mm512_maskz_extractf64x4_pd(0xff, v, 0) : _mm512_maskz_extractf64x4_pd(0xff, v, 1);
}
template <class C> KSL_LANES C chunk_at(const __m512 &v, int i)
  requires(sizeof(C) == 32)
{
  return _mm256_castpd_ps(chunk_at<__m256d>(_mm512_castps_pd(v), i));
}
#endif

/// Swaps elements h apart of two vectors, in every block of 2 h lanes: the upper half of a's block with the lower of b's.
template <int h, class V, int... l> KSL_LANES void swap_halves(V &a, V &b, numbers<l...>) {
  constexpr int W = sizeof...(l), block = 2 * h;
  const V low = KSL_SHUFFLE(a, b, (l - l % block + l % h + (l % block < h ? 0 : W))...);
  const V high = KSL_SHUFFLE(a, b, (l - l % block + l % h + h + (l % block < h ? 0 : W))...);
  a = low;
  b = high;
}

/// Transposes the 4 × 4 blocks of four vectors of four-byte lanes, by eight shuffles.
template <class V, int... l> KSL_LANES void transpose_quads(V &a, V &b, V &c, V &d, numbers<l...>) {
  constexpr int W = sizeof...(l);
  const V p = KSL_SHUFFLE(a, b, (l % 4 < 2 ? l : l - 2 + W)...), q = KSL_SHUFFLE(c, d, (l % 4 < 2 ? l : l - 2 + W)...);
  const V r = KSL_SHUFFLE(a, b, (l % 4 < 2 ? l + 2 : l + W)...), s = KSL_SHUFFLE(c, d, (l % 4 < 2 ? l + 2 : l + W)...);
  a = KSL_SHUFFLE(p, q, (l - l % 4 + l % 2 * 2 + (l % 4 < 2 ? 0 : W))...);
  b = KSL_SHUFFLE(p, q, (l - l % 4 + l % 2 * 2 + 1 + (l % 4 < 2 ? 0 : W))...);
  c = KSL_SHUFFLE(r, s, (l - l % 4 + l % 2 * 2 + (l % 4 < 2 ? 0 : W))...);
  d = KSL_SHUFFLE(r, s, (l - l % 4 + l % 2 * 2 + 1 + (l % 4 < 2 ? 0 : W))...);
}
#undef KSL_SHUFFLE

/// Transposes each of the K × K blocks that K packs hold.  Their h × h blocks are transposed already.
template <int K, int h = 1, class T, int W> KSL_LANES void transpose_blocks(pack<T, W> *v) {
  if constexpr (sizeof(T) == 4 && h == 1 && K >= 4) {
    for (int j = 0; j < K; j += 4)
      transpose_quads(v[j].lanes, v[j + 1].lanes, v[j + 2].lanes, v[j + 3].lanes, first<W>());
    transpose_blocks<K, 4>(v);
  } else if constexpr (h < K) {
    for (int j = 0; j < K; ++j)
      if (j % (2 * h) < h)
        swap_halves<h>(v[j].lanes, v[j + h].lanes, first<W>());
    transpose_blocks<K, 2 * h>(v);
  }
}

/// n lanes from chunks of K consecutive numbers of the rows first_row, first_row + K, ...
template <int n, int K, class T>
KSL_LANES chunk<T, n> gather(const T *rows, std::ptrdiff_t stride, int first_row, int last_row) {
  if constexpr (n == K) {
    const T *row = rows + (first_row < last_row ? first_row : last_row) * stride;
    return reinterpret_cast<const unaligned<chunk<T, n>> *>(row)->v;
  } else {
    const chunk<T, n / 2> a = gather<n / 2, K>(rows, stride, first_row, last_row);
    const chunk<T, n / 2> b = gather<n / 2, K>(rows, stride, first_row + n / 2, last_row);
    if constexpr (n == 2)
      return chunk<T, n>{a, b};
    else
      return join<chunk<T, n>>(a, b, first<n>());
  }
}

/// The inverse: stores each chunk to its row.  Rows after last_row are not written.
template <int n, int K, class T>
KSL_LANES void scatter(const chunk<T, n> &v, T *rows, std::ptrdiff_t stride, int first_row, int last_row) {
  for (int i = 0; i < n / K; ++i) {
    const int row = first_row + i * K;
    if (row <= last_row)
      reinterpret_cast<unaligned<chunk<T, K>> *>(rows + row * stride)->v = chunk_at<chunk<T, K>>(v, i);
  }
}

/// to = from, unrolled.  A loop would become a call of memcpy, which forces the vectors into memory.
template <int K, class P> KSL_LANES void copy(const P *from, P *to) {
  if constexpr (K > 0) {
    copy<K - 1>(from, to);
    to[K - 1] = from[K - 1];
  }
}

template <int K, class T, int W>
KSL_LANES void load_columns(const T *rows, std::ptrdiff_t stride, int last_row, pack<T, W> *out) {
  pack<T, W> v[K];
  for (int j = 0; j < K; ++j)
    v[j].lanes = gather<W, K>(rows, stride, j, last_row);
  transpose_blocks<K>(v);
  copy<K>(v, out);
}

/// to = the next K packs that next() returns.
template <int K, class Next, class P> KSL_LANES void take(Next &next, P *to) {
  if constexpr (K > 0) {
    take<K - 1>(next, to);
    to[K - 1] = next();
  }
}

/// Takes the next K columns.  If next has a function look(), it sees them while they are in registers.
template <int K, class Next, class P> KSL_LANES void take_columns(Next &next, P (&to)[K]) {
  take<K>(next, to);
  if constexpr (requires { next.look(to); })
    next.look(to);
}

template <int K, class T, int W, class Next>
KSL_LANES void store_columns(Next &next, T *rows, std::ptrdiff_t stride, int last_row) {
  pack<T, W> v[K];
  take_columns<K>(next, v);
  transpose_blocks<K>(v);
  for (int j = 0; j < K; ++j)
    scatter<W, K, T>(v[j].lanes, rows, stride, j, last_row);
}

/// The widest chunk: half a register, or a whole register if it has few lanes.
template <class P>
inline constexpr int widest = width_of<P> > 2 && sizeof(P) > 16 ? width_of<P> / 2 : width_of<P>;

/// The widest chunk that is stored: there are as many stores as chunks, and a processor makes one at a time.
template <class P> inline constexpr int widest_stored = sizeof(P) == 32 && width_of<P> == 4 ? 4 : widest<P>;

} // namespace transposition

/// For a number of columns known at compile time: as below, unrolled.
template <int columns, class T, int W, int K = transposition::widest<pack<T, W>>>
KSL_LANES void load_rows(const T *rows, std::ptrdiff_t stride, int valid, pack<T, W> *out) {
  using namespace transposition;
  if constexpr (columns >= K && K > 0) {
    load_columns<K>(rows, stride, valid - 1, out);
    load_rows<columns - K, T, W, K>(rows + K, stride, valid, out + K);
  } else if constexpr (columns > 0) {
    load_rows<columns, T, W, K / 2>(rows, stride, valid, out);
  }
}

template <int columns, class T, int W, int K = transposition::widest<pack<T, W>>>
KSL_LANES void store_rows(const pack<T, W> *in, int valid, T *rows, std::ptrdiff_t stride) {
  using namespace transposition;
  if constexpr (columns >= K && K > 0) {
    const auto next = [&in]() -> const pack<T, W> & { return *in++; };
    store_columns<K, T, W>(next, rows, stride, valid - 1);
    store_rows<columns - K, T, W, K>(in, valid, rows + K, stride);
  } else if constexpr (columns > 0) {
    store_rows<columns, T, W, K / 2>(in, valid, rows, stride);
  }
}

/// out[c] = column c of W rows, which begin stride scalars apart.  1 ≤ valid ≤ W; lanes beyond `valid` repeat the last row.
template <class T, int W, int K = transposition::widest<pack<T, W>>>
inline void load_rows(const T *rows, std::ptrdiff_t stride, int columns, int valid, pack<T, W> *out) {
  int c = 0;
  if (valid == W)
    for (; c + K <= columns; c += K)
      transposition::load_columns<K>(rows + c, stride, W - 1, out + c);
  else
    for (; c + K <= columns; c += K)
      transposition::load_columns<K>(rows + c, stride, valid - 1, out + c);
  if constexpr (K > 1)
    if (c < columns)
      load_rows<T, W, K / 2>(rows + c, stride, columns - c, valid, out + c);
}

/// Stores W rows whose columns next() returns, one after the other.  Only the first `valid` rows are written.
template <class T, int W, int K = transposition::widest_stored<pack<T, W>>, class Next>
inline void store_next(Next &next, std::ptrdiff_t columns, int valid, T *rows, std::ptrdiff_t stride) {
  std::ptrdiff_t c = 0;
  Next in_registers = next; // for all that compilers know, `next` could be in the rows
  if (valid == W)
    for (; c + K <= columns; c += K)
      transposition::store_columns<K, T, W>(in_registers, rows + c, stride, W - 1);
  else
    for (; c + K <= columns; c += K)
      transposition::store_columns<K, T, W>(in_registers, rows + c, stride, valid - 1);
  next = in_registers;
  if constexpr (K > 1)
    if (c < columns)
      store_next<T, W, K / 2>(next, columns - c, valid, rows + c, stride);
}

#if defined(__AVX2__)
namespace transposition {

#if defined(__AVX512F__)
typedef __m512i place;
KSL_LANES __m512d from_two(__m512d a, __m512i at, __m512d b) { return _mm512_permutex2var_pd(a, at, b); }
KSL_LANES __m512 from_two(__m512 a, __m512i at, __m512 b) { return _mm512_permutex2var_ps(a, at, b); }
KSL_LANES void stream(double *to, __m512d v) { _mm512_stream_pd(to, v); }
KSL_LANES void stream(float *to, __m512 v) { _mm512_stream_ps(to, v); }
KSL_LANES void store_some(double *to, unsigned which, __m512d v) {
  _mm512_mask_storeu_pd(to, static_cast<__mmask8>(which), v);
}
KSL_LANES void store_some(float *to, unsigned which, __m512 v) {
  _mm512_mask_storeu_ps(to, static_cast<__mmask16>(which), v);
}
KSL_LANES __m512i places_from(double, int first) {
  return _mm512_add_epi64(_mm512_set_epi64(7, 6, 5, 4, 3, 2, 1, 0), _mm512_set1_epi64(first));
}
KSL_LANES __m512i places_from(float, int first) {
  return _mm512_add_epi32(_mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0),
                          _mm512_set1_epi32(first));
}
#else
/// Where the numbers of a register are in two others: those that are in the second one, and the rotation that puts all in order.
struct place { __m256i second, rotated; };
KSL_LANES __m256 from_two(__m256 a, const place &at, __m256 b) {
  return _mm256_permutevar8x32_ps(_mm256_blendv_ps(a, b, _mm256_castsi256_ps(at.second)), at.rotated);
}
KSL_LANES __m256d from_two(__m256d a, const place &at, __m256d b) {
  return _mm256_castps_pd(from_two(_mm256_castpd_ps(a), at, _mm256_castpd_ps(b)));
}
KSL_LANES void stream(double *to, __m256d v) { _mm256_stream_pd(to, v); }
KSL_LANES void stream(float *to, __m256 v) { _mm256_stream_ps(to, v); }
KSL_LANES void store_some(double *to, unsigned which, __m256d v) {
  for (int i = 0; i < 4; ++i)
    if (which >> i & 1)
      to[i] = v[i];
}
KSL_LANES void store_some(float *to, unsigned which, __m256 v) {
  for (int i = 0; i < 8; ++i)
    if (which >> i & 1)
      to[i] = v[i];
}
KSL_LANES place places_from(float, int first) {
  const __m256i in_order = _mm256_set_epi32(7, 6, 5, 4, 3, 2, 1, 0);
  return {_mm256_cmpgt_epi32(_mm256_set1_epi32(first), in_order), // the permutation takes indices modulo 8
          _mm256_set_epi32(first + 7, first + 6, first + 5, first + 4, first + 3, first + 2, first + 1, first)};
}
KSL_LANES place places_from(double, int first) { return places_from(0.0f, 2 * first); }
#endif

} // namespace transposition

/// As store_next for W valid rows, past the caches: whole cache lines go to memory without being read first.  A row may begin anywhere
/// in a line.  So each line is put together from two registers.
template <class T, int W, class Next>
inline void stream_next(Next &next, std::ptrdiff_t columns, T *rows, std::ptrdiff_t stride) {
  using namespace transposition;
  pack<T, W> last[W];
  T *to[W];    // the next line of each row, in memory
  place at[W]; // the places of its numbers in the two registers
  const std::ptrdiff_t blocks = columns / W;
  take_columns<W>(next, last);
  transpose_blocks<W>(last);
  for (int r = 0; r < W; ++r) {
    T *const row = rows + r * stride;
    const int before =
        static_cast<int>(-(reinterpret_cast<std::uintptr_t>(row) / sizeof(T)) % W); // numbers before its first line
    store_some(row, (1u << before) - 1, last[r].lanes);
    to[r] = row + before, at[r] = places_from(T(), before);
  }
  for (std::ptrdiff_t b = 1; b < blocks; ++b) {
    pack<T, W> v[W];
    take_columns<W>(next, v);
    transpose_blocks<W>(v);
    for (int r = 0; r < W; ++r) {
      stream(to[r], from_two(last[r].lanes, at[r], v[r].lanes));
      to[r] += W;
    }
    copy<W>(v, last);
  }
  for (int r = 0; r < W; ++r) {
    const int left = static_cast<int>(rows + r * stride + blocks * W - to[r]);
    store_some(to[r], static_cast<unsigned>((1ull << left) - 1), from_two(last[r].lanes, at[r], last[r].lanes));
  }
  if (blocks * W < columns)
    store_next<T, W>(next, columns - blocks * W, W, rows + blocks * W, stride);
}
#endif

/// Rows from 1 KB on, of arrays from 4 MB on, are written past the caches.  Such an array doesn't stay in the nearer caches, and such a
/// row has many whole cache lines.  Memory is then written once, instead of being read and written (docs/performance.md).  Where a
/// register is half a line, it pays from rows on that are four times as long.
inline constexpr std::size_t streamed_row = 1024, streamed_array = std::size_t(4) << 20;

/// As store_next.  `all` is the number of rows of the whole array, which decides whether they are written past the caches.
template <class T, int W, class Next>
inline void store_next_of(std::size_t all, Next &next, std::ptrdiff_t columns, int valid, T *rows,
                          std::ptrdiff_t stride) {
#if defined(__AVX2__)
  if constexpr (sizeof(T) * W == vector_bytes) {
    const std::size_t bytes = static_cast<std::size_t>(columns) * sizeof(T);
    constexpr std::size_t least = vector_bytes == 64 ? streamed_row : 4 * streamed_row;
    if (valid == W && bytes >= least && bytes * all >= streamed_array)
      return stream_next<T, W>(next, columns, rows, stride);
  }
#endif
  (void)all;
  store_next<T, W>(next, columns, valid, rows, stride);
}

/// Makes what was written past the caches visible to other threads in the order of stores.
inline void finish_streams() {
#if defined(__x86_64__)
  _mm_sfence();
#endif
}

/// One row for all lanes.
template <int columns, class T, int W> KSL_LANES void load_same(const T *row, pack<T, W> *out) {
  for (int c = 0; c < columns; ++c)
    out[c] = pack<T, W>(row[c]);
}

} // namespace KSL_ISA
} // namespace ksl
