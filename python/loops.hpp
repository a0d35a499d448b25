// Calls about loops (ksl/loops.hpp) for many positions: arrays of doubles, C-contiguous, a row for each state; ksl.mechanism.loops makes them.
#pragma once

#include "array.hpp"
#include "calls.hpp"
#include "one_state.hpp"
#include "without_gil.hpp"

#include "engine/compiled/algorithms.hpp"
#include "engine/loops/assembly.hpp"
#include "engine/loops/derivatives.hpp"
#include "ksl/force_elements.hpp"
#include "ksl/loops.hpp"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace loops_calls {

namespace nb = nanobind;
using namespace nb::literals;

/// An array that Python made: double, aligned, contiguous, (states, columns).
struct rows {
  const double *first;
  std::size_t states, columns;

  rows(const double *numbers, std::size_t n, int length)
      : first(numbers), states(n), columns(static_cast<std::size_t>(length)) {}
  explicit rows(nb::handle array) {
    const auto a = reinterpret_cast<PyArrayObject *>(array.ptr());
    if (!PyArray_Check(array.ptr()) || PyArray_TYPE(a) != NPY_DOUBLE || PyArray_NDIM(a) != 2 || !PyArray_ISCARRAY_RO(a))
      throw std::invalid_argument("a contiguous array of doubles with two axes is expected");
    first = static_cast<const double *>(PyArray_DATA(a));
    states = static_cast<std::size_t>(PyArray_DIM(a, 0)), columns = static_cast<std::size_t>(PyArray_DIM(a, 1));
  }
  const double *operator[](std::size_t k) const { return first + k * columns; }
  ksl::rows_view<const double> view() const { return {first, static_cast<std::ptrdiff_t>(columns)}; }
};

inline nb::object new_rows(std::size_t states, std::size_t columns) {
  const npy_intp shape[] = {static_cast<npy_intp>(states), static_cast<npy_intp>(columns)};
  return calls::new_array(2, shape, NPY_DOUBLE);
}
inline double *data_of(nb::handle array) {
  return static_cast<double *>(PyArray_DATA(reinterpret_cast<PyArrayObject *>(array.ptr())));
}

/// A workspace that is made where it is first used.
class late_data {
public:
  explicit late_data(const ksl::model &m) : m_(m) {}
  operator ksl::data &() { return d_ ? *d_ : d_.emplace(m_); }

private:
  const ksl::model &m_;
  std::optional<ksl::data> d_;
};

/// Calls step(d, k, row) for each state, with the row of a new array (states, columns).
template <class Step> nb::object each(const ksl::model &m, std::size_t states, std::size_t columns, Step step) {
  nb::object out = new_rows(states, columns);
  double *const first = data_of(out);
  late_data d(m);
  std::optional<without_gil> released;
  if (states >= 32)
    released.emplace();
  for (std::size_t k = 0; k < states; ++k)
    step(d, k, first + k * columns);
  released.reset();
  return out;
}

inline std::vector<unsigned char> flags(const ksl::model &m, const std::vector<int> &coordinates) {
  std::vector<unsigned char> all(static_cast<std::size_t>(m.nv()), 0);
  for (const int v : coordinates)
    all.at(static_cast<std::size_t>(v)) = 1;
  return all;
}

