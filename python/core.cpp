// ksl._core: the model for Python, with a call for each algorithm (calls.hpp).
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "building.hpp"
#include "calls.hpp"
#include "compiled.hpp"
#include "generate.hpp"
#include "inverse_kinematics.hpp"
#include "loops.hpp"
#include "operators/binding.hpp"
#include "simulate.hpp"
#include "ksl/config.h"
#include "load/robot_file.hpp"
#include "paths.hpp"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

/// Paths are bytes: those of files need be no text.
std::string string_of(const nb::bytes &bytes) { return {bytes.c_str(), bytes.size()}; }

nb::bytes file_bytes(const nb::bytes &path) {
  const std::string bytes = ksl::bytes_of_robot_file(string_of(path));
  return nb::bytes(bytes.data(), bytes.size());
}

/// Reads a robot from a text in memory.  Its encoding is found as that of files; `name` stands for the file in messages.
ksl::model load_text(const nb::bytes &text, const nb::bytes &name, bool floating_base, bool mimic_independent,
                     bool strict, std::optional<std::array<double, 3>> gravity,
                     const building::payloads_given &payloads, bool masses_optional, const std::string &model_name,
                     const building::physics_given &physics, bool cut_loops) {
  return ksl::load_text(string_of(text), building::options_of(floating_base, gravity, payloads, physics),
                        {.mimic_independent = mimic_independent,
                         .strict = strict,
                         .masses_optional = masses_optional,
                         .model = model_name,
                         .cut_loops = cut_loops},
                        string_of(name));
}

/// What `ksl info` prints about a joint.  Limits that the file doesn't give are None.
nb::dict joint_dict(const ksl::model &m, const ksl::joint_row &j) {
  const ksl::joint_kind_row kind = ksl::row_of(j.kind);
  nb::dict d;
  d["name"] = j.name;
  d["kind"] = kind.name;
  d["child"] = m.links()[static_cast<std::size_t>(j.link)].name;
  d["parent"] = j.parent_link < 0 ? nb::object(nb::none())
                                  : nb::object(nb::cast(m.links()[static_cast<std::size_t>(j.parent_link)].name));
  const bool follows = j.leader >= 0;
  d["nq"] = follows ? 0 : kind.nq;
  d["nv"] = follows ? 0 : kind.nv;
  d["q_index"] = j.q_index;
  d["v_index"] = j.v_index;
  d["axis"] = std::array<double, 3>{j.axis.x, j.axis.y, j.axis.z};
  if (kind.has_axis2)
    d["axis2"] = std::array<double, 3>{j.axis2.x, j.axis2.y, j.axis2.z};
  d["pitch"] = j.pitch;
  d["has_axis"] = kind.has_axis;
  d["has_angle"] = kind.angle >= 0;
  d["has_limits"] = kind.has_limits;
  if (kind.quaternion >= 0)
    d["quaternion"] = kind.quaternion;
  if (follows) {
    d["leader"] = m.joints()[static_cast<std::size_t>(j.leader)].name;
    d["multiplier"] = j.multiplier;
    d["offset"] = j.offset;
  }
  if (j.description >= 0) {
    const ksl::joint_description &file = m.description().joints[static_cast<std::size_t>(j.description)];
    d["lower"] = file.lower;
    d["upper"] = file.upper;
    nb::list limits;
    for (int c = 0; c < ksl::numbers_with_limits(kind); ++c)
      limits.append(nb::make_tuple(ksl::limits_of(file, c).lower, ksl::limits_of(file, c).upper));
    d["limits"] = nb::tuple(limits);
    d["effort"] = file.effort;
    d["velocity"] = file.velocity;
    d["damping"] = file.damping;
    d["friction"] = file.friction;
    d["friction_width"] = file.friction_width;
    d["armature"] = file.armature;
    d["rotor_inertia"] = file.rotor_inertia;
    d["gear_ratio"] = file.gear_ratio;
    d["spring_stiffness"] = file.spring_stiffness;
    d["spring_rest"] = file.spring_rest;
    d["is_rotor"] = file.is_rotor;
  }
  return d;
}

