// KSL: dynamics as it is felt at frames: operational-space inertia, its inverse, bias force, and the pseudo-inverse of the Jacobian.
//
// With x' the twists of the frames, x' = J v, and a wrench F on each of them (Khatib, IEEE J. Robotics and Automation 3 (1987) 43),
//
//     F = Λ x'' + p,   Λ⁻¹ = J M⁻¹ Jᵀ.                                                                           (1)
//
// The articulated-body algorithm factorises M, so that neither M nor J is needed.  A unit wrench f on a frame goes towards the ground
// through the articulated bodies, as the extended force propagators of Lilly and Orin (1993) do.  At each coordinate, with U, D of
// forward_dynamics.hpp,
//
//     u = Sᵀ f,   f ← f − U D⁻¹ u.                                                                               (2)
//
// At a free joint, with the articulated inertia A, it ends.  The columns u and f of all unit wrenches give
//
//     Λ⁻¹ = Σ u D⁻¹ uᵀ over the coordinates + Σ fᵀ A⁻¹ f over the free joints.                                    (3)
#pragma once

#include "ksl/engine/algorithms/forward/forward_dynamics.hpp"
#include "ksl/engine/algorithms/kinematics/frame_motion.hpp"
#include "ksl/engine/lanes/of_precision.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Six wrenches: the columns of one frame.
template <class T> struct wrench_columns { coscrew<T> column[6]; };

/// Has room for as many frames as the model has links.
template <class T> struct operational_space_inertia_inverse_workspace {
  forward_dynamics_workspace<T> dynamics;
  array_of<wrench_columns<T>> wrench; ///< f of (2): the unit wrenches on each frame, on their way to the ground
  array_of<int> at;                   ///< the body that the wrenches of each frame have reached
  array_of<bool> carries;             ///< for each body: does it carry any of the frames
  T *u;                               ///< (6 frames) Sᵀ f of one coordinate; later (24 frames) memory to invert Λ⁻¹

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    dynamics.lay_out(memory, model);
    memory.lay_out(model.links, wrench, at);
    carries.lay_out(memory, model.bodies);
    u = memory.take<T>(24 * model.links);
  }
};

template <class T> using operational_space_inertia_workspace = operational_space_inertia_inverse_workspace<T>;

template <class T> struct operational_space_workspace {
  operational_space_inertia_inverse_workspace<T> propagation;
  frame_accelerations_workspace<T> kinematics;
  T *zero, *acceleration; ///< (nv)

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    propagation.lay_out(memory, model);
    kinematics.lay_out(memory, model);
    zero = memory.take<T>(model.nv), acceleration = memory.take<T>(model.nv);
  }
};

/// Eliminates the joint of body i from its articulated inertia, and adds what the parent feels of it to the parent's: pass_to_parent
/// (forward_dynamics.hpp) without forces.
template <joint_kind K, class T>
KSL_LANES void eliminate_joint(const body<scalar_of<T>> &b, const forward_dynamics_workspace<T> &w, int i,
                               const coordinate_physics<scalar_of<T>> *physics) {
  if constexpr (!joint<K>::is_free) { // a free joint transmits nothing
    in_place<articulated_inertia, T> A(w.A, i);
    for_coordinates_backwards<K>(b, [&](auto k) KSL_INLINED {
      const auto S = joint<K>::column(k, b, w.rotation, i);
      const coscrew<T> U = S.momentum(*A);
      T D = S.effort(U);
      if (physics)
        D = D + T(physics[k].armature);
      const T D_inverse = T(1) / D;
      w.coordinate[b.v_index + k] = {U, D_inverse, T(0)};
      if (k > 0) {
        algebra<T>::articulated_inertia_downdated(&*A, &U, D_inverse, &*A);
      } else if (b.parent > 0) {
        in_place<articulated_inertia, T> sum(w.A, b.parent);
        add_beyond_joint(*A, U, D_inverse, w.offset[i], *sum);
        sum.put();
      }
    });
  }
}

