// KSL: the first derivatives of reactions, in the axes, about the point and of the part that are asked for.
//
// f is the wrench through a joint; I, 2 B, Ψ̇, Ψ̈ are those of wrench_derivatives.hpp, I and B summed over the joint's subtree.  In axes
// and about a point that move with the joint, f changes with a coordinate k
//
//     that carries the joint, or is its own:   by q:  2 B Ψ̇ + I Ψ̈,   by v:  2 B S + I (Ψ̇ + Ṡ),   by a:  I S;    (1)
//     that the joint carries:                  as the wrench through joint k does (wrench_derivatives.hpp (3));    (2)
//     any other:                               not at all.
//
// In (1) S ×* f is missing: a position that carries the joint turns f and the axes alike.  Where other axes or another point are
// asked for, the motion x of the joint's frame relative to them adds x ×* f.                                       (3)
#pragma once

#include "ksl/engine/algorithms/derivatives/held_in_world.hpp"
#include "ksl/engine/algorithms/derivatives/wrench_derivatives.hpp"
#include "ksl/engine/algorithms/inverse/reactions.hpp"
#include "ksl/engine/steps/symmetric_matrix.hpp"

namespace ksl {
inline namespace KSL_ISA {

template <class T> struct reactions_derivatives_workspace {
  wrench_derivatives_workspace<T> wrenches;
  /// dynamics of each link and all that it carries; used if a fixed joint is asked for
  array_of<subtree_dynamics<T>> link;

  KSL_LANES void lay_out(arena &memory, const model_view<scalar_of<T>> &model) {
    wrenches.lay_out(memory, model);
    link.lay_out(memory, model.links);
  }
};

/// Pose of a link's frame in the common axes of any tree, also of another one than the link's own.
template <class T> inline SE3<T> link_in_other_tree(const model_view<scalar_of<T>> &model,
                                                    const wrench_derivatives_workspace<T> &w, int link, int tree) {
  SE3<T> D = link_in_tree(model, w, link);
  const int own = tree_of(model, model.link[link].body);
  if (own == tree)
    return D;
  const SE3<T> from = tree_pose(model, w, own), to = tree_pose(model, w, tree);
  algebra<T>::product_dd(&from, &D, &D);
  algebra<T>::product_dinvd(&to, &D, &D);
  return D;
}

/// Pose of the frame that a reaction is asked for in, in the common axes of a tree.
template <class T> inline SE3<T> requested_frame(const model_view<scalar_of<T>> &model,
                                                 const wrench_derivatives_workspace<T> &w,
                                                 const reaction_request &request, int link, int tree) {
  using A = algebra<T>;
  SE3<T> target = link_in_other_tree(model, w, link, tree), world;
  if (request.at == wrench_frame::joint) {
    const vec3<T> offset = {T(request.offset[0]), T(request.offset[1]), T(request.offset[2])};
    A::product_dv(&target, &offset, &target.t);
  } else if (request.at == wrench_frame::link) {
    target.t = link_in_other_tree(model, w, request.at_link, tree).t;
  }
  if (request.axes == wrench_frame::link)
    target.R = link_in_other_tree(model, w, request.axes_link, tree).R;
  if (request.at == wrench_frame::world || request.axes == wrench_frame::world) {
    const SE3<T> D = tree_pose(model, w, tree);
    A::SE3_inverted(&D, &world);
    if (request.at == wrench_frame::world)
      target.t = world.t;
    if (request.axes == wrench_frame::world)
      target.R = world.R;
  }
  return target;
}

/// Do the requested axes and point move with the joint?
inline bool moves_with_joint(const reaction_request &request) {
  return request.at == wrench_frame::joint && request.axes == wrench_frame::joint;
}

/// Sets the dynamics of each link and all that it carries, fixed joints included.  The trees on links of the ground have different
/// common axes, so that only their wrenches are added to those of the ground's links, in the world's axes.
template <class T> void link_dynamics(const model_view<scalar_of<T>> &model,
                                      const reactions_derivatives_workspace<T> &w,
                                      const external_wrenches<T> &external) {
  using A = algebra<T>;
  const wrench_derivatives_workspace<T> &d = w.wrenches;
  for (int l = 0; l < model.links; ++l) {
    const int i = model.link[l].body;
    w.link[l] = body_dynamics(spread<T>(model.link[l].inertia), d.rotation[i], d.origin[i], d.motion[i]);
  }
  for (int e = 0; e < external.n; ++e) {
    const coscrew<T> f = external_in_common_axes(model, d, external, e);
    A::nxpy_cc(&f, &w.link[external.link[e]].f);
  }
  for (int l = model.links - 1; l > 0; --l) {
    const int parent = model.link[l].parent;
    if (model.link[l].body > 0 && model.link[parent].body == 0) {
      const SE3<T> D = tree_pose(model, d, tree_of(model, model.link[l].body));
      coscrew<T> f;
      A::product_CoAdc(&D, &w.link[l].f, &f);
      A::xpy_cc(&f, &w.link[parent].f);
    } else {
      add_dynamics(w.link[l], w.link[parent]);
    }
  }
}

/// The coordinates that a link carries.  Those of the joint that carries the link are not among them.
template <class S> inline coordinate_run carried_by(const model_view<S> &model, int link) {
  const ksl::link<S> &l = model.link[link];
  const body<S> &b = model.body[l.body];
  if (l.carried_by_moving_joint)
    return {b.v_index + b.nv, l.body > 0 ? b.v_end : model.nv};
  int end = link + 1; // links are in depth-first order
  while (end < model.links && model.link[end].parent >= link)
    ++end;
  coordinate_run run = {0, 0};
  for (int i = l.body + 1; i < model.bodies; ++i) {
    const bool inside =
        !(model.body[i].link >= 0); // the massless body of a universal joint; the joint's link is on the next body
    const int child = model.body[i + inside].link;
    if (child > link && child < end)
      run = {run.end > 0 ? run.first : model.body[i].v_index, model.body[i].v_index + model.body[i].nv};
  }
  return run;
}

/// The derivatives of a wrench by one coordinate of q, v and a.
template <class T> struct wrench_by { coscrew<T> q, v, a; };

/// The rows of one joint in the three results, each (6, nv).
template <class T> struct reaction_rows_of_joint {
  T *by_q, *by_v, *by_a;
  index n;
  bool angular_first, negative;

  /// Calls step<P>(k) for the coordinates [first, end), as many at a time as P has lanes, and stores the wrench_by<P> that it returns.
  template <class Step> KSL_LANES void set(int first, int end, Step step) const {
    if constexpr (is_number<T>) {
      for (int k = first; k < end; k += native_lanes<T>)
        put<native_pack<T>>(k, end - k, step.template operator()<native_pack<T>>(k));
    } else {
      for (int k = first; k < end; ++k)
        put<T>(k, 1, step.template operator()<T>(k));
    }
  }
  /// The calls of `set` for the derivatives by q alone.
  template <class Step> KSL_LANES void set_by_q(int first, int end, Step step) const {
    if constexpr (is_number<T>) {
      for (int k = first; k < end; k += native_lanes<T>)
        put_one(step.template operator()<native_pack<T>>(k), by_q, k, end - k);
    } else {
      for (int k = first; k < end; ++k)
        put_one(step.template operator()<T>(k), by_q, k, 1);
    }
  }
  /// Writes zeros to all columns, row after row.  Memory that is written in order is fetched ahead, and most stores are aligned.
  KSL_LANES void clear() const {
    T *const results[] = {by_q, by_v, by_a};
    for (T *rows : results)
      if constexpr (is_number<T>)
        clear_numbers(rows, 6 * n);
      else
        for (index k = 0; k < 6 * n; ++k)
          rows[k] = T(scalar_of<T>(0));
  }
  /// The derivative by coordinate k of q that has been stored, or several in lanes.
  template <class P> KSL_LANES coscrew<P> get_by_q(int k) const { return get_one<P>(by_q, k); }
  /// Replaces each derivative x by the coordinates [first, end), in all three results, by step(x).
  template <class Step> KSL_LANES void change(int first, int end, Step step) const {
    T *const results[] = {by_q, by_v, by_a};
    for (T *rows : results)
      if constexpr (is_number<T>) {
        for (int k = first; k < end; k += native_lanes<T>)
          put_one(step(get_one<native_pack<T>>(rows, k)), rows, k, end - k);
      } else {
        for (int k = first; k < end; ++k)
          put_one(step(get_one<T>(rows, k)), rows, k, 1);
      }
  }

private:
  template <class P> KSL_LANES coscrew<P> get_one(const T *rows, int k) const {
    const T *const lin = rows + (angular_first ? 3 * n : 0) + k, *const ang = rows + (angular_first ? 0 : 3 * n) + k;
    coscrew<P> f;
    if constexpr (is_number<T>) {
      const int left = static_cast<int>(n - k);
      f = {{load_first(lin, left), load_first(lin + n, left), load_first(lin + 2 * n, left)},
           {load_first(ang, left), load_first(ang + n, left), load_first(ang + 2 * n, left)}};
    } else {
      f = {{lin[0], lin[n], lin[2 * n]}, {ang[0], ang[n], ang[2 * n]}};
    }
    if (negative)
      algebra<P>::coscrew_invert(&f);
    return f;
  }
  template <class P> KSL_LANES void put(int k, int valid, const wrench_by<P> &x) const {
    put_one(x.q, by_q, k, valid);
    put_one(x.v, by_v, k, valid);
    put_one(x.a, by_a, k, valid);
  }
  template <class P> KSL_LANES void put_one(coscrew<P> f, T *rows, int k, int valid) const {
    if (negative)
      algebra<P>::coscrew_invert(&f);
    T *const lin = rows + (angular_first ? 3 * n : 0) + k, *const ang = rows + (angular_first ? 0 : 3 * n) + k;
    store(f.lin.x, lin, valid), store(f.lin.y, lin + n, valid), store(f.lin.z, lin + 2 * n, valid);
    store(f.ang.x, ang, valid), store(f.ang.y, ang + n, valid), store(f.ang.z, ang + 2 * n, valid);
  }
  template <class P> static KSL_LANES void store(const P &x, T *to, int valid) {
    if constexpr (is_number<T>)
      store_first<T>(x, to, valid);
    else
      *to = x;
  }
};

/// A wrench that is given in common axes and about the common point, expressed in a frame with the pose D: Ad*(D⁻¹) f.
template <class P> KSL_LANES coscrew<P> expressed(const SE3<P> &frame, coscrew<P> f) {
  using A = algebra<P>;
  vec3<P> moment;
  A::cross_vv(&frame.t, &f.lin, &moment);
  A::nxpy_vv(&moment, &f.ang);
  A::product_drinvv(&frame.R, &f.lin, &f.lin);
  A::product_drinvv(&frame.R, &f.ang, &f.ang);
  return f;
}
template <class P> KSL_LANES wrench_by<P> expressed(const SE3<P> &frame, const wrench_by<P> &by) {
  return {expressed(frame, by.q), expressed(frame, by.v), expressed(frame, by.a)};
}

/// The derivatives (1) by a coordinate that carries the joint.
template <class P> KSL_LANES wrench_by<P> by_carrier_of(const subtree_dynamics<P> &d, const coordinate_motion<P> &c) {
  wrench_by<P> by;
  by.q = wrench_change(d, c.velocity_by_q.ang, c.acceleration_by_q);
  by.v = wrench_change(d, c.S.ang, c.acceleration_by_v);
  algebra<P>::product_Ms(&d.I, &c.S, &by.a);
  return by;
}

/// Sets the derivatives (1) and (2) of the wrench through the joint of a body.  `carried` are the coordinates that it carries.
/// dynamics<P>() returns I, 2 B and f of the bodies beyond the joint, in all lanes of P.  express(by) converts a wrench_by<P> from
/// common axes and the common point to the frame that is wanted.
template <class T, class Dynamics, class Express>
KSL_LANES void set_reaction(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w, int body,
                            Dynamics dynamics, coordinate_run carried, const reaction_rows_of_joint<T> &out,
                            Express express) {
  out.set(carried.first, carried.end, [&]<class P>(int k) KSL_INLINED {
    const wrench_derivative<P> f = w.derivative.template get<P>(k);
    return express(wrench_by<P>{f.by_q, f.by_v, f.by_a});
  });
  for_carriers(model, body, [&](int first, int end) KSL_INLINED {
    out.set(first, end, [&]<class P>(int k) KSL_INLINED {
      return express(by_carrier_of(dynamics.template operator()<P>(), w.coordinate.template get<P>(k)));
    });
  });
}

/// Are there columns that set_reaction doesn't set, since their coordinates don't change the wrench?
template <class S> KSL_LANES bool leaves_columns(const model_view<S> &model, int body, coordinate_run carried) {
  int written = carried.end - carried.first;
  for_carriers(model, body, [&](int first, int end) KSL_INLINED { written += end - first; });
  return written < model.nv;
}

/// Adds to the derivative by the second angle θ of a universal joint what the split of the wrench contributes.  The split is done in
/// the child, in which the first axis moves with θ.  With the moment (x, y) in the plane normal to the second axis, the actuation part
/// has there (joint<universal>::move_first_drive)
///
///     across (sin θ, cos θ),   across = sin θ x + cos θ y,
///
/// whose derivative is normal (sin θ, cos θ) + across (cos θ, −sin θ), normal = cos θ x − sin θ y.  The constraint part has the
/// negative.  f is the whole wrench in the canonical frame of the second body, whose pose in the requested frame is D.
template <class T>
inline void add_rate_of_split(const wrench_derivatives_workspace<T> &w, const body<scalar_of<T>> &b, wrench_part part,
                              const coscrew<T> &f, const SE3<T> &D, const reaction_rows_of_joint<T> &out) {
  const plane_rotation<T> theta = w.pose.rotation(b);
  const T normal = theta.cosine * f.ang.x - theta.sine * f.ang.y,
          across = theta.sine * f.ang.x + theta.cosine * f.ang.y, o = T(0);
  coscrew<T> rate = {{o, o, o},
                     {theta.sine * normal + theta.cosine * across, theta.cosine * normal - theta.sine * across, o}};
  if (part == wrench_part::constraint)
    algebra<T>::coscrew_invert(&rate);
  algebra<T>::product_CoAdc(&D, &rate, &rate);
  out.set_by_q(b.v_index, b.v_index + 1, [&]<class P>(int k) KSL_INLINED {
    coscrew<P> sum = out.template get_by_q<P>(k);
    const coscrew<P> change = in_all_lanes<P, coscrew>(rate);
    algebra<P>::xpy_cc(&change, &sum);
    return sum;
  });
}

/// As much of a pose_workspace as part_through needs, with the rotations of bodies about their joints' axes in all lanes of P.
template <class P, class T> struct rotation_in_lanes {
  const pose_workspace<T> &pose;
  KSL_LANES plane_rotation<P> rotation(const body<scalar_of<T>> &b) const {
    return in_all_lanes<P, plane_rotation>(pose.rotation(b));
  }
};

/// Splits a wrench, which is given in the frame of its body, and expresses the part in the frame in which the body has the pose D.
template <joint_kind K, class T, class P> KSL_LANES coscrew<P> split_and_moved(const body<scalar_of<T>> &b,
                                                                               const pose_workspace<T> &pose,
                                                                               wrench_part part, const SE3<P> &D,
                                                                               const coscrew<P> &f) {
  coscrew<P> x = part_through<K>(b, rotation_in_lanes<P, T>{pose}, part, f);
  algebra<P>::product_CoAdc(&D, &x, &x);
  return x;
}

/// set_reaction in any frame; d are the dynamics of the bodies beyond the joint.
template <class T>
void set_reaction_in(const SE3<T> &frame, const model_view<scalar_of<T>> &model,
                     const wrench_derivatives_workspace<T> &w, int body, const subtree_dynamics<T> &d,
                     coordinate_run carried, const reaction_rows_of_joint<T> &out) {
  const auto dynamics = [&]<class P>() KSL_INLINED { return in_all_lanes<P, subtree_dynamics>(d); };
  set_reaction(model, w, body, dynamics, carried, out,
               [&]<class P>(const wrench_by<P> &by) KSL_INLINED { return expressed(in_all_lanes<P, SE3>(frame), by); });
}

/// set_reaction for a part of the wrench.  The derivatives of the whole wrench are set in the frame of body i, in which the joint's motion
/// subspace is constant, then split, and then expressed in the requested frame.  Returns the part itself.
template <class T>
coscrew<T> set_part_of_reaction(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w, int i,
                                const subtree_dynamics<T> &d, coordinate_run carried, wrench_part part,
                                const SE3<T> &frame, const reaction_rows_of_joint<T> &out) {
  const ksl::body<scalar_of<T>> &b = model.body[i];
  const SE3<T> body = {w.rotation[i], w.origin[i]};
  const coscrew<T> whole = expressed(body, d.f);
  SE3<T> D; // of the body in the requested frame
  coscrew<T> found;
  algebra<T>::product_dinvd(&frame, &body, &D);
  set_reaction_in(body, model, w, i, d, carried, out);
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
    const auto split = [&]<class P>(const coscrew<P> &f) KSL_INLINED {
      return split_and_moved<K>(b, w.pose, part, in_all_lanes<P, SE3>(D), f);
    };
    out.change(carried.first, carried.end, split);
    for_carriers(model, i, [&](int first, int end) { out.change(first, end, split); });
    found = split(whole);
  });
  if (b.ends_universal && part != wrench_part::coupling) // a universal joint follows no other
    add_rate_of_split(w, b, part, whole, D, out);
  return found;
}

