// KSL: inverse dynamics of mechanisms with loops, with the wrenches through their joints, by the plan of the model (loop_view.hpp).
#pragma once

#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/engine/algorithms/loops/closed_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct closed_inverse_dynamics_with_reactions_workspace {
  closed_inverse_dynamics_workspace<T> closed;
  array_of<SE3<T>> in_world;
  array_of<T> wrenches; ///< (loops, 2, 6) as of closed_inverse_dynamics

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    closed.lay_out(memory, model);
    in_world.lay_out(memory, model.bodies);
    wrenches.lay_out(memory, model.loops ? 12 * model.loops->loops : 0);
  }
};

/// Adds the wrenches of the loops' joints to those through the joints of the tree, which inverse dynamics has found: along the way from
/// either end to the body where both meet.  Beyond it they cancel.
template <class T>
KSL_LANES void add_wrenches_of_loops(const model_view<scalar_of<T>> &model,
                                     const closed_inverse_dynamics_with_reactions_workspace<T> &w) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const loop_equations_workspace<T> &equations = w.closed.equations;
  for (int l = 0; l < loops.loops; ++l) {
    const closing_joint<S> &joint = loops.joint[l];
    const SE3<T> at = equations.joint[l];
    const T *const x = &w.wrenches[12 * l];
    coscrew<T> f = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
    A::product_drv(&at.R, &f.lin, &f.lin);
    A::product_drv(&at.R, &f.ang, &f.ang);
    const auto add = [&](int begin, int end, const T &sign) KSL_INLINED {
      for (int c = begin, last = 0; c < end; ++c) {
        const int body = loops.column[c].body;
        if (body == last)
          continue;
        last = body;
        const vec3<T> o = equations.world.origin[body], arm = {at.t.x - o.x, at.t.y - o.y, at.t.z - o.z};
        const mat3x3<T> R = equations.world.rotation[body];
        coscrew<T> here = f;
        vec3<T> moment;
        A::cross_vv(&arm, &f.lin, &moment);
        A::xpy_vv(&moment, &here.ang);
        A::product_drinvv(&R, &here.lin, &here.lin);
        A::product_drinvv(&R, &here.ang, &here.ang);
        coscrew<T> through = w.closed.inverse.wrench[body];
        A::axpy_vv(sign, &here.lin, &through.lin);
        A::axpy_vv(sign, &here.ang, &through.ang);
        w.closed.inverse.wrench.set(body, through);
      }
    };
    add(joint.columns_begin, joint.columns_middle, T(S(-1))); // what the loop's joint exerts, other joints need not
    add(joint.columns_middle, joint.columns_end, T(S(1)));
  }
}

/// Reactions of the requested joints into out (n, 6), after inverse_dynamics_with_reactions.  Joints of the tree must move; those of loops,
/// numbered from model.links on, are requested at the joint, in its axes.
template <class T>
void reactions(const model_view<scalar_of<T>> &model, const closed_inverse_dynamics_with_reactions_workspace<T> &w,
               const external_wrenches<T> &external, const reaction_request &request, T *out) {
  const reactions_workspace<T> tree = {w.closed.inverse, w.in_world, {}};
  const bool none = request.part == wrench_part::actuation || request.part == wrench_part::coupling;
  const T sign(scalar_of<T>(none ? 0 : request.on == wrench_side::parent ? -1 : 1));
  for (int k = 0; k < request.n;) {
    if (request.link[k] >= model.links) {
      const T *const x = &w.wrenches[12 * (request.link[k] - model.links)];
      for (int c = 0; c < 6; ++c)
        out[6 * k + (request.angular_first ? (c + 3) % 6 : c)] = sign * x[c] + T(scalar_of<T>(0));
      ++k;
      continue;
    }
    reaction_request of_tree = request;
    of_tree.link = request.link + k, of_tree.n = 0;
    while (k + of_tree.n < request.n && request.link[k + of_tree.n] < model.links)
      ++of_tree.n;
    reactions(model, tree, external, of_tree, out + 6 * k);
    k += of_tree.n;
  }
}

/// Efforts tau (nv) of the drives, and the requested reactions out (n, 6).
template <class T>
void inverse_dynamics_with_reactions(const model_view<scalar_of<T>> &model,
                                     const closed_inverse_dynamics_with_reactions_workspace<T> &w, const T *q,
                                     const T *v, const T *a, const external_wrenches<T> &external, T *tau,
                                     const reaction_request &request, T *out) {
  closed_inverse_dynamics(model, w.closed, q, v, a, external, tau, &w.wrenches[0]);
  add_wrenches_of_loops(model, w);
  reactions(model, w, external, request, out);
}

} // namespace KSL_ISA
} // namespace ksl