/// Sets the articulated inertias of all bodies, and U and D⁻¹ of all coordinates.  Featherstone, RBDA (2008), table 7.1, without
/// forces.
template <class T>
void articulated_inertias(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, const T *q) {
  const auto locate = [&]<joint_kind K>(int i, const vec3<T> &offset) KSL_INLINED { w.offset[i] = offset; };
  express_in_base(model, w.pose, w.rotation, q, locate, [&](auto k) KSL_INLINED {
    using P = typename decltype(k)::scalar;
    const spatial_inertia<P> I = rotated(own_inertia(model, k), w.rotation[k]);
    articulated_inertia<P> A;
    algebra<P>::spatial_inertia_toArticulated(&I, &A);
    w.A.set(k, A);
  });
  for (int i = model.bodies - 1; i > 0; --i) {
    const body<scalar_of<T>> &b = model.body[i];
    const coordinate_physics<scalar_of<T>> *physics = physics_of(model, b);
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { eliminate_joint<K>(b, w, i, physics); });
  }
}

/// The frame that the options name: its origin, seen from the origin of the link's body, and its axes, both in the axes of the base.
template <class T> SE3<T> frame_about_body(const model_view<scalar_of<T>> &model,
                                           const forward_dynamics_workspace<T> &w, int link, const frame_options &how) {
  using A = algebra<T>;
  const int first = model.link[link].body;
  SE3<T> in_body = spread<T>(model.link[link].pose), frame;
  const vec3<T> offset = offset_of<T>(how);
  A::product_dv(&in_body, &offset, &in_body.t);
  const mat3x3<T> R = w.rotation[first];
  A::product_drv(&R, &in_body.t, &frame.t);
  A::product_drdr(&R, &in_body.R, &frame.R);
  if (in_own_frame(how))
    return frame;
  SE3<T> base = ground_pose<T>(model); // in the world
  vec3<T> origin = {T(0), T(0), T(0)}; // of the body, from that of the base
  for (int i = first; i > 0; i = model.body[i].parent)
    if (model.body[i].is_base)
      by_kind(model.body[i].kind,
              [&]<joint_kind K>() KSL_INLINED { base = composed(base, joint<K>::kept_pose(model.body[i], w.pose)); });
    else
      A::xpy_vv(&w.offset[i], &origin);
  if (how.axes == expressed_in::world) // the world's axes in those of the base
    frame.R = {base.R.m00, base.R.m01, base.R.m02, base.R.m10, base.R.m11,
               base.R.m12, base.R.m20, base.R.m21, base.R.m22};
  if (how.at == expressed_in::world) {
    A::product_drinvv(&base.R, &base.t, &frame.t);
    A::xpy_vv(&origin, &frame.t);
    A::vec3_invert(&frame.t);
  }
  return frame;
}

/// Unit wrenches on a frame, about its body's origin and in the axes of the base, in the order of the options.
template <class T> KSL_LANES wrench_columns<T> unit_wrenches(const SE3<T> &frame, const frame_options &how) {
  wrench_columns<T> f;
  const T o = T(0);
  const vec3<T> axes[3] = {axis_of<0>(frame.R), axis_of<1>(frame.R), axis_of<2>(frame.R)};
  for (int c = 0; c < 3; ++c) {
    coscrew<T> &force = f.column[how.angular_first ? 3 + c : c], &moment = f.column[how.angular_first ? c : 3 + c];
    force.lin = axes[c], moment = {{o, o, o}, axes[c]};
    algebra<T>::cross_vv(&frame.t, &axes[c], &force.ang);
  }
  return f;
}

/// Sends unit wrenches on n frames to the ground (2); n is at most the number of links.  receive(row in v, D⁻¹, u) is called for each
/// coordinate that they pass.  u (6 n) is Sᵀ f for the 6 columns of each frame, zero for frames that the coordinate doesn't carry.
/// A free joint transmits nothing: receive_free(i) is called when wrenches have reached body i on one, those with w.at[f] == i.
template <class T, class Receive, class ReceiveFree>
void propagate(const model_view<scalar_of<T>> &model, const operational_space_inertia_inverse_workspace<T> &w, int n,
               const int *links, const frame_options &how, Receive receive, ReceiveFree receive_free) {
  using A = algebra<T>;
  const forward_dynamics_workspace<T> &d = w.dynamics;
  for (int i = 0; i < model.bodies; ++i)
    w.carries[i] = i == 0;
  for (int f = 0; f < n; ++f) {
    w.at[f] = model.link[links[f]].body;
    w.wrench[f] = unit_wrenches(frame_about_body(model, d, links[f], how), how);
    for (int i = w.at[f]; !w.carries[i]; i = model.body[i].parent)
      w.carries[i] = true;
  }
  for (int i = model.bodies - 1; i > 0; --i) {
    if (!w.carries[i])
      continue;
    const body<scalar_of<T>> &b = model.body[i];
    bool free = false;
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      free = joint<K>::is_free;
      if constexpr (joint<K>::is_free) {
        receive_free(i);
      } else {
        for_coordinates_backwards<K>(b, [&](auto k) KSL_INLINED {
          const auto S = joint<K>::column(k, b, d.rotation, i);
          const coordinate_state<T> &s = d.coordinate[b.v_index + k];
          for (int f = 0; f < n; ++f)
            for (int c = 0; c < 6; ++c) {
              coscrew<T> &wrench = w.wrench[f].column[c];
              T u = T(0);
              if (w.at[f] == i) {
                u = S.effort(wrench); // (2)
                A::axpy_cc(-(s.D_inverse * u), &s.U, &wrench);
              }
              w.u[6 * f + c] = u;
            }
          receive(b.v_index + k, s.D_inverse, w.u);
        });
      }
    });
    for (int f = 0; f < n; ++f) {
      if (w.at[f] != i)
        continue;
      w.at[f] = free ? 0 : b.parent;
      for (coscrew<T> &wrench : w.wrench[f].column)
        A::product_CoAdtc(&d.offset[i], &wrench, &wrench);
    }
  }
}

