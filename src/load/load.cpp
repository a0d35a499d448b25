// Models from robot files.
#include "ksl/builder.hpp"
#include "ksl/dynamics.hpp"

#include "load/robot_file.hpp"

namespace ksl {

model load(const std::string &path, const model_options &options, const load_options &how) {
  return load_text(bytes_of_robot_file(path), options, how, path);
}

model load_text(const std::string &text, const model_options &options, const load_options &how,
                const std::string &name) {
  robot_description robot = read_robot_text(text, name,
                                            {.floating_base = options.floating_base,
                                             .mimic_independent = how.mimic_independent,
                                             .strict = how.strict,
                                             .model = how.model,
                                             .cut_loops = how.cut_loops});
  model_options others = options;
  others.floating_base = false; // the description says it
  return model_of(std::move(robot), others, {.strict = how.strict, .masses_optional = how.masses_optional});
}

} // namespace ksl
