// What a recording has, in this order, which is that of generated code's arguments.  payload is added to the inertia of a link; parameters stand in
// its place, since the model that is recorded has none there:
//
//     inputs      [ those of the row | external (wrenches, 6) | gravity (3) | payload (links, 10) | parameters (links, 10) ]
//     outputs     [ those of the row | wrenches (joints, 6) | pivots (pivots of the plan) ]
//
// All else is a constant, of which add() computes what it can: the recording of a mechanism is as short as its own zeros and right angles make it.
// A row that is a variant of another one is recorded as that, with zeros for inputs that it lacks; steps of results that it lacks are dropped.
#include "generate/record.hpp"

#include "engine/elements/algorithms.hpp"
#include "engine/states/extents.hpp"
#include "generate/recorded_inputs.hpp"
#include "generate/recorded_loops.hpp"
#include "generate/recorded_model.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace ksl::generate {
namespace {

const algorithm_row &row_called(const std::string &name) {
  const auto found =
      std::find_if(std::begin(rows::all), std::end(rows::all), [&](const auto *row) { return name == row->name; });
  if (found == std::end(rows::all) || (*found)->loops == loops_by::plan)
    throw std::invalid_argument("there is no algorithm '" + name + "'");
  return **found;
}

/// What the engine refuses is refused here, and what fixed pivots don't compute.
void refuse(const algorithm_row &row, const model &m, bool single) {
  const std::string name = row.name;
  mimic::refuse(row, m);
  elements::refuse(row, m);
  if (way_of(row, m) == way::loops)
    refuse_loops(row, m, single);
  if (row.needs_mass && m.massless_joint() >= 0)
    throw std::invalid_argument(name + ": " + m.massless_joint_text());
  if (row.smooth_friction && m.exact_friction())
    throw std::invalid_argument(name + ": " + model::exact_friction_text());
}

/// Records the inputs of the row; a row that computes it may have more, which are zero.
void take_numbers(const algorithm_row &row, const model &m, recorded_inputs &in, state_view<recording> &s) {
  for (int i = 0; i < row.inputs; ++i) {
    const input x = row.input_list[i];
    input_of(s, x) = in.take(row.input_name[i], length_of(x, m.nq(), m.nv())).data();
  }
  const algorithm_row &by = computed(row);
  for (int i = 0; i < by.inputs; ++i)
    if (const input x = by.input_list[i]; !row.reads(x))
      input_of(s, x) = in.zeros(length_of(x, m.nq(), m.nv())).data();
}

/// The results of what computes the row; those of the row come first, reactions last.
class results {
public:
  results(const algorithm_row &row, const extents &of, state_view<recording> &s) : row_(row), of_(of) {
    const algorithm_row &by = computed(row);
    for (int r = 0; r < by.results; ++r)
      s.result[r] = take(numbers_of(by.result[r], of));
    if (by.request == request_kind::reactions)
      s.result[by.results] = take(std::ptrdiff_t(6) * of.joints);
  }
  void hand_over(recorded &to) const {
    const algorithm_row &by = computed(row_);
    for (int r = 0; r < row_.results; ++r) {
      recorded_result &named = to.results.emplace_back();
      named.name = row_.result[r].name;
      for (int i = 0; i < row_.result[r].axes; ++i)
        named.shape.push_back(length_of(row_.result[r].shape[i], of_));
      output(static_cast<std::size_t>(r), to.steps, row_.mimic == mimic_by::upper_triangle);
    }
    if (by.request == request_kind::reactions && row_.request == request_kind::reactions) {
      to.results.push_back({"wrenches", {of_.joints, 6}});
      output(static_cast<std::size_t>(by.results), to.steps, false);
    }
  }

private:
  recording *take(std::ptrdiff_t numbers) { return arrays_.emplace_back(static_cast<std::size_t>(numbers)).data(); }
  /// sparse: some numbers are left as they are.
  void output(std::size_t r, graph &steps, bool sparse) const {
    for (const recording &x : arrays_[r]) {
      if (x.place() < 0 && !sparse)
        throw recording_error(std::string(row_.name) + " leaves a number of its results unwritten");
      steps.output(x.place());
    }
  }

