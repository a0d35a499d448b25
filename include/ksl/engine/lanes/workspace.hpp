// KSL: typed arrays of a workspace, cut from one piece of memory.
//
// Each algorithm has a struct of the arrays that it needs, <algorithm>_workspace<T>, with one function that lays them out in
// memory: lay_out(arena, model).  The same function serves one state, states in lanes, and a user's own scalars.  The order of
// numbers in memory is known to the array classes below only.
#pragma once

#include "ksl/engine/lanes/body_lanes.hpp"

#include <cstddef>

namespace ksl {
inline namespace KSL_ISA {

/// Allocates arrays from one block of memory, aligned to 64 bytes.  If the memory is null, it only counts the bytes.
class arena {
public:
  explicit arena(void *memory = nullptr) : memory_(static_cast<char *>(memory)) {}

  template <class E> KSL_LANES E *take(std::ptrdiff_t n) {
    char *const at = memory_ ? memory_ + used_ : nullptr;
    used_ += (static_cast<std::size_t>(n) * sizeof(E) + 63) / 64 * 64;
    return reinterpret_cast<E *>(at);
  }
  /// Lays out arrays of n elements each.
  template <class N, class... Arrays> KSL_LANES void lay_out(N n, Arrays &...arrays) {
    (arrays.lay_out(*this, n), ...);
  }
  /// Lays out a workspace after the arrays taken so far.
  template <class Workspace, class Model> KSL_LANES Workspace take_workspace(const Model &model) {
    Workspace w;
    w.lay_out(*this, model);
    return w;
  }
  std::size_t used() const { return used_; } ///< bytes taken so far

private:
  char *memory_;
  std::size_t used_ = 0;
};

/// Size of a workspace in bytes.
template <class Workspace, class Model> std::size_t workspace_bytes(const Model &model) {
  arena measure;
  measure.take_workspace<Workspace>(model);
  return measure.used();
}

/// An array of structs, with an element for each body, coordinate or link.
template <class E> class array_of {
public:
  KSL_LANES void lay_out(arena &memory, std::ptrdiff_t n) { first_ = memory.take<E>(n); }
  KSL_LANES E &operator[](std::ptrdiff_t i) const { return first_[i]; }

private:
  E *first_;
};

/// A V<T> for each body, laid out so that several bodies can be read into the lanes of a register (body_lanes.hpp).
template <template <class> class V, class T> class per_body {
public:
  static constexpr int numbers = numbers_in<V<T>, T>;

  KSL_LANES void lay_out(arena &memory, int bodies) { first_ = memory.take<T>(padded_size<T>(numbers, bodies)); }

  /// The V of body i, or of the bodies k in lanes.
  KSL_LANES V<T> operator[](int i) const { return body_at<T>(i).template get<V>(first_); }
  template <class P> KSL_LANES V<P> operator[](bodies_at<P, T> k) const { return k.template get<V>(first_); }
  KSL_LANES void set(int i, const V<T> &v) const { body_at<T>(i).put(v, first_); }
  template <class P> KSL_LANES void set(bodies_at<P, T> k, const V<P> &v) const { k.put(v, first_); }

  /// Writes zeros to the lanes that the last of n bodies is in, before anything is stored there.  Numbers that happen to be in
  /// lanes beyond the last body can be subnormal, and then slow down arithmetic with the other lanes.
  KSL_LANES void clear_last_lanes(int n) const {
    if constexpr (is_number<T>)
      for (int c = 0; c < numbers; ++c)
        body_lanes::write(native_pack<T>(T(0)), &number((n - 1) / native_lanes<T> * native_lanes<T>, c));
  }

  /// The V of body i in memory, where its numbers are neighbours.
  KSL_LANES V<T> &at(int i) const
    requires(!is_number<T>)
  {
    return reinterpret_cast<V<T> *>(first_)[i];
  }
  /// Number c of body i.
  KSL_LANES T &number(int i, int c) const { return numbers_of<numbers>(first_, i)[c * lane_block<T>]; }
  T *data() const { return first_; }

private:
  T *first_;
};

/// Access to the V<T> of body i.  If its numbers are contiguous, this is a reference to memory, so that a number occupies a
/// register only when it is needed.  Otherwise it is a copy, which put() writes back.
template <template <class> class V, class T> class in_place {
public:
  KSL_LANES in_place(const per_body<V, T> &array, int i) : array_(array), i_(i) {
    if constexpr (is_number<T>)
      copy_ = array[i];
  }
  KSL_LANES V<T> &operator*() {
    if constexpr (is_number<T>)
      return copy_;
    else
      return *reinterpret_cast<V<T> *>(&array_.number(i_, 0));
  }
  KSL_LANES void put() const {
    if constexpr (is_number<T>)
      array_.set(i_, copy_);
  }

private:
  const per_body<V, T> &array_;
  int i_;
  V<T> copy_; ///< used for plain numbers only
};

} // namespace KSL_ISA
} // namespace ksl