inline nb::dict loop_dict(const ksl::model &m, const ksl::loop_row &l) {
  const ksl::joint_kind_row kind = ksl::row_of(l.kind);
  const auto pose = [](const ksl::SE3<double> &D) {
    return std::array<double, 16>{D.R.m00, D.R.m01, D.R.m02, D.t.x, D.R.m10, D.R.m11, D.R.m12, D.t.y,
                                  D.R.m20, D.R.m21, D.R.m22, D.t.z, 0,       0,       0,       1};
  };
  nb::dict d;
  d["name"] = l.name, d["kind"] = kind.name;
  d["predecessor"] = m.links()[static_cast<std::size_t>(l.predecessor)].name;
  d["successor"] = m.links()[static_cast<std::size_t>(l.successor)].name;
  d["predecessor_pose"] = pose(l.predecessor_pose), d["successor_pose"] = pose(l.successor_pose);
  const auto axis = [](const ksl::vec3<double> &u) { return std::array<double, 3>{u.x, u.y, u.z}; };
  d["axis"] = kind.has_axis ? nb::cast(axis(l.axis)) : nb::none();
  d["axis2"] = kind.has_axis2 ? nb::cast(axis(l.axis2)) : nb::none();
  d["pitch"] = l.pitch;
  d["equations"] = 6 - kind.nv;
  const ksl::loop_description &of = m.description().loops[static_cast<std::size_t>(&l - m.loops().data())];
  d["turned"] = of.turned, d["moved"] = of.moved;
  return d;
}

/// External wrenches of some states: links, arrays (states, 6), and their axes.
struct externals {
  std::vector<int> links;
  std::vector<rows> arrays;
  ksl::expressed_in axes;

  externals(const std::vector<int> &on, const nb::list &numbers, bool in_world)
      : links(on), axes(in_world ? ksl::expressed_in::world : ksl::expressed_in::frame) {
    for (nb::handle each : numbers)
      arrays.emplace_back(each);
  }
  ksl::external_wrenches<double> of_state(std::size_t k, std::vector<double> &memory) const {
    memory.clear();
    for (const rows &array : arrays)
      memory.insert(memory.end(), array[k], array[k] + 6);
    return {static_cast<int>(links.size()), links.data(), memory.data(), axes};
  }
  /// A batch with these wrenches; `memory` must live as long.
  ksl::batch_view<double> of_batch(std::vector<ksl::external_rows<double>> &memory) const {
    for (std::size_t e = 0; e < links.size(); ++e)
      memory.push_back({links[e], arrays[e].view()});
    ksl::batch_view<double> batch;
    batch.external_n = static_cast<int>(memory.size()), batch.external = memory.data(), batch.external_axes = axes;
    return batch;
  }
};

/// The first position with a quaternion that isn't of unit length up to rounding; as many as there are if all are.
inline std::size_t first_rough(const ksl::model &m, const rows &q) {
  std::size_t found = q.states;
  ksl::check_quaternions(m, q.view(), 0, q.states, [&](const ksl::joint_row &, std::size_t k, const double *) {
    found = std::min(found, k);
    return true;
  });
  return found;
}

/// Judges quaternions as calls of algorithms do: refuses those that are not of unit length.  Returns what is to be warned of; empty: nothing.
inline std::string judged_quaternions(const ksl::model &m, nb::handle q, const std::string &method) {
  const rows Q(q);
  calls::refuse_quaternions(m, Q.view(), Q.states);
  const std::size_t rough = first_rough(m, Q);
  return rough < Q.states ? calls::of_normalised(calls::rough_quaternion(method, m, rough)) : "";
}

/// The numbers of a plain array of so many doubles; null if it is anything else.
inline const double *plain_vector(nb::handle x, int n) {
  const bool fits = calls::is_plain(x, 1) && PyArray_DIM(reinterpret_cast<PyArrayObject *>(x.ptr()), 0) == n;
  return fits ? calls::numbers_of(x) : nullptr;
}