/// Adds x ×* f (3) to the derivatives by q; f is in the requested frame.  For each coordinate that carries a body, x has `linear` times
/// the velocity of the body's point at the frame's origin, and `angular` times its angular velocity.
template <class T>
KSL_LANES void add_motion(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                          const reaction_request &request, int link, int body, int linear, int angular,
                          const coscrew<T> &f, const reaction_rows_of_joint<T> &out) {
  const SE3<T> frame = requested_frame(model, w, request, link, tree_of(model, body));
  const auto add = [&]<class P>(int k) KSL_INLINED {
    using A = algebra<P>;
    const SE3<P> D = in_all_lanes<P, SE3>(frame);
    const coscrew<P> g = in_all_lanes<P, coscrew>(f);
    screw<P> x = w.coordinate.template part<screw, P>(k);
    A::product_Adinvs(&D, &x, &x);
    A::vec3_scale(&x.lin, P(scalar_of<T>(linear)));
    A::vec3_scale(&x.ang, P(scalar_of<T>(angular)));
    coscrew<P> change, sum = out.template get_by_q<P>(k);
    A::cross_sc(&x, &g, &change);
    A::xpy_cc(&change, &sum);
    return sum;
  };
  for_carriers(model, body, [&](int first, int end) KSL_INLINED { out.set_by_q(first, end, add); });
}

