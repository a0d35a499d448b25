// Units of meshes, as far as a robot file shows them.
#pragma once

#include <pugixml.hpp>

#include <string>
#include <vector>

namespace ksl::readers {

/// A line for each mesh file that the robot uses at scales so far apart that one of them must be in other units (millimetres, inches).
/// The meshes themselves are not read.
std::vector<std::string> mesh_scale_warnings(pugi::xml_node robot);

} // namespace ksl::readers
