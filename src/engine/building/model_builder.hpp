// Builds the arrays of a model from a description.  Links come in depth-first order, links welded by fixed joints are lumped
// into one body, and joint frames are rotated so that the axis is z.
#pragma once

#include "ksl/model.hpp"

#include "description/structure/mimic.hpp"

#include <string>
#include <vector>

namespace ksl {

/// Fills the arrays of a model, which has its description only.
class model_builder {
public:
  explicit model_builder(model &m) : m_(m) {}

  /// Builds all arrays.  Throws description_error if the description is not a tree.
  void build();

  /// Sets the arrays that depend on the inertias of links, in place of those that were there.
  void add_inertias();

private:
  void warn(const std::string &line);
  void find_massless_joint();
  void collect_children();
  void add_ground();
  std::string free_name(const char *usual, const char *otherwise) const;
  bool names_other_link(const char *name, int root) const;
  void descend(int root);
  void push_children(int description_link, std::vector<int> &pending) const;
  void add_link(const joint_description &j, int index);
  void add_moving_link(int description_link, int parent, joint_row row, const SE3<double> &joint_placement,
                       int parent_body);
  int add_body(joint_kind kind, int parent, int link, const SE3<double> &placement, double pitch, bool follows = false);
  body<double> new_body(joint_kind kind, int parent, int link, const SE3<double> &placement) const;
  int chain_start(joint_kind kind, int parent) const;
  void add_welded_link(int description_link, int parent, const SE3<double> &pose, int body);
  void finish();
  std::vector<joint_row> expanded_rows() const;
  void couple();
  void close_subtrees();
  void sum_inertias();
  void add_tree_rows();
  void augment_inertias();
  void check_finite() const;
  void add_angles();
  void add_limits();
  void add_ranges();
  void narrow(std::vector<model::position_range> &limits, const joint_row &row, int c);
  void round_to_single();
  void add_loops();
  void fit_loops();
  bool add_idle_bodies(const std::vector<double> &q);
  void add_force_elements();

  model &m_;
  std::vector<std::vector<int>> children_; // for each link of the description: the joints whose parent it is
  std::vector<leader_of_joint> leaders_;   // of each joint of the description
  std::vector<joint_row> followers_, fixed_joints_;
};

} // namespace ksl