/// Adds u D⁻¹ uᵀ to the lower triangle of a symmetric matrix (m, m).
template <class T> KSL_LANES void add_square(const T *u, const T &D_inverse, int m, T *matrix) {
  for (int r = 0; r < m; ++r) {
    const T x = D_inverse * u[r];
    for (int c = 0; c <= r; ++c)
      matrix[r * m + c] = matrix[r * m + c] + x * u[c];
  }
}

/// Adds fᵀ A⁻¹ f to Λ⁻¹ (3), for the wrenches that have reached the free joint of body i.  solution(frame, column, A⁻¹ f) is called with
/// the acceleration of each.
template <class T, class Solution>
void add_free(const operational_space_inertia_inverse_workspace<T> &w, int i, int n, T *matrix, Solution solution) {
  const int m = 6 * n;
  const articulated_inertia<T> A = w.dynamics.A[i];
  for (int f = 0; f < n; ++f)
    for (int r = 0; r < 6 && w.at[f] == i; ++r) {
      const screw<T> a = solve(A, w.wrench[f].column[r]); // A⁻¹ f
      solution(f, r, a);
      for (int g = 0; g <= f; ++g)
        for (int c = 0; c < (g == f ? r + 1 : 6) && w.at[g] == i; ++c) {
          T &x = matrix[(6 * f + r) * m + 6 * g + c];
          x = x + algebra<T>::dot_cs(&w.wrench[g].column[c], &a);
        }
    }
}

/// Copies the lower triangle of a matrix (m, m) to the upper one.
template <class T> void mirror_lower(int m, T *matrix) {
  for (int r = 0; r < m; ++r)
    for (int c = 0; c < r; ++c)
      matrix[c * m + r] = matrix[r * m + c];
}

/// Λ⁻¹ (3), after articulated_inertias.  keep(row in v, u) is called with u of each coordinate, and keep_free(body, frame, column, a)
/// with A⁻¹ f of bodies on free joints.
template <class T, class Keep, class KeepFree>
void inertia_inverse(const model_view<scalar_of<T>> &model, const operational_space_inertia_inverse_workspace<T> &w,
                     int n, const int *links, const frame_options &how, T *inverse, Keep keep, KeepFree keep_free) {
  const int m = 6 * n;
  for (int i = 0; i < m * m; ++i)
    inverse[i] = T(0);
  propagate(
      model, w, n, links, how,
      [&](int row, const T &D_inverse, const T *u) {
        add_square(u, D_inverse, m, inverse); // (3)
        keep(row, u);
      },
      [&](int i) { add_free(w, i, n, inverse, [&](int f, int c, const screw<T> &a) { keep_free(i, f, c, a); }); });
  mirror_lower(m, inverse);
}

/// Λ⁻¹ = J M⁻¹ Jᵀ (n, 6, n, 6), symmetric, for q (nq): the rates of all twists for a unit wrench on each frame.  n is at most the
/// number of links.  O(bodies + n² depth); depth: how many coordinates carry any of the frames.
template <class T> void operational_space_inertia_inverse(const model_view<scalar_of<T>> &model,
                                                          const operational_space_inertia_inverse_workspace<T> &w,
                                                          const T *q, int n, const int *links, const frame_options &how,
                                                          T *inverse) {
  articulated_inertias(model, w.dynamics, q);
  inertia_inverse(model, w, n, links, how, inverse, [](int, const T *) {}, [](int, int, int, const screw<T> &) {});
}

