// The plan makes closed mechanisms recordable: its pivots are the same at all positions, so that elimination is a fixed sequence of steps.  Where a
// state has too small a pivot, or is open, the steps give NaN as kernels do, and nothing takes other pivots afterwards: code for such states returns
// NaN.
//
// What is computed is what loops::closed_by_plan, linear_by_plan and motion_by_plan compute, on the expanded mechanism; followers have equations of
// their own in the plan.
#include "generate/recorded_loops.hpp"

#include "engine/loops/closed_by_plan.hpp"
#include "engine/loops/derivatives.hpp"
#include "engine/loops/linear_by_plan.hpp"
#include "engine/loops/motion_by_plan.hpp"
#include "engine/loops/tables.hpp"
#include "engine/states/extents.hpp"
#include "generate/recorded_calls.hpp"
#include "generate/recorded_mimic.hpp"
#include "generate/workspace.hpp"
#include "ksl/engine/algorithms/loops/closed_derivatives.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>

namespace ksl::generate {
namespace {

constexpr int parts = 5; ///< of efforts

/// NaN if one of them is: a number that says whether all are.
recording sum_of(const recording *x, int n) {
  recording sum = 0.0;
  for (int i = 0; i < n; ++i)
    sum = sum + x[i];
  return sum;
}

/// What the efforts (nv) consist of, as closed_by_plan computes it: what the tree's parts don't explain is transmitted.
void record_parts(const recorded_mechanism &of, const state_view<recording> &s, const recordings &efforts) {
  const int nv = of.m.nv();
  record_tree(of, rows::effort_parts, s);
  // (5, nv): row 0 = τ − damping − friction − rotor − spring
  recording *const out = s.result[0];
  for (int k = 0; k < nv; ++k) {
    out[k] = efforts[static_cast<std::size_t>(k)];
    for (int part = 1; part < parts; ++part)
      out[k] = out[k] - out[part * nv + k];
  }
  mark_missing(sum_of(efforts.data(), nv), out, std::ptrdiff_t(parts) * nv);
}

/// Calls of the mechanism without weight, and its motion by the plan.
class weightless_calls : public recorded_calls {
public:
  explicit weightless_calls(const recorded_mechanism &of) : recorded_calls(of), of_(of), own_(own_coordinates(of.m)) {}

