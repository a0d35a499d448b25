// Which joint can move without moving any mass: found once for each model, at its construction.
#pragma once

#include "ksl/engine/owned_workspace.hpp"
#include "ksl/engine/solve_mass_matrix.hpp"
#include "ksl/model.hpp"

#include <cmath>

namespace ksl {

/// Is a joint that carries the articulated inertia A without inertia in one of its coordinates?  Rounding leaves about 1e−16 of A.
template <joint_kind K>
bool moves_no_mass(const body<double> &b, const forward_dynamics_workspace<double> &w, int i) {
  constexpr double least = 1e-13;
  const articulated_inertia<double> A = w.A[i];
  const double size = A.Mxx + A.Myy + A.Mzz + A.Ixx + A.Iyy + A.Izz;
  bool none = false;
  if constexpr (joint<K>::is_free) {
    const screw<double> x = solve<double>(A, {{1, 1, 1}, {1, 1, 1}});
    for (double y : {x.lin.x, x.lin.y, x.lin.z, x.ang.x, x.ang.y, x.ang.z})
      none = none || !(std::fabs(y) * least * size <= 1);
  } else {
    for (int k = 0; k < joint<K>::nv; ++k)
      none = none || !(w.coordinate[b.v_index + k].D_inverse * least * size <= 1);
  }
  return none;
}

/// The body whose joint moves no mass at one position, or 0.
inline int body_without_mass(const model_view<double> &model, const forward_dynamics_workspace<double> &w, const double *q,
                             const double *no_effort) {
  start_at_rest(model, w, q, {});
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<double> &b = model.body[i];
    bool none = false;
    by_kind(b.kind, [&]<joint_kind K>() {
      pass_to_parent<K>(b, w, i, no_effort + b.v_index, physics_of(model, b));
      none = moves_no_mass<K>(b, w, i);
    });
    if (none)
      return i; // beyond it, numbers are not finite
  }
  return 0;
}

/// The index of such a joint in m.joints(), or −1.  By the articulated-body algorithm at two positions that nothing singles out: what
/// is singular at both is so by the structure of the mechanism.
inline int massless_joint(const model &m) {
  if (m.followers())
    return -1; // a follower without mass moves that of its leader, and the other way round
  const owned_workspace<forward_dynamics_workspace<double>> w(m.view());
  std::vector<double> q(static_cast<std::size_t>(m.nq())), no_effort(static_cast<std::size_t>(m.nv()));
  int found = 0;
  for (int turn = 0; turn < 2; ++turn) {
    for (std::size_t k = 0; k < q.size(); ++k)
      q[k] = std::sin(1.0 + 2.3 * static_cast<double>(k) + 0.7 * turn); // quaternions need not be of unit length
    const int body = body_without_mass(m.view(), *w, q.data(), no_effort.data());
    if (body == 0)
      return -1;
    found = body;
  }
  while (m.view().body[found].link < 0) // inside a universal joint
    ++found;
  for (int j = 0; j < m.moving_joints(); ++j)
    if (m.joints()[static_cast<std::size_t>(j)].link == m.view().body[found].link)
      return j;
  return -1;
}

} // namespace ksl