/// Adds (3): x is the motion of the joint's frame, as far as axes and point don't move with it, less the motion of the links that
/// they move with.  f is the reaction itself.
template <class T> void add_relative_motion(const model_view<scalar_of<T>> &model,
                                            const wrench_derivatives_workspace<T> &w, const reaction_request &request,
                                            int link, const coscrew<T> &f, const reaction_rows_of_joint<T> &out) {
  const int other_point = request.at != wrench_frame::joint, other_axes = request.axes != wrench_frame::joint;
  add_motion(model, w, request, link, model.link[link].body, other_point, other_axes, f, out);
  if (request.at == wrench_frame::link)
    add_motion(model, w, request, link, model.link[request.at_link].body, -1, 0, f, out);
  if (request.axes == wrench_frame::link)
    add_motion(model, w, request, link, model.link[request.axes_link].body, 0, -1, f, out);
}

/// Adds the contribution of external wrenches that are held in the world's axes (held_in_world.hpp) to the derivatives by q of the
/// requested part.  Only wrenches on links beyond the joint count.
template <class T>
void add_turning_of_external(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                             const reaction_request &request, int link, const external_wrenches<T> &external,
                             const reaction_rows_of_joint<T> &out) {
  const ksl::link<scalar_of<T>> &l = model.link[link];
  const bool moves = l.carried_by_moving_joint && l.body > 0;
  if (!moves && (request.part == wrench_part::actuation || request.part == wrench_part::coupling))
    return;
  for (int e = 0; e < external.n; ++e) {
    const int body = model.link[external.link[e]].body;
    if (body == 0 || !is_carried(model, link, external.link[e]))
      continue;
    const held_wrench<T> held = held_in_common_axes(model, w, external, e);
    const SE3<T> frame = requested_frame(model, w, request, link, tree_of(model, body));
    const auto add = [&](auto part) KSL_INLINED {
      for_carriers(model, body, [&](int first, int end) KSL_INLINED {
        out.set_by_q(first, end, [&]<class P>(int k) KSL_INLINED {
          using A = algebra<P>;
          const vec3<P> turn = w.coordinate.template part<vec3, P, 3>(k), point = in_all_lanes<P, vec3>(held.point);
          const coscrew<P> f = in_all_lanes<P, coscrew>(held.f);
          coscrew<P> change, sum = out.template get_by_q<P>(k);
          A::cross_vv(&turn, &f.lin, &change.lin);
          A::cross_vv(&turn, &f.ang, &change.ang);
          A::product_CoAdtc(&point, &change, &change);
          change = part(change);
          A::xpy_cc(&change, &sum);
          return sum;
        });
      });
    };
    if (request.part == wrench_part::total || !moves) {
      add([&]<class P>(const coscrew<P> &f) KSL_INLINED { return expressed(in_all_lanes<P, SE3>(frame), f); });
    } else {
      const ksl::body<scalar_of<T>> &b = model.body[l.body];
      const SE3<T> own = {w.rotation[l.body], w.origin[l.body]};
      SE3<T> D; // of the body in the requested frame
      algebra<T>::product_dinvd(&frame, &own, &D);
      by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED {
        add([&]<class P>(const coscrew<P> &f) KSL_INLINED {
          return split_and_moved<K>(b, w.pose, request.part, in_all_lanes<P, SE3>(D),
                                    expressed(in_all_lanes<P, SE3>(own), f));
        });
      });
    }
  }
}

