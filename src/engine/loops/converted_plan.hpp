// A plan of loops whose numbers are of another scalar.
#pragma once

#include "ksl/engine/model/loop_plan.hpp"

#include <vector>

namespace ksl::loops {

/// Sets `out`, which is empty, to the plan.
/// Member by member, since a number of S is made of each: for float rounded, for recordings a constant.  Lists of indices are the same; point() sets
/// pointers and sizes of the view, and what else the view has is copied.
template <class S> void convert(const loop_plan<double> &plan, loop_plan<S> &out) {
  const auto number = [](double x) { return static_cast<S>(x); };
  const auto numbers = [](const std::vector<double> &from, std::vector<S> &to) {
    for (const double x : from)
      to.push_back(static_cast<S>(x));
  };
  const auto vector = [&](const vec3<double> &x) { return vec3<S>{number(x.x), number(x.y), number(x.z)}; };
  const auto pose = [&](const SE3<double> &D) {
    const mat3x3<double> &R = D.R;
    return SE3<S>{{number(R.m00), number(R.m10), number(R.m20), number(R.m01), number(R.m11), number(R.m21),
                   number(R.m02), number(R.m12), number(R.m22)},
                  vector(D.t)};
  };
  for (const closing_joint<double> &joint : plan.joints) {
    closing_joint<S> x{joint.predecessor,
                       joint.successor,
                       pose(joint.on_predecessor),
                       pose(joint.on_successor),
                       joint.is_turned,
                       joint.turns,
                       vector(joint.axis),
                       joint.forces,
                       joint.moments,
                       {},
                       {},
                       joint.first_row,
                       joint.columns_begin,
                       joint.columns_middle,
                       joint.columns_end,
                       joint.own_begin,
                       joint.elements_begin,
                       joint.elements_end,
                       joint.through_begin,
                       joint.through_middle,
                       joint.through_end,
                       joint.mixed,
                       vector(joint.turn),
                       vector(joint.across),
                       number(joint.pitch),
                       joint.has_two_axes,
                       vector(joint.axis2),
                       number(joint.cosine)};
    for (int i = 0; i < 6; ++i)
      x.direction[i] = vector(joint.direction[i]), x.along[i] = joint.along[i];
    out.joints.push_back(x);
  }
  for (const joint_compliance_view<double> &of : plan.compliances) {
    joint_compliance_view<S> x{of.joint, {}};
    for (int i = 0; i < 36; ++i)
      x.matrix[i / 6][i % 6] = number(of.matrix[i / 6][i % 6]);
    out.compliances.push_back(x);
  }
  for (const screw<double> &x : plan.own)
    out.own.push_back({vector(x.lin), vector(x.ang)});
  for (const loop_element<double> &x : plan.elements)
    out.elements.push_back({x.row, x.place, number(x.value)});
  out.columns = plan.columns, out.pivots = plan.pivots, out.list = plan.list;
  out.independent = plan.independent, out.place = plan.place, out.redundant = plan.redundant;
  numbers(plan.pitch, out.pitch);
  numbers(plan.row_scale, out.row_scale);
  numbers(plan.column_scale, out.column_scale);
  out.drive = plan.drive;
  numbers(plan.drive_scale, out.drive_scale);
  out.crossed = plan.crossed, out.through = plan.through, out.compliance_of = plan.compliance_of;
  out.patterns = plan.patterns;
  out.view.crosses_welds = plan.view.crosses_welds;
  out.view.first_coupling = plan.view.first_coupling;
  out.view.couplings_begin = plan.view.couplings_begin, out.view.couplings_end = plan.view.couplings_end;
  out.view.fill_begin = plan.view.fill_begin, out.view.fill_end = plan.view.fill_end;
  out.view.steady = plan.view.steady;
  out.view.drives_are_independent = plan.view.drives_are_independent;
  out.view.length = number(plan.view.length);
  out.view.tolerance = number(plan.view.tolerance);
  out.point();
}

} // namespace ksl::loops
