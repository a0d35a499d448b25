// Lists become lines, so that a thousand elements of one kind make one of them:
//
//     links     sensor (12 links)                                    by tag
//     joints    joint a, b: damping, friction (not used)             by what and why, then all with the same joints together
//     robot     transmission (6)                                     by tag
//     unknown   unknown element <foo> in link base, line 7, and 3 more    by tag and kind of owner, with the first place
#include "text/unused.hpp"

#include "text/words.hpp"

#include <algorithm>

namespace ksl::text {

unused_list::group &unused_list::groups::of(const std::string &what, const std::string &after) {
  const auto [entry, is_new] = at.try_emplace({what, after}, all.size());
  if (is_new)
    all.push_back({what, after, {}, 0});
  return all[entry->second];
}

/// Links form one group and joints another.  Only the first place is kept.
void unused_list::groups::add_place(const std::string &what, const std::string &after, const owner &where, int line) {
  group &same = of(what, after + " in " + where.kind);
  if (same.count++ > 0)
    return;
  same.names = {(where.name.empty() ? "" : " ") + where.name + ", line " + std::to_string(line)};
}

/// Groups with the same owners become one: "damping, friction".
/// Groups of one count and one first place only: of different counts the words "and 3 more" would be wrong for one of them.
std::vector<unused_list::group> unused_list::groups::merged() const {
  std::vector<group> fewer;
  std::map<std::pair<std::string, std::vector<std::string>>, std::size_t> first;
  for (const group &each : all) {
    const auto [entry, is_new] = first.try_emplace({each.after, each.names}, fewer.size());
    if (is_new)
      fewer.push_back(each);
    else if (fewer[entry->second].count == each.count)
      fewer[entry->second].what += ", " + each.what;
    else
      fewer.push_back(each);
  }
  return fewer;
}

void unused_list::in_robot(const std::string &tag) { ++robot_.of(tag).count; }

void unused_list::in_link(const std::string &tag) { ++links_.of(tag).count; }

void unused_list::in_joint(const std::string &what, const std::string &why, const std::string &joint) {
  joints_.of(what, why).names.push_back(joint);
}

void unused_list::unknown_element(pugi::xml_node element, const owner &where, int line) {
  elements.push_back(element);
  elements_.add_place("<" + std::string(element.name()) + ">", "", where, line);
}

void unused_list::unknown_attribute(pugi::xml_attribute attribute, pugi::xml_node of, const owner &where, int line) {
  attributes.push_back({of, attribute});
  attributes_.add_place(attribute.name(), " of <" + std::string(of.name()) + ">", where, line);
}

void unused_list::text(const std::string &tag, const owner &where, int line) {
  texts_.add_place("<" + tag + ">", "", where, line);
}

std::vector<std::string> unused_list::lines() const {
  std::vector<std::string> all;
  for (const group &each : links_.all)
    all.push_back(each.what + " (" + std::to_string(each.count) + (each.count == 1 ? " link)" : " links)"));
  for (const group &each : joints_.merged())
    all.push_back("joint " + listed(each.names, each.names.size()) + ": " + each.what + " (" + each.after + ")");
  for (const group &each : robot_.all)
    all.push_back(each.what + " (" + std::to_string(each.count) + ")");
  const auto add = [&all](const std::string &kind, const groups &places) {
    for (const group &each : places.merged())
      all.push_back(kind + each.what + each.after + each.names[0] +
                    (each.count > 1 ? ", and " + std::to_string(each.count - 1) + " more" : ""));
  };
  add("unknown element ", elements_);
  add("unknown attribute ", attributes_);
  add("text in ", texts_);
  for (std::string &line : all)
    line = printable(line);
  return all;
}

} // namespace ksl::text
