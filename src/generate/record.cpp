#include "generate/record.hpp"

#include "engine/loops/closed_by_plan.hpp"
#include "engine/states/extents.hpp"
#include "engine/states/ways.hpp"
#include "generate/recorded_inputs.hpp"
#include "generate/recorded_mimic.hpp"
#include "generate/recorded_model.hpp"
#include "generate/recorded_rows.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
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

/// Is the row computed by the plan of loops alone?  Parts of efforts take more, and force elements move with the state.
bool is_by_plan(const algorithm_row &row, const model &m) {
  return row.loops != loops_by::parts && m.acting_force_elements() == 0 &&
         loops::plan_suits(row.loops, m.view(), false);
}

void refuse_loops(const algorithm_row &row, const model &m, bool single) {
  const std::string name = row.name;
  if (single)
    throw std::invalid_argument(name + " can't be generated in float for a closed mechanism; ask for double");
  if (is_by_plan(row, m))
    return;
  const bool never = row.loops == loops_by::linear || row.loops == loops_by::parts || row.loops == loops_by::refusal;
  throw std::invalid_argument(
      name + " can't be generated for this closed mechanism: " +
      (never ? "it isn't computed by fixed pivots; cut the loops"
       : m.acting_force_elements() > 0
           ? "springs, dampers or cylinders between two points act; leave them out of physics"
           : "its pivots depend on the state, or it has no drives; name drives, or cut the loops"));
}

/// What the engine refuses is refused here, and what is computed by more than kernels.
void refuse(const algorithm_row &row, const model &m, bool single) {
  const std::string name = row.name;
  switch (way_of(row, m)) {
  case way::kernels: break;
  case way::mimic:
    if (!has_recording_with_followers(computed(row)))
      throw std::invalid_argument(
          name + " can't be generated yet for a mechanism with mimic joints; read them as independent");
    break;
  case way::elements:
    throw std::invalid_argument(
        name + " can't be generated yet for a mechanism with springs, dampers or cylinders between two points");
  case way::loops: refuse_loops(row, m, single); break;
  }
  if (row.needs_mass && m.massless_joint() >= 0)
    throw std::invalid_argument(name + ": " + m.massless_joint_text());
  if (row.smooth_friction && m.exact_friction())
    throw std::invalid_argument(name + ": " + model::exact_friction_text());
}

/// Those of the row, and for what computes it zeros where this has more.
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
  /// Where the plan doesn't determine the efforts, which the row doesn't have, the engine takes other pivots: reactions are then NaN, too.
  void tell_missing_efforts() {
    const algorithm_row &by = computed(row_);
    if (row_.results > 0 || by.results == 0)
      return;
    recording sum = 0.0;
    for (const recording &effort : arrays_[0])
      sum = sum + effort;
    const recording::condition are_numbers =
        math<recording>::fabs(sum) <= recording(std::numeric_limits<double>::max());
    for (recording &number : arrays_.back())
      number = math<recording>::select(are_numbers, number, recording(std::numeric_limits<double>::quiet_NaN()));
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
  std::vector<std::vector<recording>> arrays_;
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

} // namespace

recorded record(const model &m, const request &asked) {
  const algorithm_row &row = row_called(asked.row);
  refuse(row, m, asked.single);
  for (const auto *links : {&asked.links, &asked.external_links, &asked.payload_links, &asked.parameter_links})
    check_links(m, *links);
  if (static_cast<int>(asked.links.size()) < least_links(row.request))
    throw std::invalid_argument(asked.row + " needs the names of " +
                                (least_links(row.request) == 1 ? "a link" : "two links"));
  recorded out = {graph(asked.single), {}, {}};
  const recording_on on(out.steps);
  recorded_inputs in(out);
  state_view<recording> s;
  take_numbers(row, m, in, s);
  const int wrenches = static_cast<int>(asked.external_links.size());
  if (wrenches > 0)
    s.external = {wrenches, asked.external_links.data(), in.take("external", 6 * wrenches).data(), expressed_in::frame};
  s.links = {static_cast<int>(asked.links.size()), asked.links.data()};
  s.frame = asked.frame, s.joints = &asked.joints;
  const ksl::model bare = without_inertia(m, asked.parameter_links);
  recorded_model model = asked.single ? recorded_model(bare.view_single()) : recorded_model(bare.view());
  if (asked.gravity) {
    const std::vector<recording> &g = in.take("gravity", 3);
    model.set_gravity({g[0], g[1], g[2]});
  }
  take_inertias("payload", asked.payload_links, in, model);
  take_inertias("parameters", asked.parameter_links, in, model);
  results to(row, extents_of(m, s), s);
  const bool closed = way_of(row, m) == way::loops;
  const algorithm_row &by = closed ? loops::row_by_plan(row.loops) : computed(row);
  if (closed)
    model.set_loops(*m.plan_of_loops(), row.loops == loops_by::steady);
  if (row.loops == loops_by::jump && closed)
    s.v = s.tau = in.zeros(m.nv()).data(), model.set_gravity({0.0, 0.0, 0.0});
  if (m.followers() > 0)
    record_with_followers(by, m, asked.single, model.view(), s);
  else
    recorder_of(by.name)(model.view(), s);
  if (closed)
    to.tell_missing_efforts();
  to.hand_over(out);
  out.steps = out.steps.needed();
  return out;
}

} // namespace ksl::generate
