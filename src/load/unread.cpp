#include "load/unread.hpp"

#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace ksl::readers {

//     element    names at most one link and one joint    listed as unused
//                two links, or two joints                refused, unless its tag says that it joins none, or an option leaves such out
//     plugin     has a word that couples                 a mimic joint where it states one; otherwise as an element
//                other                                   listed, with the links or joints that it names
//
// Names count wherever they stand, in attributes and texts, at any depth.

namespace {

/// Elements that name several links or joints and join none of them, by a word in their tag.  All others that name two are refused.
constexpr std::string_view harmless_words[] = {
    "collision",    "contact",  "bumper",     // which links may touch: contacts are no part of a mechanism
    "sensor",       "camera",   "light",      // measure or show, and exert nothing
    "visual",       "marker",                 // are drawn
    "transmission", "actuator", "controller", // between motors and joints, which stay independent of each other
    "gripper",                                // of SDF: how fingers hold objects that are no part of the robot
};
/// Such elements by the whole tag: words that others may contain.  MoveIt's names for choices of links and joints.
constexpr std::string_view harmless_tags[] = {"group",         "group_state",   "chain",      "end_effector",
                                              "virtual_joint", "passive_joint", "joint_state"};
/// Words of what couples: in a tag, and of plugins in the file's name, its own, or the tags in it.
constexpr std::string_view coupling_words[] = {"mimic",   "coupl", "constraint", "gearbox", "closure",
                                               "bushing", "weld",  "attach",     "spring",  "tendon"};

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return out;
}

template <class Words> bool has_word(const std::string &text, const Words &words) {
  return std::any_of(std::begin(words), std::end(words),
                     [&](std::string_view word) { return text.find(word) != text.npos; });
}

bool is_harmless(pugi::xml_node node) {
  const std::string_view tag = node.name();
  const std::string local = lower(tag.substr(tag.find(':') == tag.npos ? 0 : tag.find(':') + 1));
  return (has_word(lower(tag), harmless_words) && !has_word(lower(tag), coupling_words)) ||
         std::find(std::begin(harmless_tags), std::end(harmless_tags), local) != std::end(harmless_tags);
}

/// The link or joint that an element stands in, which it then names without saying so.
void add_owner(const part_names &names, pugi::xml_node node, part_names::found &out) {
  for (pugi::xml_node above = node.parent(); above; above = above.parent()) {
    const std::string_view tag = above.name();
    const char *attribute = tag == "gazebo" ? "reference" : "name";
    if (tag == "gazebo" || tag == "link" || tag == "joint" || tag == "drake:joint")
      return names.add_named(above.attribute(attribute).value(), out);
  }
}

[[noreturn]] void refuse(const text::xml_file &file, pugi::xml_node at, const std::string &what, const char *kind,
                         const std::set<std::string> &names, const char *mend) {
  file.refuse(at, what + " names " + kind + " " + text::listed({names.begin(), names.end()}) +
                      ", and is nothing that KSL can read: without what joins them the robot would be another "
                      "machine; " +
                      mend);
}

constexpr const char *mend_links =
    "state it as a joint, <constraint> or <force_element>, or read the file without what closes loops: --loops cut, "
    "loops=\"cut\" in Python, cut_loops in C++";
constexpr const char *mend_joints =
    "state it as <mimic>, or read the file without couplings: --mimic independent, mimic=\"independent\" in Python, "
    "mimic_independent in C++";

void refuse_if_two(const text::xml_file &file, pugi::xml_node at, const std::string &what,
                   const part_names::found &named, left_out option) {
  if (named.joints.size() > 1 && !option.joints)
    refuse(file, at, what, "joints", named.joints, mend_joints);
  if (named.links.size() > 1 && !option.links)
    refuse(file, at, what, "links", named.links, mend_links);
}

std::string text_of(pugi::xml_node parent, const char *tag) {
  return std::string(text::trimmed(parent.child_value(tag)));
}

/// As plugins of Gazebo have it: the joint in <joint> leads, that in <mimicJoint> follows.  Plugins with other tags differ in which one leads.
std::optional<stated_mimic> mimic_in(const text::xml_file &file, const part_names &names, pugi::xml_node plugin) {
  const std::string leader = text_of(plugin, "joint"), follower = text_of(plugin, "mimicJoint");
  if (!names.is_joint(leader) || !names.is_joint(follower) || leader == follower)
    return std::nullopt;
  stated_mimic out{plugin, follower, leader};
  for (const auto &[tag, value] : {std::pair{"multiplier", &out.multiplier}, {"offset", &out.offset}})
    if (const std::string given = text_of(plugin, tag); !given.empty()) {
      const auto number = text::number_in(given);
      if (!number)
        file.refuse(plugin, "its <" + std::string(tag) + "> is " + text::quoted(given) +
                                ", no number; write a finite decimal number such as 0.25");
      *value = *number;
    }
  return out;
}

} // namespace

/// "arm::hand" is tried whole, and then without what is before the last "::".
bool part_names::add_one(std::string_view name, found &out) const {
  const auto link = links_.find(name);
  const auto joint = joints_.find(name);
  if (link != links_.end())
    out.links.insert(link->second);
  if (joint != joints_.end())
    out.joints.insert(*joint);
  if (link != links_.end() || joint != joints_.end())
    return true;
  const std::size_t scope = name.rfind("::"); // model::link
  return scope != name.npos && add_one(name.substr(scope + 2), out);
}