/// Sets the derivatives of the wrench through a joint between links of the ground, tree by tree: each has common axes of its own.
/// Returns the reaction itself.
template <class T>
coscrew<T> set_reaction_of_ground(const model_view<scalar_of<T>> &model, const reactions_derivatives_workspace<T> &w,
                                  const reaction_request &request, int link, const reaction_rows_of_joint<T> &out) {
  const coordinate_run carried = carried_by(model, link);
  for (int i = 1; i < model.bodies; ++i) {
    const body<scalar_of<T>> &b = model.body[i];
    if (b.parent > 0 || b.v_index < carried.first || b.v_end > carried.end)
      continue;
    const SE3<T> frame = requested_frame(model, w.wrenches, request, link, i);
    set_reaction_in(frame, model, w.wrenches, 0, w.link[link], {b.v_index, b.v_end}, out);
  }
  return expressed(requested_frame(model, w.wrenches, request, link, 0), w.link[link].f);
}

/// Sets the derivatives of one reaction as requested: in any axes, about any point, of the whole wrench or a part.
template <class T>
void set_requested_reaction(const model_view<scalar_of<T>> &model, const reactions_derivatives_workspace<T> &w,
                            const reaction_request &request, int link, const reaction_rows_of_joint<T> &out) {
  const ksl::link<scalar_of<T>> &l = model.link[link];
  const bool moves = l.carried_by_moving_joint && l.body > 0;
  out.clear();
  if ((request.part == wrench_part::actuation || request.part == wrench_part::coupling) && !moves)
    return;
  coscrew<T> f;
  if (l.body == 0) {
    f = set_reaction_of_ground(model, w, request, link, out);
  } else {
    const subtree_dynamics<T> d = moves ? w.wrenches.subtree.get(last_coordinate(model, l.body)) : w.link[link];
    const SE3<T> frame = requested_frame(model, w.wrenches, request, link, tree_of(model, l.body));
    if (request.part == wrench_part::total || !moves) {
      set_reaction_in(frame, model, w.wrenches, l.body, d, carried_by(model, link), out);
      f = expressed(frame, d.f);
    } else {
      f = set_part_of_reaction(model, w.wrenches, l.body, d, carried_by(model, link), request.part, frame, out);
    }
  }
  if (!moves_with_joint(request))
    add_relative_motion(model, w.wrenches, request, link, f, out);
}