nb::dict link_dict(const ksl::link_description &l) {
  const ksl::spatial_inertia<double> &I = l.inertia;
  nb::dict d;
  d["name"] = l.name;
  d["mass"] = I.m;
  d["first_moment"] = std::array<double, 3>{I.h.x, I.h.y, I.h.z};
  d["inertia"] = std::array<double, 6>{I.Ixx, I.Iyy, I.Izz, I.Ixy, I.Iyz, I.Izx};
  return d;
}

/// The words of n numbers of a joint: of(i) is that of number i.
using words = nb::typed<nb::tuple, nb::str, nb::ellipsis>;
template <class Of> words words_of(int n, Of of) {
  nb::list all;
  for (int i = 0; i < n; ++i)
    all.append(of(i));
  return words(nb::tuple(all));
}

/// The kinds of joints: all that the package says of a kind is taken from here.
void add_joint_kinds(nb::module_ &module) {
  using row = ksl::joint_kind_row;
  const auto some = [](int i) { return i < 0 ? std::optional<int>() : std::optional<int>(i); };
  nb::class_<row>(
      module, "JointKind",
      "A kind of joint.  Names of numbers are what tables call them after JOINT. (\"x\"), empty where the joint's name says it.")
      .def_prop_ro("name", [](const row &k) { return std::string(k.name); })
      .def_prop_ro(
          "other_name",
          [](const row &k) { return k.other_name ? std::optional<std::string>(k.other_name) : std::nullopt; },
          "A second name in files.")
      .def_ro("nq", &row::nq)
      .def_ro("nv", &row::nv)
      .def_ro("has_axis", &row::has_axis)
      .def_ro("has_axis2", &row::has_axis2)
      .def_ro("has_pitch", &row::has_pitch)
      .def_ro("has_limits", &row::has_limits, "Has it one coordinate, whose position can have bounds?")
      .def_prop_ro(
          "numbers_with_limits", [](const row &k) { return ksl::numbers_with_limits(k); },
          "How many numbers of q can have bounds.")
      .def_ro("is_free", &row::is_free)
      .def_ro("in_urdf", &row::in_urdf, "Does URDF itself define it?")
      .def_ro("velocity_is_rate", &row::velocity_is_rate,
              "Is v the rate of q?  Else it is a twist in the child's axes.")
      .def_prop_ro(
          "angle", [some](const row &k) { return some(k.angle); }, "Where in q its angle about the axis is.")
      .def_prop_ro(
          "quaternion", [some](const row &k) { return some(k.quaternion); },
          "Where in q a quaternion [x y z w] begins.")
      .def_prop_ro(
          "position", [](const row &k) { return words_of(k.nq, [&](int i) { return k.positions[i].name; }); }, "(nq)")
      .def_prop_ro(
          "velocity", [](const row &k) { return words_of(k.nv, [&](int i) { return k.velocities[i].velocity; }); },
          "(nv)")
      .def_prop_ro(
          "acceleration",
          [](const row &k) { return words_of(k.nv, [&](int i) { return k.velocities[i].acceleration; }); }, "(nv)")
      .def_prop_ro(
          "effort", [](const row &k) { return words_of(k.nv, [&](int i) { return k.velocities[i].effort; }); }, "(nv)")
      .def_prop_ro(
          "position_unit", [](const row &k) { return words_of(k.nq, [&](int i) { return k.positions[i].unit; }); },
          "(nq) m, rad, or empty for numbers of a quaternion.")
      .def_prop_ro(
          "velocity_unit", [](const row &k) { return words_of(k.nv, [&](int i) { return k.velocities[i].unit; }); },
          "(nv) m or rad, of the coordinate.");
  nb::list rows;
  for (const ksl::joint_kind kind : ksl::joint_kinds)
    rows.append(ksl::row_of(kind));
  module.attr("joint_kinds") = nb::tuple(rows);
}

/// DescriptionError and ResultError of ksl.base.errors, for those of C++.
void translate_exceptions() {
  nb::register_exception_translator([](const std::exception_ptr &p, void *) {
    try {
      std::rethrow_exception(p);
    } catch (const ksl::description_error &e) {
      nb::object error = nb::module_::import_("ksl.base.errors").attr("DescriptionError");
      PyErr_SetString(error.ptr(), e.what());
    } catch (const ksl::result_error &e) {
      nb::object error = nb::module_::import_("ksl.base.errors").attr("ResultError");
      nb::object raised = error(e.what());
      raised.attr("state") = e.state;
      PyErr_SetObject(error.ptr(), raised.ptr());
    }
  });
}