  recording set_G(const recording *q, recording *G) const {
    const int f = of_.view.loops->freedoms;
    const recordings at = expanded_position(of_.m, of_.single, q);
    recordings all(static_cast<std::size_t>(of_.view.nv) * static_cast<std::size_t>(f));
    loops::motion_by_plan<recording> motion;
    const empty_memory memory = laid_out([&](arena &pieces) { motion.lay_out(pieces, of_.view); });
    const recording fault = motion.set(of_.view, at.data(), all.data());
    for (const int i : own_)
      G = std::copy_n(all.data() + std::ptrdiff_t(i) * f, f, G);
    return fault;
  }
  // the user's coordinate for one of the expanded mechanism
  int own(int coordinate) const {
    return static_cast<int>(std::find(own_.begin(), own_.end(), coordinate) - own_.begin());
  }

private:
  recorded_mechanism of_;
  std::vector<int> own_;
};

/// What wrenches on links, or their parameters, do, as the engine computes it by the plan.
void record_linear(const recorded_mechanism &of, const algorithm_row &row, const state_view<recording> &s) {
  model_view<recording> view = of.view;
  view.gravity = {0.0, 0.0, 0.0};
  view.physics = nullptr;
  loops::linear_by_plan<recording, weightless_calls> work(row, of.m, weightless_calls({of.m, of.single, view}));
  const empty_memory memory = laid_out([&](arena &pieces) { work.lay_out(pieces, room_for(s)); });
  const recording sum = work.run(s, of.view.gravity);
  const std::ptrdiff_t n = numbers_of(row.result[0], extents_of(of.m, s));
  std::copy_n(work.found(), n, s.result[0]);
  mark_missing(sum, s.result[0], n);
}

/// The pivot that has been replaced by its inverse, but for its sign: recorded is 1 / pivot, its negation, or a constant.
/// Elimination keeps 1 / pivot in the pivot's place.  The step of that quotient has the pivot as its operand; a pivot that is a constant has left a
/// constant.
recording pivot_of(recording inverse) {
  const step s = recording::current->steps()[static_cast<std::size_t>(inverse.place())];
  if (s.what == operation::negate)
    return pivot_of(recording::step_of(s.a));
  return s.what == operation::divide ? recording::step_of(s.b) : 1.0 / inverse;
}

/// The private row of derivatives along the mechanism; null for other rows.
const algorithm_row *derivatives_by_plan(const algorithm_row &row) {
  const std::string_view name = row.name;
  return name == rows::inverse_dynamics_derivatives.name   ? &rows::closed_inverse_dynamics_derivatives
         : name == rows::forward_dynamics_derivatives.name ? &rows::closed_forward_dynamics_derivatives
                                                           : nullptr;
}

/// Is it computed by the plan?  Derivatives are as loops::derive_by_plan computes them.
bool suits(const algorithm_row &row, const model &m) {
  if (derivatives_by_plan(row))
    return loops::freedoms_by_plan(m) > 0;
  if (row.loops == loops_by::linear)
    return loops::linear_suits(row, m.view());
  return loops::plan_suits(row.loops, m.view(), m.acting_force_elements() > 0);
}

bool has_independent_drives(const model &m) {
  const loop_view<double> *const loops = m.view().loops;
  return loops && loops->drives_are_independent && loops->freedoms > 0;
}

std::string pivots_depend(const std::string &what) {
  return what + " can't be generated for this closed mechanism: its pivots depend on the state, or its drives don't "
                "determine the motion; name as many drives as it has freedoms, or cut the loops";
}

} // namespace

const algorithm_row &recorded_row(const algorithm_row &row, const model &m) {
  const algorithm_row *const along = m.loops().empty() ? nullptr : derivatives_by_plan(row);
  return along ? *along : row;
}

void refuse_loops(const algorithm_row &row, const model &m, bool single) {
  const std::string name = row.name;
  const bool elements_act = m.acting_force_elements() > 0;
  if (single)
    throw std::invalid_argument(name + " can't be generated in float for a closed mechanism; ask for double");
  const bool of_joints = row.loops == loops_by::reactions || row.request == request_kind::joints;
  if (of_joints && !m.loop_tables().loose.empty())
    throw std::invalid_argument(name +
                                " can't be generated for stiffnesses of 0 in loops; leave these out, or cut the loops");
  if (suits(row, m))
    return;
  if (row.loops == loops_by::jump && (elements_act || m.view().physics))
    throw std::invalid_argument(name + " can't be generated for this closed mechanism: the physics of joints or force "
                                       "elements act in it; leave them out of physics");
  if (row.loops != loops_by::refusal || derivatives_by_plan(row))
    throw std::invalid_argument(pivots_depend(name));
  throw std::invalid_argument(
      name + " can't be generated for this closed mechanism: it isn't there with loops; cut the loops");
}

const char *differentiated_along(const algorithm_row &row, const model &m) {
  const std::string_view name = row.name;
  if (m.loops().empty())
    return nullptr;
  if (name == rows::reactions_derivatives.name)
    return rows::reactions.name;
  if (m.acting_force_elements() == 0) // the engine has them by the plan
    return nullptr;
  return name == rows::inverse_dynamics_derivatives.name   ? rows::inverse_dynamics.name
         : name == rows::forward_dynamics_derivatives.name ? rows::forward_dynamics.name
                                                           : nullptr;
}

void refuse_along(const std::string &name, const model &m, bool single) {
  if (m.loops().empty())
    return;
  if (single)
    throw std::invalid_argument(name + " can't be generated in float for a closed mechanism; ask for double");
  if (!has_independent_drives(m))
    throw std::invalid_argument(pivots_depend(name));
}

void mark_missing(const recording &sum, recording *x, std::ptrdiff_t n) {
  // false for NaN and infinities
  const recording::condition are_numbers = math<recording>::fabs(sum) <= recording(std::numeric_limits<double>::max());
  for (std::ptrdiff_t i = 0; i < n; ++i)
    x[i] = math<recording>::select(are_numbers, x[i], recording(std::numeric_limits<double>::quiet_NaN()));
}

void record_closed(const recorded_mechanism &of, const algorithm_row &row, const state_view<recording> &given) {
  if (row.loops == loops_by::linear)
    return record_linear(of, row, given);
  const algorithm_row &by = row.loops == loops_by::plan ? row : loops::row_by_plan(row.loops);
  const int nv = of.m.nv();
  state_view<recording> s = given;
  recordings still(static_cast<std::size_t>(nv), recording(0.0)), efforts(still);
  if (row.loops == loops_by::jump)
    // M dv = Jᵀ impulses is forward dynamics at rest, without efforts and without gravity (record.cpp)
    s.v = s.tau = still.data();
  const recorded_forces forces(of, s.q, s.v, s.external);
  s.external = forces.all();
  if (row.loops != loops_by::parts) {
    record_tree(of, by, s);
    // the efforts are those of other pivots where the plan doesn't determine them, and so are the reactions
    if (row.request == request_kind::reactions)
      mark_missing(sum_of(s.result[0], nv), s.result[by.results], 6 * std::ptrdiff_t(s.joints->n));
    return;
  }
  state_view<recording> whole = s;
  whole.result[0] = efforts.data();
  record_tree(of, by, whole);
  record_parts(of, s, efforts);
}

/// |p| R C for each pivot p: lengths, as elimination.hpp scales the equations.
recordings sizes_of_pivots(const recorded_mechanism &of, const recording *q) {
  const empty_workspace<loop_equations_workspace<recording>> memory(of.view);
  loop_equations_workspace<recording> w = *memory;
  const loop_view<recording> &loops = *of.view.loops;
  const recordings all = expanded_position(of.m, of.single, q),
                   still(static_cast<std::size_t>(of.view.nv), recording(0.0));
  set_loop_equations<false>(of.view, w, all.data(), still.data());
  eliminate_by_plan<false>(of.view, w);
  recordings sizes;
  for (int k = 0; k < loops.pivots; ++k) {
    const loop_pivot &p = loops.pivot[k];
    sizes.push_back(math<recording>::fabs(pivot_of(w.lower(p.row, k))) *
                    (loops.row_scale[p.row] * loops.column_scale[p.column]));
  }
  return sizes;
}

motion_along motions_along(const recorded_mechanism &of, const recording *q, const recording *v, const recording *a) {
  const loop_view<recording> &loops = *of.view.loops;
  const int all = of.view.nv, f = loops.freedoms;
  const empty_workspace<closed_derivatives_workspace<recording>> memory(of.view);
  closed_derivatives_workspace<recording> w = *memory;
  loop_equations_workspace<recording> &equations = w.dynamics.equations;
  const recordings at = expanded_position(of.m, of.single, q), velocity = expanded_motion(of.m, of.single, v),
                   acceleration = expanded_motion(of.m, of.single, a);
  // K and K̇ v; K = L U by the plan's pivots; G from it, and how G y and its rate vary along G (closed_derivatives.hpp)
  set_loop_equations<true>(of.view, equations, at.data(), velocity.data());
  eliminate_by_plan<true>(of.view, equations);
  solve_by_plan(of.view, equations);
  set_G(loops, all, w);
  clear(&w.dynamics.multiplier[0], loops.rows); // of wrenches, which nobody asks for
  vary_closed(of.view, w, velocity.data(), acceleration.data(), false);
  // rows of followers are multiples of those of their leaders: the user has the latter
  const std::vector<int> kept = own_coordinates(of.m);
  const auto matrix = [&](const array_of<recording> &from) {
    recordings out;
    for (const int i : kept)
      for (int j = 0; j < f; ++j)
        out.push_back(from[i * w.width + j]);
    return out;
  };
  return {f, equations.fault, matrix(w.G), matrix(w.v_by_q), matrix(w.a_by_q), matrix(w.a_by_v)};
}

} // namespace ksl::generate
