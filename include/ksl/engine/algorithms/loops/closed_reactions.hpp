// KSL: inverse dynamics of mechanisms with loops, with the wrenches through their joints, by the plan of the model (loop_view.hpp).
//
// Equations that follow from others have multipliers λ with Kᵀ λ = 0: patterns of wrenches that balance and that rigid bodies leave open.  Of
// all wrenches that balance, those are taken that have the least norm, or store the least energy in the joints that have compliances
// (src/engine/loops/closed_state.hpp says more, and computes states where the patterns nearly depend on each other or some store no energy).
#pragma once

#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/engine/algorithms/loops/closed_dynamics.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct closed_inverse_dynamics_with_reactions_workspace {
  closed_inverse_dynamics_workspace<T> closed;
  array_of<SE3<T>> in_world;
  array_of<coscrew<T>> link_wrench;
  /// the wrench of each loop's joint on its successor, at its frame there and in its axes
  array_of<coscrew<T>> of_loop;
  /// Wrenches through all joints that are crossed, then those of loops: of the motion, and of each redundant equation.
  array_of<coscrew<T>> balanced;
  array_of<T> inverse_square; ///< of each pattern

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    const auto *loops = model.loops;
    const int redundant = loops ? loops->rows - loops->pivots : 0;
    closed.lay_out(memory, model);
    closed.inverse.wrench.with_ground = true;
    in_world.lay_out(memory, model.bodies);
    link_wrench.lay_out(memory, model.links);
    of_loop.lay_out(memory, loops ? loops->loops : 0);
    balanced.lay_out(memory, redundant > 0 ? (redundant + 1) * (loops->crossings + loops->loops) : 0);
    inverse_square.lay_out(memory, redundant);
  }
  KSL_LANES reactions_workspace<T> tree() const { return {closed.inverse, in_world, link_wrench}; }
};

/// The wrench of a loop's joint on its successor, at its frame there and in its axes.
template <class T>
KSL_LANES coscrew<T> wrench_of_loop(const closing_joint<scalar_of<T>> &joint, const vec3<T> &normal,
                                    const T *multipliers) {
  const T o(scalar_of<T>(0));
  coscrew<T> f = {{o, o, o}, {o, o, o}};
  for (int i = 0; i < joint.forces + joint.moments; ++i) {
    const T &size = multipliers[joint.first_row + i];
    vec3<T> &sum = i < joint.forces ? f.lin : f.ang;
    switch (joint.along[i]) {
    case 0: sum.x = sum.x + size; break;
    case 1: sum.y = sum.y + size; break;
    case 2: sum.z = sum.z + size; break;
    default:
      const vec3<T> d = direction_of<T>(joint, normal, i), turn = spread<T>(joint.turn);
      algebra<T>::axpy_vv(size, &d, &sum);
      if (i == joint.mixed)
        algebra<T>::axpy_vv(size, &turn, &f.ang);
    }
  }
  return f;
}

/// Adds a wrench, given as above, to those through the joints of the tree that it crosses: along the way from either end to the body where
/// both meet.  Beyond it they cancel.  add(place, wrench) is called for each, with the wrench about the origin of the joint's body, in its axes.
template <class T, class Add>
KSL_LANES void for_crossed(const model_view<scalar_of<T>> &model, const loop_equations_workspace<T> &equations,
                           int loop, coscrew<T> f, Add add) {
  using A = algebra<T>;
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const closing_joint<S> &joint = loops.joint[loop];
  const SE3<T> at = equations.joint[loop];
  const bool has_moment = joint.moments > 0 || joint.mixed >= 0;
  A::product_drv(&at.R, &f.lin, &f.lin);
  if (has_moment)
    A::product_drv(&at.R, &f.ang, &f.ang);
  for (int k = joint.through_begin; k < joint.through_end; ++k) {
    const int place = loops.through[k], body = model.link[loops.crossed[place]].body;
    const vec3<T> o = equations.world.origin[body], arm = {at.t.x - o.x, at.t.y - o.y, at.t.z - o.z};
    const mat3x3<T> R = equations.world.rotation[body];
    coscrew<T> here = f;
    vec3<T> moment;
    A::cross_vv(&arm, &f.lin, &moment);
    if (has_moment)
      A::xpy_vv(&moment, &here.ang);
    else
      here.ang = moment;
    A::product_drinvv(&R, &here.lin, &here.lin);
    A::product_drinvv(&R, &here.ang, &here.ang);
    if (k < joint.through_middle) // what the loop's joint exerts, other joints need not
      A::coscrew_invert(&here);
    add(place, here);
  }
}

