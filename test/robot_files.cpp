#include "robot_files.hpp"

const char *const every_kind_file = KSL_SOURCES "/test/engine/every_kind.urdf";
const char *const coupled_file = KSL_SOURCES "/test/engine/coupled.urdf";
const char *const sdf_file = KSL_SOURCES "/test/reference/read_sdf.sdf";

std::string robot_file(const std::string &name) { return KSL_SOURCES "/examples/robots/" + name + ".urdf"; }