/// Derivatives of one state in plain arrays, without external wrenches, as matrices.  None for other arrays, and for states that the plan
/// doesn't fit: derivatives() computes these, or says why it can't.
inline nb::object derivatives_of_state(const ksl::model &m, nb::handle q, nb::handle v, nb::handle x, bool forward) {
  const npy_intp nv = m.nv(), f = ksl::loops::freedoms_by_plan(m), shape[] = {nv, f}, square[] = {nv, nv};
  ksl::state_view<double> s;
  s.q = plain_vector(q, m.nq()), s.v = plain_vector(v, m.nv());
  const double *&last = forward ? s.tau : s.a;
  last = plain_vector(x, m.nv());
  if (f == 0 || !s.q || !s.v || !last || first_rough(m, rows(s.q, 1, m.nq())) == 0)
    return nb::none();
  nb::object out[3];
  double *results[3];
  for (int r = 0; r < 3; ++r) {
    out[r] = calls::new_array(2, r == 2 && forward ? square : shape, NPY_DOUBLE);
    results[r] = data_of(out[r]);
  }
  const ksl::nearest_rounding rounding;
  if (!ksl::loops::derive_by_plan(forward, m, nullptr, s, results[0], results[1], results[2]))
    return nb::none();
  const std::size_t numbers = static_cast<std::size_t>(nv * f);
  for (int r = 0; r < 3; ++r)
    if (!calls::finite(results[r], r == 2 && forward ? static_cast<std::size_t>(nv * nv) : numbers))
      return nb::none();
  return nb::make_tuple(out[0], out[1], out[2]);
}

/// The freedoms that results of no states have: those of the plan, which nearly all states follow.
inline std::size_t freedoms_of_none(const ksl::model &m) {
  return m.view().loops ? static_cast<std::size_t>(m.view().loops->freedoms) : 0;
}

/// Derivatives along the mechanism of inverse or of forward dynamics: three arrays, and the number of independent coordinates, which must be
/// the same in all states.
inline nb::object derivatives(const ksl::model &m, nb::handle q, nb::handle v, nb::handle x,
                              const std::vector<int> &links, const nb::list &wrenches, bool in_world, bool forward) {
  const rows Q(q), V(v), X(x);
  const externals e(links, wrenches, in_world);
  late_data d(m);
  const std::size_t nv = static_cast<std::size_t>(m.nv());
  std::vector<double> memory, by_q(nv * nv), by_v(nv * nv), by_x(nv * nv); // their freedoms are not known before
  std::vector<unsigned char> done(Q.states, 0);
  std::vector<ksl::external_rows<double>> rows_of_links;
  const auto derive = forward ? ksl::closed_forward_dynamics_derivatives : ksl::closed_inverse_dynamics_derivatives;
  std::size_t f = 0;
  nb::object out[3];
  const auto make = [&] {
    out[0] = new_rows(Q.states, nv * f), out[1] = new_rows(Q.states, nv * f);
    out[2] = new_rows(Q.states, nv * (forward ? nv : f));
  };
  if (const int planned = ksl::loops::freedoms_by_plan(m); planned > 0) {
    f = static_cast<std::size_t>(planned);
    make();
    double *const results[] = {data_of(out[0]), data_of(out[1]), data_of(out[2])};
    ksl::batch_view<double> batch = e.of_batch(rows_of_links);
    batch.n = Q.states, batch.q = Q.view(), batch.v = V.view(), (forward ? batch.tau : batch.a) = X.view();
    for (int r = 0; r < 3; ++r)
      batch.result[r] = {results[r], static_cast<std::ptrdiff_t>(nv * (r == 2 && forward ? nv : f))};
    if (Q.states == 1) { // straight into the arrays
      ksl::state_view<double> s;
      s.q = Q[0], s.v = V[0], (forward ? s.tau : s.a) = X[0], s.external = e.of_state(0, memory);
      const ksl::nearest_rounding rounding;
      done[0] = ksl::loops::derive_by_plan(forward, m, nullptr, s, results[0], results[1], results[2]);
    } else {
      const without_gil released;
      ksl::compiled::derive_in_lanes(forward, m, batch, done.data());
    }
  }
  for (std::size_t k = 0; k < Q.states; ++k) {
    if (done[k])
      continue;
    const std::size_t freedoms = static_cast<std::size_t>(
        derive(m, d, Q[k], V[k], X[k], e.of_state(k, memory), by_q.data(), by_v.data(), by_x.data()));
    if (!out[0].is_valid()) {
      f = freedoms;
      make();
    }
    if (freedoms != f)
      throw std::invalid_argument("state " + std::to_string(k) +
                                  " has another number of freedoms than state 0; call it alone");
    std::copy_n(by_q.data(), nv * f, data_of(out[0]) + k * nv * f);
    std::copy_n(by_v.data(), nv * f, data_of(out[1]) + k * nv * f);
    const std::size_t columns = forward ? nv : f;
    std::copy_n(by_x.data(), nv * columns, data_of(out[2]) + k * nv * columns);
  }
  if (Q.states == 0) {
    f = freedoms_of_none(m);
    make();
  }
  return nb::make_tuple(out[0], out[1], out[2], f);
}