/// In a matrix with a diagonal of ones, a row whose pivot is below this counts as dependent on the rows before.
template <class T> inline T rank_tolerance() { return T(of_precision<scalar_of<T>>(1e-10, 1e-4)); }

/// Inverts a symmetric, positive semidefinite matrix (m, m) in place, and returns its rank.  The matrix is scaled to a diagonal of
/// ones and swept (Goodnight, American Statistician 33 (1979) 149), largest pivots first.  When no pivot above rank_tolerance is left,
/// the remaining rows and columns are set to zero.  Which pivot is the largest may differ between lanes, so it is chosen by factors
/// that are one or zero.  memory (4 m).
template <class T> T invert_semidefinite(int m, T *A, T *memory) {
  const T zero = T(0), one = T(1), tolerance = rank_tolerance<T>();
  T *const scale = memory, *const left = memory + m, *const column = memory + 2 * m, *const chosen = memory + 3 * m;
  T rank = zero, largest = zero;
  for (int i = 0; i < m; ++i)
    largest = math<T>::select(A[i * m + i] > largest, A[i * m + i], largest);
  for (int i = 0; i < m; ++i) { // a diagonal element that is this small is zero but for rounding
    const auto some = A[i * m + i] > tolerance * tolerance * largest;
    scale[i] = math<T>::select(some, one / math<T>::sqrt(math<T>::select(some, A[i * m + i], one)), zero);
    left[i] = one;
  }
  for (int i = 0; i < m; ++i)
    for (int j = 0; j <= i; ++j)
      A[i * m + j] = A[i * m + j] * scale[i] * scale[j];
  for (int k = 0; k < m; ++k) {
    T d = -one, which = zero;
    for (int i = 0; i < m; ++i) {
      const T candidate = math<T>::select(left[i] > zero, A[i * m + i], -one);
      which = math<T>::select(candidate > d, T(static_cast<scalar_of<T>>(i)), which);
      d = math<T>::select(candidate > d, candidate, d);
    }
    const T independent = math<T>::select(d > tolerance, one, zero);
    const T inverse = independent / math<T>::select(d > tolerance, d, one);
    rank = rank + independent;
    for (int i = 0; i < m; ++i) {
      chosen[i] = math<T>::select(which == T(static_cast<scalar_of<T>>(i)), independent, zero);
      left[i] = left[i] - chosen[i];
    }
    for (int i = 0; i < m; ++i) { // the pivot's column, less one in the pivot's row
      column[i] = -chosen[i];
      for (int j = 0; j < m; ++j)
        column[i] = column[i] + chosen[j] * A[i > j ? i * m + j : j * m + i];
    }
    for (int i = 0; i < m; ++i) {
      const T x = inverse * column[i];
      for (int j = 0; j <= i; ++j)
        A[i * m + j] = A[i * m + j] - x * column[j];
      A[i * m + i] = A[i * m + i] - (chosen[i] + chosen[i]);
    }
  }
  for (int i = 0; i < m; ++i) // swept rows and columns hold −A⁻¹; left is one for the others
    scale[i] = scale[i] * (one - left[i]);
  for (int i = 0; i < m; ++i)
    for (int j = 0; j <= i; ++j)
      A[i * m + j] = zero - A[i * m + j] * scale[i] * scale[j];
  mirror_lower(m, A);
  return rank;
}

/// Λ (n, 6, n, 6), symmetric, and the rank of Λ⁻¹, for q (nq).  Where the frames can't move in every direction, Λ⁻¹ is singular:
/// as many rows of it as its rank are inverted, and the others are zero in Λ.
template <class T>
void operational_space_inertia(const model_view<scalar_of<T>> &model, const operational_space_inertia_workspace<T> &w,
                               const T *q, int n, const int *links, const frame_options &how, T *inertia, T *rank) {
  operational_space_inertia_inverse(model, w, q, n, links, how, inertia);
  *rank = invert_semidefinite(6 * n, inertia, w.u);
}

