// Robot files that tests in C++ read.
#pragma once

#include <string>

// Where they lie is compiled into robot_files.cpp alone, so that a compiler's cache serves clones in other folders.
extern const char *const every_kind_file; // a robot with every kind of joint
extern const char *const coupled_file;    // the same with joints that follow others
extern const char *const sdf_file;

/// A sample robot, examples/robots/NAME.urdf.
std::string robot_file(const std::string &name);