/// How motions and wrenches of loops vary along the mechanism, and the wrenches (closed_reaction_variations), of all states.
inline nb::object reaction_variations(const ksl::model &m, nb::handle q, nb::handle v, nb::handle a,
                                      const std::vector<int> &links, const nb::list &wrenches, bool in_world) {
  const rows Q(q), V(v), X(a);
  const externals e(links, wrenches, in_world);
  ksl::data d(m);
  const std::size_t nv = static_cast<std::size_t>(m.nv()), loops = m.loops().size();
  std::vector<int> indices(nv);
  std::vector<double> memory;
  const std::size_t f =
      Q.states ? static_cast<std::size_t>(ksl::independent(m, d, Q[0], indices.data())) : freedoms_of_none(m);
  const std::size_t columns[] = {9 * f * nv, 36 * f * loops, 18 * f * loops, 12 * loops};
  nb::object out[4];
  for (int i = 0; i < 4; ++i)
    out[i] = new_rows(Q.states, columns[i]);
  for (std::size_t k = 0; k < Q.states; ++k) {
    if (static_cast<std::size_t>(ksl::independent(m, d, Q[k], indices.data())) != f)
      throw std::invalid_argument("state " + std::to_string(k) +
                                  " has another number of freedoms than state 0; call it alone");
    double *at[4];
    for (int i = 0; i < 4; ++i)
      at[i] = data_of(out[i]) + k * columns[i];
    ksl::closed_reaction_variations(m, d, Q[k], V[k], X[k], e.of_state(k, memory), at[0], at[1], at[2], at[3]);
  }
  return nb::make_tuple(out[0], out[1], out[2], out[3], f);
}

inline nb::dict force_element_dict(const ksl::model &m, const ksl::force_element_row &f) {
  const ksl::force_element_numbers &x = f.numbers;
  const auto point = [](const ksl::vec3<double> &p) { return std::array<double, 3>{p.x, p.y, p.z}; };
  nb::dict d;
  d["name"] = f.name;
  d["link1"] = m.links()[static_cast<std::size_t>(f.link1)].name;
  d["link2"] = m.links()[static_cast<std::size_t>(f.link2)].name;
  d["point1"] = point(f.point1), d["point2"] = point(f.point2);
  d["stiffness"] = x.stiffness, d["free_length"] = x.free_length, d["damping"] = x.damping, d["preload"] = x.preload;
  d["lower"] = x.lower, d["upper"] = x.upper, d["stop_stiffness"] = x.stop_stiffness;
  return d;
}

/// Lengths, rates and tensions of force elements, (states, 3 × elements).
inline nb::object force_element_states(const ksl::model &m, nb::handle q, nb::handle v) {
  const rows Q(q), V(v);
  const std::size_t n = m.force_elements().size();
  nb::object out = new_rows(Q.states, 3 * n);
  double *row = data_of(out);
  for (std::size_t k = 0; k < Q.states; ++k, row += 3 * n)
    ksl::force_element_states(m, Q[k], V[k], row, row + n, row + 2 * n);
  return out;
}

