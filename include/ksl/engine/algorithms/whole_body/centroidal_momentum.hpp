// KSL: the momentum of the bodies that move about their centre of mass, and its rate.  Links that are welded to the ground don't
// count.
//
// Orin, Goswami, Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 35 (2013), eqs. (5)–(8).  The momenta I v of the
// bodies, or their rates by Newton's and Euler's laws, are summed from the leaves to the root, and then moved to the centre of mass c:
// (p, l) becomes (p, l − c × p).
#pragma once

#include "ksl/engine/steps/body_motions.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/frame_options.hpp"
#include "ksl/engine/steps/subtree_moment.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct centroidal_momentum_workspace {
  pose_workspace<T> pose;
  per_body<screw, T> twist;          ///< of each body, in its frame
  per_body<coscrew, T> sum;          ///< momentum of each subtree, in the frame of its body
  per_body<mass_moment, T> children; ///< sum over the subtrees of each body's children, in its frame

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, twist, sum, children);
  }
};

template <class T> struct centroidal_momentum_rate_workspace {
  pose_workspace<T> pose;
  per_body<body_motion, T> motion;   ///< of each body, in its frame
  per_body<coscrew, T> sum;          ///< rate of momentum of each subtree, in the frame of its body
  per_body<mass_moment, T> children; ///< as above

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    pose.lay_out(memory, model);
    memory.lay_out(model.bodies, motion, sum, children);
  }
};

/// The origin of body 1 in the world; zero if nothing moves.  Sums are taken about this point, so that no digits are lost where a robot
/// stands or floats far from the world's origin.
template <class T> KSL_LANES vec3<T> first_origin(const model_view<scalar_of<T>> &model,
                                                  const pose_workspace<T> &pose) {
  vec3<T> origin = {T(0), T(0), T(0)};
  if (model.bodies > 1)
    by_kind(model.body[1].kind, [&]<joint_kind K>() KSL_INLINED { origin = joint<K>::kept_pose(model.body[1], pose).t; });
  return origin;
}

/// Sums the momenta of all bodies but the ground, or their rates, and writes the sum about the centre of mass and in the world's axes
/// to out (6).  On entry sum[i] is that of body i, in its frame.
template <class T>
KSL_LANES void sum_about_center(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                const per_body<coscrew, T> &sum, const per_body<mass_moment, T> &children,
                                component_order order, T *out) {
  using A = algebra<T>;
  const vec3<T> reference = first_origin(model, pose);
  const T o = T(0);
  sum.set(0, {{o, o, o}, {o, o, o}});
  children.set(0, {o, {o, o, o}});
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      auto D = joint<K>::kept_pose(b, pose);
      if (b.parent == 0)
        A::nxpy_vv(&reference, &D.t);
      add_to_parent(in_parent(subtree_moment(model, children, i), D), model, children, i);
      coscrew<T> p = sum[i];
      D.to_parent(p.lin, p.ang);
      A::product_CoAdtc(&D.t, &p, &p);
      add_wrench(sum, b.parent, p);
    });
  }
  coscrew<T> all = sum[0];
  const vec3<T> center = point_of_momentum(children[0]);
  A::product_CoAdtinvc(&center, &all, &all);
  const bool angular_first = order == component_order::angular_first;
  T *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  lin[0] = all.lin.x, lin[1] = all.lin.y, lin[2] = all.lin.z;
  ang[0] = all.ang.x, ang[1] = all.ang.y, ang[2] = all.ang.z;
}

/// Momentum (6) about the centre of mass and in the world's axes, kg m/s and kg m²/s, for q (nq) and v (nv).  O(bodies).
template <class T>
void centroidal_momentum(const model_view<scalar_of<T>> &model, const centroidal_momentum_workspace<T> &w, const T *q,
                         const T *v, component_order order, T *momentum) {
  body_twists(model, w.pose, w.twist, q, v, [&]<class P>(bodies_at<P, T> k) KSL_INLINED {
    const spatial_inertia<P> I = own_inertia(model, k);
    const screw<P> s = w.twist[k];
    coscrew<P> p;
    algebra<P>::product_Ms(&I, &s, &p);
    w.sum.set(k, p);
  });
  sum_about_center(model, w.pose, w.sum, w.children, order, momentum);
}

/// Rate (6) of the momentum about the centre of mass, in the world's axes, N and N m, for q (nq), v (nv) and dv (nv): the sum of all
/// external wrenches, those of gravity and of the ground among them.  O(bodies).
template <class T>
void centroidal_momentum_rate(const model_view<scalar_of<T>> &model, const centroidal_momentum_rate_workspace<T> &w,
                              const T *q, const T *v, const T *dv, component_order order, T *rate) {
  body_motions(model, w.pose, w.motion, ground_at_rest<T>(), q, v, dv,
               [&](auto k) KSL_INLINED { w.sum.set(k, newton_euler(own_inertia(model, k), w.motion[k])); });
  sum_about_center(model, w.pose, w.sum, w.children, order, rate);
}

} // namespace KSL_ISA
} // namespace ksl
