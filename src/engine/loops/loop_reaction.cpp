#include "engine/loops/loop_reaction.hpp"

namespace ksl::loops {
namespace {

using A = algebra<double>;

SE3<double> pose_of_link(const geometry &g, const double *q, int link) {
  double x[16];
  state_view<double> s;
  s.q = q, s.links = {1, &link}, s.result[0] = x;
  g.tree().call(rows::frame_poses, g.rest(), s);
  return {{x[0], x[4], x[8], x[1], x[5], x[9], x[2], x[6], x[10]}, {x[3], x[7], x[11]}};
}

} // namespace

void set_loop_reaction(const geometry &g, const double *q, const reaction_request &wanted, int loop,
                       const double *wrenches, double *out) {
  const double *const x = wrenches + 6 * std::ptrdiff_t(loop);
  coscrew<double> f = {{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
  if (wanted.part == wrench_part::actuation || wanted.part == wrench_part::coupling)
    f = {{0, 0, 0}, {0, 0, 0}};
  const SE3<double> joint = g.successor_frame(loop);
  SE3<double> target = {joint.R, {wanted.offset[0], wanted.offset[1], wanted.offset[2]}}, D;
  if (wanted.at == wrench_frame::joint)
    A::product_dv(&joint, &target.t, &target.t);
  else if (wanted.at == wrench_frame::world)
    target.t = {0, 0, 0};
  else
    target.t = pose_of_link(g, q, wanted.at_link).t;
  if (wanted.axes == wrench_frame::world)
    target.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  else if (wanted.axes == wrench_frame::link)
    target.R = pose_of_link(g, q, wanted.axes_link).R;
  A::product_dinvd(&target, &joint, &D);
  A::product_CoAdc(&D, &f, &f);
  const double sign = wanted.on == wrench_side::parent ? -1 : 1;
  const double lin[] = {sign * f.lin.x, sign * f.lin.y, sign * f.lin.z},
               ang[] = {sign * f.ang.x, sign * f.ang.y, sign * f.ang.z};
  std::copy_n(wanted.angular_first ? ang : lin, 3, out);
  std::copy_n(wanted.angular_first ? lin : ang, 3, out + 3);
}

} // namespace ksl::loops