/// What loops and force elements are, and the equations of loops.
inline void add_equations(nb::class_<ksl::model> &model) {
  model
      .def_prop_ro("force_elements",
                   [](const ksl::model &m) {
                     nb::list all;
                     for (const ksl::force_element_row &f : m.force_elements())
                       all.append(force_element_dict(m, f));
                     return all;
                   })
      .def("force_element_states", &force_element_states, "q"_a, "v"_a);
  model
      .def_prop_ro("loops",
                   [](const ksl::model &m) {
                     nb::list all;
                     for (const ksl::loop_row &l : m.loops())
                       all.append(loop_dict(m, l));
                     return all;
                   })
      .def_prop_ro("drives", [](const ksl::model &m) { return m.description().drives; })
      .def_prop_ro("drive_weights", [](const ksl::model &m) { return m.description().drive_weights; })
      .def_prop_ro("loop_rows", &ksl::loop_rows)
      .def("judged_quaternions", &judged_quaternions, "q"_a, "method"_a)
      .def(
          "has_unit_quaternions",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            return first_rough(m, Q) == Q.states;
          },
          "q"_a)
      .def(
          "loop_error",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            return each(m, Q.states, static_cast<std::size_t>(ksl::loop_rows(m)),
                        [&](ksl::data &d, std::size_t k, double *out) { ksl::loop_error(m, d, Q[k], out); });
          },
          "q"_a)
      .def(
          "loop_jacobian",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            return each(m, Q.states, static_cast<std::size_t>(ksl::loop_rows(m) * m.nv()),
                        [&](ksl::data &d, std::size_t k, double *out) { ksl::loop_jacobian(m, d, Q[k], out); });
          },
          "q"_a)
      .def(
          "loop_acceleration",
          [](const ksl::model &m, nb::handle q, nb::handle v, nb::handle a) {
            const rows Q(q), V(v), A(a);
            return each(
                m, Q.states, static_cast<std::size_t>(ksl::loop_rows(m)),
                [&](ksl::data &d, std::size_t k, double *out) { ksl::loop_acceleration(m, d, Q[k], V[k], A[k], out); });
          },
          "q"_a, "v"_a, "a"_a);
}

/// Freedoms that loops leave, and motions and positions that keep them closed.
inline void add_closing(nb::class_<ksl::model> &model) {
  model
      .def(
          "mobility",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            ksl::data d(m);
            std::vector<int> redundant(static_cast<std::size_t>(ksl::loop_rows(m)));
            const ksl::loop_mobility found = ksl::mobility(m, d, Q[0], redundant.data());
            redundant.resize(static_cast<std::size_t>(std::max(found.redundant, 0)));
            return nb::make_tuple(found.mobility, found.rank, found.redundant, found.smallest, found.next, found.length,
                                  redundant);
          },
          "q"_a)
      .def(
          "independent",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            ksl::data d(m);
            std::vector<int> indices(static_cast<std::size_t>(m.nv()));
            indices.resize(static_cast<std::size_t>(ksl::independent(m, d, Q[0], indices.data())));
            return indices;
          },
          "q"_a)
      .def(
          "consistent_velocity",
          [](const ksl::model &m, nb::handle q, nb::handle v, const std::vector<int> &given) {
            const rows Q(q), V(v);
            const std::vector<unsigned char> is_given = flags(m, given);
            std::vector<int> how(Q.states);
            nb::object out =
                each(m, Q.states, static_cast<std::size_t>(m.nv()), [&](ksl::data &d, std::size_t k, double *x) {
                  how[k] = static_cast<int>(ksl::consistent_velocity(m, d, Q[k], V[k], is_given.data(), x));
                });
            return nb::make_tuple(out, how);
          },
          "q"_a, "v"_a, "given"_a)
      .def(
          "consistent_acceleration",
          [](const ksl::model &m, nb::handle q, nb::handle v, nb::handle a, const std::vector<int> &given) {
            const rows Q(q), V(v), A(a);
            const std::vector<unsigned char> is_given = flags(m, given);
            std::vector<int> how(Q.states);
            nb::object out =
                each(m, Q.states, static_cast<std::size_t>(m.nv()), [&](ksl::data &d, std::size_t k, double *x) {
                  how[k] = static_cast<int>(ksl::consistent_acceleration(m, d, Q[k], V[k], A[k], is_given.data(), x));
                });
            return nb::make_tuple(out, how);
          },
          "q"_a, "v"_a, "a"_a, "given"_a)
      .def(
          "close",
          [](const ksl::model &m, nb::handle q, const std::vector<int> &hold, bool limits, int iterations, int starts) {
            const rows Q(q);
            const std::vector<unsigned char> held = flags(m, hold);
            std::vector<int> how(Q.states);
            std::vector<double> error(Q.states);
            const ksl::close_options options = {limits, iterations, starts};
            nb::object out =
                each(m, Q.states, static_cast<std::size_t>(m.nq()), [&](late_data &, std::size_t k, double *x) {
                  how[k] = static_cast<int>(ksl::loops::close(m, nullptr, Q[k], held.data(), options, x, &error[k]));
                });
            return nb::make_tuple(out, how, error);
          },
          "q"_a, "hold"_a, "limits"_a, "iterations"_a, "starts"_a);
}