/// set_reaction for the usual request, the whole wrench through a moving joint in the joint's own frame.  `clear` says whether zeros are
/// written, too.
template <class T>
KSL_LANES void set_whole_reaction(const model_view<scalar_of<T>> &model, const wrench_derivatives_workspace<T> &w,
                                  const ksl::link<scalar_of<T>> &l, bool clear, const reaction_rows_of_joint<T> &out) {
  const body<scalar_of<T>> &b = model.body[l.body];
  const coordinate_run carried = {b.v_index + b.nv, b.v_end};
  const mat3x3<T> R = w.rotation[l.body], in_body = spread<T>(l.pose.R);
  SE3<T> frame = {R, w.origin[l.body]};
  algebra<T>::product_drdr(&R, &in_body, &frame.R);
  if (clear && leaves_columns(model, l.body, carried))
    out.clear();
  const auto dynamics = [&]<class P>() KSL_INLINED { return w.subtree.template in_all_lanes<P>(carried.first - 1); };
  set_reaction(model, w, l.body, dynamics, carried, out,
               [&]<class P>(const wrench_by<P> &by) KSL_INLINED { return expressed(in_all_lanes<P, SE3>(frame), by); });
}

/// The derivatives of reactions(q, v, a) with the same request, each (n, 6, nv), row-major.  Unless `clear` is set, zeros that follow
/// from the shape of the tree are left out where the whole wrench is asked for in the joint's own frame.
template <class T>
void elements_of_reactions_derivatives(const model_view<scalar_of<T>> &model,
                                       const reactions_derivatives_workspace<T> &w, const T *q, const T *v, const T *a,
                                       const reaction_request &request, const external_wrenches<T> &external, T *by_q,
                                       T *by_v, T *by_a, bool clear = is_number<T>) {
  forward_motions(model, w.wrenches, q, v, a, external);
  sum_subtrees(model, w.wrenches);
  bool any_inside = false; // is any of the joints fixed, and so inside of a body
  for (int j = 0; j < request.n; ++j)
    any_inside |= !model.link[request.link[j]].carried_by_moving_joint || model.link[request.link[j]].body == 0;
  if (any_inside)
    link_dynamics(model, w, external);
  const index n = model.nv;
  const bool whole = request.part == wrench_part::total && in_joint_frame(request);
  for (index j = 0; j < request.n; ++j) {
    const index at = 6 * n * j;
    const reaction_rows_of_joint<T> out = {
        by_q + at, by_v + at, by_a + at, n, request.angular_first, request.on == wrench_side::parent};
    const ksl::link<scalar_of<T>> &l = model.link[request.link[j]];
    if (whole && l.carried_by_moving_joint && l.body > 0)
      set_whole_reaction(model, w.wrenches, l, clear, out);
    else
      set_requested_reaction(model, w, request, request.link[j], out);
    if (external.axes == expressed_in::world)
      add_turning_of_external(model, w.wrenches, request, request.link[j], external, out);
  }
}

/// The derivatives of reactions(q, v, a) with the same request, each (n, 6, nv), row-major: of the components in the requested
/// axes, about the requested point; by q along q ⊕ s e_k with v and a held componentwise, by v and by a.  External wrenches are
/// held in the axes in which they are given, those of their links, which move, or of the world.
template <class T>
void reactions_derivatives(const model_view<scalar_of<T>> &model, const reactions_derivatives_workspace<T> &w,
                           const T *q, const T *v, const T *a, const reaction_request &request,
                           const external_wrenches<T> &external, T *by_q, T *by_v, T *by_a) {
  elements_of_reactions_derivatives(model, w, q, v, a, request, external, by_q, by_v, by_a, true);
}

} // namespace KSL_ISA
} // namespace ksl
