#include "load/urdf_loops.hpp"

#include "description/parts/given.hpp"
#include "description/structure/loops.hpp"
#include "ksl/engine/model/joints.hpp"
#include "load/urdf_values.hpp"
#include "text/words.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::readers {

namespace {

using A = algebra<double>;

//     <constraint name type>                       <loop_joint name type>               <loop name type>
//       <parent link/>   <parent_origin xyz/>        <link1 link xyz rpy/>                <predecessor link> <origin/>
//       <child link/>    <child_origin xyz/>         <link2 link xyz rpy/>                <successor link> <origin/>
//       <parent_axis xyz/>  <child_axis xyz/>        <axis xyz/>                          <axis xyz/>
//
// Ends of <loop_joint> and <loop> have their pose in attributes or in an <origin>.  Second axes are in axis2, parent_axis2 and child_axis2, the pitch
// of a helical joint in screw_thread_pitch.

/// The tags of one way to write a loop.
struct form {
  const char *predecessor, *successor;
  /// null: xyz and rpy stand in the elements that name the links, or in them
  const char *predecessor_origin, *successor_origin;
  const char *axis, *successor_axis;
  const char *axis2, *successor_axis2;
};
constexpr form constraint = {"parent",      "child",      "parent_origin", "child_origin",
                             "parent_axis", "child_axis", "parent_axis2",  "child_axis2"};
constexpr form loop_joint = {"link1", "link2", nullptr, nullptr, "axis", nullptr, "axis2", nullptr};
constexpr form urdf_plus = {"predecessor", "successor", nullptr, nullptr, "axis", nullptr, "axis2", nullptr};

const form &form_of(std::string_view tag) {
  return tag == "constraint" ? constraint : tag == "loop_joint" ? loop_joint : urdf_plus;
}

void expect_content(const element &loop, const form &of) {
  if (of.predecessor_origin)
    loop.expect({"name", "type"},
                {of.predecessor, of.predecessor_origin, of.axis, of.axis2, of.successor, of.successor_origin,
                 of.successor_axis, of.successor_axis2, "screw_thread_pitch", "limit", "dynamics", "mimic"});
  else
    loop.expect({"name", "type"},
                {of.predecessor, of.successor, of.axis, of.axis2, "screw_thread_pitch", "limit", "dynamics", "mimic"});
}

/// The joint's frame on one side: in an element of its own, in the one that names the link, or in the <origin> of that.
SE3<double> frame_in(const element &loop, const char *link, const char *origin, int minor, given_rotation &rotation) {
  const element end = loop.child(link);
  if (origin) {
    end.expect({"link"}, {});
    const element own = loop.child(origin);
    if (!own)
      return {given::rotation_of({}), {0, 0, 0}};
    own.expect({"xyz", "rpy", "quat_xyzw"}, {});
    return pose_in(own, minor, rotation);
  }
  end.expect({"link", "xyz", "rpy", "quat_xyzw"}, {"origin"});
  const bool has_both = end.child("origin") && (end.has("xyz") || end.has("rpy") || end.has("quat_xyzw"));
  if (has_both)
    end.refuse("<" + end.tag() + "> has an <origin>, and xyz or rpy besides; keep one of them");
  return end.child("origin") ? origin_in(end, minor, rotation) : pose_in(end, minor, rotation);
}

vec3<double> vector_in(const element &loop, const char *tag) {
  const element axis = tag ? loop.child(tag) : element(loop);
  return tag && axis ? direction_in(axis) : vec3<double>{0, 0, 0};
}

bool is_given(const vec3<double> &v) { return v.x != 0 || v.y != 0 || v.z != 0; }
bool same(const vec3<double> &a, const vec3<double> &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

vec3<double> cross(const vec3<double> &a, const vec3<double> &b) {
  vec3<double> c;
  A::cross_vv(&a, &b, &c);
  return c;
}

/// The rotation about the unit vector k with this sine and cosine.
/// c 1 + s k̃ + (1 − c) k kᵀ (Rodrigues), in columns.
mat3x3<double> turn_about(const vec3<double> &k, double s, double c) {
  const double d = 1 - c;
  return {c + d * k.x * k.x,       d * k.x * k.y + s * k.z, d * k.x * k.z - s * k.y,
          d * k.x * k.y - s * k.z, c + d * k.y * k.y,       d * k.y * k.z + s * k.x,
          d * k.x * k.z + s * k.y, d * k.y * k.z - s * k.x, c + d * k.z * k.z};
}

/// A direction at a right angle to the unit vector a.
vec3<double> across(const vec3<double> &a) {
  const double x = std::fabs(a.x), y = std::fabs(a.y), z = std::fabs(a.z);
  const vec3<double> least = x <= y && x <= z ? vec3<double>{1, 0, 0}
                             : y <= z         ? vec3<double>{0, 1, 0}
                                              : vec3<double>{0, 0, 1};
  return given::direction_of(cross(a, least));
}

/// The smallest rotation that leads the unit vector a to b.
/// About a × b, whose length is the sine; opposite vectors leave the axis open.
mat3x3<double> least_turn(const vec3<double> &a, const vec3<double> &b) {
  const vec3<double> n = cross(a, b);
  const double s = std::sqrt(A::dot_vv(&n, &n)), c = A::dot_vv(&a, &b);
  if (s == 0)
    return c > 0 ? given::rotation_of({}) : turn_about(across(a), 0, -1);
  return turn_about({n.x / s, n.y / s, n.z / s}, s, c);
}

/// The rotation about the unit vector k that leads a into the half-plane of b.
/// The angle is that from k × a to k × b, which both are at a right angle to k.
mat3x3<double> turn_into_plane(const vec3<double> &k, const vec3<double> &a, const vec3<double> &b) {
  const vec3<double> ka = cross(k, a), kb = cross(k, b), n = cross(ka, kb);
  const double s = A::dot_vv(&n, &k), c = A::dot_vv(&ka, &kb), length = std::hypot(s, c);
  return length == 0 ? given::rotation_of({}) : turn_about(k, s / length, c / length);
}

mat3x3<double> product(const mat3x3<double> &R, const mat3x3<double> &S) {
  mat3x3<double> out;
  A::product_drdr(&R, &S, &out);
  return out;
}

/// Axes of both sides, in the frames of the origins.  The description has the same components in both, so that the successor's frame is
/// turned as little as that needs.
/// R′ = R T with T a = b, and T a₂ in the half-plane of b and b₂: then R′ a = R b is the successor's axis.
void align(loop_description &out, const vec3<double> &a, const vec3<double> &b, const vec3<double> &a2,
           const vec3<double> &b2) {
  if (same(a, b) && (!is_given(a2) || !is_given(b2) || same(a2, b2)))
    return;
  mat3x3<double> turn = least_turn(a, b);
  if (is_given(a2) && is_given(b2)) {
    vec3<double> turned;
    A::product_drv(&turn, &a2, &turned);
    turn = product(turn_into_plane(b, turned, b2), turn);
  }
  out.successor_pose.R = product(out.successor_pose.R, turn);
  out.given.successor = {};
}

/// What is given of a, the axis of the predecessor's side or of both, and b, that of the successor's:
///
///     a, or b                   the axis of both sides; no effect on a kind without axes
///     a and b                   one on each side: the successor's frame is turned (align)
///     a and b, universal        the joint's two axes, unless a second one is given
void read_axes(const element &loop, const form &of, loop_description &out, text::unused_list &unused) {
  const joint_kind_row row = row_of(out.kind);
  const auto direction = [](const vec3<double> &v) { return is_given(v) ? given::direction_of(v) : v; };
  vec3<double> a = vector_in(loop, of.axis), b = vector_in(loop, of.successor_axis);
  vec3<double> a2 = vector_in(loop, of.axis2), b2 = vector_in(loop, of.successor_axis2);
  const auto ignore = [&](const char *tag) {
    if (tag && loop.child(tag))
      unused.in_joint(tag, "no effect on a " + std::string(row.name) + " joint", out.name);
  };
  if (!row.has_axis2) {
    ignore(of.axis2), ignore(of.successor_axis2);
    a2 = b2 = {0, 0, 0};
  } else if (!is_given(a2) && !is_given(b2)) {
    // one axis on each side: they are the joint's two
    a2 = b, b = {0, 0, 0};
    if (!is_given(a2))
      loop.refuse("a universal joint needs its second axis, which is fixed in the " + std::string(of.successor) +
                  "; write <" + of.axis2 + " xyz=\"0 1 0\"/> for example");
  }
  if (!is_given(a) && !is_given(b)) {
    if (row.has_axis)
      loop.refuse("a " + std::string(row.name) + " joint that closes a loop needs its axis; write <" + of.axis +
                  " xyz=\"0 0 1\"/> for example");
    return;
  }
  if (!row.has_axis && !(is_given(a) && is_given(b)))
    return ignore(of.axis), ignore(of.successor_axis);
  if (!is_given(a))
    a = b;
  if (!is_given(a2))
    a2 = b2;
  if (is_given(b))
    align(out, direction(a), direction(b), direction(a2), direction(b2));
  if (row.has_axis)
    out.given.axis = a, out.axis = direction(a);
  if (row.has_axis2)
    out.given.axis2 = a2, out.axis2 = direction(a2);
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

} // namespace

force_element_description force_element_in(const element &of, const links_by_name &links) {
  of.expect({"name", "stiffness", "free_length", "damping", "preload", "lower", "upper", "stop_stiffness"},
            {"link1", "link2"});
  force_element_description out;
  out.name = of.where().name;
  out.at = {of.line()};
  out.link1 = link_in(of, "link1", links), out.link2 = link_in(of, "link2", links);
  for (const auto &[tag, point] : {std::pair{"link1", &out.point1}, {"link2", &out.point2}}) {
    const element end = of.child(tag);
    end.expect({"link", "xyz"}, {});
    if (end.has("xyz")) {
      const auto [x, y, z] = end.numbers<3>("xyz");
      *point = {x, y, z};
    }
  }
  force_element_numbers &x = out.numbers;
  for (const auto &[name, value] : {std::pair{"stiffness", &x.stiffness},
                                    {"free_length", &x.free_length},
                                    {"damping", &x.damping},
                                    {"preload", &x.preload},
                                    {"stop_stiffness", &x.stop_stiffness}})
    *value = of.number(name).value_or(0);
  x.lower = of.number("lower"), x.upper = of.number("upper");
  return out;
}

bool is_loop(std::string_view tag) { return tag == "constraint" || tag == "loop_joint" || tag == "loop"; }

bool is_foreign_loop(std::string_view tag) {
  std::string local(tag.substr(tag.find(':') == tag.npos ? 0 : tag.find(':') + 1));
  std::transform(local.begin(), local.end(), local.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  std::erase_if(local, [](char c) { return c == '_' || c == '-'; });
  const bool is_known = is_loop(tag) || tag == "coupling";
  for (const char *word : {"constraint", "loopjoint", "loop", "coupling", "loopconstraint", "closure", "loopclosure"})
    if (local == word && !is_known)
      return true;
  return false;
}

loop_description loop_in(const element &loop, const links_by_name &links, int minor, text::unused_list &unused) {
  if (loop.where().name.empty())
    loop.refuse("<" + loop.tag() + "> has no name; write <" + loop.tag() + " name=\"...\" type=\"...\">");
  const form &of = form_of(loop.tag());
  expect_content(loop, of);
  loop_description out;
  out.name = loop.where().name;
  out.at = {loop.line()};
  out.kind = kind_in(loop);
  out.predecessor = link_in(loop, of.predecessor, links);
  out.successor = link_in(loop, of.successor, links);
  out.predecessor_pose = frame_in(loop, of.predecessor, of.predecessor_origin, minor, out.given.predecessor);
  out.successor_pose = frame_in(loop, of.successor, of.successor_origin, minor, out.given.successor);
  read_axes(loop, of, out, unused);
  if (row_of(out.kind).has_pitch) {
    out.given.pitch = pitch_in(loop, "screw_thread_pitch");
    out.pitch = given::pitch_of(out.given.pitch);
  } else if (loop.child("screw_thread_pitch")) {
    unused.in_joint("screw_thread_pitch", "no effect on a " + std::string(row_of(out.kind).name) + " joint", out.name);
  }
  for (const char *tag : {"limit", "dynamics", "mimic"})
    if (loop.node().child(tag))
      unused.in_joint(tag, "not used, since the joint closes a loop", out.name);
  return out;
}

/// Joints keep their order in the file, in the tree and among loops; those with motors are preferred by the spanning tree.
void split_loops(robot_description &robot, const std::set<std::string> &motors, text::unused_list &unused) {
  std::vector<std::pair<int, int>> ends;
  std::vector<bool> has_motor;
  for (const joint_description &joint : robot.joints) {
    ends.emplace_back(joint.parent, joint.child);
    has_motor.push_back(motors.count(joint.name) > 0);
  }
  const std::vector<bool> in_tree = spanning_tree(robot.links.size(), ends, has_motor);
  std::vector<joint_description> tree;
  for (std::size_t j = 0; j < in_tree.size(); ++j) {
    joint_description &joint = robot.joints[j];
    if (in_tree[j]) {
      tree.push_back(std::move(joint));
      continue;
    }
    for (const std::string &lost : lost_in_loop(joint))
      unused.in_joint(lost, "not used, since the joint closes a loop", joint.name);
    robot.loops.push_back(as_loop(joint));
  }
  robot.joints = std::move(tree);
}

/// Upwards from each link over welds to the first joint that moves, or to a link that is known:
///
///     root ─ j1 ─ a ═ b ═ c       from c: c, b, a are welded, j1 moves all three
std::vector<int> moving_joints(const robot_description &robot) {
  std::vector<int> above(robot.links.size(), -1);
  for (std::size_t j = 0; j < robot.joints.size(); ++j)
    above[index(robot.joints[j].child)] = static_cast<int>(j);
  std::vector<int> moving(robot.links.size(), -1);
  std::vector<bool> is_known(robot.links.size(), false);
  for (std::size_t start = 0; start < robot.links.size(); ++start) {
    std::vector<int> welded; // to each other; a cycle of them is refused later
    int link = static_cast<int>(start), found = -1;
    while (!is_known[index(link)]) {
      is_known[index(link)] = true;
      welded.push_back(link);
      const int j = above[index(link)];
      if (j < 0)
        break;
      if (row_of(robot.joints[index(j)].kind).nv > 0) {
        found = j;
        break;
      }
      link = robot.joints[index(j)].parent;
      found = moving[index(link)];
    }
    for (const int each : welded)
      moving[index(each)] = found;
  }
  return moving;
}

///
///     below ─┬─ leader ── … ═ predecessor        one joint on each side, both on what the same joint moves: then `ratio` relates their coordinates
///            └─ follower ── … ═ successor
void read_coupling(const element &coupling, robot_description &robot, const links_by_name &links,
                   const std::vector<int> &moving) {
  coupling.expect({"name", "type"}, {"predecessor", "successor", "ratio"});
  const element ratio = coupling.child("ratio");
  const std::string mend =
      "write <ratio value=\"2\"/>, how far the successor's joint moves for one of the predecessor's";
  if (!ratio)
    coupling.refuse("<coupling> has no <ratio>; " + mend);
  ratio.expect({"value"}, {});
  const double multiplier = ratio.required_number("value", mend);
  const int from = link_in(coupling, "predecessor", links), to = link_in(coupling, "successor", links);
  const int leader = moving[index(from)], follower = moving[index(to)];
  const auto below = [&](int j) { return moving[index(robot.joints[index(j)].parent)]; };
  // both sides are chains from where they part: of one joint each where that is carried by the same joint
  if (leader < 0 || follower < 0 || leader == follower || below(leader) != below(follower))
    coupling.refuse(
        "it couples links " + robot.links[index(from)].name + " and " + robot.links[index(to)].name +
        ", which don't both move by one joint on the same link; only such a coupling of one joint to another is "
        "read: couple joints one by one, by <mimic>");
  joint_description &joint = robot.joints[index(follower)];
  if (joint.mimic)
    coupling.refuse("joint " + joint.name + " follows joint " + joint.mimic->joint + " already; keep one of both");
  joint.mimic = {robot.joints[index(leader)].name, multiplier, 0, {coupling.line()}};
}

} // namespace ksl::readers
