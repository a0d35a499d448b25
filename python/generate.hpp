// Recordings for Python: what src/generate/ records, as bytes that NumPy reads.
#pragma once

#include "calls.hpp"
#include "generate/record_derivative.hpp"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace generate_calls {

namespace nb = nanobind;
using namespace nb::literals;

/// The arrays of a graph, each as bytes: (n) of uint8, (n, 3) of int32, (n) of float64, (outputs) of int32.
class recording_of_python {
public:
  explicit recording_of_python(ksl::generate::recorded of) : of_(std::move(of)) {}

  nb::bytes operations() const {
    return bytes_of([](const auto &s) { return static_cast<std::uint8_t>(s.what); });
  }
  nb::bytes operands() const {
    struct three { std::int32_t a, b, c; };
    return bytes_of([](const auto &s) { return three{s.a, s.b, s.c}; });
  }
  nb::bytes numbers() const {
    return bytes_of([](const auto &s) { return s.number; });
  }
  nb::bytes outputs() const {
    const std::vector<int> &all = of_.steps.outputs();
    return nb::bytes(all.data(), all.size() * sizeof(int));
  }
  std::vector<std::pair<std::string, int>> inputs() const {
    std::vector<std::pair<std::string, int>> all;
    for (const auto &[name, numbers] : of_.inputs)
      all.emplace_back(name, numbers);
    return all;
  }
  std::vector<std::pair<std::string, std::vector<int>>> results() const {
    std::vector<std::pair<std::string, std::vector<int>>> all;
    for (const auto &[name, shape] : of_.results)
      all.emplace_back(name, shape);
    return all;
  }

private:
  template <class Of> nb::bytes bytes_of(Of of) const {
    std::vector<decltype(of(of_.steps.steps()[0]))> all;
    for (const ksl::generate::step &s : of_.steps.steps())
      all.push_back(of(s));
    return nb::bytes(all.data(), all.size() * sizeof(all[0]));
  }

  ksl::generate::recorded of_;
};

inline recording_of_python record(const ksl::model &m, const std::string &row, nb::handle request,
                                  const std::vector<int> &external_links, bool gravity,
                                  const std::vector<int> &payload_links, const std::vector<int> &parameter_links,
                                  bool pivots, bool single, const std::string &kind) {
  ksl::generate::request asked;
  asked.row = row, asked.external_links = external_links, asked.gravity = gravity, asked.single = single;
  asked.payload_links = payload_links, asked.parameter_links = parameter_links, asked.pivots = pivots;
  if (nb::isinstance<calls::reactions_request>(request)) {
    asked.joints = nb::cast<const calls::reactions_request &>(request).request;
  } else if (nb::isinstance<calls::link_request>(request)) {
    const calls::link_request &links = nb::cast<const calls::link_request &>(request);
    asked.links = links.index, asked.frame = links.frame;
  }
  try {
    using ksl::generate::derivative;
    const std::map<std::string, derivative> kinds = {{"jvp", derivative::rates},
                                                     {"vjp", derivative::weights},
                                                     {"jacobian", derivative::matrix},
                                                     {"adjoint", derivative::adjoint},
                                                     {"adjoint's jacobian", derivative::adjoints_matrix}};
    const auto found = kinds.find(kind);
    return recording_of_python(found == kinds.end() ? ksl::generate::record_or_differentiate(m, asked)
                                                    : ksl::generate::record_derivative(m, asked, found->second));
  } catch (const ksl::generate::recording_error &e) {
    calls::refuse(row + " can't be generated for this mechanism: " + e.what());
  }
}

inline void add_recording(nb::module_ &module, nb::class_<ksl::model> &model) {
  nb::class_<recording_of_python>(module, "Recording",
                                  "An algorithm recorded on one mechanism: steps on earlier steps.")
      .def_prop_ro("operations", &recording_of_python::operations)
      .def_prop_ro("operands", &recording_of_python::operands)
      .def_prop_ro("numbers", &recording_of_python::numbers)
      .def_prop_ro("outputs", &recording_of_python::outputs)
      .def_prop_ro("inputs", &recording_of_python::inputs, "Names, and how many numbers each has.")
      .def_prop_ro("results", &recording_of_python::results, "Names and shapes.");
  model.def("record", &record, "row"_a, "request"_a.none(), "external_links"_a, "gravity"_a, "payload_links"_a,
            "parameter_links"_a, "pivots"_a, "single"_a, "kind"_a);
}

} // namespace generate_calls
