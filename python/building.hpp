// The builder, and models made from others, for Python.  Arrays come as lists of numbers, matrices by rows; ksl.model.builder
// and ksl.model.surgery check their shapes.
#pragma once

#include "description_state.hpp"
#include "engine/building/inertias.hpp"
#include "ksl/surgery.hpp"
#include "ksl/urdf.hpp"

#include <nanobind/stl/tuple.h>

namespace building {

namespace nb = nanobind;
using namespace nb::literals;

using three = std::array<double, 3>;
using mass_numbers = std::tuple<double, three, std::array<double, 9>>; // mass, centre of mass, inertia about it
using joint_numbers = std::tuple<std::optional<three>, std::optional<three>, ksl::optional_number, ksl::optional_number,
                                 ksl::optional_number, ksl::optional_number, ksl::optional_number, double, double,
                                 std::optional<std::tuple<std::string, double, double>>, // leader, multiplier, offset
                                 ksl::optional_number, std::array<double, 5>, std::array<ksl::optional_number, 4>>;
using dh_numbers = std::tuple<std::array<double, 4>, std::string, mass_numbers, joint_numbers>;
using plain_values = nb::typed<nb::list, nb::any>;
using physics_given = std::tuple<std::vector<std::string>, double>; // names, width of friction
using payloads_given = std::vector<std::tuple<std::string, double, three>>;

inline ksl::vec3<double> vector_of(const three &x) { return {x[0], x[1], x[2]}; }

inline ksl::SE3<double> pose_of(const std::array<double, 16> &x) {
  return {{x[0], x[4], x[8], x[1], x[5], x[9], x[2], x[6], x[10]}, {x[3], x[7], x[11]}};
}

inline ksl::link_mass mass_of(const mass_numbers &given) {
  const auto &[mass, center, I] = given;
  return {mass, vector_of(center), {I[0], I[3], I[6], I[1], I[4], I[7], I[2], I[5], I[8]}};
}

inline ksl::joint_options options_of(const joint_numbers &given) {
  const auto &[axis, axis2, pitch, lower, upper, effort, velocity, damping, friction, mimic, friction_width, physics,
               further] = given;
  const auto vector = [](const std::optional<three> &x) { return x ? std::optional(vector_of(*x)) : std::nullopt; };
  ksl::joint_options options = {vector(axis), vector(axis2), pitch, lower,          upper,      effort,     velocity,
                                damping,      friction,      {},    friction_width, physics[0], physics[1], physics[2],
                                physics[3],   physics[4],    {}};
  for (std::size_t c = 0; c < 2; ++c)
    options.further[c] = {further[2 * c], further[2 * c + 1]};
  if (mimic)
    options.mimic = {std::get<0>(*mimic), std::get<1>(*mimic), std::get<2>(*mimic), {}};
  return options;
}

inline ksl::model_options options_of(bool floating_base, const std::optional<three> &gravity,
                                     const payloads_given &payloads, const physics_given &physics) {
  ksl::model_options options;
  options.physics = ksl::physics_named(std::get<0>(physics), std::get<1>(physics));
  options.floating_base = floating_base;
  options.gravity = gravity;
  for (const auto &[link, mass, point] : payloads)
    options.payloads.push_back({link, mass, point});
  return options;
}

inline void add_dh_chain(ksl::builder &b, const std::string &parent, const std::vector<dh_numbers> &rows, bool modified,
                         const std::string &prefix) {
  std::vector<ksl::dh_row> table;
  for (const auto &[numbers, kind, mass, options] : rows)
    table.push_back({numbers[0], numbers[1], numbers[2], numbers[3], ksl::joint_kind_named(kind), mass_of(mass),
                     options_of(options)});
  b.add_dh_chain(parent, table, modified ? ksl::dh_convention::modified : ksl::dh_convention::standard, prefix);
}

inline ksl::model with_inertias(const ksl::model &m,
                                const std::vector<std::tuple<int, std::array<double, 10>>> &given) {
  std::vector<ksl::link_inertia> inertias;
  for (const auto &[link, ten] : given)
    inertias.push_back({link, ksl::inertia_of_parameters(ten.data())});
  return m.with_inertias(inertias);
}

/// A joint that closes a loop, as Python gives it: name, kind, links, frames on both, axes, pitch.
using loop_given = std::tuple<std::string, std::string, std::string, std::string, std::array<double, 16>,
                              std::array<double, 16>, std::optional<three>, std::optional<three>, ksl::optional_number>;

inline void add_loop(ksl::builder &b, const loop_given &given) {
  const auto &[name, kind, predecessor, successor, on_predecessor, on_successor, axis, axis2, pitch] = given;
  const auto vector = [](const std::optional<three> &x) { return x ? std::optional(vector_of(*x)) : std::nullopt; };
  b.add_loop(name, ksl::joint_kind_named(kind), predecessor, successor, pose_of(on_predecessor), pose_of(on_successor),
             {vector(axis), vector(axis2), pitch});
}

/// A force element, as Python gives it: name, links, points on both, stiffness, free length, damping, preload, limits, stop stiffness.
using force_element_given = std::tuple<std::string, std::string, std::string, three, three, std::array<double, 4>,
                                       std::array<ksl::optional_number, 2>, double>;

inline void add_force_element(ksl::builder &b, const force_element_given &given) {
  const auto &[name, link1, link2, point1, point2, numbers, limits, stop] = given;
  b.add_force_element(name, link1, vector_of(point1), link2, vector_of(point2),
                      {numbers[0], numbers[1], numbers[2], numbers[3], limits[0], limits[1], stop});
}

/// A builder checks loops and finds their links, which have the same indices in it.  Its own joints have names that no loop has.
inline ksl::model with_loops(const ksl::model &m, const std::vector<loop_given> &loops,
                             const std::vector<force_element_given> &elements) {
  ksl::builder alone(m.description().name);
  std::size_t longest = 0;
  for (const loop_given &loop : loops)
    longest = std::max(longest, std::get<0>(loop).size());
  const std::string name(longest + 1, '_');
  int number = 0;
  for (const ksl::link_description &link : m.description().links) {
    alone.add_link(link.name);
    if (const std::string &root = m.description().links.front().name; root != link.name)
      alone.add_joint(name + std::to_string(number++), ksl::joint_kind::fixed, root, link.name,
                      pose_of({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}));
  }
  for (const loop_given &loop : loops)
    add_loop(alone, loop);
  for (const force_element_given &of : elements)
    add_force_element(alone, of);
  const ksl::robot_description all = alone.description();
  return ksl::model(ksl::with_force_elements(ksl::with_loops(m.description(), all.loops), all.force_elements));
}

/// A builder is the one object here that changes: without the interpreter's lock, its own keeps two threads apart.
inline void add_builder(nb::module_ &module) {
  nb::class_<ksl::builder>(module, "Builder", "Links and joints as ksl.Builder passes them on.")
      .def(nb::init<std::string, three>(), "name"_a, "gravity"_a)
      .def(
          "read_from",
          [](ksl::builder &b, const std::string &file, const std::vector<std::string> &unused,
             const std::vector<std::string> &warnings) { b.read_from(file, unused, warnings); },
          "file"_a, "unused"_a, "warnings"_a, nb::lock_self())
      .def(
          "add_link",
          [](ksl::builder &b, const std::string &name, const mass_numbers &mass) { b.add_link(name, mass_of(mass)); },
          "name"_a, "mass"_a, nb::lock_self())
      .def(
          "add_joint",
          [](ksl::builder &b, const std::string &name, const std::string &kind, const std::string &parent,
             const std::string &child, const std::array<double, 16> &pose, const joint_numbers &options) {
            b.add_joint(name, ksl::joint_kind_named(kind), parent, child, pose_of(pose), options_of(options));
          },
          "name"_a, "kind"_a, "parent"_a, "child"_a, "pose"_a, "options"_a, nb::lock_self())
      .def("add_loop", &add_loop, "loop"_a, nb::lock_self())
      .def("add_force_element", &add_force_element, "element"_a, nb::lock_self())
      .def(
          "set_drives",
          [](ksl::builder &b, const std::vector<std::string> &joints, const std::vector<double> &weights) {
            b.set_drives(joints, weights);
          },
          "joints"_a, "weights"_a, nb::lock_self())
      .def("add_dh_chain", &add_dh_chain, "parent"_a, "rows"_a, "modified"_a, "prefix"_a, nb::lock_self())
      .def(
          "build",
          [](const ksl::builder &b, bool floating_base, bool strict, std::optional<three> gravity,
             const payloads_given &payloads, bool masses_optional, const physics_given &physics) {
            return b.build(options_of(floating_base, gravity, payloads, physics),
                           {.strict = strict, .masses_optional = masses_optional});
          },
          "floating_base"_a, "strict"_a, "gravity"_a.none(), "payloads"_a, "masses_optional"_a,
          "physics"_a = physics_given(std::vector<std::string>(), ksl::physics_options().friction_width),
          nb::lock_self());
}

inline void add_surgery(nb::class_<ksl::model> &model) {
  model
      .def(
          "with_root",
          [](const ksl::model &m, const std::string &link) {
            return ksl::model(ksl::with_root(m.description(), link));
          },
          "link"_a)
      .def(
          "with_frozen_joints",
          [](const ksl::model &m, const std::vector<std::tuple<std::string, std::vector<double>>> &joints) {
            std::vector<ksl::frozen_joint> frozen;
            for (const auto &[joint, q] : joints)
              frozen.push_back({joint, q});
            return ksl::model(ksl::with_frozen_joints(m.description(), frozen));
          },
          "joints"_a)
      .def(
          "with_payload",
          [](const ksl::model &m, const std::string &link, const mass_numbers &payload) {
            return ksl::model(ksl::with_payload(m.description(), link, mass_of(payload)));
          },
          "link"_a, "payload"_a)
      .def(
          "merged",
          [](const ksl::model &m, const ksl::model &other, const std::string &parent_link,
             const std::array<double, 16> &pose, const std::string &prefix) {
            return ksl::model(ksl::merged(m.description(), other.description(), parent_link, pose_of(pose), prefix));
          },
          "other"_a, "parent_link"_a, "pose"_a, "prefix"_a)
      .def(
          "subtree",
          [](const ksl::model &m, const std::string &link, bool drop_loops) {
            return ksl::model(ksl::subtree(m.description(), link, {drop_loops}));
          },
          "link"_a, "drop_loops"_a)
      .def(
          "with_frame",
          [](const ksl::model &m, const std::string &name, const std::string &link,
             const std::array<double, 16> &pose) {
            return ksl::model(ksl::with_frame(m.description(), name, link, pose_of(pose)));
          },
          "name"_a, "link"_a, "pose"_a)
      .def("with_loops", &with_loops, "loops"_a, "elements"_a)
      .def("without_loops", [](const ksl::model &m) { return ksl::model(ksl::without_loops(m.description())); })
      .def(
          "with_compliances",
          [](const ksl::model &m,
             const std::vector<std::tuple<std::string, std::array<double, 36>, std::array<double, 36>>> &given) {
            std::vector<ksl::joint_compliance> compliances;
            for (const auto &[joint, matrix, loose] : given)
              compliances.push_back({joint, matrix, loose});
            return ksl::model(ksl::with_compliances(m.description(), std::move(compliances)));
          },
          "compliances"_a)
      .def(
          "with_drives",
          [](const ksl::model &m, const std::vector<std::string> &joints, const std::vector<double> &weights) {
            return ksl::model(ksl::with_drives(m.description(), joints, weights));
          },
          "joints"_a, "weights"_a)
      .def("with_inertias", &with_inertias, "inertias"_a)
      .def("with_gravity", &ksl::model::with_gravity, "gravity"_a)
      .def(
          "with_physics",
          [](const ksl::model &m, const physics_given &physics) {
            ksl::model_options options;
            options.physics = ksl::physics_named(std::get<0>(physics), std::get<1>(physics));
            return ksl::model(m.description(), options);
          },
          "physics"_a)
      .def_prop_ro("physics",
                   [](const ksl::model &m) {
                     return physics_given{ksl::names_of(m.description().physics),
                                          m.description().physics.friction_width};
                   })
      .def("urdf_text", [](const ksl::model &m) { return ksl::urdf_text(m.description()); })
      .def("state", [](const ksl::model &m) { return plain_values(description_state::state_of(m.description())); })
      .def_static(
          "from_state", [](plain_values state) { return ksl::model(description_state::robot_of(std::move(state))); },
          "state"_a);
}

} // namespace building