/// The wrench through a joint of the tree that loops cross, about the origin of its body and in its axes.
template <class T> struct crossed_wrench {
  const model_view<scalar_of<T>> &model;
  const closed_inverse_dynamics_with_reactions_workspace<T> &w;
  const int link;
  const bool welded = is_welded(model, link);

  KSL_LANES coscrew<T> get() const {
    return welded ? w.link_wrench[link] : w.closed.inverse.wrench.through[model.link[link].body];
  }
  KSL_LANES void set(const coscrew<T> &f) const {
    if (welded)
      w.link_wrench[link] = f;
    else
      w.closed.inverse.wrench.through.set(model.link[link].body, f);
  }
  /// Moves a wrench from the body's origin to that of the joint, or back.
  KSL_LANES void move(coscrew<T> &f, bool to_joint) const {
    if (!welded)
      return;
    vec3<T> arm = spread<T>(model.link[link].pose.t);
    if (to_joint)
      algebra<T>::vec3_inverted(&arm, &arm);
    vec3<T> moment;
    algebra<T>::cross_vv(&arm, &f.lin, &moment);
    algebra<T>::xpy_vv(&moment, &f.ang);
  }
};

template <class T> KSL_LANES void add_scaled(const T &x, const coscrew<T> &f, coscrew<T> &sum) {
  algebra<T>::axpy_vv(x, &f.lin, &sum.lin);
  algebra<T>::axpy_vv(x, &f.ang, &sum.ang);
}

template <class T> KSL_LANES T sum_of_products(const coscrew<T> &x, const coscrew<T> &y) {
  return algebra<T>::dot_vv(&x.lin, &y.lin) + algebra<T>::dot_vv(&x.ang, &y.ang);
}

/// C x, of a joint's compliance.
template <class T>
KSL_LANES coscrew<T> give_way(const joint_compliance_view<scalar_of<T>> &C, const coscrew<T> &f) {
  const T six[] = {f.lin.x, f.lin.y, f.lin.z, f.ang.x, f.ang.y, f.ang.z};
  T moved[6];
  for (int i = 0; i < 6; ++i) {
    moved[i] = T(C.matrix[i][0]) * six[0];
    for (int j = 1; j < 6; ++j)
      moved[i] = moved[i] + T(C.matrix[i][j]) * six[j];
  }
  return {{moved[0], moved[1], moved[2]}, {moved[3], moved[4], moved[5]}};
}

/// x · y over the joints at which a pattern has wrenches; or x · C y, if joints have compliances.
template <class T>
KSL_LANES T sum_of_products(const loop_view<scalar_of<T>> &loops, const loop_pattern &at, const coscrew<T> *x,
                            const coscrew<T> *y) {
  T sum(scalar_of<T>(0));
  for (int k = at.places_begin; k < at.places_end; ++k) {
    const int place = loops.list[k];
    if (loops.compliances == 0)
      sum = sum + sum_of_products(x[place], y[place]);
    else if (const int c = loops.compliance_of[place]; c >= 0)
      sum = sum + sum_of_products(x[place], give_way(loops.compliance[c], y[place]));
  }
  return sum;
}

