// Lists the contents of a file that KSL doesn't use, each kind once.
//
// What becomes of what a reader can't take as it is:
//
//     refused     description_error: a number is none, or without it the robot would be another machine
//     warning     it is read, and may not be what is meant
//     unused      it is known and moves nothing, or it is unknown and joins nothing
#pragma once

#include <pugixml.hpp>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace ksl::text {

/// The link, joint or robot that contains something.
struct owner {
  std::string kind; ///< "link", "joint" or "robot"
  std::string name; ///< empty for the robot

  /// "link base".
  std::string words() const { return name.empty() ? kind : kind + " " + name; }
};

/// Collects what is not used, and describes each kind of it in one line, in a fixed order.
class unused_list {
public:
  /// An element of the robot that is known and not used: "gazebo (9)".
  void in_robot(const std::string &tag);
  /// One or more elements of a link that are known and not used: "visual (12 links)".
  void in_link(const std::string &tag);
  /// A property of a joint, once for each joint, and what is done with it: "joint a, b: damping, friction (read, not
  /// applied)".
  void in_joint(const std::string &what, const std::string &why, const std::string &joint);
  /// Content that the format doesn't define: "unknown element <foo> in link bar, line 12, and 3 more".
  void unknown_element(pugi::xml_node element, const owner &where, int line);
  void unknown_attribute(pugi::xml_attribute attribute, pugi::xml_node of, const owner &where, int line);
  void text(const std::string &tag, const owner &where, int line);

  /// What these two have listed, for readers that ask what it may mean: elements, and attributes with theirs.
  std::vector<pugi::xml_node> elements;
  std::vector<std::pair<pugi::xml_node, pugi::xml_attribute>> attributes;

  std::vector<std::string> lines() const;

private:
  /// Things of one kind in order of appearance: what they are, the text that follows the names, and the names of their owners.
  struct group {
    std::string what, after;
    std::vector<std::string> names;
    std::size_t count = 0;
  };
  struct groups {
    std::vector<group> all;
    std::map<std::pair<std::string, std::string>, std::size_t> at; ///< index in `all` for (what, after)
    group &of(const std::string &what, const std::string &after = {});
    void add_place(const std::string &what, const std::string &after, const owner &where, int line);
    std::vector<group> merged() const;
  };

  groups links_, joints_, robot_, elements_, attributes_, texts_;
};

} // namespace ksl::text