  const algorithm_row &row_;
  const extents of_;
  std::vector<recordings> arrays_;
};

void check_links(const model &m, const std::vector<int> &links) {
  for (const int i : links)
    if (i < 0 || i >= static_cast<int>(m.links().size()))
      throw std::out_of_range("the model has no link " + std::to_string(i));
}

/// The model whose links have no inertia of their own, to which inputs are added.
model without_inertia(const model &m, const std::vector<int> &links) {
  std::vector<link_inertia> none;
  for (const int i : links)
    none.push_back({i, {}});
  return none.empty() ? m : m.with_inertias(none);
}

/// Ten numbers for each of these links, added to its inertia.
void take_inertias(const char *name, const std::vector<int> &links, recorded_inputs &in, recorded_model &to) {
  if (links.empty())
    return;
  const recording *const ten = in.take(name, static_cast<int>(10 * links.size())).data();
  for (std::size_t i = 0; i < links.size(); ++i)
    to.add_inertia(links[i], ten + 10 * i);
}

/// The sizes of pivots as a further result, where the row is computed by them.
void add_pivots(const recorded_mechanism &of, const algorithm_row &row, const recording *q, recorded &to) {
  if (way_of(row, of.m) != way::loops)
    return;
  const recordings sizes = sizes_of_pivots(of, q);
  to.results.push_back({"pivots", {static_cast<int>(sizes.size())}});
  for (const recording &size : sizes)
    to.steps.output(size.place());
}

} // namespace

recorded record(const model &m, const request &asked) {
  const algorithm_row &named = row_called(asked.row), &row = recorded_row(named, m);
  refuse(named, m, asked.single);
  for (const auto *links : {&asked.links, &asked.external_links, &asked.payload_links, &asked.parameter_links})
    check_links(m, *links);
  if (static_cast<int>(asked.links.size()) < least_links(row.request))
    throw std::invalid_argument(asked.row + " needs the names of " +
                                (least_links(row.request) == 1 ? "a link" : "two links"));
  recorded out = {graph(asked.single), {}, {}};
  const recording_on on(out.steps);
  // The order in which inputs are taken from here on is that of arguments in generated code.
  recorded_inputs in(out);
  state_view<recording> s;
  take_numbers(row, m, in, s);
  const int wrenches = static_cast<int>(asked.external_links.size());
  if (wrenches > 0)
    s.external = {wrenches, asked.external_links.data(), in.take("external", 6 * wrenches).data(), expressed_in::frame};
  s.links = {static_cast<int>(asked.links.size()), asked.links.data()};
  s.frame = asked.frame, s.joints = &asked.joints;
  // constants of the model first; gravity and inertias that are inputs take their place, or are added
  const ksl::model bare = without_inertia(m, asked.parameter_links);
  recorded_model model = asked.single ? recorded_model(bare.view_single()) : recorded_model(bare.view());
  if (asked.gravity) {
    const recordings &g = in.take("gravity", 3);
    model.set_gravity({g[0], g[1], g[2]});
  }
  take_inertias("payload", asked.payload_links, in, model);
  take_inertias("parameters", asked.parameter_links, in, model);
  results to(row, extents_of(m, s), s);
  const recorded_mechanism mechanism = {m, asked.single, model.view()};
  switch (way_of(row, m)) {
  case way::kernels:
  case way::mimic: record_tree(mechanism, row, s); break;
  case way::elements: record_with_elements(mechanism, row, s); break;
  case way::loops:
    model.set_loops(*m.plan_of_loops(), row.loops == loops_by::steady);
    if (row.loops == loops_by::jump)
      model.set_gravity({0.0, 0.0, 0.0});
    record_closed(mechanism, row, s);
    break;
  }
  to.hand_over(out);
  if (asked.pivots)
    add_pivots(mechanism, row, s.q, out);
  out.steps = out.steps.needed();
  return out;
}

} // namespace ksl::generate
