// KSL: velocity and acceleration of the centre of mass of the bodies that move.  Links that are welded to the ground don't count.
//
// The velocity is Σ p / Σ m, and the acceleration Σ f / Σ m, over all bodies: p = m v + ω × h is the linear momentum of a body, and
// f = m a + A h its rate (newton_euler.hpp).  The vectors are summed from the leaves to the root.
#pragma once

#include "ksl/engine/steps/body_motions.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct center_of_mass_velocity_workspace {
  pose_workspace<T> pose;
  per_body<screw, T> twist; ///< of each body, in its frame
  per_body<vec3, T> sum;    ///< linear momentum of each subtree, in the axes of its body

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, twist, sum);
  }
};

template <class T> struct center_of_mass_acceleration_workspace {
  pose_workspace<T> pose;
  per_body<body_motion, T> motion; ///< of each body, in its frame
  per_body<vec3, T> sum;           ///< rate of the linear momentum of each subtree, in the axes of its body

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, motion, sum);
  }
};

/// Writes Σ x / Σ m to out (3), in the world's axes.  On entry sum[i] is x of body i in its axes; the ground is left out.
template <class T>
KSL_LANES void mean_over_mass(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                              const per_body<vec3, T> &sum, T *out) {
  scalar_of<T> mass = 0;
  sum.set(0, {T(0), T(0), T(0)});
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    mass = mass + own_mass(model, i);
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      const auto D = joint<K>::kept_pose(b, pose);
      vec3<T> x = sum[i];
      D.to_parent(x);
      const vec3<T> others = sum[b.parent];
      algebra<T>::xpy_vv(&others, &x);
      sum.set(b.parent, x);
    });
  }
  const vec3<T> all = sum[0];
  out[0] = all.x / T(mass), out[1] = all.y / T(mass), out[2] = all.z / T(mass);
}

/// Velocity (3) of the centre of mass, in the world's axes, m/s, for q (nq) and v (nv).  O(bodies).
template <class T>
void center_of_mass_velocity(const model_view<scalar_of<T>> &model, const center_of_mass_velocity_workspace<T> &w,
                             const T *q, const T *v, T *velocity) {
  body_twists(model, w.pose, w.twist, q, v, [&]<class P>(bodies_at<P, T> k) KSL_INLINED {
    const spatial_inertia<P> I = own_inertia(model, k);
    const screw<P> s = w.twist[k];
    vec3<P> p; // m v + ω × h
    algebra<P>::cross_vv(&s.ang, &I.h, &p);
    algebra<P>::axpy_vv(I.m, &s.lin, &p);
    w.sum.set(k, p);
  });
  mean_over_mass(model, w.pose, w.sum, velocity);
}

/// Acceleration (3) of the centre of mass, in the world's axes, m/s², for q (nq), v (nv) and dv (nv).  Gravity doesn't enter.
/// O(bodies).
template <class T>
void center_of_mass_acceleration(const model_view<scalar_of<T>> &model,
                                 const center_of_mass_acceleration_workspace<T> &w, const T *q, const T *v, const T *dv,
                                 T *acceleration) {
  body_motions(model, w.pose, w.motion, ground_at_rest<T>(), q, v, dv, [&]<class P>(bodies_at<P, T> k) KSL_INLINED {
    const spatial_inertia<P> I = own_inertia(model, k);
    const body_motion<P> m = w.motion[k];
    const mat3x3<P> field = acceleration_field(products_of(m.angular_velocity), m.angular_acceleration);
    vec3<P> f; // m a + A h
    algebra<P>::product_drv(&field, &I.h, &f);
    algebra<P>::axpy_vv(I.m, &m.acceleration, &f);
    w.sum.set(k, f);
  });
  mean_over_mass(model, w.pose, w.sum, acceleration);
}

} // namespace KSL_ISA
} // namespace ksl
