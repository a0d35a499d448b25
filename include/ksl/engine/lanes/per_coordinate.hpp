// KSL: arrays over the coordinates of the velocity, laid out so that several coordinates can be computed in lanes.
#pragma once

#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Coordinates without gaps: [first, end).
struct coordinate_run { int first, end; };

template <class T, bool = is_number<T>> struct coordinate_lanes { using type = T; };
template <class T> struct coordinate_lanes<T, true> { using type = native_pack<T>; };
/// The scalar of several coordinates: lanes of plain numbers; other scalars are computed one by one.
template <class T> using lanes_of_coordinates = typename coordinate_lanes<T>::type;

/// A V<T> for each coordinate.  With plain numbers, every number has a row of its own over the coordinates.  One load, at any
/// coordinate, then reads it for as many coordinates as a register holds.  With other scalars the numbers of a coordinate are
/// neighbours.
template <template <class> class V, class T> class per_coordinate {
public:
  static constexpr int numbers = numbers_in<V<T>, T>;

  KSL_LANES void lay_out(arena &memory, int n) {
    stride_ = is_number<T> ? before + padded(n + native_lanes_of) : n;
    first_ = memory.take<T>(numbers * stride_);
    if (is_number<T> && first_) // an arena without memory only counts, and null must not be moved
      first_ += before;
  }

  /// The V of coordinate k, or with packs P of the coordinates k, k + 1, ...  Lanes beyond the last coordinate are undefined.
  template <class P = T> KSL_LANES V<P> get(int k) const { return part<V, P>(k); }
  template <class P> KSL_LANES void set(int k, const V<P> &v) const { set_part<V, P>(k, v); }

  /// The numbers of V from number c on, as a U.
  template <template <class> class U, class P, int c = 0> KSL_LANES U<P> part(int k) const {
    U<P> u;
    read<numbers_in<U<P>, P>>(place_of(k, c), reinterpret_cast<P *>(&u));
    return u;
  }
  template <template <class> class U, class P, int c = 0> KSL_LANES void set_part(int k, const U<P> &u) const {
    write<numbers_in<U<P>, P>>(place_of(k, c), reinterpret_cast<const P *>(&u));
  }
  /// The V of coordinate k, in all lanes of P.
  template <class P> KSL_LANES V<P> in_all_lanes(int k) const {
    V<P> v;
    if constexpr (is_number<T>)
      spread_from<numbers>(place_of(k, 0), reinterpret_cast<P *>(&v));
    else
      v = at(k);
    return v;
  }
  /// The V of coordinate k in memory, where its numbers are neighbours.
  KSL_LANES V<T> &at(int k) const
    requires(!is_number<T>)
  {
    return *reinterpret_cast<V<T> *>(&number(k, 0));
  }
  /// Number c of coordinate k.
  KSL_LANES T &number(int k, int c) const { return is_number<T> ? first_[c * stride_ + k] : first_[numbers * k + c]; }

  /// Writes zeros to the lanes beyond the last of n coordinates.  Numbers that happen to be there can be subnormal, and then
  /// slow down arithmetic with the other lanes.
  KSL_LANES void clear_beyond(int n) const {
    if constexpr (is_number<T>)
      for (int c = 0; c < numbers; ++c)
        body_lanes::write(native_pack<T>(T(0)), &number(n, c));
  }

private:
  static constexpr int native_lanes_of = is_number<T> ? padded(1) : 1;
  static constexpr int before = padded(1); ///< room for a body without coordinates, the ground, before the first

  /// Where number c of coordinate k is, and how far it is to the next number.  In registers: what is stored could be this object, for all
  /// that compilers know.
  struct place {
    T *first;
    std::ptrdiff_t stride;
    KSL_LANES T *operator[](int c) const { return first + (is_number<T> ? c * stride : c); }
  };
  KSL_LANES place place_of(int k, int c) const { return {&number(k, c), stride_}; }

  template <int n, class P> KSL_LANES static void read(place from, P *to) { // always unrolled, as body_lanes::read_all
    if constexpr (n > 0) {
      read<n - 1>(from, to);
      body_lanes::read(from[n - 1], to[n - 1]);
    }
  }
  template <int n, class P> KSL_LANES static void spread_from(place from, P *to) {
    if constexpr (n > 0) {
      spread_from<n - 1>(from, to);
      to[n - 1] = P(*from[n - 1]);
    }
  }
  template <int n, class P> KSL_LANES static void write(place to, const P *from) {
    if constexpr (n > 0) {
      write<n - 1>(to, from);
      body_lanes::write(from[n - 1], to[n - 1]);
    }
  }

  T *first_;
  std::ptrdiff_t stride_;
};

} // namespace KSL_ISA
} // namespace ksl
