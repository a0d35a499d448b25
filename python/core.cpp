// ksl._core: the model and its batch calls for Python.  Shapes are plain here ((n, nq) and so on); ksl.model gives them
// their leading dimensions, names and keywords.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "direct.hpp"
#include "ksl/config.h"
#include "without_gil.hpp"

#include <algorithm>

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class S> using matrix_in = nb::ndarray<const S, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
template <class S> using external_in = nb::ndarray<const S, nb::ndim<3>, nb::c_contig, nb::device::cpu>;
template <class S, int dimensions> using array_out = nb::ndarray<S, nb::ndim<dimensions>, nb::c_contig, nb::device::cpu>;

struct request_fields {
  std::vector<int> links;
  ksl::reaction_request request;
};

/// Links by index, in the order wanted: kept by ksl.model, so that a call converts no list.
struct link_list {
  std::vector<int> index;
};

template <class S, class Array> ksl::rows_view<S> rows_of(const Array &x) {
  return {x.data(), static_cast<std::ptrdiff_t>(x.ndim() > 1 ? x.size() / std::max<std::size_t>(1, x.shape(0)) : 1)};
}

/// Rows of a (n, width) argument; none where it is not given.
template <class S>
ksl::rows_view<const S> input(const std::optional<matrix_in<S>> &x, std::size_t n, int width) {
  if (!x)
    return {};
  if (x->shape(0) != n || x->shape(1) != static_cast<std::size_t>(width))
    throw std::invalid_argument("each of v, a and tau must have nv columns and as many rows as q");
  return rows_of<const S>(*x);
}

template <class S>
ksl::batch_view<S> batch_of(const ksl::model &m, const matrix_in<S> &q, const std::optional<matrix_in<S>> &v = {},
                            const std::optional<matrix_in<S>> &a = {}, const std::optional<matrix_in<S>> &tau = {}) {
  ksl::batch_view<S> batch;
  batch.n = q.shape(0);
  batch.q = input<S>(q, batch.n, m.nq());
  batch.v = input(v, batch.n, m.nv());
  batch.a = input(a, batch.n, m.nv());
  batch.tau = input(tau, batch.n, m.nv());
  return batch;
}

/// links must outlive the batch.
template <class S>
void add_external(const ksl::model &m, ksl::batch_view<S> &batch, const std::vector<int> &links,
                  const external_in<S> &wrenches) {
  if (wrenches.shape(0) != batch.n || wrenches.shape(1) != links.size() || wrenches.shape(2) != 6)
    throw std::invalid_argument("external wrenches must have the shape (n, links, 6)");
  for (int link : links)
    if (link < 0 || static_cast<std::size_t>(link) >= m.links().size())
      throw std::out_of_range("external wrench on a link out of range");
  batch.external_n = static_cast<int>(links.size());
  batch.external_link = links.data();
  batch.external = rows_of<const S>(wrenches);
}

template <class S, class Array> ksl::rows_view<S> output(const Array &out, std::size_t n, std::size_t width) {
  if (out.shape(0) != n || (n && out.size() / n != width))
    throw std::invalid_argument("a result array has the wrong shape");
  return rows_of<S>(out);
}

/// Efforts into tau (n, nv), unless None, and for each request its reactions into outs (n, joints, 6).
template <class S>
void inverse_dynamics(const ksl::model &m, matrix_in<S> q, std::optional<matrix_in<S>> v, std::optional<matrix_in<S>> a,
                      const std::vector<int> &external_links, external_in<S> external, std::optional<array_out<S, 2>> tau,
                      const std::vector<request_fields *> &requests, const std::vector<array_out<S, 3>> &outs, int threads) {
  ksl::batch_view<S> batch = batch_of(m, q, v, a);
  add_external(m, batch, external_links, external);
  if (tau)
    batch.out = output<S>(*tau, batch.n, static_cast<std::size_t>(m.nv()));
  std::vector<ksl::reaction_rows<S>> wanted;
  for (std::size_t r = 0; r < requests.size(); ++r) {
    const ksl::reaction_request &request = requests[r]->request;
    wanted.push_back({request, output<S>(outs.at(r), batch.n, 6 * static_cast<std::size_t>(request.n))});
  }
  const without_gil released;
  ksl::inverse_dynamics_batch(m, batch, wanted, threads);
}

template <class S>
void forward_dynamics(const ksl::model &m, matrix_in<S> q, matrix_in<S> v, matrix_in<S> tau,
                      const std::vector<int> &external_links, external_in<S> external, array_out<S, 2> out, int threads) {
  ksl::batch_view<S> batch = batch_of<S>(m, q, v, {}, tau);
  add_external(m, batch, external_links, external);
  batch.out = output<S>(out, batch.n, static_cast<std::size_t>(m.nv()));
  const without_gil released;
  ksl::forward_dynamics_batch(m, batch, threads);
}

