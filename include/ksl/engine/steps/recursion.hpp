// KSL: what bodies hand on in a recursion over the tree: motions from the ground to the leaves, wrenches from the leaves to the ground.
//
// The mathematics is that of inverse_dynamics.hpp.  Here is what processors need of it.  The bodies are in depth-first order, so most bodies are
// carried by the body before them.  What such a neighbour hands on stays in registers:
//
//     ground → 1 → 2 → 3      motions:  `last` is that of body i − 1
//                  └─→ 4      wrenches: `carried` is what body i + 1 passes to its parent i; what comes from body 4 to 2 goes through memory
#pragma once

#include "ksl/engine/model/joints.hpp"
#include "ksl/engine/steps/external_wrenches.hpp"
#include "ksl/engine/steps/newton_euler.hpp"

namespace ksl {
inline namespace KSL_ISA {

/// Is the wrench of a body's motion computed when its children have passed theirs?  In that pass each body waits for the wrench of the next one, and
/// the laws of motion wait for nothing.
template <class T> inline constexpr bool laws_are_late = in_narrow_lanes<T>;

/// Calls step<K>(i, b) for body b, number i; K is the kind of its joint.
template <class S, class Step> KSL_LANES void for_joint(const model_view<S> &model, int i, Step step) {
  const body<S> &b = model.body[i];
  by_kind(b.kind, [&]<joint_kind K>() KSL_INLINED { step.template operator()<K>(i, b); });
}

/// Motions of bodies, from the ground to the leaves.
template <class T> struct motions_outward {
  const per_body<body_motion, T> &motion;
  body_motion<T> last; ///< of the body before

  KSL_LANES motions_outward(const model_view<scalar_of<T>> &model, const per_body<body_motion, T> &motions)
      : motion(motions), last(ground_motion<T>(model)) {
    motion.set(0, last);
  }
  /// Of the parent of body i: from registers for one state, which waits for its chain.  In lanes other numbers need the registers more.
  KSL_LANES body_motion<T> of_parent(int i, const body<scalar_of<T>> &b) const {
    return is_number<T> && b.parent == i - 1 ? last : motion[b.parent];
  }
  KSL_LANES void set(int i, const body_motion<T> &m) {
    motion.set(i, m);
    last = m;
  }
};

/// Wrenches through joints, in the frames of their bodies.
template <class T> struct joint_wrenches {
  per_body<coscrew, T> through;   ///< the joint of each body, about its origin; body 0: between ground and root
  per_body<coscrew, T> passed;    ///< with late laws: the same at the parent, if that isn't the body before
  bool with_ground = !is_pack<T>; ///< is the wrench of body 0 wanted?  It costs as much as that of a moving body

  KSL_LANES void lay_out(arena &memory, int bodies) {
    through.lay_out(memory, bodies);
    passed.lay_out(memory, laws_are_late<T> ? bodies : 0);
  }
};

/// Subtracts external wrenches on body i from f, and adds what its children have passed to it, but for the body after it.
template <class T>
KSL_NOT_INLINED void add_besides_chain(const model_view<scalar_of<T>> &model, const pose_workspace<T> &pose,
                                       const per_body<coscrew, T> &passed, const external_wrenches<T> &external, int i,
                                       coscrew<T> &f) {
  for (int k = 0; k < external.n; ++k)
    if (model.link[external.link[k]].body == i) {
      const coscrew<T> e = external_in_body(model, pose, external, k);
      algebra<T>::nxpy_cc(&e, &f);
    }
  for (int child = model.body[i].last_branch; child > i + 1;) {
    const coscrew<T> from_child = passed[child];
    algebra<T>::xpy_cc(&from_child, &f);
    for (--child; model.body[child].parent != i;) // in depth-first order the child before carries the body before
      child = model.body[child].parent;
  }
}

/// Calls move(i) for each body from the ground to the leaves, which sets its motion, and computes the wrenches that these motions need.
template <class T, class Workspace, class Move>
KSL_LANES void wrenches_of_motions(const model_view<scalar_of<T>> &model, const Workspace &w,
                                   const external_wrenches<T> &external, Move move) {
  if constexpr (laws_are_late<T>) {
    for (int i = 1; i < model.bodies; ++i)
      move(i);
  } else {
    for_bodies<T>(model.bodies, move, [&](auto k) KSL_INLINED {
      if (is_number<T> || w.wrench.with_ground || k.i > 0)
        w.wrench.through.set(k, newton_euler(own_inertia(model, k), w.motion[k]));
    });
    subtract_external(model, w.pose, external, w.wrench.through, [](int, coscrew<T> &) KSL_INLINED {});
  }
}

/// Joint wrenches from the leaves to the ground.  The workspace w has pose, motion and, as joint_wrenches, wrench.
template <class T, class Workspace> struct wrenches_inward {
  const model_view<scalar_of<T>> &model;
  const Workspace &w;
  const external_wrenches<T> &external;
  coscrew<T> carried; ///< what body i + 1 passes to body i, if i is its parent: from memory it would come later
  bool has_carried = false;

  KSL_LANES wrenches_inward(const model_view<scalar_of<T>> &m, const Workspace &workspace,
                            const external_wrenches<T> &e)
      : model(m), w(workspace), external(e) {}

  /// The wrench through the joint of body i, complete with those of its children.
  KSL_LANES coscrew<T> receive_from_children(int i) {
    coscrew<T> f = besides_chain(i);
    if (has_carried)
      algebra<T>::xpy_cc(&carried, &f);
    if (has_carried || laws_are_late<T>)
      w.wrench.through.set(i, f);
    return f;
  }

  /// Hands f, at the parent's origin and in its axes, to the parent of body i.
  KSL_LANES void pass_to_parent(int i, const body<scalar_of<T>> &b, const coscrew<T> &f) {
    has_carried = b.parent == i - 1;
    if (has_carried)
      carried = f;
    else if constexpr (laws_are_late<T>)
      w.wrench.passed.set(i, f);
    else
      add_wrench(w.wrench.through, b.parent, f);
  }

  KSL_LANES void finish_ground() {
    if (w.wrench.with_ground)
      receive_from_children(0);
  }

private:
  /// The wrench through the joint of body i, but for what the body after it passes.
  KSL_LANES coscrew<T> besides_chain(int i) const {
    if constexpr (laws_are_late<T>) {
      coscrew<T> f = newton_euler(own_inertia(model, body_at<T>(i)), w.motion[i]);
      if (external.n > 0 || model.body[i].last_branch > 0) [[unlikely]] {
        coscrew<T> all = f; // a copy, since only this needs an address
        add_besides_chain(model, w.pose, w.wrench.passed, external, i, all);
        f = all;
      }
      return f;
    } else {
      return w.wrench.through[i];
    }
  }
};

} // namespace KSL_ISA
} // namespace ksl
