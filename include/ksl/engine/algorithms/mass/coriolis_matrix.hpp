// KSL: the Coriolis matrix.
//
// Many matrices C satisfy C v = bias − gravity.  This one is the sum of Jᵀ J̇ dm over all particles, J being the Jacobian of a particle
// in world axes.  Ṁ − 2 C is skew-symmetric, and where joints have one coordinate each, the elements of C are those of Christoffel's
// symbols of M.  It is the matrix of Echeandia and Wensing, "Numerical methods to compute the Coriolis matrix and Christoffel symbols
// for rigid-body systems" (2021).  Their B(I, v) = ½ [(v ×*) I + (I v) ×̄* − I (v ×)], written for the axes of the base, is
//
//     B = [0, −p̃; 0, N],  p = ∫ ṙ dm,  N = ∫ (r · ṙ) 1 − ṙ rᵀ dm = (h · v) 1 − v hᵀ − ω̃ Σ,  Σ = ∫ r rᵀ dm = ½ tr(I) 1 − I.  (1)
//
// I and B are summed over subtrees.  With those of the subtree of coordinate k, and Ṡ = v × S, v the twist of the joint's body,
//
//     C_rk = S_r · (I Ṡ_k + B S_k),    C_kr = (I S_k) · Ṡ_r + (Bᵀ S_k) · S_r      for each r that carries k,          (2)
//
// and the first formula holds for r of the same joint.
#pragma once

#include "ksl/engine/algorithms/mass/mass_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// p and N (1) of a body, or their sums over a subtree, about the origin of the base.
template <class T> struct moments_of_velocity {
  vec3<T> p;
  mat3x3<T> N;
};

template <class T> struct coriolis_matrix_workspace {
  mass_matrix_workspace<T> joints;         ///< axes, origins and columns are used
  per_body<spatial_inertia, T> inertia;    ///< of each subtree, about the origin of the base
  per_body<moments_of_velocity, T> moving; ///< of each subtree
  per_body<screw, T> twist;                ///< of each body, about the origin of the base
  per_body<vec3, T> origin;                ///< of each body
  array_of<screw<T>> rate;                 ///< Ṡ of each coordinate

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    joints.lay_out(memory, model);
    memory.lay_out(model.bodies, inertia, moving, twist, origin);
    rate.lay_out(memory, model.nv);
  }
};

/// p and N (1) of one body.
template <class T> KSL_LANES moments_of_velocity<T> moments_of(const spatial_inertia<T> &I, const screw<T> &twist) {
  using A = algebra<T>;
  const vec3<T> &v = twist.lin, &w = twist.ang, &h = I.h;
  const T half_trace = T(0.5) * (I.Ixx + I.Iyy + I.Izz), hv = A::dot_vv(&h, &v);
  const T xx = half_trace - I.Ixx, yy = half_trace - I.Iyy,
          zz = half_trace - I.Izz; // of Σ; the others are −Ixy, −Iyz, −Izx
  moments_of_velocity<T> m;
  A::cross_vv(&w, &h, &m.p);
  A::axpy_vv(I.m, &v, &m.p);
  mat3x3<T> &N = m.N; // columns of ω̃ Σ are ω × (columns of Σ)
  N.m00 = hv - v.x * h.x - (w.y * -I.Izx - w.z * -I.Ixy);
  N.m10 = -(v.y * h.x) - (w.z * xx - w.x * -I.Izx);
  N.m20 = -(v.z * h.x) - (w.x * -I.Ixy - w.y * xx);
  N.m01 = -(v.x * h.y) - (w.y * -I.Iyz - w.z * yy);
  N.m11 = hv - v.y * h.y - (w.z * -I.Ixy - w.x * -I.Iyz);
  N.m21 = -(v.z * h.y) - (w.x * yy - w.y * -I.Ixy);
  N.m02 = -(v.x * h.z) - (w.y * zz - w.z * -I.Iyz);
  N.m12 = -(v.y * h.z) - (w.z * -I.Izx - w.x * zz);
  N.m22 = hv - v.z * h.z - (w.x * -I.Iyz - w.y * -I.Izx);
  return m;
}

template <class T>
KSL_LANES moments_of_velocity<T> sum_of(const moments_of_velocity<T> &a, const moments_of_velocity<T> &b) {
  return {{a.p.x + b.p.x, a.p.y + b.p.y, a.p.z + b.p.z},
          {a.N.m00 + b.N.m00, a.N.m10 + b.N.m10, a.N.m20 + b.N.m20, a.N.m01 + b.N.m01, a.N.m11 + b.N.m11,
           a.N.m21 + b.N.m21, a.N.m02 + b.N.m02, a.N.m12 + b.N.m12, a.N.m22 + b.N.m22}};
}

