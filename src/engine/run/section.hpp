// The wrench through a section of a link, from the reactions of its joints and the motion of the link (ksl/section.hpp).
//
// The part beyond is cut free, and its equations of motion are written about the origin of the link's frame, in its axes (Featherstone, RBDA (2008),
// eq. (5.9)):
//
//       near part │ beyond           w + Σ joints + Σ force elements + Σ external wrenches = I (a − g) + v ×* I v
//     ── joint ───┼──── joint ──
//                w ──▸                w: of the near part on the part beyond, then moved to the point of the section, m ← m − p × f
//
// No joint is between both parts: each joint of the link is on one side, and `is_beyond` says on which.
#pragma once

#include "engine/run/compute.hpp"
#include "engine/elements/forces.hpp"
#include "ksl/algebra.hpp"
#include "ksl/section.hpp"

namespace ksl {
namespace sections {

template <class S> vec3<S> three(const double *x) { return {S(x[0]), S(x[1]), S(x[2])}; }
inline double dot(const double *a, const vec3<double> &b) { return a[0] * b.x + a[1] * b.y + a[2] * b.z; }

/// Is a point of the link beyond the plane, or in it?
inline bool is_point_beyond(const link_section &section, const vec3<double> &at) {
  return dot(section.normal, at) >= dot(section.normal, three<double>(section.point));
}

/// The inertia of the part beyond.
inline spatial_inertia<double> inertia_beyond(const model &m, const link_section &section) {
  const spatial_inertia<double> own = m.links()[static_cast<std::size_t>(section.link)].inertia;
  if (section.share == section_share::inertia)
    return section.inertia;
  double share = section.fraction;
  if (section.share == section_share::by_center) {
    const vec3<double> at = three<double>(section.point);
    share = own.m > 0 && dot(section.normal, own.h) >= own.m * dot(section.normal, at) ? 1 : 0;
  }
  return {share * own.m,   {share * own.h.x, share * own.h.y, share * own.h.z},
          share * own.Ixx, share * own.Iyy,
          share * own.Izz, share * own.Ixy,
          share * own.Iyz, share * own.Izx};
}

/// The wrench that the motion needs, I (a − g) + v ×* I v in the link's frame (Featherstone, RBDA (2008), eq. (5.9)).
template <class S>
coscrew<S> inertial_wrench(const model &m, data &d, const state_view<S> &state, const mat3x3<S> &R,
                           const spatial_inertia<double> &of) {
  using A = algebra<S>;
  screw<S> twist, acceleration;
  vec3<S> g = m.view_in<S>().gravity;
  S numbers[6];
  state_view<S> s = state;
  const auto run = [&](const algorithm_row &row, S *out) {
    s.result[0] = out;
    compute<S>(row, m, d, s);
    return screw<S>{{out[0], out[1], out[2]}, {out[3], out[4], out[5]}};
  };
  twist = run(rows::frame_velocities, numbers);
  acceleration = run(rows::frame_accelerations, numbers);
  A::product_drinvv(&R, &g, &g);
  A::nxpy_vv(&g, &acceleration.lin);
  const spatial_inertia<S> I = {
      S(of.m), {S(of.h.x), S(of.h.y), S(of.h.z)}, S(of.Ixx), S(of.Iyy), S(of.Izz), S(of.Ixy), S(of.Iyz), S(of.Izx)};
  coscrew<S> momentum, wrench;
  A::product_Ms(&I, &twist, &momentum);
  A::product_Ms(&I, &acceleration, &wrench);
  const auto add_cross = [](const vec3<S> &a, const vec3<S> &b, vec3<S> &out) {
    out.x += a.y * b.z - a.z * b.y, out.y += a.z * b.x - a.x * b.z, out.z += a.x * b.y - a.y * b.x;
  };
  // v ×* (p, l) = (ω × p, ω × l + v × p)
  add_cross(twist.ang, momentum.lin, wrench.lin);
  add_cross(twist.ang, momentum.ang, wrench.ang);
  add_cross(twist.lin, momentum.lin, wrench.ang);
  return wrench;
}

/// Subtracts what a joint exerts on the part beyond.  joint: as requests for reactions number it; on: on which side of it the link is.
template <class S>
void subtract_joint(const model &m, data &d, state_view<S> s, int joint, wrench_side on, int link, coscrew<S> &wrench) {
  reaction_request request;
  request.n = 1, request.link = &joint, request.on = on;
  request.at = request.axes = wrench_frame::link, request.at_link = request.axes_link = link;
  S f[6];
  const reaction_result<S> wanted = {&request, f};
  s.reactions_n = 1, s.reactions = &wanted;
  compute<S>(rows::reactions, m, d, s);
  wrench.lin.x -= f[0], wrench.lin.y -= f[1], wrench.lin.z -= f[2];
  wrench.ang.x -= f[3], wrench.ang.y -= f[4], wrench.ang.z -= f[5];
}

/// Subtracts what force elements exert on the part beyond: those whose points on the link are beyond the plane, or in it.
template <class S>
void subtract_elements(const model &m, const state_view<S> &s, const link_section &section, coscrew<S> &wrench) {
  if (m.acting_force_elements() == 0)
    return;
  elements::forces<S> forces(m, m.acting_force_elements());
  batch_view<S> batch;
  batch.n = 1, batch.q = {s.q, 0}, batch.v = {s.v, 0};
  arena measure;
  forces.lay_out(measure, 0, 1);
  arena memory(thread_memory(kept_for::workspace, measure.used()));
  forces.lay_out(memory, 0, 1);
  forces.set(batch, 0, 1);
  for (int end = 0; end < forces.ends(); ++end) {
    const force_element_row &of = m.force_elements()[static_cast<std::size_t>(end / 2)];
    if (forces.link(end) != section.link || !is_point_beyond(section, end % 2 == 0 ? of.point1 : of.point2))
      continue;
    const S *const f = forces.external()[end].wrench.first;
    wrench.lin.x -= f[0], wrench.lin.y -= f[1], wrench.lin.z -= f[2];
    wrench.ang.x -= f[3], wrench.ang.y -= f[4], wrench.ang.z -= f[5];
  }
}

} // namespace sections

template <class S>
void section_wrench(const model &m, data &d, const S *q, const S *v, const S *a, const link_section &section, S *out,
                    const external_wrenches<S> &external) {
  const nearest_rounding rounding;
  using A = algebra<S>;
  // The link is the child of the joint that carries it, and the parent of those that it carries: the wrench on it is that on the child, or on the
  // parent.  Joints that close loops have it as their successor, a child, or predecessor.
  const int carrier = m.joint_above(section.link);
  const state_view<S> s = {.q = q, .v = v, .a = a, .external = external, .links = {1, &section.link}};
  S pose[16];
  state_view<S> of_pose = s;
  of_pose.result[0] = pose;
  compute<S>(rows::frame_poses, m, d, of_pose);
  const mat3x3<S> R = {pose[0], pose[4], pose[8], pose[1], pose[5], pose[9], pose[2], pose[6], pose[10]};
  coscrew<S> wrench = sections::inertial_wrench<S>(m, d, s, R, sections::inertia_beyond(m, section));
  for (int j = 0; j < static_cast<int>(m.joints().size()); ++j)
    if (const joint_row &joint = m.joints()[static_cast<std::size_t>(j)];
        (j == carrier || joint.parent_link == section.link) && is_beyond(m, section, j))
      sections::subtract_joint<S>(m, d, s, joint.link, j == carrier ? wrench_side::child : wrench_side::parent,
                                  section.link, wrench);
  for (int l = 0; l < static_cast<int>(m.loops().size()); ++l)
    if (const loop_row &loop = m.loops()[static_cast<std::size_t>(l)];
        (loop.successor == section.link || loop.predecessor == section.link) &&
        is_beyond(m, section, static_cast<int>(m.joints().size()) + l))
      sections::subtract_joint<S>(m, d, s, static_cast<int>(m.links().size()) + l,
                                  loop.successor == section.link ? wrench_side::child : wrench_side::parent,
                                  section.link, wrench);
  sections::subtract_elements<S>(m, s, section, wrench);
  for (int e = 0; e < external.n && is_beyond(m, section, carrier); ++e)
    if (const S *const f = external.wrench + 6 * e; external.link[e] == section.link) {
      coscrew<S> given = {{f[0], f[1], f[2]}, {f[3], f[4], f[5]}};
      if (external.axes == expressed_in::world)
        A::product_CoAdrinvc(&R, &given, &given);
      A::nxpy_vv(&given.lin, &wrench.lin), A::nxpy_vv(&given.ang, &wrench.ang);
    }
  const vec3<S> at = sections::three<S>(section.point);
  A::product_CoAdtinvc(&at, &wrench, &wrench);
  if (section.axes == expressed_in::world)
    A::product_CoAdrc(&R, &wrench, &wrench);
  const bool angular_first = section.order == component_order::angular_first;
  S *const lin = out + (angular_first ? 3 : 0), *const ang = out + (angular_first ? 0 : 3);
  lin[0] = wrench.lin.x, lin[1] = wrench.lin.y, lin[2] = wrench.lin.z;
  ang[0] = wrench.ang.x, ang[1] = wrench.ang.y, ang[2] = wrench.ang.z;
}

} // namespace ksl
