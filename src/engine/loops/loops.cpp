// Calls about loops (ksl/loops.hpp).
//
//     e(q)              loop_error           (rows) what is left of each joint's displacement
//     K(q)              loop_jacobian        (rows, nv) ė = K v where the loops are closed
//     K a + K̇ v         loop_acceleration    (rows)
//     σ of R K C        mobility             rank, freedoms nv − rank, redundant rows − rank, and how near the rank is to another one
//     null space of Kᵀ  reaction_patterns    wrenches that balance
//     K x = 0, −K̇ v     consistent_…         the solutions nearest to given numbers
//
// Pivots, where they are needed, are the state's own; only the derivatives try the plan of the model first.  A model without loops has no rows, and
// each call then answers as for a tree: all velocities are consistent, all coordinates independent.
#include "ksl/loops.hpp"

#include "engine/loops/assembly.hpp"
#include "engine/loops/closed_state.hpp"
#include "engine/loops/derivatives.hpp"
#include "engine/loops/findings.hpp"
#include "engine/loops/singular_values.hpp"
#include "engine/states/not_finite.hpp"
#include "engine/states/thread_memory.hpp"
#include "ksl/dynamics.hpp"
#include "ksl/result_error.hpp"
#include "text/rounding.hpp"

#include <cmath>
#include <initializer_list>

namespace ksl {
namespace {

using namespace loops;

/// Something that is laid out in the memory of a workspace, or of the thread where there is none or that is too small.
/// lay() is called twice with the same object: on an arena without memory, which adds sizes up, and on one that hands the pieces out.
template <class Work, class Lay> Work laid_out(Work work, data *d, Lay lay) {
  arena measure;
  lay(work, measure);
  arena memory(d && measure.used() <= d->bytes() ? d->memory() : thread_memory(kept_for::workspace, measure.used()));
  lay(work, memory);
  return work;
}
closed_state state_of(const model &m, data &d) {
  return laid_out(closed_state(m, loop_tolerance::accepted), &d,
                  [](closed_state &w, arena &memory) { w.lay_out(memory, 0); });
}
assembly assembly_of(const model &m, data *d) {
  return laid_out(assembly(m), d, [](assembly &w, arena &memory) { w.lay_out(memory); });
}
struct placed {
  geometry at;
  double *scaled, *values, *zero;
};
placed geometry_of(const model &m, data &d, const double *q) {
  const tables &t = m.loop_tables();
  placed p = laid_out(placed{geometry(m, t), nullptr, nullptr, nullptr}, &d, [&](placed &w, arena &memory) {
    w.at.lay_out(memory);
    w.scaled = memory.take<double>(t.rows * m.nv()), w.values = memory.take<double>(std::max(t.rows, m.nv()));
    w.zero = memory.take<double>(m.nv());
  });
  p.at.set_position(q);
  return p;
}

/// Numbers that a call was given, or has computed.
struct numbers {
  const double *first;
  std::ptrdiff_t n;

  bool are_finite() const {
    return !first || std::all_of(first, first + n, [](double x) { return std::isfinite(x); });
  }
};

/// Throws result_error, which allocates, where results are not finite although all arguments are.
/// Finite arguments with results that are not are an overflow, which is told; arguments that are not finite give such results without an error, as
/// all algorithms do.  So arguments may be written over only once it is known whether they were finite (given_finite).
void require_finite(const char *call, const char *what, std::initializer_list<numbers> results,
                    std::initializer_list<numbers> arguments) {
  const auto finite = [](const numbers &x) { return x.are_finite(); };
  if (!std::all_of(results.begin(), results.end(), finite) && std::all_of(arguments.begin(), arguments.end(), finite))
    for (const numbers &x : results)
      examine_numbers(call, what, x.first, x.n);
}
void require_finite(const char *call, const model &m, const geometry &at, const double *q) {
  require_finite(call, "the Jacobian of the loops", {{at.jacobian(), std::ptrdiff_t(m.loop_tables().rows) * m.nv()}},
                 {{q, m.nq()}});
}

} // namespace

int loop_rows(const model &m) { return m.loops().empty() ? 0 : m.loop_tables().rows; }

void loop_error(const model &m, data &d, const double *q, double *error) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return;
  geometry_of(m, d, q).at.error(error);
  require_finite("loop_error", "error", {{error, loop_rows(m)}}, {{q, m.nq()}});
}

void loop_jacobian(const model &m, data &d, const double *q, double *J) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return;
  const placed p = geometry_of(m, d, q);
  require_finite("loop_jacobian", m, p.at, q);
  std::copy_n(p.at.jacobian(), loop_rows(m) * m.nv(), J);
}

void loop_acceleration(const model &m, data &d, const double *q, const double *v, const double *a,
                       double *acceleration) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return;
  geometry_of(m, d, q).at.acceleration(q, v, a, acceleration, nullptr);
  require_finite("loop_acceleration", "acceleration", {{acceleration, loop_rows(m)}},
                 {{q, m.nq()}, {v, m.nv()}, {a, m.nv()}});
}

