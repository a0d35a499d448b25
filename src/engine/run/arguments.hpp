// What the arguments of a call must be, whatever language it comes from.  The sentences about what they are not are those of the
// interface: they name arguments as its users do.
#pragma once

#include "engine/kernels/algorithm.hpp"
#include "ksl/engine/model/quaternion_tolerance.hpp"
#include "ksl/model.hpp"

#include <cmath>
#include <cstdint>
#include <string>

namespace ksl {

/// Calls refuse(sentence) if the algorithm can't be computed for the model: a joint can move without moving any mass, or friction has
/// no derivative.
template <class Refuse> void check_model(const algorithm_row &row, const model &m, Refuse refuse) {
  if (row.needs_mass && m.massless_joint() >= 0)
    refuse(std::string(row.name) + ": " + m.massless_joint_text());
  if (row.smooth_friction && m.exact_friction())
    refuse(std::string(row.name) + ": " + model::exact_friction_text());
}

/// May a call of the algorithm name n links?
inline bool may_name_links(const algorithm_row &row, const model &m, int n) {
  return !links_are_few(row) || n <= static_cast<int>(m.links().size());
}

/// Calls refuse(sentence) for a link that says nothing: hybrid dynamics hold the joints that carry the links named, and a fixed one can't be held.
template <class Refuse> void check_links(const algorithm_row &row, const model &m, int n, const int *index,
                                         Refuse refuse) {
  if (row.mimic != mimic_by::hybrid)
    return;
  for (int k = 0; k < n; ++k) {
    const joint_row &joint = m.joints()[static_cast<std::size_t>(m.joint_above(index[k]))];
    if (joint.v_index < 0 && joint.leader < 0)
      refuse(std::string(row.name) + ": link " + m.links()[static_cast<std::size_t>(index[k])].name +
             " is carried by joint " + joint.name +
             ", which is fixed and has no acceleration to be given; name links "
             "that a moving joint carries");
  }
}

/// Rows of numbers of n states as memory.
struct memory_of_rows {
  std::uintptr_t first = 0;
  std::ptrdiff_t stride = 0; ///< bytes
  std::size_t bytes = 0;     ///< of one row; 0: no rows

  template <class S>
  memory_of_rows(const rows_view<S> &rows, std::ptrdiff_t columns)
      : first(reinterpret_cast<std::uintptr_t>(rows.first)),
        stride(rows.stride * static_cast<std::ptrdiff_t>(sizeof(S))),
        bytes(rows.first ? static_cast<std::size_t>(columns) * sizeof(S) : 0) {}
};

/// Do the rows of a and b have no number in common?  Rows of equal distance may be parts of one record.
///
///     │ a a a . b b . . │ a a a . b b . . │     with one stride: b is `ahead` of a, modulo the stride, by the row of a or more,
///       └ ahead ┘                             and ends before the next row of a
inline bool are_apart(const memory_of_rows &a, const memory_of_rows &b, std::size_t n) {
  if (n == 0 || a.bytes == 0 || b.bytes == 0)
    return true;
  const auto lowest = [&](const memory_of_rows &x) {
    return x.stride < 0 ? x.first - (n - 1) * static_cast<std::size_t>(-x.stride) : x.first;
  };
  const auto span = [&](const memory_of_rows &x) {
    return (n - 1) * static_cast<std::size_t>(x.stride < 0 ? -x.stride : x.stride) + x.bytes;
  };
  if (lowest(a) + span(a) <= lowest(b) || lowest(b) + span(b) <= lowest(a))
    return true;
  if (n == 1 || a.stride != b.stride || a.stride == 0)
    return false;
  const std::size_t distance = static_cast<std::size_t>(a.stride < 0 ? -a.stride : a.stride);
  const std::size_t ahead =
      a.first <= b.first ? (b.first - a.first) % distance : (distance - (a.first - b.first) % distance) % distance;
  return ahead >= a.bytes && ahead + b.bytes <= distance;
}

/// Is each row of b that of the same state of a?  A state is read before its result is written.
inline bool coincide(const memory_of_rows &a, const memory_of_rows &b, std::size_t n) {
  return a.first == b.first && a.bytes == b.bytes && (n < 2 || a.stride == b.stride);
}

/// Calls refuse(sentence) for a result whose rows overlap each other.
template <class S, class Refuse>
void check_stride(const rows_view<S> &rows, std::ptrdiff_t columns, std::size_t n, const char *name, Refuse refuse) {
  const std::ptrdiff_t apart = rows.stride < 0 ? -rows.stride : rows.stride;
  if (rows.first && n > 1 && apart < columns)
    refuse(std::string(name) + ": its rows have " + std::to_string(columns) + " numbers, and its stride is " +
           std::to_string(rows.stride) + ", so that they overlap; give a stride of " + std::to_string(columns) +
           " or more");
}

/// Calls refuse(sentence) for a result that would be written over numbers that are still to be read.
template <class Refuse>
void check_overlap(const memory_of_rows &result, const char *name, const memory_of_rows &input, const char *of,
                   std::size_t n, bool may_coincide, Refuse refuse) {
  if (are_apart(result, input, n) || (may_coincide && coincide(result, input, n)))
    return;
  refuse(std::string(name) + " overlaps " + of + ", which would be overwritten before it is read; give " +
         (may_coincide ? "memory apart from it, or the same memory and stride" : "memory apart from it"));
}

/// Which of n numbers is the first that is not finite; n if all are.
template <class S> int first_not_finite(const S *x, int n) {
  int i = 0;
  while (i < n && std::isfinite(x[i]))
    ++i;
  return i;
}

/// Calls found(joint, state, numbers) for quaternions of the positions [first, end) that differ from unit length by more than rounding,
/// until it returns false.  They are refused unless is_unit_quaternion(numbers).
template <class S, class Found>
void check_quaternions(const model &m, const rows_view<const S> &q, std::size_t first, std::size_t end, Found found) {
  for (const model::quaternion_in_q &quaternion : m.quaternions())
    for (std::size_t k = first; k < end; ++k)
      if (const S *x = row(q, k) + quaternion.q_index;
          !is_unit_quaternion(x, quaternion_rounding) &&
          !found(m.joints()[static_cast<std::size_t>(quaternion.joint)], k, x))
        return;
}

} // namespace ksl
