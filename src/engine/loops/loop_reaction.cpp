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
  // A loop's joint has no coordinate, so that its whole wrench is constraint: of actuation and of what couples joints it has none.
  // From the joint's frame s on the successor to the frame D that is asked for, all poses in the world: f_D = [Ad]*(D⁻¹ s) f_s (Coscrews page).  `at`
  // chooses the origin of D, with `offset` in the axes of s where that is the joint; `axes` chooses its axes, those of s unless others are named.
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

void requested_reactions::lay_out(arena &memory, const model &m, int most) {
  links_of_model_ = m.view().links;
  links_ = memory.take<int>(most);
  found_ = memory.take<double>(6 * std::ptrdiff_t(most)), efforts_ = memory.take<double>(m.nv());
}

const double *requested_reactions::find(const closed_state &c, const double *q, const double *v, const double *a,
                                        const external_wrenches<double> &all, const reaction_request &wanted) {
  reaction_request of_tree = wanted;
  of_tree.n = 0, of_tree.link = links_;
  for (int k = 0; k < wanted.n; ++k)
    if (wanted.link[k] < links_of_model_)
      links_[of_tree.n++] = wanted.link[k];
  // The tree writes its n wrenches to the front of found_; the loop below moves each to its place:
  //
  //     asked for   tree  loop  tree  tree  loop
  //     found_      t0    t1    t2    —     —     →  t0  l0  t1  t2  l1
  const reaction_result<double> result = {&of_tree, found_};
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.external = all;
  s.reactions_n = 1, s.reactions = &result, s.result[0] = efforts_;
  if (of_tree.n > 0)
    c.call(rows::inverse_dynamics_with_reactions, s);
  for (int k = wanted.n - 1, n = of_tree.n; k >= 0; --k) // from the end, since those of the tree move backwards
    if (double *const out = found_ + 6 * std::ptrdiff_t(k); wanted.link[k] < links_of_model_)
      std::copy_n(found_ + 6 * std::ptrdiff_t(--n), 6, out);
    else
      set_loop_reaction(c.at(), q, wanted, wanted.link[k] - links_of_model_, c.loop_wrenches(), out);
  return found_;
}

} // namespace ksl::loops