/// A text is a name, or a list of names and numbers, separated by blanks, commas or semicolons.
void part_names::add_named(const std::string &text, found &out) const {
  const std::string_view whole = text::trimmed(text);
  if (whole.empty() || text::number_in(whole) || add_one(whole, out))
    return;
  std::string blanks(whole);
  std::replace_if(blanks.begin(), blanks.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  found list; // a sentence may hold names, too, but is no list of them
  for (const std::string_view word : text::split(blanks))
    if (text::number_in(word) || !add_one(word, list))
      return;
  out.links.merge(list.links), out.joints.merge(list.joints);
}

part_names::found part_names::named_in(pugi::xml_node node) const {
  struct collector : pugi::xml_tree_walker {
    const part_names &names;
    found &out;
    collector(const part_names &all, found &into) : names(all), out(into) {}
    bool for_each(pugi::xml_node &each) override {
      for (const pugi::xml_attribute attribute : each.attributes())
        names.add_named(attribute.value(), out);
      if (each.type() == pugi::node_pcdata || each.type() == pugi::node_cdata)
        names.add_named(each.value(), out);
      return true;
    }
  };
  found out;
  collector all(*this, out);
  all.for_each(node);
  node.traverse(all);
  return out;
}

void refuse_if_joining(const text::xml_file &file, const part_names &names, pugi::xml_node node, left_out option) {
  if (is_harmless(node))
    return;
  part_names::found named = names.named_in(node);
  if (named.links.empty() && named.joints.empty())
    return;
  part_names::found own;
  add_owner(names, node, own);
  if (!named.links.empty()) // a joint is named as its link may be: each counts with its own kind
    named.links.merge(own.links);
  if (!named.joints.empty())
    named.joints.merge(own.joints);
  refuse_if_two(file, node, "<" + std::string(node.name()) + ">", named, option);
}

void refuse_if_joining(const text::xml_file &file, const part_names &names, pugi::xml_node joint,
                       pugi::xml_attribute attribute, left_out option) {
  part_names::found named, own;
  names.add_named(attribute.value(), named);
  names.add_named(joint.attribute("name").value(), own);
  named.links.clear(); // a joint's own links may stand there
  if (!named.joints.empty())
    named.joints.merge(own.joints);
  refuse_if_two(file, joint, std::string(attribute.name()) + " of <" + joint.name() + ">", named, option);
}

bool is_plugin(pugi::xml_node node) {
  return node.name() == std::string_view("plugin") || node.attribute("plugin") || node.attribute("filename");
}

/// Equal to 1e-9, since a file may state a coupling twice, by decimal numbers: p the follower's position, q the leader's, p = multiplier q + offset.
void follow(const text::xml_file &file, const stated_mimic &mimic, joint_description &follower,
            const joint_description &leader) {
  const auto same = [](double x, double y) { return std::fabs(x - y) <= 1e-9 * std::max(1.0, std::fabs(y)); };
  if (follower.mimic && follower.mimic->joint == leader.name && same(follower.mimic->multiplier, mimic.multiplier) &&
      same(follower.mimic->offset, mimic.offset))
    return;
  if (leader.mimic && leader.mimic->joint == follower.name) { // q = (p − offset) / multiplier is the same coupling
    const double m = leader.mimic->multiplier, offset = leader.mimic->offset;
    if (same(m * mimic.multiplier, 1) && same(m * mimic.offset + offset, 0))
      return;
  }
  if (follower.mimic || (leader.mimic && leader.mimic->joint == follower.name))
    file.refuse(mimic.at, "joint " + follower.name + " would follow joint " + leader.name + " by multiplier " +
                              text::shown(mimic.multiplier) + " and offset " + text::shown(mimic.offset) + ", but " +
                              (follower.mimic ? "it follows joint " + follower.mimic->joint + " by multiplier " +
                                                    text::shown(follower.mimic->multiplier) + " and offset " +
                                                    text::shown(follower.mimic->offset)
                                              : "that one follows it otherwise") +
                              " already; make both the same, or keep one");
  follower.mimic = {leader.name, mimic.multiplier, mimic.offset, {file.line_of(mimic.at)}};
}

std::vector<std::string> read_plugin(const text::xml_file &file, const part_names &names, pugi::xml_node plugin,
                                     left_out option, std::vector<stated_mimic> &mimics) {
  std::string words = lower(plugin.name());
  for (const char *attribute : {"filename", "plugin", "name"})
    words += " " + lower(plugin.attribute(attribute).value());
  for (const pugi::xml_node child : plugin.children())
    words += " " + lower(child.name());
  const part_names::found named = names.named_in(plugin);
  if (has_word(words, coupling_words)) {
    if (const auto mimic = mimic_in(file, names, plugin)) {
      mimics.push_back(*mimic);
      return {};
    }
    refuse_if_two(file, plugin, "plugin " + text::quoted(plugin.attribute("name").value()), named, option);
  }
  // joints say more than links, of which a joint's own may be named like it
  std::vector<std::string> all(named.joints.begin(), named.joints.end());
  if (all.size() < 2)
    all.assign(named.links.begin(), named.links.end());
  return all.size() < 2 ? std::vector<std::string>() : all;
}

} // namespace ksl::readers