/// The pattern of a redundant equation: wrenches through all joints that are crossed, and those of loops.
template <class T>
KSL_LANES void set_pattern(const model_view<scalar_of<T>> &model,
                           const closed_inverse_dynamics_with_reactions_workspace<T> &w, int redundant,
                           coscrew<T> *pattern) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const T o(S(0));
  T *const lambda = &w.closed.multiplier[0];
  for (int i = 0; i < loops.rows; ++i)
    lambda[i] = o;
  lambda[loops.redundant[redundant]] = T(S(1));
  back_through_lower(loops, w.closed.equations, lambda);
  const loop_pattern &at = loops.pattern[redundant];
  for (int k = at.places_begin; k < at.places_end; ++k)
    pattern[loops.list[k]] = {{o, o, o}, {o, o, o}};
  for (int k = at.loops_begin; k < at.loops_end; ++k) {
    const int l = loops.list[k];
    pattern[loops.crossings + l] = wrench_of_loop(loops.joint[l], w.closed.equations.normal[l], lambda);
    for_crossed(model, w.closed.equations, l, pattern[loops.crossings + l],
                [&](int place, const coscrew<T> &f) KSL_INLINED { algebra<T>::xpy_cc(&f, &pattern[place]); });
  }
  for (int k = at.places_begin; loops.crosses_welds && k < at.places_end; ++k)
    if (const int place = loops.list[k]; place < loops.crossings)
      crossed_wrench<T>{model, w, loops.crossed[place]}.move(pattern[place], true);
}

/// Rounding of the elements of a pattern, relative to its norm.
template <class S> inline S of_elements() { return of_precision<S>(1e-11, 1e-4); }

/// The energy that rounding of its elements may give a pattern; 0 where norms decide.
template <class T>
KSL_LANES T energy_of_rounding(const loop_view<scalar_of<T>> &loops, const loop_pattern &at,
                               const coscrew<T> *pattern) {
  using S = scalar_of<T>;
  S most(0);
  for (int c = 0; c < loops.compliances; ++c)
    for (int i = 0; i < 6; ++i)
      most = loops.compliance[c].matrix[i][i] > most ? loops.compliance[c].matrix[i][i] : most;
  T square(S(0));
  for (int k = at.places_begin; loops.compliances > 0 && k < at.places_end; ++k)
    square = square + sum_of_products(pattern[loops.list[k]], pattern[loops.list[k]]);
  return square * T(most * of_elements<S>() * of_elements<S>());
}

/// Replaces wrenches that balance by those of least norm or energy: Gram and Schmidt's method.  Returns NaN where patterns nearly depend on each
/// other, or store no energy, else 0.
template <class T>
KSL_LANES T take_off_patterns(const model_view<scalar_of<T>> &model,
                              const closed_inverse_dynamics_with_reactions_workspace<T> &w) {
  using S = scalar_of<T>;
  const loop_view<S> &loops = *model.loops;
  const int n = loops.crossings + loops.loops, redundant = loops.rows - loops.pivots;
  coscrew<T> *const found = &w.balanced[0];
  for (int k = 0; k < loops.crossings; ++k) {
    const crossed_wrench<T> of = {model, w, loops.crossed[k]};
    found[k] = of.get();
    of.move(found[k], true);
  }
  for (int l = 0; l < loops.loops; ++l)
    found[loops.crossings + l] = w.of_loop[l];
  T fault(S(0));
  const auto take_off = [&](int r, coscrew<T> *from) KSL_INLINED {
    const loop_pattern &at = loops.pattern[r];
    const coscrew<T> *const pattern = found + (r + 1) * n;
    const T along = -(sum_of_products(loops, at, pattern, from) * w.inverse_square[r]);
    for (int k = at.places_begin; k < at.places_end; ++k)
      add_scaled(along, pattern[loops.list[k]], from[loops.list[k]]);
  };
  for (int r = 0; r < redundant; ++r) {
    const loop_pattern &at = loops.pattern[r];
    coscrew<T> *const pattern = found + (r + 1) * n;
    set_pattern(model, w, r, pattern);
    const bool alone = at.earlier_begin == at.earlier_end;
    const T least = energy_of_rounding(loops, at, pattern);
    const T whole = alone ? T(S(0)) : sum_of_products(loops, at, pattern, pattern);
    for (int k = at.earlier_begin; k < at.earlier_end; ++k)
      take_off(loops.list[k], pattern);
    const T left = sum_of_products(loops, at, pattern, pattern);
    const T needed = T(least_share<S>()) * whole + least;
    fault = fault + fault_beyond(math<T>::select(left > needed, T(S(0)), T(S(1))), T(S(0.5)));
    w.inverse_square[r] = T(S(1)) / left;
    take_off(r, found);
  }
  for (int k = 0; k < loops.crossings; ++k) {
    const crossed_wrench<T> of = {model, w, loops.crossed[k]};
    of.move(found[k], false);
    of.set(found[k]);
  }
  for (int l = 0; l < loops.loops; ++l)
    w.of_loop[l] = found[loops.crossings + l];
  return fault;
}

