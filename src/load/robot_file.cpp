#include "load/robot_file.hpp"

#include "load/sdf.hpp"
#include "load/urdf.hpp"
#include "text/regular_file.hpp"
#include "text/rounding.hpp"
#include "text/words.hpp"

namespace ksl {

std::string bytes_of_robot_file(const std::string &path) { return text::bytes_of_file(path); }

std::string bytes_of_robot_text(const char *text, std::size_t length, const std::string &name) {
  text::check_size(length, name);
  return {text, length};
}

/// The root element says which format it is: <sdf>, or <robot> of URDF, whose reader refuses all others by what they seem to be.  A floating base is
/// known to SDF's reader, since links float on the world there, and set behind URDF's.
robot_description read_robot_text(const std::string &text, const std::string &name, const read_options &options) {
  const nearest_rounding rounding;
  const text::xml_file file(text, name);
  const std::string root = file.root().name();
  if (root == "sdf")
    return read_sdf(file, options);
  if (!options.model.empty())
    text::refuse(name, 0,
                 "model " + text::quoted(options.model) +
                     " is asked for, but only SDF files hold several; leave that option out");
  robot_description robot = read_urdf(file, options);
  robot.floating_base = options.floating_base;
  return robot;
}

} // namespace ksl