template <class S> void mass_matrix(const ksl::model &m, matrix_in<S> q, array_out<S, 3> out, int threads) {
  ksl::batch_view<S> batch = batch_of(m, q);
  batch.out = output<S>(out, batch.n, static_cast<std::size_t>(m.nv()) * static_cast<std::size_t>(m.nv()));
  const without_gil released;
  ksl::mass_matrix_batch(m, batch, threads);
}

/// Poses of the links into out (n, links, 4, 4).
template <class S>
void frame_poses(const ksl::model &m, matrix_in<S> q, const link_list &links, array_out<S, 4> out, int threads) {
  ksl::batch_view<S> batch = batch_of(m, q);
  batch.out = output<S>(out, batch.n, 16 * links.index.size());
  const without_gil released;
  ksl::frame_poses_batch(m, batch, static_cast<int>(links.index.size()), links.index.data(), threads);
}

template <class S>
void energy(const ksl::model &m, matrix_in<S> q, matrix_in<S> v, array_out<S, 1> kinetic, array_out<S, 1> potential, int threads) {
  const ksl::batch_view<S> batch = batch_of<S>(m, q, v);
  const ksl::rows_view<S> out[2] = {output<S>(kinetic, batch.n, 1), output<S>(potential, batch.n, 1)};
  const without_gil released;
  ksl::energy_batch(m, batch, out[0], out[1], threads);
}

template <class S>
void external_power(const ksl::model &m, matrix_in<S> q, matrix_in<S> v, const std::vector<int> &external_links,
                    external_in<S> external, array_out<S, 1> power, int threads) {
  ksl::batch_view<S> batch = batch_of<S>(m, q, v);
  add_external(m, batch, external_links, external);
  batch.out = output<S>(power, batch.n, 1);
  const without_gil released;
  ksl::external_power_batch(m, batch, threads);
}

ksl::model load(const std::string &path, bool floating_base, bool mimic_independent, bool strict,
                std::array<double, 3> gravity,
                const std::vector<std::tuple<std::string, double, std::array<double, 3>>> &payloads,
                bool masses_optional) {
  ksl::model_options options;
  options.floating_base = floating_base;
  options.gravity = gravity;
  for (const auto &[link, mass, point] : payloads)
    options.payloads.push_back({link, mass, point});
  return ksl::load(path, options, mimic_independent, strict, masses_optional);
}

