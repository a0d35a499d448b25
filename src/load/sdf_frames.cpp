// What is asked for is found once for each frame, by a walk to the first that is known and back: the frame that it is relative to and how deep it is,
// its pose in the world, the link that it moves with.  Cycles are refused.
#include "load/sdf_frames.hpp"

#include "text/limits.hpp"
#include "text/words.hpp"

#include <algorithm>

namespace ksl::readers::sdf {

using namespace text;

SE3<double> product(const SE3<double> &a, const SE3<double> &b) {
  SE3<double> out;
  algebra<double>::product_dd(&a, &b, &out);
  return out;
}

SE3<double> inverse(const SE3<double> &a) {
  SE3<double> out;
  algebra<double>::SE3_inverted(&a, &out);
  return out;
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): try_emplace moves it, but leaves it as it is where the name is taken
void frame_graph::add(const std::string &full_name, frame f) {
  if (full_name.size() > limits::name_bytes + own_frame.size())
    f.where.refuse("its name, with those of the models around it, has " + std::to_string(full_name.size()) +
                   " bytes, more than " + std::to_string(limits::name_bytes) + "; shorten one of them");
  const auto [entry, is_new] = frames_.try_emplace(full_name, std::move(f));
  if (!is_new)
    f.where.refuse("the name is given twice in its model, first in line " + std::to_string(entry->second.where.line()) +
                   "; rename one of these links, joints, frames or models");
  names_.push_back(full_name);
}

void frame_graph::place_by(const std::string &model, const std::string &placement_frame, const element &where) {
  const std::string scope = model.substr(0, model.size() - own_frame.size());
  const SE3<double> in_model =
      *relative_within(frames_.size(), model, found(scope, placement_frame, where, "placement_frame"));
  // the file's pose X is that of the placement frame F, so that X_model X_F = X
  SE3<double> &pose = frames_.find(model)->second.pose;
  pose = product(pose, inverse(in_model));
}

std::string frame_graph::found(const std::string &scope, const std::string &name, const element &where,
                               const std::string &role) const {
  if (name == "world")
    return name;
  for (const std::string &full_name : {scope + name, scope + name + "::" + own_frame})
    if (frames_.count(full_name))
      return full_name;
  std::vector<std::string> names; // as they are written in this scope
  for (const std::string &each : names_)
    if (each.substr(0, scope.size()) == scope && each.find(own_frame) == each.npos)
      names.push_back(each.substr(scope.size()));
  where.refuse(role + " names " + quoted(name) + ", which is no link, joint, frame or model here" +
               suggestion(name, names, "name one of " + listed(names)));
}

namespace {

/// The word in messages for how a frame refers to another one.  The frame of a joint moves with its child, and is placed in it by
/// default.
std::string role(const frame_graph::frame &f, const std::string &name, const char *usual) {
  const std::string tag = f.where.tag();
  return (tag == "joint" || tag == "drake:joint") && name == f.attached_to ? "<child>" : usual;
}

} // namespace

/// How many frames a frame is from the world.  Found once for each, with the frame that it is relative to: models may be long chains.
int frame_graph::depth(const std::string &from) const {
  // while its path is followed, a frame is unknown: one that leads to an unknown frame in the end is on a cycle
  std::vector<std::string> path; // frames whose depth isn't known yet
  for (std::string name = from; name != "world" && !places_.count(name); name = places_.at(name).relative_to) {
    const frame &f = at(name);
    places_[name] = {found(f.scope, f.relative_to, f.where, role(f, f.relative_to, "relative_to")), unknown};
    path.push_back(name);
  }
  for (auto name = path.rbegin(); name != path.rend(); ++name) {
    place &p = places_.at(*name);
    const int above = p.relative_to == "world" ? 0 : places_.at(p.relative_to).depth;
    if (above == unknown)
      at(*name).where.refuse("its pose is relative to itself, by way of " + quoted(at(*name).relative_to) +
                             "; correct one relative_to");
    p.depth = above + 1;
  }
  return from == "world" ? 0 : places_.at(from).depth;
}

SE3<double> frame_graph::relative(const std::string &in, const std::string &of) const {
  constexpr std::size_t near = 64; // frames on the way; files may be long chains of frames, which are followed once
  if (const auto pose = relative_within(near, in, of))
    return *pose;
  return product(inverse(in_world(in)), in_world(of));
}

/// Upwards to the world or to a frame whose pose is known, and then down: X_n = X_(n−1) · pose_n.
SE3<double> frame_graph::in_world(const std::string &full_name) const {
  depth(full_name);
  std::vector<std::string> path; // frames whose pose isn't known yet
  std::string name = full_name;
  for (; name != "world" && !in_world_.count(name); name = places_.at(name).relative_to)
    path.push_back(name);
  SE3<double> pose = name == "world" ? SE3<double>{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}} : in_world_.at(name);
  for (auto each = path.rbegin(); each != path.rend(); ++each)
    pose = in_world_[*each] = product(pose, at(*each).pose);
  return pose;
}

/// With common the first frame on both ways: (X₁ X₂ … from common to `in`)⁻¹ (Y₁ Y₂ … from common to `of`).
std::optional<SE3<double>> frame_graph::relative_within(std::size_t most, const std::string &in,
                                                        const std::string &of) const {
  // only as far as their first common frame: then a pose that the file gives is not changed by rounding
  std::vector<std::string> up_from_in, up_from_of;
  std::string a = in, b = of;
  int depth_of_a = depth(in), depth_of_b = depth(of);
  const auto step = [this](std::string &name, int &depth, std::vector<std::string> &path) {
    path.push_back(name);
    name = places_.at(name).relative_to;
    --depth;
  };
  while (a != b) {
    if (up_from_in.size() + up_from_of.size() > most)
      return std::nullopt;
    const int difference = depth_of_a - depth_of_b; // the deeper one goes up, or both
    if (difference >= 0)
      step(a, depth_of_a, up_from_in);
    if (difference <= 0)
      step(b, depth_of_b, up_from_of);
  }
  const auto down = [this](const std::vector<std::string> &names) {
    SE3<double> pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    for (const std::string &name : names)
      pose = &name == &names.front() ? at(name).pose : product(at(name).pose, pose);
    return pose;
  };
  if (up_from_in.empty())
    return down(up_from_of);
  return product(inverse(down(up_from_in)), down(up_from_of));
}

/// Along attached_to to a frame that is attached to nothing, a link, or to the world.
std::string frame_graph::link_of(const std::string &full_name) const {
  std::vector<std::string> path; // frames whose link isn't known yet
  std::string name = full_name;
  while (name != "world" && !links_.count(name)) {
    const frame &f = at(name);
    if (f.attached_to.empty())
      break;
    if (path.size() > frames_.size())
      f.where.refuse("it is attached to itself, by way of " + quoted(f.attached_to) + "; correct one attached_to");
    path.push_back(name);
    name = found(f.scope, f.attached_to, f.where, role(f, f.attached_to, "attached_to"));
  }
  const auto known = links_.find(name);
  std::string link = known == links_.end() ? name : known->second;
  for (const std::string &each : path)
    links_[each] = link;
  return link;
}

} // namespace ksl::readers::sdf
