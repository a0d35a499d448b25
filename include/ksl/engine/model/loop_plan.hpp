// KSL: the arrays of a loop_view, which a model owns.
#pragma once

#include "ksl/engine/model/loop_view.hpp"

#include <vector>

namespace ksl {

/// Empty for trees, and for models whose loops have no plan.  Copies point to their own arrays.
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
  loop_plan(const loop_plan &other) { *this = other; }
  loop_plan(loop_plan &&other) noexcept { *this = static_cast<loop_plan &&>(other); }
  ~loop_plan() = default;
  loop_plan &operator=(const loop_plan &other) {
    if (this == &other)
      return *this;
    joints = other.joints, columns = other.columns, pitch = other.pitch, row_scale = other.row_scale;
    own = other.own, elements = other.elements;
    column_scale = other.column_scale, pivots = other.pivots, list = other.list, independent = other.independent;
    place = other.place, redundant = other.redundant, crossed = other.crossed, through = other.through;
    drive = other.drive, drive_scale = other.drive_scale;
    compliances = other.compliances, compliance_of = other.compliance_of, patterns = other.patterns;
    view = other.view;
    point();
    return *this;
  }
  loop_plan &operator=(loop_plan &&other) noexcept {
    joints.swap(other.joints), columns.swap(other.columns), pitch.swap(other.pitch), row_scale.swap(other.row_scale);
    column_scale.swap(other.column_scale), pivots.swap(other.pivots), list.swap(other.list);
    own.swap(other.own), elements.swap(other.elements);
    independent.swap(other.independent), place.swap(other.place), redundant.swap(other.redundant);
    crossed.swap(other.crossed), through.swap(other.through), compliances.swap(other.compliances);
    drive.swap(other.drive), drive_scale.swap(other.drive_scale);
    compliance_of.swap(other.compliance_of), patterns.swap(other.patterns);
    view = other.view;
    point();
    return *this;
  }

  /// Sets the pointers and sizes of the view from the arrays.
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