/// What `ksl info` prints of a joint; limits that the file leaves out are None.
nb::dict joint_dict(const ksl::model &m, const ksl::joint_row &j) {
  nb::dict d;
  d["name"] = j.name;
  d["kind"] = ksl::row_of(j.kind).name;
  d["child"] = m.links()[static_cast<std::size_t>(j.link)].name;
  d["parent"] = j.parent_link < 0 ? nb::object(nb::none())
                                  : nb::object(nb::cast(m.links()[static_cast<std::size_t>(j.parent_link)].name));
  d["nq"] = ksl::row_of(j.kind).nq;
  d["nv"] = ksl::row_of(j.kind).nv;
  d["q_index"] = j.q_index;
  d["v_index"] = j.v_index;
  d["axis"] = std::array<double, 3>{j.axis.x, j.axis.y, j.axis.z};
  d["pitch"] = j.pitch;
  if (j.description >= 0) {
    const ksl::joint_description &file = m.description().joints[static_cast<std::size_t>(j.description)];
    d["lower"] = file.lower;
    d["upper"] = file.upper;
    d["effort"] = file.effort;
    d["velocity"] = file.velocity;
    d["damping"] = file.damping;
    d["friction"] = file.friction;
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

/// The calls that exist in both precisions; nanobind chooses by the arrays' dtype.
template <class S> void add_batch_calls(nb::class_<ksl::model> &model) {
  model
      .def("inverse_dynamics", &inverse_dynamics<S>, "q"_a.noconvert(), "v"_a.none().noconvert(), "a"_a.none().noconvert(),
           "external_links"_a, "external"_a.noconvert(), "tau"_a.none().noconvert(), "requests"_a, "outs"_a, "threads"_a)
      .def("forward_dynamics", &forward_dynamics<S>, "q"_a.noconvert(), "v"_a.noconvert(), "tau"_a.noconvert(),
           "external_links"_a, "external"_a.noconvert(), "out"_a.noconvert(), "threads"_a)
      .def("mass_matrix", &mass_matrix<S>, "q"_a.noconvert(), "out"_a.noconvert(), "threads"_a)
      .def("frame_poses", &frame_poses<S>, "q"_a.noconvert(), "links"_a, "out"_a.noconvert(), "threads"_a)
      .def("energy", &energy<S>, "q"_a.noconvert(), "v"_a.noconvert(), "kinetic"_a.noconvert(), "potential"_a.noconvert(),
           "threads"_a)
      .def("external_power", &external_power<S>, "q"_a.noconvert(), "v"_a.noconvert(), "external_links"_a,
           "external"_a.noconvert(), "out"_a.noconvert(), "threads"_a);
}

} // namespace

NB_MODULE(_core, module) {
  nb::register_exception_translator([](const std::exception_ptr &p, void *) {
    try {
      std::rethrow_exception(p);
    } catch (const ksl::description_error &e) {
      nb::object error = nb::module_::import_("ksl.errors").attr("DescriptionError");
      PyErr_SetString(error.ptr(), e.what());
    }
  });

#ifdef NDEBUG
  nb::set_leak_warnings(false); // a daemon thread in a call holds its model to the end: no leak
#endif

  module.attr("__version__") = KSL_VERSION;
  module.def("instruction_set", &ksl::instruction_set, "Name of the instruction set whose kernels run.");

  nb::enum_<ksl::wrench_part>(module, "Part")
      .value("total", ksl::wrench_part::total)
      .value("constraint", ksl::wrench_part::constraint)
      .value("actuation", ksl::wrench_part::actuation);
  nb::enum_<ksl::wrench_side>(module, "Side")
      .value("child", ksl::wrench_side::child)
      .value("parent", ksl::wrench_side::parent);
  nb::enum_<ksl::wrench_frame>(module, "Frame")
      .value("joint", ksl::wrench_frame::joint)
      .value("world", ksl::wrench_frame::world)
      .value("link", ksl::wrench_frame::link);

  nb::class_<request_fields>(module, "Request", "Which reactions, and how they are to be expressed.")
      .def(
          "__init__",
          [](request_fields *self, std::vector<int> links, ksl::wrench_part part, ksl::wrench_side on, ksl::wrench_frame at,
             int at_link, std::array<double, 3> offset, ksl::wrench_frame axes, int axes_link, bool angular_first) {
            new (self) request_fields{std::move(links), {}};
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
      .def_prop_ro("joints", [](const request_fields &r) { return r.request.n; });

  nb::class_<link_list>(module, "Links", "Which links, by index, in what order.")
      .def("__init__", [](link_list *self, std::vector<int> index) { new (self) link_list{std::move(index)}; }, "index"_a)
      .def_prop_ro("n", [](const link_list &links) { return links.index.size(); });

  nb::class_<ksl::model> model(module, "Model");
  model
      .def_prop_ro("nq", &ksl::model::nq)
      .def_prop_ro("nv", &ksl::model::nv)
      .def_prop_ro("moving_joints", &ksl::model::moving_joints)
      .def_prop_ro("name", [](const ksl::model &m) { return m.description().name; })
      .def_prop_ro("file", [](const ksl::model &m) { return m.description().file; })
      .def_prop_ro("gravity",
                   [](const ksl::model &m) {
                     const ksl::vec3<double> g = m.view().gravity;
                     return std::array<double, 3>{g.x, g.y, g.z};
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
      .def_prop_ro("links",
                   [](const ksl::model &m) {
                     nb::list rows;
                     for (const ksl::link_description &l : m.links())
                       rows.append(link_dict(l));
                     return rows;
                   });
  add_batch_calls<double>(model);
  add_batch_calls<float>(model);
  model
      .def("inverse_dynamics_direct", &direct::inverse_dynamics, "q"_a, "v"_a.none(), "a"_a.none(), "external"_a.none(),
           "tau"_a, "threads"_a)
      .def(
          "reactions_direct",
          [](const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, nb::handle external, const request_fields &r,
             nb::handle out, int threads) { return direct::reactions(m, q, v, a, external, r.request, out, threads); },
          "q"_a, "v"_a, "a"_a, "external"_a.none(), "request"_a, "out"_a, "threads"_a)
      .def("forward_dynamics_direct", &direct::forward_dynamics, "q"_a, "v"_a, "tau"_a, "external"_a.none(), "a"_a, "threads"_a)
      .def("mass_matrix_direct", &direct::mass_matrix, "q"_a, "out"_a, "threads"_a)
      .def("frame_pose_direct", &direct::frame_pose, "q"_a, "link"_a, "out"_a, "threads"_a)
      .def(
          "frame_poses_direct",
          [](const ksl::model &m, nb::handle q, const link_list &links, nb::handle out, int threads) {
            return direct::frame_poses(m, q, links.index, out, threads);
          },
          "q"_a, "links"_a, "out"_a, "threads"_a)
      .def("energy_direct", &direct::energy, "q"_a, "v"_a, "kinetic"_a, "potential"_a, "threads"_a);

  module.def("load", &load, "path"_a, "floating_base"_a, "mimic_independent"_a, "strict"_a, "gravity"_a, "payloads"_a,
             "masses_optional"_a);
}
