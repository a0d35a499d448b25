// A model whose numbers are recordings: constants of its own precision, where none of them is an input.
#pragma once

#include "engine/building/inertias.hpp"
#include "engine/loops/converted_plan.hpp"
#include "generate/recording.hpp"
#include "ksl/engine/model/body_constants.hpp"

#include <cstddef>
#include <vector>

namespace ksl::generate {

/// What a view looks at.  The graph in force must outlive it.
class recorded_model {
public:
  template <class S> explicit recorded_model(const model_view<S> &from) {
    const auto n = [](int i) { return static_cast<std::size_t>(i); };
    for (int i = 0; i < from.bodies; ++i) {
      bodies_.push_back(spread<recording>(from.body[i]));
      augmented_.push_back(spread<recording>(from.augmented[i]));
    }
    for (int i = 0; i < from.links; ++i)
      links_.push_back(spread<recording>(from.link[i]));
    inertia_.resize(n(padded_size<recording>(10, from.bodies)));
    for (int i = 0; i < from.bodies; ++i) {
      const auto own = bodies_at<S, S>{i}.template get<spatial_inertia>(from.inertia);
      body_at<recording>(i).put<spatial_inertia>(spread<recording>(own), inertia_.data());
    }
    const int angles = padded(from.nq) + padded(1);
    theta0_sine_.assign(from.theta0_sine, from.theta0_sine + from.nq);
    theta0_cosine_.assign(from.theta0_cosine, from.theta0_cosine + from.nq);
    theta0_sine_.resize(n(angles)), theta0_cosine_.resize(n(angles));
    for (int k = 0; from.physics && k < from.nv; ++k)
      physics_.push_back(spread<recording>(from.physics[k]));
    for (const S *x = from.lower; x < from.lower + from.nq; ++x)
      lower_.emplace_back(static_cast<double>(*x)),
          upper_.emplace_back(static_cast<double>(from.upper[x - from.lower]));
    // in the order of model_view's members
    view_ = {from.bodies,
             from.links,
             from.nq,
             from.nv,
             from.pose_numbers,
             from.longest_path,
             from.tree_elements,
             spread<recording>(from.gravity),
             bodies_.data(),
             links_.data(),
             inertia_.data(),
             augmented_.data(),
             theta0_sine_.data(),
             theta0_cosine_.data(),
             from.tree_row,
             from.first_angle,
             from.angles_end,
             lower_.data(),
             upper_.data(),
             physics_.empty() ? nullptr : physics_.data(),
             nullptr};
  }
  recorded_model(const recorded_model &) = delete;
  recorded_model &operator=(const recorded_model &) = delete;

  const model_view<recording> &view() const { return view_; }
  /// Takes over a plan of loops, whose independent coordinates have no accelerations of their own where it is steady.
  void set_loops(const loop_plan<double> &plan, bool steady) {
    loops::convert(plan, loops_);
    loops_.view.steady = steady;
    view_.loops = &loops_.view;
  }
  void set_gravity(const vec3<recording> &gravity) { view_.gravity = gravity; }
  /// Adds ten numbers, in the link's frame, to the inertia of a link, and to what follows from it.
  /// What model_builder computes from inertias, which are linear in them: I of the link in its body's frame, the body's sum, and augmented inertias,
  /// where the mass counts at the joints on the way to the ground.
  void add_inertia(int to, const recording *ten) {
    using A = algebra<recording>;
    const spatial_inertia<recording> given = inertia_of_parameters(ten);
    link<recording> &l = links_[static_cast<std::size_t>(to)];
    spatial_inertia<recording> in_body, &augmented = augmented_[static_cast<std::size_t>(l.body)];
    A::spatial_inertia_transformed(&given, &l.pose, &in_body);
    const bodies_at<recording, recording> at{l.body};
    auto of_body = at.get<spatial_inertia>(inertia_.data());
    // of the link, of the body that it is welded into, and that body's augmented one
    for (spatial_inertia<recording> *sum : {&l.inertia, &of_body, &augmented})
      A::spatial_inertia_added(sum, &in_body, sum);
    at.put(of_body, inertia_.data());
    // on the way to the ground the mass is at the joint by which each body carries the next
    for (int i = l.body; i > 0; i = bodies_[static_cast<std::size_t>(i)].parent) {
      const body<recording> &b = bodies_[static_cast<std::size_t>(i)];
      add_mass_beyond(b, given.m, augmented_[static_cast<std::size_t>(b.parent)]);
    }
  }

private:
  std::vector<body<recording>> bodies_;
  std::vector<link<recording>> links_;
  std::vector<spatial_inertia<recording>> augmented_;
  recordings inertia_, theta0_sine_, theta0_cosine_, lower_, upper_;
  std::vector<coordinate_physics<recording>> physics_;
  loop_plan<recording> loops_;
  model_view<recording> view_;
};

} // namespace ksl::generate