/// Which reactions and which links a call is about, and how results are expressed.
void add_enumerations(nb::module_ &module) {
  nb::enum_<ksl::wrench_part>(module, "Part")
      .value("total", ksl::wrench_part::total)
      .value("constraint", ksl::wrench_part::constraint)
      .value("actuation", ksl::wrench_part::actuation)
      .value("coupling", ksl::wrench_part::coupling);
  nb::enum_<ksl::wrench_side>(module, "Side")
      .value("child", ksl::wrench_side::child)
      .value("parent", ksl::wrench_side::parent);
  nb::enum_<ksl::wrench_frame>(module, "Frame")
      .value("joint", ksl::wrench_frame::joint)
      .value("world", ksl::wrench_frame::world)
      .value("link", ksl::wrench_frame::link);
}

void add_reactions_request(nb::module_ &module) {
  nb::class_<calls::reactions_request>(module, "Request", "Which reactions, and how they are to be expressed.")
      .def(
          "__init__",
          [](calls::reactions_request *self, std::vector<int> links, ksl::wrench_part part, ksl::wrench_side on,
             ksl::wrench_frame at, int at_link, std::array<double, 3> offset, ksl::wrench_frame axes, int axes_link,
             bool angular_first) {
            new (self) calls::reactions_request{std::move(links), {}};
            ksl::reaction_request &r = self->request;
            r.n = static_cast<int>(self->links.size());
            r.link = self->links.data();
            r.part = part;
            r.on = on;
            r.at = at;
            r.at_link = at_link;
            for (std::size_t i = 0; i < 3; ++i)
              r.offset[i] = offset[i];
            r.axes = axes;
            r.axes_link = axes_link;
            r.angular_first = angular_first;
          },
          "links"_a, "part"_a, "on"_a, "at"_a, "at_link"_a, "offset"_a, "axes"_a, "axes_link"_a, "angular_first"_a)
      .def_prop_ro("joints", [](const calls::reactions_request &r) { return r.request.n; });
}

void add_link_request(nb::module_ &module) {
  nb::class_<calls::link_request>(module, "Links",
                                  "Which links, by index, in what order; and how a motion of one is expressed.")
      .def(
          "__init__",
          [](calls::link_request *self, std::vector<int> index, bool world_axes, bool at_world, bool angular_first,
             int kind, std::array<double, 3> offset) {
            const auto in = [](bool world) { return world ? ksl::expressed_in::world : ksl::expressed_in::frame; };
            const auto which = static_cast<ksl::acceleration_kind>(kind);
            new (self) calls::link_request{
                std::move(index),
                {in(world_axes), in(at_world), angular_first, which, {offset[0], offset[1], offset[2]}}};
          },
          "index"_a, "world_axes"_a = false, "at_world"_a = false, "angular_first"_a = false, "kind"_a = 0,
          "offset"_a = std::array<double, 3>{})
      .def_prop_ro("n", [](const calls::link_request &links) { return links.index.size(); });
}

/// What a model says of itself.
void add_properties(nb::class_<ksl::model> &model) {
  model.def_prop_ro("nq", &ksl::model::nq)
      .def_prop_ro("nv", &ksl::model::nv)
      .def_prop_ro("tree_rows", &ksl::model::tree_rows)
      .def_prop_ro("tree_columns", nb::overload_cast<>(&ksl::model::tree_columns, nb::const_))
      .def_prop_ro("moving_joints", &ksl::model::moving_joints)
      .def_prop_ro_static(
          "joint_kinds", [](nb::handle) { return nb::module_::import_("ksl._core").attr("joint_kinds"); },
          "All kinds of joints, for what converts arguments.")
      .def_prop_ro("followers", &ksl::model::followers)
      .def_prop_ro("name", [](const ksl::model &m) { return m.description().name; })
      .def_prop_ro("file", [](const ksl::model &m) { return paths::str_of_path(m.description().file); })
      .def_prop_ro("gravity",
                   [](const ksl::model &m) {
                     const ksl::vec3<double> g = m.view().gravity;
                     return std::array<double, 3>{g.x, g.y, g.z};
                   })
      .def_prop_ro("position_ranges",
                   [](const ksl::model &m) {
                     std::vector<std::array<double, 2>> ranges;
                     for (const auto &[lower, upper] : m.position_ranges())
                       ranges.push_back({lower, upper});
                     return ranges;
                   })
      .def_prop_ro("unused", [](const ksl::model &m) { return m.description().unused; })
      .def_prop_ro("warnings", [](const ksl::model &m) { return m.description().warnings; })
      .def_prop_ro("joints",
                   [](const ksl::model &m) {
                     nb::list rows;
                     for (const ksl::joint_row &j : m.joints())
                       rows.append(joint_dict(m, j));
                     return rows;
                   })
      .def_prop_ro("links", [](const ksl::model &m) {
        nb::list rows;
        for (const ksl::link_description &l : m.links())
          rows.append(link_dict(l));
        return rows;
      });
}

