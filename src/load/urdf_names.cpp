// Names of kinds are those of ksl::joint_kinds, with the names that URDF or other formats have for some of them (other_name).
#include "load/urdf_names.hpp"

#include "ksl/engine/model/joints.hpp"
#include "text/words.hpp"

namespace ksl::readers {

using text::quoted;

joint_kind kind_in(const element &joint) {
  const std::string type = joint.text("type");
  std::vector<std::string> names;
  for (const joint_kind kind : joint_kinds) {
    const joint_kind_row row = row_of(kind);
    if (type == row.name || (row.other_name && type == row.other_name))
      return kind;
    names.push_back(row.name);
  }
  const std::string known = text::listed(names, names.size());
  if (type.empty())
    joint.refuse("<" + joint.tag() + "> has no type; write type=\"...\" with one of " + known);
  joint.refuse("joint type " + quoted(type) + " is unknown, expected one of " + known +
               text::suggestion(type, names, "write one of these"));
}

int link_in(const element &joint, const char *tag, const links_by_name &links) {
  const element end = joint.child(tag);
  const std::string example = std::string("<").append(tag).append(" link=\"...\"/>");
  if (!end)
    joint.refuse("no <" + std::string(tag) + "> in <" + joint.tag() + ">; add " + example);
  const std::string name = end.text("link");
  if (name.empty())
    end.refuse("<" + std::string(tag) + "> names no link; write " + example);
  if (const auto found = links.index.find(name); found != links.index.end())
    return found->second;
  std::vector<std::string> names;
  for (const link_description &link : links.robot.links)
    names.push_back(link.name);
  end.refuse(std::string(tag) + " link " + quoted(name) + " does not exist" +
             text::suggestion(name, names, "add that link, or name one of " + text::listed(names)));
}

} // namespace ksl::readers
