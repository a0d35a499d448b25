// The class Operator of the extension.  ksl.operators makes its objects, and gives arrays that fit.
#pragma once

#include "../calls.hpp"
#include "card.hpp"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <tuple>

namespace operators {

namespace nb = nanobind;
using namespace nb::literals;

/// An operator that Python holds.
struct held {
  std::shared_ptr<const operation> of;
  std::int64_t number;

  explicit held(std::shared_ptr<const operation> o) : of(std::move(o)), number(kept<operation>::add(of)) {}
  held(const held &) = delete;
  held &operator=(const held &) = delete;
  ~held() { kept<operation>::remove(number); }
};

inline const ksl::algorithm_row *row_named(const std::string &name) {
  if (name.empty())
    return nullptr;
  for (const ksl::algorithm_row *row : ksl::rows::all)
    if (name == row->name)
      return row;
  for (const ksl::algorithm_row *row : completions)
    if (row && name == row->name)
      return row;
  throw nb::value_error(("no algorithm " + name).c_str());
}

inline lifted lift_named(const std::string &name) {
  return name == "position" ? lifted::position : name == "poses" ? lifted::poses : lifted::plain;
}

using terms = std::vector<std::tuple<int, int, int>>;

inline void init(held *self, const ksl::model &m, const std::string &value, int value_result, const std::string &lift,
                 const std::string &first, std::vector<int> first_result, const std::string &gradient,
                 const std::string &second, const terms &second_terms, const std::string &regressor,
                 int regressor_result, bool solved, nb::handle request, nb::handle external, bool in_world,
                 const std::vector<int> &given, bool nan_where_open) {
  description d;
  d.value = row_named(value), d.value_result = value_result, d.lift = lift_named(lift);
  if (d.value)
    for (std::size_t k = 0; k < std::size(completions); ++k)
      if (completions[k] == d.value)
        d.completes = static_cast<completed>(k);
  d.given.assign(static_cast<std::size_t>(m.nv()), 0);
  for (const int v : given)
    d.given.at(static_cast<std::size_t>(v)) = 1;
  d.nan_where_open = nan_where_open;
  d.first = row_named(first), d.first_result = std::move(first_result);
  d.gradient = row_named(gradient), d.second = row_named(second);
  for (const auto &[result, x, y] : second_terms)
    d.second_terms.push_back({result, x, y});
  d.regressor = row_named(regressor), d.regressor_result = regressor_result, d.solved = solved;
  d.solve = solved ? row_named("solve_mass_matrix") : nullptr;
  if (!external.is_none())
    d.external_links = nb::cast<const calls::link_request &>(external).index;
  d.external_axes = in_world ? ksl::expressed_in::world : ksl::expressed_in::frame;
  if (nb::isinstance<calls::link_request>(request)) {
    const auto &links = nb::cast<const calls::link_request &>(request);
    d.links = links.index, d.frame = links.frame;
  } else if (nb::isinstance<calls::reactions_request>(request)) {
    const auto &joints = nb::cast<const calls::reactions_request &>(request);
    d.joint_links = joints.links, d.joints = joints.request, d.has_joints = true;
  }
  try {
    new (self) held(std::make_shared<const operation>(m, std::move(d)));
  } catch (const std::invalid_argument &e) {
    throw nb::value_error(e.what());
  }
}

template <class S> using read = nb::ndarray<const S, nb::c_contig, nb::device::cpu>;
template <class S> using written = nb::ndarray<S, nb::c_contig, nb::device::cpu>;

/// Computes a stage on arrays of ksl.operators: (groups, states, numbers), or (groups, links, 10).
template <class S>
void compute_arrays(const held &self, int what, const std::vector<read<S>> &in, const std::vector<written<S>> &out,
                    int threads) {
  const operation &of = *self.of;
  const auto which = static_cast<stage>(what);
  if (what < 0 || what >= stages || static_cast<int>(in.size()) != inputs_of(which, of.buffers()) ||
      static_cast<int>(out.size()) != outputs_of(which, of.buffers()) || in[0].ndim() != 3)
    throw nb::value_error("arrays don't fit the operator");
  arrays<S> given;
  given.groups = in[0].shape(0), given.states = in[0].shape(1);
  for (const read<S> &x : in)
    given.in.push_back(x.data());
  for (const written<S> &x : out)
    given.out.push_back(x.data());
  std::optional<without_gil> released;
  if (given.groups * given.states >= calls::states_worth_releasing)
    released.emplace();
  compute(of, which, given, threads);
}

/// What lies at an address that Python has from the driver.
template <class Pointer> Pointer at_address(std::uintptr_t address) {
  return reinterpret_cast<Pointer>(address); // NOLINT(performance-no-int-to-ptr): ctypes gives numbers
}

/// functions: addresses, in the order of card::driver; on: of each card the kernel, its context, threads and multiprocessors.
inline void init_kernel(card::held *self, const std::vector<std::uintptr_t> &functions,
                        const std::vector<std::tuple<std::uintptr_t, std::uintptr_t, int, int>> &on,
                        const std::vector<std::int64_t> &widths, std::size_t inputs, bool single) {
  card::kernel k = {{}, {}, widths, inputs, single};
  const auto take = [&](auto &function, std::size_t i) {
    function = at_address<std::decay_t<decltype(function)>>(functions.at(i));
  };
  take(k.of.launch, 0), take(k.of.context_of, 1), take(k.of.get_current, 2), take(k.of.push, 3), take(k.of.pop, 4);
  take(k.of.name_of, 5);
  for (const auto &[function, context, threads, multiprocessors] : on)
    k.on.push_back({at_address<void *>(function), at_address<void *>(context), threads, multiprocessors});
  new (self) card::held(std::move(k));
}

inline void add_operators(nb::module_ &module) {
  nb::class_<held>(module, "Operator", "An algorithm with its derivatives, for one model.")
      .def("__init__", &init, "model"_a, "value"_a, "value_result"_a, "lift"_a, "first"_a, "first_result"_a,
           "gradient"_a, "second"_a, "second_terms"_a, "regressor"_a, "regressor_result"_a, "solved"_a,
           "request"_a.none(), "external"_a.none(), "in_world"_a, "given"_a, "nan_where_open"_a)
      .def_ro("number", &held::number, "By which compiled programs name it.")
      .def_prop_ro("widths",
                   [](const held &h) {
                     std::vector<int> all;
                     for (int x = 0; x < h.of->buffers(); ++x)
                       all.push_back(h.of->width(x));
                     return all;
                   })
      .def_prop_ro(
          "shape", [](const held &h) { return h.of->result_shape(); }, "Of the result of a state.")
      .def("compute", &compute_arrays<double>, "stage"_a, "inputs"_a, "outputs"_a, "threads"_a)
      .def("compute", &compute_arrays<float>, "stage"_a, "inputs"_a, "outputs"_a, "threads"_a);
  nb::class_<card::held>(module, "CardKernel", "A kernel that is loaded on graphics cards, for programs of JAX.")
      .def("__init__", &init_kernel, "functions"_a, "on"_a, "widths"_a, "inputs"_a, "single"_a)
      .def_ro("number", &card::held::number, "By which compiled programs name it.");
  module.attr("xla_handler") = nb::capsule(reinterpret_cast<void *>(&ffi::handle<ffi::execute, 0>));
  module.attr("xla_handler_on_card") =
      nb::capsule(reinterpret_cast<void *>(&ffi::handle<card::execute, xla::may_be_recorded>));
}

} // namespace operators