/// Adds a method for each algorithm.  The methods of ksl.mechanism.calls wrap them, with keywords and docstrings.
void add_calls(nb::class_<ksl::model> &model) {
  for (const ksl::algorithm_row *row : ksl::rows::all)
    if (row->loops != ksl::loops_by::plan)
      model.def(
          row->name,
          [row](const ksl::model &m, nb::handle q, nb::handle x, nb::handle y, nb::handle z, nb::handle external,
                nb::handle request, nb::handle out,
                nb::handle threads) { return calls::run(*row, m, {q, x, y, z}, external, request, out, threads); },
          "q"_a.none(), "x"_a.none(), "y"_a.none(), "z"_a.none(), "external"_a.none(), "request"_a.none(),
          "out"_a.none(), "threads"_a.none());
}

void add_loading(nb::module_ &module) {
  module.def("file_bytes", &file_bytes, "path"_a,
             "The bytes of a robot file, if it is a regular one and not too large.");
  module.def("load_text", &load_text, "text"_a, "name"_a, "floating_base"_a, "mimic_independent"_a, "strict"_a,
             "gravity"_a.none(), "payloads"_a, "masses_optional"_a, "model_name"_a, "physics"_a, "cut_loops"_a = false);
}

} // namespace

// nanobind's function that begins the module, under another name: it would give the types of the main interpreter to a subinterpreter,
// which that one then lacks.
#define PyInit__core begin_core
NB_MODULE(_core, module) {
  if (_import_array() < 0)
    nb::raise_python_error();
  nb::set_leak_warnings(false); // a daemon thread that computes while the program ends keeps its model
  translate_exceptions();
  module.attr("__version__") = KSL_VERSION;
  module.attr("QUATERNION_TOLERANCE") = ksl::quaternion_tolerance;
  module.attr("QUATERNION_ROUNDING") = ksl::quaternion_rounding;
  module.def("instruction_set", &ksl::instruction_set, "Name of the instruction set whose kernels run.");
  add_joint_kinds(module);
  add_enumerations(module);
  add_reactions_request(module);
  add_link_request(module);
  nb::class_<ksl::model> model(module, "Model");
  add_properties(model);
  add_calls(model);
  generate_calls::add_recording(module, model);
  compiled_calls::add_compiled(model);
  model.def("inverse_kinematics", &calls::inverse_kinematics, "frames"_a, "target"_a, "start"_a.none(),
            "position_tolerance"_a, "orientation_tolerance"_a, "iterations"_a, "starts"_a, "seed"_a, "limits"_a,
            "threads"_a.none());
  building::add_surgery(model);
  loops_calls::add_loops(model);
  loops_calls::add_tolerances(module);
  simulation_calls::add_simulation(model);
  building::add_builder(module);
  add_loading(module);
  operators::add_operators(module);
}
#undef PyInit__core

extern "C" NB_EXPORT PyObject *PyInit__core() {
  if (PyInterpreterState_GetID(PyInterpreterState_Get()) == 0) // the main one's
    return begin_core();
  PyErr_SetString(
      PyExc_ImportError,
      "ksl can't be imported in a subinterpreter, since its types and NumPy's belong to the main interpreter; "
      "import it there, or use another process");
  return nullptr;
}
