//     pose        x y z roll pitch yaw       R = Rz(yaw) Ry(pitch) Rx(roll), in rad, or in degrees where it says so
//                 x y z qx qy qz qw          rotation_format="quat_xyzw"
//     inertial    pose: the centroid, and axes there; mass; inertia: ixx … about the centroid, in these axes
//
// Numbers of the file are kept, angles in rad, in given_rotation and given_inertia: a robot that is written has them again.
#include "load/sdf_values.hpp"

#include "description/parts/given.hpp"
#include "text/words.hpp"

#include <cmath>

namespace ksl::readers::sdf {

using namespace given;
using namespace text;

namespace {

constexpr double degree = 0.017453292519943295;

bool is_true(const element &of, const std::string &text, const std::string &what) {
  if (text == "true" || text == "1")
    return true;
  if (text != "false" && text != "0")
    of.refuse(what + " is " + quoted(text) + ", expected true or false");
  return false;
}

/// [x y z w], about unit length: SDF files have a few digits.
given_rotation quaternion_of(const element &pose, const std::vector<double> &n) {
  const double norm = std::sqrt(n[3] * n[3] + n[4] * n[4] + n[5] * n[5] + n[6] * n[6]);
  if (!(std::fabs(norm - 1) <= 1e-2))
    pose.refuse("the quaternion of <pose> has length " + shown(norm) +
                ", expected 1; write x y z w of a unit quaternion");
  return {given_rotation::quaternion, {n[3], n[4], n[5], n[6]}};
}

} // namespace

given_pose pose_in(const element &parent, version of_file) {
  given_pose out;
  const element pose = parent.child("pose");
  if (!pose)
    return out;
  pose.expect_text({"relative_to", "degrees", "rotation_format", "frame"});
  const std::string frame = pose.text("frame"); // many files of SDF 1.6 have frame="" everywhere
  out.relative_to = pose.text("relative_to");
  if (!frame.empty() && !of_file.has_old_frames()) // to ignore it would move the element
    pose.refuse("<pose> has frame=" + quoted(frame) + ", which was replaced in SDF 1.7; write relative_to");
  if (!frame.empty() && !out.relative_to.empty() && frame != out.relative_to)
    pose.refuse("<pose> has frame=" + quoted(frame) + " and relative_to=" + quoted(out.relative_to) +
                "; remove one of them");
  if (!frame.empty())
    out.relative_to = frame;
  const std::string format = pose.has("rotation_format") ? pose.text("rotation_format") : "euler_rpy";
  const bool in_degrees = pose.has("degrees") && is_true(pose, pose.text("degrees"), "degrees of <pose>");
  if (pose.content().empty())
    return out;
  if (format == "quat_xyzw") {
    if (in_degrees)
      pose.refuse("<pose> has degrees and a quaternion; remove degrees, or give the angles");
    const auto n = pose.content_numbers(7, "0 0 0.5 0 0 0 1");
    out.rotation = quaternion_of(pose, n);
    out.pose.t = {n[0], n[1], n[2]};
  } else if (format == "euler_rpy") {
    const auto n = pose.content_numbers(6, "0 0 0.5 0 0 1.57");
    const double unit = in_degrees ? degree : 1;
    out.rotation = {given_rotation::rpy, {n[3] * unit, n[4] * unit, n[5] * unit}};
    out.pose.t = {n[0], n[1], n[2]};
    // none is the identity exactly, and is written as nothing
    if (n[3] == 0 && n[4] == 0 && n[5] == 0)
      out.rotation = {};
  } else {
    pose.refuse("<pose> has rotation_format " + quoted(format) + ", expected euler_rpy or quat_xyzw");
  }
  out.pose.R = rotation_of(out.rotation);
  return out;
}

std::string text_in(const element &parent, const char *tag) {
  const element child = parent.child(tag);
  if (!child)
    return {};
  child.expect_text({});
  return child.content();
}

bool flag_in(const element &parent, const char *tag, bool otherwise) {
  const std::string text = text_in(parent, tag);
  return text.empty() ? otherwise : is_true(parent, text, "<" + std::string(tag) + ">");
}

optional_number number_in(const element &parent, const char *tag) {
  const element child = parent.child(tag);
  if (!child)
    return {};
  child.expect_text({});
  return child.content_numbers(1, "0.5")[0];
}

optional_number limit_in(const element &parent, const char *tag) {
  const std::string text = text_in(parent, tag);
  for (const char *boundless : {"inf", "-inf", "+inf", "infinity", "-infinity"})
    if (text == boundless)
      return {};
  return number_in(parent, tag);
}

given_inertia inertia_in(const element &inertial, version of_file, std::vector<std::string> &missing) {
  inertial.expect({"auto"}, {"pose", "mass", "inertia", "fluid_added_mass", "density", "auto_inertia_params"});
  if (inertial.has("auto") && is_true(inertial, inertial.text("auto"), "auto of <inertial>"))
    inertial.refuse(
        "its inertia is to be computed from its collision geometry, which KSL doesn't do; write mass and inertia instead of auto=\"true\"");
  given_inertia out;
  const given_pose at = pose_in(inertial, of_file);
  if (!at.relative_to.empty())
    inertial.refuse("the <pose> of an <inertial> is in its link, but is relative to " + quoted(at.relative_to) +
                    "; remove relative_to or frame");
  out.center_of_mass = at.pose.t, out.axes = at.rotation;
  const auto read = [&](const element &parent, const char *tag, double otherwise) {
    const element child = parent.child(tag);
    if (!child) {
      if (otherwise != 0)
        missing.push_back("<" + std::string(tag) + ">");
      return otherwise;
    }
    child.expect_text({});
    return child.content_numbers(1, "0.5")[0];
  };
  out.mass = read(inertial, "mass", 1);
  const element I = inertial.child("inertia");
  if (!I) {
    missing.push_back("<inertia>");
    out.moments = {1, 1, 1, 0, 0, 0};
    return out;
  }
  I.expect({}, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"});
  out.moments = {read(I, "ixx", 1), read(I, "iyy", 1), read(I, "izz", 1),
                 read(I, "ixy", 0), read(I, "iyz", 0), read(I, "ixz", 0)};
  return out;
}

} // namespace ksl::readers::sdf
