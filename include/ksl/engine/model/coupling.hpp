// KSL: mimic joints: followers, whose position is that of their leader times a factor, plus an offset.
//
// Algorithms know nothing of them.  They run on the expanded mechanism, in which each follower has numbers of its own.  A
// user's numbers are expanded before, and results are reduced after: with v̂ = G v, and q̂ = G q + offset for the joints that
// are coupled, efforts are τ = Gᵀ τ̂ and the mass matrix is M = Gᵀ M̂ G (the projection of Lagrange's equations on the motions
// that the coupling admits: Featherstone, RBDA (2008), section 3.2).
#pragma once

#include "ksl/engine/lanes/workspace.hpp"

namespace ksl {

/// A follower and its leader, which is no follower itself.  Both have one number in q and one in v, here by their indices in
/// the expanded arrays.
template <class T> struct follower {
  int q, v;               ///< of the follower
  int leader_q, leader_v; ///< of the leader
  T multiplier, offset;   ///< position = multiplier × the leader's + offset
};

/// All followers of a mechanism, and where the numbers of the other joints are.
template <class T> struct coupling_view {
  int followers;                    ///< how many
  const ksl::follower<T> *follower; ///< (followers)
  int nq, nv;                       ///< how many numbers a user gives
  const int *in_q, *in_v;           ///< (nq), (nv) where each of them is in the expanded arrays
};

inline namespace KSL_ISA {

/// The expanded position, from the user's q (nq).
template <class T> void expand_position(const coupling_view<scalar_of<T>> &c, const T *q, T *expanded) {
  for (int i = 0; i < c.nq; ++i)
    expanded[c.in_q[i]] = q[i];
  for (int i = 0; i < c.followers; ++i) {
    const follower<scalar_of<T>> &f = c.follower[i];
    expanded[f.q] = T(f.multiplier) * expanded[f.leader_q] + T(f.offset);
  }
}

/// The expanded velocity or acceleration, G v, from the user's v (nv).
template <class T> void expand_motion(const coupling_view<scalar_of<T>> &c, const T *v, T *expanded) {
  for (int i = 0; i < c.nv; ++i)
    expanded[c.in_v[i]] = v[i];
  for (int i = 0; i < c.followers; ++i) {
    const follower<scalar_of<T>> &f = c.follower[i];
    expanded[f.v] = T(f.multiplier) * expanded[f.leader_v];
  }
}

/// Expanded efforts with Gᵀ τ̂ = τ: those of leaders; followers have none of their own.
template <class T> void expand_effort(const coupling_view<scalar_of<T>> &c, const T *tau, T *expanded) {
  for (int i = 0; i < c.nv; ++i)
    expanded[c.in_v[i]] = tau[i];
  for (int i = 0; i < c.followers; ++i)
    expanded[c.follower[i].v] = T(scalar_of<T>(0));
}

/// What the numbers along an axis of a result are, which says how the axis is reduced.
enum class along : unsigned char {
  positions, ///< q: leaders' are kept
  motions,   ///< velocities or accelerations: leaders' are kept
  efforts    ///< efforts, or derivatives by a motion: multiplied by Gᵀ
};

/// Adds the rows of followers to those of their leaders, in an array x (rows, inner): Gᵀ x, before those of leaders are picked.
template <class T>
void add_followers(const coupling_view<scalar_of<T>> &c, std::ptrdiff_t inner, T *x) {
  for (int i = 0; i < c.followers; ++i) {
    const follower<scalar_of<T>> &f = c.follower[i];
    T *const sum = x + f.leader_v * inner;
    const T *const from = x + f.v * inner;
    for (std::ptrdiff_t k = 0; k < inner; ++k)
      sum[k] = sum[k] + T(f.multiplier) * from[k];
  }
}

/// Reduces one axis of an array x (outer, expanded length, inner) to out (outer, nq or nv, inner), which may be x.  Overwrites x.
template <class T>
void reduce_axis(const coupling_view<scalar_of<T>> &c, along what, int expanded_length, std::ptrdiff_t outer,
                 std::ptrdiff_t inner, T *x, T *out) {
  const int length = what == along::positions ? c.nq : c.nv;
  const int *const kept = what == along::positions ? c.in_q : c.in_v;
  int first_moved = 0; // followers are often the last ones: what is before them stays together
  while (first_moved < length && kept[first_moved] == first_moved)
    ++first_moved;
  const std::ptrdiff_t together = first_moved * inner;
  for (std::ptrdiff_t o = 0; o < outer; ++o) {
    T *const block = x + o * expanded_length * inner;
    if (what == along::efforts)
      add_followers(c, inner, block);
    for (std::ptrdiff_t k = 0; k < together && out != block; ++k) // never to the right, so that nothing is lost
      out[k] = block[k];
    out += together;
    for (int i = first_moved; i < length; ++i)
      for (std::ptrdiff_t k = 0; k < inner; ++k)
        *out++ = block[kept[i] * inner + k];
  }
}

} // namespace KSL_ISA
} // namespace ksl