/// Sets the twists of all bodies, Ṡ of all coordinates, and I, p and N of each body.
template <class T>
KSL_LANES void move_bodies(const model_view<scalar_of<T>> &model, const coriolis_matrix_workspace<T> &w, const T *q,
                           const T *v) {
  using A = algebra<T>;
  locate_joints(model, w.joints.pose, w.joints.rotation, w.joints.origin, w.joints.column, q);
  w.twist.set(0, {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}});
  w.origin.set(0, {T(0), T(0), T(0)});
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    screw<T> s = w.twist[b.parent];
    for (int k = b.v_index; k < b.v_index + b.nv; ++k)
      A::axpy_ss(v[k], &w.joints.column[k], &s);
    w.twist.set(i, s);
    w.origin.set(i, w.joints.origin[i]);
    for (int k = b.v_index; k < b.v_index + b.nv; ++k) {
      const screw<T> &S = w.joints.column[k];
      screw<T> &rate = w.rate[k];
      vec3<T> turned;
      A::cross_vv(&s.ang, &S.lin, &turned);
      A::cross_vv(&s.lin, &S.ang, &rate.lin);
      A::xpy_vv(&turned, &rate.lin);
      A::cross_vv(&s.ang, &S.ang, &rate.ang);
    }
  }
  for_bodies<T>(
      model.bodies, [](int) KSL_INLINED {},
      [&](auto k) KSL_INLINED {
        using P = typename decltype(k)::scalar;
        spatial_inertia<P> I = rotated(own_inertia(model, k), w.joints.rotation[k]);
        const vec3<P> o = w.origin[k];
        algebra<P>::spatial_inertia_translated(&I, &o, &I);
        w.inertia.set(k, I);
        w.moving.set(k, moments_of(I, w.twist[k]));
      });
}

/// Sets the elements (2) of coordinate k of body i, in its row and its column.  I and m are those of the subtree.
template <class T>
KSL_LANES void set_coriolis(const model_view<scalar_of<T>> &model, const coriolis_matrix_workspace<T> &w, int i, int k,
                            const spatial_inertia<T> &I, const moments_of_velocity<T> &m, T *C) {
  using A = algebra<T>;
  const screw<T> S = w.joints.column[k], rate = w.rate[k];
  coscrew<T> F, momentum, turn;
  vec3<T> x;
  A::product_Ms(&I, &rate, &F); // F = I Ṡ + B S, B S = (−p × ω, N ω)
  A::cross_vv(&m.p, &S.ang, &x);
  A::nxpy_vv(&x, &F.lin);
  A::product_drv(&m.N, &S.ang, &x);
  A::xpy_vv(&x, &F.ang);
  A::product_Ms(&I, &S, &momentum);
  A::cross_vv(&m.p, &S.lin, &turn.ang); // Bᵀ S = (0, p × v + Nᵀ ω)
  A::product_drinvv(&m.N, &S.ang, &x);
  A::xpy_vv(&x, &turn.ang);
  const body<scalar_of<T>> &b = model.body[i];
  for (int r = b.v_index; r < b.v_index + b.nv; ++r)
    C[r * model.nv + k] = A::dot_cs(&F, &w.joints.column[r]);
  for_each_ancestor(model, i, 0, [&](index r, index) KSL_INLINED {
    C[r * model.nv + k] = A::dot_cs(&F, &w.joints.column[r]);
    C[k * model.nv + r] = A::dot_cs(&momentum, &w.rate[r]) + A::dot_vv(&turn.ang, &w.joints.column[r].ang);
  });
}

/// C (nv, nv), row-major, for q (nq) and v (nv): inverse_dynamics(q, v, a) = M a + C v + gravity.  O(bodies × depth), besides
/// writing nv² numbers.
template <class T>
void coriolis_matrix(const model_view<scalar_of<T>> &model, const coriolis_matrix_workspace<T> &w, const T *q,
                     const T *v, T *C) {
  using A = algebra<T>;
  for (index k = 0; k < index(model.nv) * model.nv; ++k)
    C[k] = T(0);
  move_bodies(model, w, q, v);
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const spatial_inertia<T> I = w.inertia[i];
    const moments_of_velocity<T> m = w.moving[i];
    for (int k = b.v_index; k < b.v_index + b.nv; ++k)
      set_coriolis(model, w, i, k, I, m, C);
    if (b.parent == 0)
      continue;
    spatial_inertia<T> sum = w.inertia[b.parent];
    A::spatial_inertia_added(&sum, &I, &sum);
    w.inertia.set(b.parent, sum);
    w.moving.set(b.parent, sum_of(w.moving[b.parent], m));
  }
}

} // namespace KSL_ISA
} // namespace ksl