loop_mobility mobility(const model &m, data &d, const double *q, int *redundant_rows) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return {m.nv(), 0, 0, 0, 0, 0};
  const tables &t = m.loop_tables();
  const int nv = m.nv(), rows = t.rows;
  require_finite("mobility", m, geometry_of(m, d, q).at, q);
  if (redundant_rows) {
    closed_state c = state_of(m, d);
    c.set_open_position(q);
    std::copy(c.solved().row + c.solved().rank, c.solved().row + rows, redundant_rows);
    std::sort(redundant_rows, redundant_rows + rows - c.solved().rank);
  }
  const placed p = geometry_of(m, d, q);
  // singular values of R K C, whose elements relate lengths to lengths (elimination.hpp): rank, and how far it is from another one
  // One-sided Jacobi rotations make the rows of `scaled` orthogonal, min(rows, nv) of them: R K C itself, or its transpose.
  const bool wide = rows < nv; // fewer vectors to turn
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < nv; ++j)
      p.scaled[wide ? i * nv + j : j * rows + i] = p.at.jacobian()[i * nv + j] *
                                                   t.row_scale[static_cast<std::size_t>(i)] *
                                                   t.column_scale[static_cast<std::size_t>(j)];
  const int n = std::min(rows, nv);
  singular_values(p.scaled, n, std::max(rows, nv), p.values);
  int rank = 0;
  while (rank < n && p.values[rank] > p.at.zero())
    ++rank;
  const double size = p.at.size();
  // Two singular values bound the gap at the rank: the smallest that counts, and the largest that doesn't, relative to the largest term.
  return {nv - rank, rank, rows - rank, rank > 0 ? p.values[rank - 1] / size : 0, rank < n ? p.values[rank] / size : 0,
          t.length};
}

int independent(const model &m, data &d, const double *q, int *indices) {
  const nearest_rounding rounding;
  if (m.loops().empty()) {
    for (int i = 0; i < m.nv(); ++i)
      indices[i] = i;
    return m.nv();
  }
  closed_state c = state_of(m, d);
  c.set_open_position(q);
  require_finite("independent", m, c.at(), q);
  std::copy_n(c.solved().independent(), c.solved().freedoms(), indices);
  return c.solved().freedoms();
}

completion consistent_velocity(const model &m, data &d, const double *q, const double *v, const unsigned char *given,
                               double *out) {
  const nearest_rounding rounding;
  if (m.loops().empty()) {
    std::copy_n(v, m.nv(), out);
    return completion::unique;
  }
  assembly w = assembly_of(m, &d);
  const bool given_finite = numbers{v, m.nv()}.are_finite(); // v may be out
  const completion how = w.complete_velocity(q, v, given, out);
  if (given_finite)
    require_finite("consistent_velocity", "velocities", {{out, m.nv()}}, {{q, m.nq()}});
  return how;
}

completion consistent_acceleration(const model &m, data &d, const double *q, const double *v, const double *a,
                                   const unsigned char *given, double *out) {
  const nearest_rounding rounding;
  if (m.loops().empty()) {
    std::copy_n(a, m.nv(), out);
    return completion::unique;
  }
  assembly w = assembly_of(m, &d);
  const bool given_finite = numbers{a, m.nv()}.are_finite(); // a may be out
  const completion how = w.complete_acceleration(q, v, a, given, out);
  if (given_finite)
    require_finite("consistent_acceleration", "accelerations", {{out, m.nv()}}, {{q, m.nq()}, {v, m.nv()}});
  return how;
}

closing loops::close(const model &m, data *d, const double *q, const unsigned char *hold, const close_options &options,
                     double *out, double *error) {
  const nearest_rounding rounding;
  if (m.loops().empty()) {
    std::copy_n(q, m.nq(), out);
    *error = 0;
    return closing::closed;
  }
  return assembly_of(m, d).close(q, hold, options, out, error);
}

closing close(const model &m, data &d, const double *q, const unsigned char *hold, const close_options &options,
              double *out, double *error) {
  return loops::close(m, &d, q, hold, options, out, error);
}

int reaction_patterns(const model &m, data &d, const double *q, double *patterns) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return 0;
  closed_state c = state_of(m, d);
  c.set_open_position(q);
  require_finite("reaction_patterns", m, c.at(), q);
  const int n = c.set_patterns(q);
  c.copy_patterns(n, open_component(m), patterns);
  return n;
}

std::vector<lone_body> lone_bodies(const model &m) {
  std::vector<lone_body> found;
  if (!m.loops().empty())
    for (const std::vector<idle_body> *bodies : {&m.loop_tables().idle, &m.loop_tables().uneven})
      for (const idle_body &body : *bodies)
        found.push_back({body.link, body.direction, body.is_even});
  return found;
}

double open_component(const model &m) {
  using loop_tolerance::open_component, loop_tolerance::rank_by_digits;
  return m.loops().empty() ? open_component : std::max(open_component, rank_by_digits * m.loop_tables().digits);
}

