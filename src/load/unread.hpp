// Does what a reader doesn't know join two links, or couple two joints?  Without it the robot would be another machine.
#pragma once

#include "ksl/engine/model/description.hpp"
#include "text/xml.hpp"

#include <map>
#include <set>
#include <string>
#include <vector>

namespace ksl::readers {

/// The names of a robot's links and of frames on them, and of its joints, as elements that are not read may give them.
class part_names {
public:
  /// `link` is that which moves with what has the name: two names of one link are no two links.
  void add_link(const std::string &name, const std::string &link) { links_.emplace(name, link); }
  void add_joint(const std::string &name) { joints_.insert(name); }
  bool is_joint(const std::string &name) const { return joints_.count(name) > 0; }

  /// Links and joints that an element names, in its attributes and texts and in those of the elements in it.
  struct found { std::set<std::string> links, joints; };
  found named_in(pugi::xml_node node) const;
  /// Adds the links and joints that one text names: it is a name, or a list of names and of nothing else.
  void add_named(const std::string &text, found &out) const;

private:
  bool add_one(std::string_view name, found &out) const;

  std::map<std::string, std::string, std::less<>> links_;
  std::set<std::string, std::less<>> joints_;
};

/// What an option leaves out is no fault: loops="cut" links that are joined, mimic="independent" joints that are coupled.
struct left_out { bool links = false, joints = false; };

/// Refuses an element that names two links or two joints, counting the link or joint that it stands in, unless its tag says that it
/// joins none.
void refuse_if_joining(const text::xml_file &file, const part_names &names, pugi::xml_node node, left_out option);

/// Refuses an attribute of a joint that names another one, likewise.
void refuse_if_joining(const text::xml_file &file, const part_names &names, pugi::xml_node joint,
                       pugi::xml_attribute attribute, left_out option);

/// A joint that follows another, stated elsewhere than in its own <joint>.
struct stated_mimic {
  pugi::xml_node at;
  std::string follower, leader;
  double multiplier = 1, offset = 0;
};

/// Makes a joint follow another.  Nothing to do where the file couples the two so already; refuses where it does otherwise.
void follow(const text::xml_file &file, const stated_mimic &mimic, joint_description &follower,
            const joint_description &leader);

/// Is an element in <gazebo> a plugin: <plugin>, or a tag that says what it is, with a file.
bool is_plugin(pugi::xml_node node);

/// What a plugin of a simulator does to links and joints can't be read, but that one joint mimics another: appended to `mimics`.  Refuses other
/// plugins that couple two links or joints, by their words.  Returns the names of two or more joints or links that it acts on otherwise.
std::vector<std::string> read_plugin(const text::xml_file &file, const part_names &names, pugi::xml_node plugin,
                                     left_out option, std::vector<stated_mimic> &mimics);

} // namespace ksl::readers
