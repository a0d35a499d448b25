// KSL: a matrix whose columns are twists, row-major: one number of all twists after the other.
#pragma once

#include "ksl/engine/lanes/scalar.hpp"
#include "ksl/engine/steps/frame_options.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Column c, or the columns c, c + 1, … < end in the lanes of P.
template <class P> struct columns_at { int c, end; };

/// A matrix (6, n).
template <class T> struct twist_columns {
  T *numbers;
  int n;
  bool angular_first;

  KSL_LANES T *linear() const { return numbers + (angular_first ? 3 * n : 0); }
  KSL_LANES T *angular() const { return numbers + (angular_first ? 0 : 3 * n); }

  KSL_LANES void set(int c, const screw<T> &s) const {
    T *const lin = linear() + c, *const ang = angular() + c;
    lin[0] = s.lin.x, lin[n] = s.lin.y, lin[2 * n] = s.lin.z;
    ang[0] = s.ang.x, ang[n] = s.ang.y, ang[2 * n] = s.ang.z;
  }
  template <class P> KSL_LANES screw<P> get(columns_at<P> k) const {
    const T *const lin = linear() + k.c, *const ang = angular() + k.c;
    const int left = k.end - k.c;
    return {{load<P>(lin, left), load<P>(lin + n, left), load<P>(lin + 2 * n, left)},
            {load<P>(ang, left), load<P>(ang + n, left), load<P>(ang + 2 * n, left)}};
  }
  template <class P> KSL_LANES void set(columns_at<P> k, const screw<P> &s) const {
    T *const lin = linear() + k.c, *const ang = angular() + k.c;
    const int left = k.end - k.c;
    store(s.lin.x, lin, left), store(s.lin.y, lin + n, left), store(s.lin.z, lin + 2 * n, left);
    store(s.ang.x, ang, left), store(s.ang.y, ang + n, left), store(s.ang.z, ang + 2 * n, left);
  }
  void clear() const {
    for (int i = 0; i < 6 * n; ++i)
      numbers[i] = T(0);
  }

private:
  template <class P> static KSL_LANES P load(const T *from, int left) {
    if constexpr (is_number<T>)
      return load_first(from, left);
    else
      return *from;
  }
  template <class P> static KSL_LANES void store(const P &x, T *to, int left) {
    if constexpr (is_number<T>)
      store_first(x, to, left);
    else
      *to = x;
  }
};

/// Calls step(columns_at) for the columns [first, end); with plain numbers, as many at a time as a register has lanes.
template <class T, class Step> KSL_LANES void for_columns(int first, int end, Step step) {
  if constexpr (is_number<T>)
    for (int c = first; c < end; c += native_lanes<T>)
      step(columns_at<native_pack<T>>{c, end});
  else
    for (int c = first; c < end; ++c)
      step(columns_at<T>{c, end});
}

} // namespace KSL_ISA
} // namespace ksl
