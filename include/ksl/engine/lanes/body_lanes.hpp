// KSL: arrays over bodies, laid out so that the bodies of one state can be computed in lanes.
//
// Many steps of an algorithm don't depend on other bodies: rotating an inertia to other axes, Newton's and Euler's laws.  If
// the scalar is a plain number, such steps are computed for several bodies at once, one in each lane of a register.  If it is a
// pack of states or a user's own scalar, the bodies are computed one after the other.  The results are the same to the bit.
#pragma once

#include "ksl/engine/lanes/scalar.hpp"

#include <cstddef>
#include <cstdint>

namespace ksl {
inline namespace KSL_ISA {

/// n rounded up to whole registers of any instruction set.
constexpr int padded(int n) { return (n + 15) / 16 * 16; }

/// Number c of body i lies at [i / lane_block][c][i % lane_block], so that one load reads it for several bodies.
template <class T> inline constexpr int lane_block = is_number<T> ? padded(1) : 1;

/// How many numbers T the struct V has.
template <class V, class T> inline constexpr int numbers_in = static_cast<int>(sizeof(V) / sizeof(T));

/// Where the numbers of body i begin in an array over bodies with n numbers each; they are lane_block<T> apart.
template <int n, class T> KSL_LANES T *numbers_of(T *array, int i) {
  const unsigned body = static_cast<unsigned>(i),
                 g = static_cast<unsigned>(lane_block<T>); // unsigned division costs less
  return array + (body / g * (n * g) + body % g);
}

/// Size of an array over bodies with n numbers each.
template <class T> constexpr int padded_size(int n, int bodies) {
  return (bodies + lane_block<T> - 1) / lane_block<T> * lane_block<T> * n;
}

namespace body_lanes {

template <class T> KSL_LANES void read(const T *from, T &to) { to = *from; }
template <class T, int W> KSL_LANES void read(const T *from, pack<T, W> &to) { __builtin_memcpy(&to, from, sizeof to); }
template <class T> KSL_LANES void write(const T &from, T *to) { *to = from; }
template <class T, int W> KSL_LANES void write(const pack<T, W> &from, T *to) {
  __builtin_memcpy(to, &from, sizeof from);
}

/// Always unrolled: a struct filled in a loop would be kept in memory instead of registers.
template <int n, class T, class P> KSL_LANES void read_all(const T *from, P *to) {
  if constexpr (n > 0) {
    read_all<n - 1>(from, to);
    read(from + (n - 1) * lane_block<T>, to[n - 1]);
  }
}
template <int n, class T, class P> KSL_LANES void write_all(const P *from, T *to) {
  if constexpr (n > 0) {
    write_all<n - 1>(from, to);
    write(from[n - 1], to + (n - 1) * lane_block<T>);
  }
}

} // namespace body_lanes

/// Writes n zeros.  Whole registers are stored where they don't cross cache lines.
template <class T> KSL_LANES void clear_numbers(T *to, std::ptrdiff_t n) {
  constexpr std::ptrdiff_t lanes = native_lanes<T>, size = lanes * static_cast<std::ptrdiff_t>(sizeof(T));
  const native_pack<T> zero(T(0));
  if (n < lanes)
    return store_first<T>(zero, to, static_cast<int>(n));
  T *const end = to + n;
  body_lanes::write(zero, to);
  for (to += lanes - reinterpret_cast<std::intptr_t>(to) % size / static_cast<std::ptrdiff_t>(sizeof(T));
       to + lanes <= end; to += lanes)
    body_lanes::write(zero, to);
  body_lanes::write(zero, end - lanes);
}

/// Body i, or the bodies i, i + 1, ... in the lanes of P.
template <class P, class T> struct bodies_at {
  using scalar = P;
  int i;

  /// Loads the V<P> of these bodies from an array over bodies.
  template <template <class> class V> KSL_LANES V<P> get(const T *array) const {
    constexpr int n = numbers_in<V<P>, P>;
    V<P> v;
    body_lanes::read_all<n>(numbers_of<n>(array, i), reinterpret_cast<P *>(&v));
    return v;
  }

  template <template <class> class V> KSL_LANES void put(const V<P> &v, T *array) const {
    constexpr int n = numbers_in<V<P>, P>;
    body_lanes::write_all<n>(reinterpret_cast<const P *>(&v), numbers_of<n>(array, i));
  }
};

template <class T> KSL_LANES bodies_at<T, T> body_at(int i) { return {i}; }

/// Two steps for n bodies, parents first.  one(i) is called for all bodies but the ground, and may read what one() stored for
/// the parent.  lanes(bodies_at) may read what one() stored for its own bodies, and nothing that lanes() stored for others.
/// With plain numbers the second step runs in lanes, after the first is complete.  Otherwise both steps run for one body after
/// the other, so that the second finds the data of the first in the nearest cache.
template <class T, class One, class Lanes> KSL_LANES void for_bodies(int n, One one, Lanes lanes) {
  if constexpr (is_number<T>) {
    for (int i = 1; i < n; ++i)
      one(i);
    for (int i = 0; i < n; i += native_lanes<T>)
      lanes(bodies_at<native_pack<T>, T>{i});
  } else {
    lanes(body_at<T>(0));
    for (int i = 1; i < n; ++i) {
      one(i);
      lanes(body_at<T>(i));
    }
  }
}

} // namespace KSL_ISA
} // namespace ksl
