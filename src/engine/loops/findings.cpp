#include "engine/loops/findings.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

#include <cmath>

namespace ksl::loops {

/// Joints that move are in the order of their coordinates: the last that begins at v or before has it.
const joint_row &joint_of(const model &m, int v) {
  int found = 0;
  for (int j = 0; j < m.moving_joints(); ++j)
    if (m.joints()[static_cast<std::size_t>(j)].v_index <= v)
      found = j;
  return m.joints()[static_cast<std::size_t>(found)];
}

int loop_of(const tables &t, int row) {
  int loop = 0;
  while (loop + 1 < static_cast<int>(t.loops.size()) && t.loops[static_cast<std::size_t>(loop) + 1].first_row <= row)
    ++loop;
  return loop;
}

/// What would make efforts determined where the drives leave no more than bodies that turn alone.
static std::string of_uneven(const tables &t, const model &m) {
  if (t.uneven.empty())
    return {};
  return "; link " + m.links()[static_cast<std::size_t>(t.uneven[0].link)].name +
         " turns alone about a line of its own, and needs no drive if its mass is the same all round it";
}

//     kind                           row                                                value against allowed
//     open, velocity, acceleration   equation, of the loop that loop_of() finds         its error or rate: rad, m, by second or second²
//     few_drives                     independent coordinate that no drive moves
//     massless                       independent coordinate                             NaN: its inertia overflows
//     idle_effort, no_column         coordinate of the idle body                        effort that is needed there
std::string text_of(const finding &fault, const model &m) {
  using kind = finding::kind;
  if (!fault)
    return {};
  const tables &t = m.loop_tables();
  if (fault.what == kind::massless && std::isnan(fault.value))
    return "the inertia of joint " + joint_of(m, fault.row).name +
           " overflows at this position; the masses or the lengths of the mechanism are too large: give smaller ones";
  if (fault.what == kind::massless)
    return "joint " + joint_of(m, fault.row).name +
           " moves no mass in the closed mechanism at this position, so that its acceleration is not determined; give a link that it moves "
           "mass and inertia, or fix the joint";
  if (fault.what == kind::few_drives) {
    const joint_row &left = joint_of(m, fault.row);
    return "the drives leave a freedom, that of joint " + left.name + ": the mechanism has " +
           std::to_string(fault.freedoms) + " at this position, and " + std::to_string(t.drives.size()) +
           " coordinates with a drive; name as many as determine its motion" +
           (left.kind == joint_kind::floating
                ? ", " + left.name + " among them, which then carries what the motion needs from outside"
                : "") +
           of_uneven(t, m);
  }
  if (fault.what == kind::idle_effort || fault.what == kind::no_column) {
    std::string link;
    for (const idle_body &body : t.idle)
      if (body.coordinate == fault.row)
        link = m.links()[static_cast<std::size_t>(body.link)].name;
    const std::string by = ", by joint " + joint_of(m, fault.row).name;
    if (fault.what == kind::no_column)
      return "the drives leave a freedom: link " + link + " turns idly about its own line" + by +
             "; a universal joint in place of a ball at its end takes that freedom";
    const bool turns = t.column_turns[static_cast<std::size_t>(fault.row)];
    return "the drives leave a freedom: link " + link + " turns idly about its own line" + by +
           ", and this motion needs " + text::shown(fault.value) + (turns ? " N m" : " N") + " there, more than " +
           text::shown(fault.allowed) +
           ", which nothing gives; accelerations of forward_dynamics need none, and a link whose mass is the same all round "
           "the line needs none while it has no spin";
  }
  if (fault.what == kind::more_drives)
    return "derivatives of efforts need as many drives as freedoms, " + std::to_string(fault.freedoms) +
           " at this position, and there are " + std::to_string(t.drives.size()) +
           " coordinates with a drive; name fewer";
  if (fault.what == kind::no_drives) {
    std::vector<std::string> names;
    for (int j = 0; j < m.moving_joints(); ++j)
      names.push_back(m.joints()[static_cast<std::size_t>(j)].name);
    return "the joints that have motors are not known, and the mechanism has " + std::to_string(fault.freedoms) +
           (fault.freedoms == 1 ? " freedom" : " freedoms") + "; name them, drives= in Python, from among " +
           text::listed(names, names.size());
  }
  const std::string joint = "loop joint " + m.loops()[static_cast<std::size_t>(loop_of(t, fault.row))].name;
  const bool turns = t.row_turns[static_cast<std::size_t>(fault.row)];
  if (!std::isfinite(fault.value))
    return joint + ": numbers of this state overflow; give smaller ones";
  const std::string by = text::shown(std::fabs(fault.value)) + (turns ? " rad" : " m"),
                    allowed = text::shown(fault.allowed);
  if (fault.what == kind::open)
    return joint + " is open at this position by " + by + ", more than " + allowed +
           "; close(q) gives the nearest closed position";
  if (fault.what == kind::velocity)
    return joint + ": these velocities open it by " + by + "/s, more than " + allowed +
           "; consistent_velocity gives all of them from those of independent joints";
  return joint + ": these accelerations open it by " + by + "/s², more than " + allowed +
         "; consistent_acceleration gives all of them from those of independent joints";
}

} // namespace ksl::loops