/// Computes column `column` of M⁻¹ Jᵀ (nv, m): the accelerations under a unit wrench on a frame, by (3) of forward_dynamics.hpp.  On
/// entry the column has what inertia_inverse keeps, u of each coordinate and A⁻¹ f of free joints.
template <class T>
void accelerate_column(const model_view<scalar_of<T>> &model, const forward_dynamics_workspace<T> &w, int m, int column,
                       T *matrix) {
  using A = algebra<T>;
  w.acceleration[0] = {{T(0), T(0), T(0)}, {T(0), T(0), T(0)}};
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
      T *const x = matrix + b.v_index * m + column;
      screw<T> a;
      A::product_Adtinvs(&w.offset[i], &w.acceleration[b.parent], &a);
      if constexpr (joint<K>::is_free) {
        const mat3x3<T> R = w.rotation[i];
        w.acceleration[i] = {{x[0], x[m], x[2 * m]}, {x[3 * m], x[4 * m], x[5 * m]}};
        A::subtract_ss(&w.acceleration[i], &a, &a);
        A::product_Adrinvs(&R, &a, &a);
        x[0] = a.lin.x, x[m] = a.lin.y, x[2 * m] = a.lin.z;
        x[3 * m] = a.ang.x, x[4 * m] = a.ang.y, x[5 * m] = a.ang.z;
      } else {
        for_coordinates<K>(b, [&](auto k) KSL_INLINED {
          const coordinate_state<T> &s = w.coordinate[b.v_index + k];
          const T acceleration = s.D_inverse * (x[k * m] - A::dot_cs(&s.U, &a));
          joint<K>::column(k, b, w.rotation, i).add(acceleration, a);
          x[k * m] = acceleration;
        });
        w.acceleration[i] = a;
      }
    });
  }
}

/// Dynamics at n frames for q (nq) and v (nv), under gravity and external wrenches: F = Λ x'' + p for wrenches F on the frames, no
/// efforts, and x'' the rates of the numbers of their twists.
///
/// inertia Λ (n, 6, n, 6) and its rank as above.  bias p (n, 6) = −Λ x''_free = Λ (J M⁻¹ b − (rate of J) v), b the bias of the
/// joints: the wrenches under which the twists stay as they are.  pseudo_inverse (nv, n, 6) = M⁻¹ Jᵀ Λ, the accelerations a with
/// J a = x'' that need efforts Jᵀ F only (Khatib 1987, eq. (58)).  O(n bodies) and O(n² depth + n³).
template <class T> void operational_space(const model_view<scalar_of<T>> &model,
                                          const operational_space_workspace<T> &w, const T *q, const T *v, int n,
                                          const int *links, const frame_options &how,
                                          const external_wrenches<T> &external, T *inertia, T *bias, T *pseudo_inverse,
                                          T *rank) {
  const operational_space_inertia_inverse_workspace<T> &p = w.propagation;
  const int m = 6 * n;
  for (int i = 0; i < model.nv; ++i)
    w.zero[i] = T(0);
  for (int i = 0; i < model.nv * m; ++i)
    pseudo_inverse[i] = T(0);
  forward_dynamics(model, p.dynamics, q, v, w.zero, external, w.acceleration); // without efforts: x''_free follows
  inertia_inverse(
      model, p, n, links, how, inertia,
      [&](int row, const T *u) {
        for (int c = 0; c < m; ++c)
          pseudo_inverse[row * m + c] = u[c];
      },
      [&](int i, int f, int c, const screw<T> &a) {
        T *const x = pseudo_inverse + model.body[i].v_index * m + 6 * f + c;
        x[0] = a.lin.x, x[m] = a.lin.y, x[2 * m] = a.lin.z;
        x[3 * m] = a.ang.x, x[4 * m] = a.ang.y, x[5 * m] = a.ang.z;
      });
  for (int c = 0; c < m; ++c)
    accelerate_column(model, p.dynamics, m, c, pseudo_inverse);
  *rank = invert_semidefinite(m, inertia, p.u);
  const auto times_inertia = [&](T *row, const T &factor) {
    for (int c = 0; c < m; ++c) {
      T sum = T(0);
      for (int k = 0; k < m; ++k)
        sum = sum + row[k] * inertia[k * m + c];
      p.u[c] = factor * sum;
    }
    for (int c = 0; c < m; ++c)
      row[c] = p.u[c];
  };
  for (int i = 0; i < model.nv; ++i) // M⁻¹ Jᵀ Λ, row by row
    times_inertia(pseudo_inverse + i * m, T(1));
  frame_options rate = how;
  rate.kind = acceleration_kind::rate;
  frame_accelerations(model, w.kinematics, q, v, w.acceleration, n, links, rate, bias);
  times_inertia(bias, T(-1)); // p = −Λ x''_free
}

} // namespace KSL_ISA
} // namespace ksl