inline void add_dynamics(nb::class_<ksl::model> &model) {
  model
      .def(
          "stabilised_forward_dynamics",
          [](const ksl::model &m, nb::handle q, nb::handle v, nb::handle tau, const std::vector<int> &links,
             const nb::list &wrenches, bool in_world, double alpha, double beta) {
            const rows Q(q), V(v), T(tau);
            const externals e(links, wrenches, in_world);
            std::vector<double> memory;
            return each(m, Q.states, static_cast<std::size_t>(m.nv()), [&](ksl::data &d, std::size_t k, double *a) {
              ksl::stabilised_forward_dynamics(m, d, Q[k], V[k], T[k], e.of_state(k, memory), {alpha, beta}, a);
            });
          },
          "q"_a, "v"_a, "tau"_a, "links"_a, "wrenches"_a, "in_world"_a, "alpha"_a, "beta"_a)
      .def("reaction_variations", &reaction_variations, "q"_a, "v"_a, "a"_a, "links"_a, "wrenches"_a, "in_world"_a)
      .def("closed_derivatives_of_state", &derivatives_of_state, "q"_a.none(), "v"_a.none(), "x"_a.none(), "forward"_a)
      .def("closed_derivatives", &derivatives, "q"_a, "v"_a, "x"_a, "links"_a, "wrenches"_a, "in_world"_a, "forward"_a)
      .def(
          "reaction_patterns",
          [](const ksl::model &m, nb::handle q) {
            const rows Q(q);
            const std::size_t length = 6 * (m.joints().size() + m.loops().size()),
                              most = static_cast<std::size_t>(ksl::loop_rows(m));
            ksl::data d(m);
            std::vector<double> found(most * length);
            const std::size_t n = static_cast<std::size_t>(ksl::reaction_patterns(m, d, Q[0], found.data()));
            nb::object out = new_rows(n, length);
            std::copy_n(found.data(), n * length, data_of(out));
            return out;
          },
          "q"_a)
      .def("lone_bodies",
           [](const ksl::model &m) { // link, direction and whether its mass is the same all round
             std::vector<std::tuple<int, std::array<double, 3>, bool>> found;
             for (const ksl::lone_body &body : ksl::lone_bodies(m))
               found.push_back({body.link, {body.direction.x, body.direction.y, body.direction.z}, body.is_even});
             return found;
           })
      .def("open_component", &ksl::open_component);
}

inline void add_loops(nb::class_<ksl::model> &model) {
  add_equations(model);
  add_closing(model);
  add_dynamics(model);
}

inline void add_tolerances(nb::module_ &module) {
  using namespace ksl::loop_tolerance;
  module.def(
      "loop_tolerances",
      [] {
        return std::map<std::string, double>{
            {"closed", closed}, {"accepted", accepted},     {"few_digits", few_digits},
            {"rank", rank},     {"unsure", unsure},         {"nearly_singular", nearly_singular},
            {"rates", rates},   {"plan_pivot", plan_pivot},
        };
      },
      "The tolerances of closed mechanisms (ksl/engine/algorithms/loops/tolerances.hpp).");
}

} // namespace loops_calls
