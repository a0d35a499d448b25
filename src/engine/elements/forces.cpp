// For sentences and for queries a state is a batch of one, whose rows have a stride of zero, with all elements of the model: those that
// physics_options leave out have lengths and tensions, too.
#include "engine/elements/forces.hpp"

#include "ksl/force_elements.hpp"
#include "text/words.hpp"

#include <memory>

namespace ksl::elements {

found_forces::found_forces(const model &m, double rounding)
    : at_(m, static_cast<int>(m.force_elements().size()), rounding) {
  arena measure;
  at_.lay_out(measure, 0, 1);
  memory_.resize(measure.used() + 64);
  void *begin = memory_.data();
  std::size_t space = memory_.size();
  arena pieces(std::align(64, measure.used(), begin, space));
  at_.lay_out(pieces, 0, 1);
}

void found_forces::set(const double *q, const double *v) {
  batch_view<double> batch;
  batch.n = 1, batch.q = {q, 0}, batch.v = {v, 0};
  at_.set(batch, 0, 1);
}

namespace {

std::string reason_of(const model &m, const found_forces &found) {
  for (std::size_t i = 0; i < m.force_elements().size(); ++i) {
    const force_element_row &of = m.force_elements()[i];
    const std::string who = "force element " + text::quoted(of.name) + ": ";
    const auto name = [&](int link) { return m.links()[static_cast<std::size_t>(link)].name; };
    const auto limit = [&](const char *which, double value) {
      return who + "its length is " + text::shown(found[i].length) + " m, " + which + " limit of " +
             text::shown(value) +
             " m; correct the position or the limit, or give it a stop_stiffness, for stops that give way";
    };
    switch (found[i].found()) {
    case fault::none: break;
    case fault::below: return limit("below its lower", *of.numbers.lower);
    case fault::above: return limit("above its upper", *of.numbers.upper);
    case fault::coincide:
      return who + "its points on links " + name(of.link1) + " and " + name(of.link2) +
             " coincide, so that its force has no direction; move one of them, or avoid the position";
    }
  }
  return {};
}

} // namespace

template <class S> std::string reason(const model &m, const S *q, const S *v) {
  std::vector<double> positions(q, q + m.nq()), velocities(static_cast<std::size_t>(m.nv()), 0.0);
  if (v)
    velocities.assign(v, v + m.nv());
  found_forces found(m, rounding_of<S>);
  found.set(positions.data(), velocities.data());
  return reason_of(m, found);
}

template class forces<double>;
template class forces<float>;
template std::string reason(const model &, const double *, const double *);
template std::string reason(const model &, const float *, const float *);

} // namespace ksl::elements

namespace ksl {

/// Results are there before a fault is told: the length of an element that is beyond its stops is what one wants to see.
void force_element_states(const model &m, const double *q, const double *v, double *length, double *rate,
                          double *tension) {
  elements::found_forces found(m);
  found.set(q, v);
  for (std::size_t i = 0; i < m.force_elements().size(); ++i)
    length[i] = found[i].length, rate[i] = found[i].speed, tension[i] = found[i].tension;
  const std::string why = elements::reason_of(m, found);
  if (!why.empty())
    throw result_error("force_element_states: " + why, 0, -1);
}

} // namespace ksl
