// KSL: the arrays of a loop_view, which a model owns.
#pragma once

#include "ksl/engine/model/loop_view.hpp"

#include <vector>

namespace ksl {

/// Models that are copies of each other share one.
template <class S> struct loop_plan {
  std::vector<closing_joint<S>> joints;
  std::vector<loop_column> columns;
  std::vector<S> pitch, row_scale, column_scale, drive_scale;
  std::vector<screw<S>> own;
  std::vector<loop_element<S>> elements;
  std::vector<loop_pivot> pivots;
  std::vector<int> list, independent, place, redundant, crossed, through, drive;
  std::vector<joint_compliance_view<S>> compliances;
  std::vector<int> compliance_of;
  std::vector<loop_pattern> patterns;
  loop_view<S> view{};

  loop_plan() = default;
  loop_plan(const loop_plan &) = delete; // the view looks at the arrays
  loop_plan &operator=(const loop_plan &) = delete;

  /// Sets the pointers and sizes of the view, once all arrays are there.
  void point() {
    view.loops = static_cast<int>(joints.size()), view.rows = static_cast<int>(row_scale.size());
    view.pivots = static_cast<int>(pivots.size()), view.freedoms = static_cast<int>(independent.size());
    view.joint = joints.data(), view.column = columns.data(), view.pitch = pitch.data(), view.pivot = pivots.data();
    view.own = own.data(), view.element = elements.data();
    view.list = list.data(), view.independent = independent.data(), view.place = place.data();
    view.crossings = static_cast<int>(crossed.size()), view.crossed = crossed.data(), view.through = through.data();
    view.compliances = static_cast<int>(compliances.size()), view.compliance = compliances.data();
    view.compliance_of = compliance_of.data(), view.pattern = patterns.data();
    view.drives = static_cast<int>(drive.size()), view.drive = drive.data(), view.drive_scale = drive_scale.data();
    view.redundant = redundant.data(), view.row_scale = row_scale.data(), view.column_scale = column_scale.data();
  }
};

} // namespace ksl
