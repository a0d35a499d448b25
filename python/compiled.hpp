// Code that Python had compiled for one mechanism: which call each function answers, and where it is.
#pragma once

#include "calls.hpp"
#include "engine/states/machine_code.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace compiled_calls {

namespace nb = nanobind;
using namespace nb::literals;

/// The words by which it was asked for, its row and request, the links on which wrenches act, whether it is of float, how
/// many states it takes at a time, the bytes of memory that it needs, and its address (batch_code).
using given_code =
    std::tuple<std::string, std::string, nb::object, std::vector<int>, bool, int, std::size_t, std::uintptr_t>;

inline ksl::requested_code code_of(const given_code &given) {
  const auto &[asked, name, request, externals, single, lanes, bytes, address] = given;
  ksl::requested_code code;
  for (const ksl::algorithm_row *row : ksl::rows::all)
    if (name == row->name)
      code.row = row;
  if (!code.row)
    calls::refuse("there is no algorithm " + name);
  code.asked = asked, code.single = single, code.lanes = lanes, code.bytes = bytes, code.externals = externals;
  code.run = reinterpret_cast<ksl::batch_code>(address); // NOLINT(performance-no-int-to-ptr): ctypes gives numbers
  if (nb::isinstance<calls::reactions_request>(request)) {
    const calls::reactions_request &of = nb::cast<const calls::reactions_request &>(request);
    code.joints = of.links, code.reactions = of.request;
  } else if (nb::isinstance<calls::link_request>(request)) {
    const calls::link_request &of = nb::cast<const calls::link_request &>(request);
    code.links = of.index, code.frame = of.frame;
  }
  return code;
}

inline ksl::model with_code(const ksl::model &m, const std::vector<given_code> &given) {
  const auto code = std::make_shared<ksl::machine_code>();
  for (const given_code &one : given)
    code->rows.push_back(code_of(one));
  if (m.code()) // what was compiled before answers where this doesn't
    code->rows.insert(code->rows.end(), m.code()->rows.begin(), m.code()->rows.end());
  return m.with_code(code);
}

inline void add_compiled(nb::class_<ksl::model> &model) {
  model.def(
      "with_code", &with_code, "functions"_a,
      "The model with functions that answer calls: (words, row, request, external links, single, lanes, bytes, address).");
  model.def("compiled", [](const ksl::model &m) {
    std::vector<std::string> words;
    for (std::size_t i = 0; m.code() && i < m.code()->rows.size(); ++i)
      words.push_back(m.code()->rows[i].asked);
    return words;
  });
}

} // namespace compiled_calls