namespace {

closed_derivatives derivatives_of(const model &m, data &d, int externals) {
  return laid_out(closed_derivatives(m, loop_tolerance::accepted), &d,
                  [externals](closed_derivatives &w, arena &memory) { w.lay_out(memory, externals); });
}

void require(const char *call, const finding &fault, const model &m) {
  if (fault)
    throw result_error(std::string(call) + ": " + text_of(fault, m), 0, -1);
}

} // namespace

/// By the plan first, which gives the derivatives where it fits; else with pivots of the state's own, which say why there are none.
int closed_inverse_dynamics_derivatives(const model &m, data &d, const double *q, const double *v, const double *a,
                                        const external_wrenches<double> &external, double *by_q, double *by_v,
                                        double *by_a) {
  const nearest_rounding rounding;
  if (derive_by_plan(false, m, &d, {.q = q, .v = v, .a = a, .external = external}, by_q, by_v, by_a))
    return m.view().loops->freedoms;
  closed_derivatives w = derivatives_of(m, d, external.n);
  finding fault = w.state().set_position(q);
  if (!fault)
    fault = w.inverse_dynamics(q, v, a, external, by_q, by_v, by_a);
  require("inverse_dynamics_derivatives", fault, m);
  const std::ptrdiff_t n = std::ptrdiff_t(m.nv()) * w.state().solved().freedoms();
  require_finite("inverse_dynamics_derivatives", "derivatives", {{by_q, n}, {by_v, n}, {by_a, n}},
                 {{q, m.nq()}, {v, m.nv()}, {a, m.nv()}, {external.wrench, 6 * std::ptrdiff_t(external.n)}});
  return w.state().solved().freedoms();
}

int closed_forward_dynamics_derivatives(const model &m, data &d, const double *q, const double *v, const double *tau,
                                        const external_wrenches<double> &external, double *by_q, double *by_v,
                                        double *by_tau) {
  const nearest_rounding rounding;
  if (derive_by_plan(true, m, &d, {.q = q, .v = v, .tau = tau, .external = external}, by_q, by_v, by_tau))
    return m.view().loops->freedoms;
  closed_derivatives w = derivatives_of(m, d, external.n);
  finding fault = w.state().set_position(q);
  if (!fault)
    fault = w.forward_dynamics(q, v, tau, external, by_q, by_v, by_tau);
  require("forward_dynamics_derivatives", fault, m);
  const std::ptrdiff_t nv = m.nv(), n = nv * w.state().solved().freedoms();
  require_finite("forward_dynamics_derivatives", "derivatives", {{by_q, n}, {by_v, n}, {by_tau, nv * nv}},
                 {{q, m.nq()}, {v, nv}, {tau, nv}, {external.wrench, 6 * std::ptrdiff_t(external.n)}});
  return w.state().solved().freedoms();
}

void closed_reaction_variations(const model &m, data &d, const double *q, const double *v, const double *a,
                                const external_wrenches<double> &external, double *motions, double *on_links,
                                double *at_joints, double *wrenches) {
  const nearest_rounding rounding;
  closed_derivatives w = derivatives_of(m, d, external.n);
  finding fault = w.state().set_position(q);
  if (!fault)
    fault = w.reaction_variations(q, v, a, external, motions, on_links, at_joints);
  require("reactions_derivatives", fault, m);
  const external_wrenches<double> of_loops = w.state().all_wrenches({});
  std::copy_n(of_loops.wrench, 6 * of_loops.n, wrenches);
  // three kinds of variation, each by f coordinates: motions 3 · f · (dq, dv, da of nv); on_links 3 · f · loops · 2 sides · 6; at_joints without
  // sides
  const std::ptrdiff_t nv = m.nv(), f = w.state().solved().freedoms(), loops = std::ptrdiff_t(m.loops().size());
  require_finite(
      "reactions_derivatives", "derivatives",
      {{motions, 9 * f * nv}, {on_links, 36 * f * loops}, {at_joints, 18 * f * loops}, {wrenches, 12 * loops}},
      {{q, m.nq()}, {v, nv}, {a, nv}, {external.wrench, 6 * std::ptrdiff_t(external.n)}});
}

/// States may be open by `corrected`, far more than elsewhere, since their errors are what the gains are for.
void stabilised_forward_dynamics(const model &m, data &d, const double *q, const double *v, const double *tau,
                                 const external_wrenches<double> &external, const stabilisation &gains, double *a) {
  const nearest_rounding rounding;
  if (m.loops().empty())
    return forward_dynamics(m, d, q, v, tau, a, external);
  closed_state c = laid_out(closed_state(m, loop_tolerance::corrected), &d,
                            [&](closed_state &w, arena &memory) { w.lay_out(memory, external.n); });
  finding fault = c.set_position(q);
  if (!fault)
    fault = c.forward_dynamics(q, v, tau, external, a, &gains);
  require("forward_dynamics", fault, m);
  require_finite("forward_dynamics", "accelerations", {{a, m.nv()}},
                 {{q, m.nq()}, {v, m.nv()}, {tau, m.nv()}, {external.wrench, 6 * std::ptrdiff_t(external.n)}});
}

} // namespace ksl
