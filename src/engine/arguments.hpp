// What the arguments of a call must be, whatever language it comes from.  The sentences about what they are not are those of the
// interface: they name arguments as its users do.
#pragma once

#include "engine/algorithm.hpp"
#include "ksl/engine/model/quaternion_tolerance.hpp"
#include "ksl/model.hpp"

#include <cmath>
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
