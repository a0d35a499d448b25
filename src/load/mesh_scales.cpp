#include "load/mesh_scales.hpp"

#include "text/words.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace ksl::readers {

using namespace text;

namespace {

/// Inches and metres differ by 39, millimetres by 1000; nobody draws the same part in two sizes that differ so much.
constexpr double suspicious = 30;

struct use {
  double scale;
  std::string link;
};

/// The largest of the three scales; 1 where none is given or one is no number, which readers of geometry would refuse.
double scale_of(std::string_view text) {
  double largest = 0;
  for (const std::string_view word : split(text))
    largest = std::max(largest, std::fabs(number_in(word).value_or(1)));
  return largest > 0 ? largest : 1;
}

std::string link_around(pugi::xml_node node) {
  while (node && std::string_view(node.name()) != "link")
    node = node.parent();
  return node.attribute("name").value();
}

/// Meshes of URDF, <mesh filename scale/>, and of SDF, <mesh><uri/><scale/></mesh>.
struct mesh_finder : pugi::xml_tree_walker {
  std::map<std::string, std::vector<use>> uses;
  bool for_each(pugi::xml_node &node) override {
    if (std::string_view(node.name()) != "mesh")
      return true;
    const std::string file = node.attribute("filename").value() + std::string(trimmed(node.child_value("uri")));
    const std::string scale = node.attribute("scale").value() + std::string(node.child_value("scale"));
    if (!file.empty())
      uses[file].push_back({scale_of(scale), link_around(node)});
    return true;
  }
};

} // namespace

/// A mesh that two links draw at scales of 1 and 0.001, say, was made in metres by one and in millimetres by the other; masses and
/// lengths of the file may be in two units, too.
std::vector<std::string> mesh_scale_warnings(pugi::xml_node robot) {
  mesh_finder found;
  robot.traverse(found);
  std::vector<std::string> lines;
  for (const auto &[file, uses] : found.uses) {
    const auto [least, most] =
        std::minmax_element(uses.begin(), uses.end(), [](const use &a, const use &b) { return a.scale < b.scale; });
    if (most->scale / least->scale >= suspicious)
      lines.push_back(printable(
          "link " + least->link + (most->link == least->link ? "" : ", " + most->link) + ": mesh " + quoted(file) +
          " is used at scale " + shown(least->scale) + " and at scale " + shown(most->scale) +
          ", so one of them is in other units; check whether masses and lengths of this file are in kg and m"));
  }
  return lines;
}

} // namespace ksl::readers
