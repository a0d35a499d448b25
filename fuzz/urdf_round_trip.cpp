// What is loaded is written as URDF, and loaded again: the same model, and the same text.
#include "robot_text.hpp"

#include "ksl/engine/model/joints.hpp"
#include "ksl/urdf.hpp"
#include "load/urdf.hpp"

#include <cstring>

namespace {

using namespace ksl;

template <class T> bool same_bits(const T &a, const T &b) { return std::memcmp(&a, &b, sizeof a) == 0; }

std::string difference(const link_description &a, const link_description &b) {
  return a.name != b.name                   ? "name"
         : a.has_inertial != b.has_inertial ? "has_inertial"
         : !same_bits(a.inertia, b.inertia) ? "inertia"
                                            : "";
}

std::string difference(const joint_description &a, const joint_description &b) {
  const joint_kind_row row = row_of(a.kind);
  if (a.name != b.name || a.kind != b.kind || a.parent != b.parent || a.child != b.child)
    return "name, kind or ends";
  if (!same_bits(a.placement, b.placement))
    return "placement";
  if ((row.has_axis && !same_bits(a.axis, b.axis)) || !same_bits(a.axis2, b.axis2) || a.pitch != b.pitch)
    return "axes or pitch";
  for (int c = 0; c < numbers_with_limits(row); ++c)
    if (limits_of(a, c).lower != limits_of(b, c).lower || limits_of(a, c).upper != limits_of(b, c).upper)
      return "limits";
  if (row.nv == 1 && (a.effort != b.effort || a.velocity != b.velocity))
    return "effort or velocity";
  if (a.damping != b.damping || a.friction != b.friction || a.friction_width != b.friction_width ||
      a.armature != b.armature || a.rotor_inertia != b.rotor_inertia || a.gear_ratio != b.gear_ratio ||
      a.spring_stiffness != b.spring_stiffness)
    return "physics";
  if (a.mimic.has_value() != b.mimic.has_value() ||
      (a.mimic && (a.mimic->joint != b.mimic->joint || a.mimic->multiplier != b.mimic->multiplier ||
                   a.mimic->offset != b.mimic->offset)))
    return "mimic";
  return "";
}

template <class Items> void check_same(const Items &a, const Items &b, const std::string &text) {
  if (a.size() != b.size())
    fuzz::broken("what is written is read again", "another number of links or joints:\n" + text);
  for (std::size_t i = 0; i < a.size(); ++i)
    if (const std::string what = difference(a[i], b[i]); !what.empty())
      fuzz::broken("what is written is read again", what + " of " + a[i].name + ":\n" + text);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *bytes, std::size_t size) {
  robot_description robot;
  try {
    robot = read_urdf_text({reinterpret_cast<const char *>(bytes), size}, "fuzzed.urdf");
  } catch (const description_error &) {
    return 0;
  }
  const std::string text = urdf_text(robot);
  try {
    robot_description again = read_urdf_text(text, "written.urdf");
    check_same(robot.links, again.links, text);
    check_same(robot.joints, again.joints, text);
    again.unused = robot.unused; // they are comments
    if (urdf_text(again) != text || again.name != robot.name)
      fuzz::broken("what is read again is written as before", text);
  } catch (const description_error &error) {
    fuzz::broken("what is written can be read", error.what() + ("\n" + text));
  }
  return 0;
}