/// Writes the wrench through a loop's joint; all of it is constraint.
template <class T>
KSL_LANES void put_loop(const model_view<scalar_of<T>> &model,
                        const closed_inverse_dynamics_with_reactions_workspace<T> &w, const reaction_request &request,
                        bool moved, int loop, T *out) {
  using A = algebra<T>;
  const T o(scalar_of<T>(0));
  coscrew<T> f = w.of_loop[loop];
  if (request.part == wrench_part::actuation || request.part == wrench_part::coupling)
    f = {{o, o, o}, {o, o, o}};
  if (moved) {
    const closing_joint<scalar_of<T>> &joint = model.loops->joint[loop];
    const SE3<T> body = w.in_world[joint.successor], on_body = spread<T>(joint.on_successor);
    SE3<T> pose, D;
    A::product_dd(&body, &on_body, &pose);
    const SE3<T> target = requested_frame(model, w.in_world, request, pose);
    A::product_dinvd(&target, &pose, &D);
    A::product_CoAdc(&D, &f, &f);
  }
  if (request.on == wrench_side::parent)
    A::coscrew_invert(&f);
  put_reaction(f, request.angular_first, out);
}

/// Reactions of the requested joints into out (n, 6), after inverse_dynamics_with_reactions; joints of loops are numbered from model.links on.
template <class T>
void reactions(const model_view<scalar_of<T>> &model, const closed_inverse_dynamics_with_reactions_workspace<T> &w,
               const external_wrenches<T> &external, const reaction_request &request, T *out) {
  bool any_welded = false;
  for (int k = 0; k < request.n; ++k)
    any_welded |= request.link[k] < model.links && is_welded(model, request.link[k]);
  if (any_welded && !model.loops->crosses_welds)
    link_wrenches(model, w.tree(), external);
  const bool moved = !in_joint_frame(request);
  if (moved)
    compose_poses(model, w.closed.inverse.pose, w.in_world);
  for (int k = 0; k < request.n; ++k)
    if (request.link[k] >= model.links)
      put_loop(model, w, request, moved, request.link[k] - model.links, out + 6 * k);
    else
      put_part(model, w.tree(), request, moved, request.link[k], out + 6 * k);
}

/// Efforts tau (nv) of the drives, and the requested reactions out (n, 6).
template <class T>
void inverse_dynamics_with_reactions(const model_view<scalar_of<T>> &model,
                                     const closed_inverse_dynamics_with_reactions_workspace<T> &w, const T *q,
                                     const T *v, const T *a, const external_wrenches<T> &external, T *tau,
                                     const reaction_request &request, T *out) {
  const loop_view<scalar_of<T>> &loops = *model.loops;
  closed_inverse_dynamics(model, w.closed, q, v, a, external, tau);
  T *const lambda = &w.closed.multiplier[0];
  back_through_lower(loops, w.closed.equations, lambda);
  if (loops.crosses_welds)
    link_wrenches(model, w.tree(), external);
  for (int l = 0; l < loops.loops; ++l) {
    w.of_loop[l] = wrench_of_loop(loops.joint[l], w.closed.equations.normal[l], lambda);
    for_crossed(model, w.closed.equations, l, w.of_loop[l], [&](int place, const coscrew<T> &f) KSL_INLINED {
      const crossed_wrench<T> of = {model, w, loops.crossed[place]};
      coscrew<T> sum = of.get();
      algebra<T>::xpy_cc(&f, &sum);
      of.set(sum);
    });
  }
  if (loops.rows > loops.pivots) {
    const T fault = take_off_patterns(model, w);
    for (int i = 0; i < model.nv; ++i)
      tau[i] = tau[i] + fault;
  }
  reactions(model, w, external, request, out);
}

} // namespace KSL_ISA
} // namespace ksl
