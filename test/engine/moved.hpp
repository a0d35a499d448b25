// Positions that depend on a scalar with derivatives.
#pragma once

#include "ksl/engine/lanes/sine_cosine.hpp"
#include "ksl/model.hpp"

#include <vector>

namespace robots {

/// q moved along the tangent x (nv): of spherical, floating and planar joints by the twist x in the child's axes.  To the second order this is
/// the exponential for the rotation, and a chart of the manifold for all.
template <class S, class T>
std::vector<T> moved(const ksl::model &m, const std::vector<S> &q, const std::vector<T> &x) {
  using A = ksl::algebra<T>;
  std::vector<T> out(q.begin(), q.end());
  for (int i = 1; i < m.view().bodies; ++i) {
    const ksl::body<double> &b = m.view().body[i];
    const int quaternion = ksl::row_of(b.kind).quaternion;
    T *const position = &out[static_cast<std::size_t>(b.q_index)];
    const T *const step = &x[static_cast<std::size_t>(b.v_index)];
    if (quaternion < 0) { // coordinates that are independent, but a planar joint's velocity is in the child's axes
      for (int k = 0; k < b.nv; ++k)
        position[k] = position[k] + step[k];
      if (b.kind == ksl::joint_kind::planar) {
        T sine, cosine;
        ksl::sine_cosine(T(q[static_cast<std::size_t>(b.q_index + 2)]), sine, cosine);
        position[0] = position[0] + ((cosine - T(1)) * step[0] - sine * step[1]);
        position[1] = position[1] + (sine * step[0] + (cosine - T(1)) * step[1]);
      }
      continue;
    }
    T *const p = position + quaternion;
    const T *const angular = step + b.nv - 3;
    if (quaternion == 3) { // a position comes first
      const ksl::mat3x3<T> R = ksl::rotation_of(p);
      ksl::vec3<T> along = {step[0], step[1], step[2]};
      A::product_drv(&R, &along, &along);
      position[0] = position[0] + along.x, position[1] = position[1] + along.y, position[2] = position[2] + along.z;
    }
    const ksl::quaternion<T> from = {p[0], p[1], p[2], p[3]};
    const ksl::quaternion<T> rotation = {T(0.5) * angular[0], T(0.5) * angular[1], T(0.5) * angular[2], T(1)};
    ksl::quaternion<T> to;
    A::product_qq(&from, &rotation, &to);
    p[0] = to.x, p[1] = to.y, p[2] = to.z, p[3] = to.w;
  }
  return out;
}

} // namespace robots
