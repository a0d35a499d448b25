#include "engine/loops/plan.hpp"
#include "ksl/engine/algorithms/loops/tolerances.hpp"

#include <algorithm>

namespace ksl::loops {

std::shared_ptr<const loop_plan<float>> rounded(const loop_plan<double> &plan) {
  const std::shared_ptr<loop_plan<float>> made = std::make_shared<loop_plan<float>>();
  loop_plan<float> &out = *made;
  const auto vector = [](const vec3<double> &x) {
    return vec3<float>{static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
  };
  const auto pose = [&](const SE3<double> &D) {
    const auto f = [](double x) { return static_cast<float>(x); };
    const mat3x3<double> &R = D.R;
    return SE3<float>{{f(R.m00), f(R.m10), f(R.m20), f(R.m01), f(R.m11), f(R.m21), f(R.m02), f(R.m12), f(R.m22)},
                      vector(D.t)};
  };
  for (const closing_joint<double> &joint : plan.joints) {
    closing_joint<float> x{joint.predecessor,
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
                           static_cast<float>(joint.pitch),
                           joint.has_two_axes,
                           vector(joint.axis2),
                           static_cast<float>(joint.cosine)};
    for (int i = 0; i < 6; ++i)
      x.direction[i] = vector(joint.direction[i]), x.along[i] = joint.along[i];
    out.joints.push_back(x);
  }
  for (const joint_compliance_view<double> &of : plan.compliances) {
    joint_compliance_view<float> x{of.joint, {}};
    for (int i = 0; i < 36; ++i)
      x.matrix[i / 6][i % 6] = static_cast<float>(of.matrix[i / 6][i % 6]);
    out.compliances.push_back(x);
  }
  for (const screw<double> &x : plan.own)
    out.own.push_back({vector(x.lin), vector(x.ang)});
  for (const loop_element<double> &x : plan.elements)
    out.elements.push_back({x.row, x.place, static_cast<float>(x.value)});
  out.columns = plan.columns, out.pivots = plan.pivots, out.list = plan.list;
  out.independent = plan.independent, out.place = plan.place, out.redundant = plan.redundant;
  out.pitch.assign(plan.pitch.begin(), plan.pitch.end());
  out.row_scale.assign(plan.row_scale.begin(), plan.row_scale.end());
  out.column_scale.assign(plan.column_scale.begin(), plan.column_scale.end());
  out.drive = plan.drive;
  out.drive_scale.assign(plan.drive_scale.begin(), plan.drive_scale.end());
  out.crossed = plan.crossed, out.through = plan.through, out.compliance_of = plan.compliance_of;
  out.patterns = plan.patterns;
  out.view.crosses_welds = plan.view.crosses_welds;
  out.view.first_coupling = plan.view.first_coupling;
  out.view.couplings_begin = plan.view.couplings_begin, out.view.couplings_end = plan.view.couplings_end;
  out.view.fill_begin = plan.view.fill_begin, out.view.fill_end = plan.view.fill_end;
  out.view.drives_are_independent = plan.view.drives_are_independent;
  out.view.length = static_cast<float>(plan.view.length);
  out.view.tolerance = static_cast<float>(std::max(loop_tolerance::accepted_single, plan.view.tolerance));
  out.point();
  return made;
}

} // namespace ksl::loops
