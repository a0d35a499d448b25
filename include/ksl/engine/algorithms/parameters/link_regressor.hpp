// KSL: how motions and wrenches of one link depend on its ten inertial parameters.
//
// The parameters φ of a link are its mass m, first moment h = m c and moments of inertia about the link's origin, in its axes:
// [m, hx, hy, hz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz].  Momenta and wrenches are linear in φ (Atkeson, An, Hollerbach, Estimation of inertial
// parameters of manipulator loads and links, IJRR 5 (1986)).  An effort, or a component of a wrench, is the power s · f of the link's
// wrench f on some twist s.  The functions here give the ten numbers y with y · φ = s · f, all in the link's frame.
#pragma once

#include "ksl/engine/algorithms/kinematics/forward_kinematics.hpp"
#include "ksl/engine/steps/body_motions.hpp"

namespace ksl {
inline namespace KSL_ISA {

inline constexpr int parameters_of_link = 10;

/// The six numbers y for which uᵀ I w + sᵀ I t is the scalar product of y and the moments of inertia.  27 flops.
template <class T>
KSL_LANES void inertia_form(const vec3<T> &u, const vec3<T> &w, const vec3<T> &s, const vec3<T> &t, T *y) {
  y[0] = u.x * w.x + s.x * t.x;
  y[1] = (u.x * w.y + u.y * w.x) + (s.x * t.y + s.y * t.x);
  y[2] = u.y * w.y + s.y * t.y;
  y[3] = (u.x * w.z + u.z * w.x) + (s.x * t.z + s.z * t.x);
  y[4] = (u.y * w.z + u.z * w.y) + (s.y * t.z + s.z * t.y);
  y[5] = u.z * w.z + s.z * t.z;
}

/// The ten numbers y of the power on s of the wrench that gives the link its motion: f = m a + A h, τ = I ω̇ + ω × I ω + h × a
/// (newton_euler.hpp).
template <class T> KSL_LANES void wrench_form(const screw<T> &s, const body_motion<T> &m, T *y) {
  using A = algebra<T>;
  const vec3<T> &a = m.acceleration, &w = m.angular_velocity;
  const mat3x3<T> field = acceleration_field(products_of(w), m.angular_acceleration);
  vec3<T> h, moment, turned;
  A::product_drinvv(&field, &s.lin, &h); // s · A h = h · Aᵀ s
  A::cross_vv(&a, &s.ang, &moment);
  A::xpy_vv(&moment, &h);
  A::cross_vv(&s.ang, &w, &turned); // s · (ω × I ω) = (s × ω) · I ω
  y[0] = A::dot_vv(&s.lin, &a);
  y[1] = h.x, y[2] = h.y, y[3] = h.z;
  inertia_form(s.ang, m.angular_acceleration, turned, w, y + 4);
}

/// The ten numbers y of the product of s and the link's momentum: p = m v + ω × h, l = I ω + h × v.
template <class T> KSL_LANES void momentum_form(const screw<T> &s, const screw<T> &v, T *y) {
  using A = algebra<T>;
  const vec3<T> none = {T(0), T(0), T(0)};
  vec3<T> h, moment;
  A::cross_vv(&s.lin, &v.ang, &h);
  A::cross_vv(&v.lin, &s.ang, &moment);
  A::xpy_vv(&moment, &h);
  y[0] = A::dot_vv(&s.lin, &v.lin);
  y[1] = h.x, y[2] = h.y, y[3] = h.z;
  inertia_form(s.ang, v.ang, none, none, y + 4);
}

/// The twist of a link at its origin and in its axes, from that of its body.
template <class T> KSL_LANES screw<T> twist_of_link(const link<scalar_of<T>> &l, const screw<T> &of_body) {
  const SE3<T> pose = spread<T>(l.pose);
  screw<T> s = of_body;
  algebra<T>::product_Adinvs(&pose, &s, &s);
  return s;
}

/// The motion of a link, likewise.
template <class T> KSL_LANES body_motion<T> motion_of_link(const link<scalar_of<T>> &l, const body_motion<T> &of_body) {
  using A = algebra<T>;
  const SE3<T> pose = spread<T>(l.pose);
  body_motion<T> m = of_body;
  m.acceleration = acceleration_at(m, pose.t);
  A::product_drinvv(&pose.R, &m.acceleration, &m.acceleration);
  A::product_drinvv(&pose.R, &m.angular_velocity, &m.angular_velocity);
  A::product_drinvv(&pose.R, &m.angular_acceleration, &m.angular_acceleration);
  return m;
}

/// Calls use(twist) for each column of the motion subspace of body j's joint, expressed at a link's origin and in its axes.
template <class T, class Use>
KSL_LANES void columns_at_link(const model_view<scalar_of<T>> &model, const array_of<SE3<T>> &in_world, int j,
                               const SE3<T> &of_link, Use use) {
  const body<scalar_of<T>> &b = model.body[j];
  SE3<T> D; // of the joint's body in the link's frame
  algebra<T>::product_dinvd(&of_link, &in_world[j], &D);
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
    for_coordinates<K>(b, [&](auto c) KSL_INLINED {
      T unit[most_coordinates<K>];
      for (int k = 0; k < most_coordinates<K>; ++k)
        unit[k] = T(k == c ? 1 : 0);
      screw<T> s = joint<K>::twist(b, unit);
      algebra<T>::product_Ads(&D, &s, &s);
      use(b.v_index + c, s);
    });
  });
}

} // namespace KSL_ISA
} // namespace ksl
