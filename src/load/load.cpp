// Models from robot files.
#include "ksl/builder.hpp"
#include "ksl/dynamics.hpp"

#include "load/robot_file.hpp"

namespace ksl {

model load(const std::string &path, const model_options &options, bool mimic_independent, bool strict,
           bool masses_optional, const std::string &model_name) {
  return load_text(bytes_of_robot_file(path), options, mimic_independent, strict, masses_optional, model_name, path);
}

model load_text(const std::string &text, const model_options &options, bool mimic_independent, bool strict,
                bool masses_optional, const std::string &model_name, const std::string &name) {
  robot_description robot = read_robot_text(text, name, {mimic_independent, strict, options.floating_base, model_name});
  model_options others = options;
  others.floating_base = false; // the description says it
  return model_of(std::move(robot), others, strict, masses_optional);
}

} // namespace ksl
