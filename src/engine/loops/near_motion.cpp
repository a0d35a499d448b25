// An equation is left out where less than `zero` is left of its row, scaled, by the rows before it (least_norm.hpp).  Steps close the others alone,
// and what the equations that are left out make of that is in `open`: it tells how well frames fit.
#include "engine/loops/near_motion.hpp"

#include "ksl/engine/model/joints.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

} // namespace

std::vector<double> start_position(const model &m, int number) {
  std::vector<double> q(index(m.nq()), 0.0);
  for (const model::quaternion_in_q &quaternion : m.quaternions())
    q[index(quaternion.q_index + 3)] = 1;
  for (const joint_row &joint : m.joints())
    if (number > 0 && joint.v_index >= 0 && row_of(joint.kind).velocity_is_rate)
      for (int c = 0; c < row_of(joint.kind).nq; ++c)
        // up to 0.7 rad or m from the neutral position, all different
        q[index(joint.q_index + c)] = 0.7 * std::sin(1.3 * (joint.q_index + c + 1) * number);
  return q;
}

// Scales here are those of loops: rows of translation by 1 / L_loop, coordinates that slide by the shortest loop that they move.  Then R K C relates
// rad to rad, where tables.hpp has lengths of the mechanism for both, and a limit such as few_digits means the same in each loop.
near_motion::near_motion(const model &m, const tables &t)
    : m_(m), t_(t), g_(m, t), row_scale_(index(t.rows), 1), column_scale_(index(m.nv()), 1),
      length_of_column_(index(m.nv()), t.length), none_(index(m.nv()), 0),
      memory_([this](arena &memory) { lay_out(memory); }) {
  for (const loop &l : t_.loops) {
    for (int i = l.first_row; i < l.first_row + l.rows; ++i)
      row_scale_[index(i)] = t_.row_turns[index(i)] ? 1 : 1 / l.length;
    for (int k = l.support_begin; k < l.support_end; ++k) {
      double &length = length_of_column_[index(t_.columns[index(t_.supports[index(k)].column)].v)];
      length = std::min(length, l.length);
    }
  }
  for (int j = 0; j < m_.nv(); ++j)
    if (!t_.column_turns[index(j)])
      column_scale_[index(j)] = length_of_column_[index(j)];
}

void near_motion::lay_out(arena &memory) {
  g_.lay_out(memory), k_.lay_out(memory, t_.rows, m_.nv()), solve_.lay_out(memory, t_.rows, m_.nv());
  error_ = memory.take<double>(t_.rows), right_ = memory.take<double>(t_.rows);
  step_ = memory.take<double>(m_.nv()), tangent_ = memory.take<double>(m_.nv());
}

/// open: the largest error, in rad and lengths of each loop, and NaN if one is.
void near_motion::set(position &at) {
  g_.set_position(at.q.data());
  g_.error(error_);
  at.open = 0;
  for (int i = 0; i < t_.rows; ++i) {
    const double x = std::fabs(error_[i]) * row_scale_[index(i)];
    if (!(x <= at.open) && !std::isnan(at.open))
      at.open = x, at.row = i;
  }
}

void near_motion::step(const position &from, const double *dv, double share, position &to) {
  for (int j = 0; j < m_.nv(); ++j)
    tangent_[j] = share * dv[j];
  state_view<double> s;
  s.q = from.q.data(), s.v = tangent_, s.result[0] = to.q.data();
  g_.tree().call(rows::integrate, g_.rest(), s);
}

// Gauss–Newton steps of the independent equations.  Far away they are halved while the error doesn't fall; near the end the error is what has been
// left out, and steps end at rounding.
void near_motion::close(position &at, double zero, const unsigned char *fixed) {
  // steps, relative to lengths: below `near` they are taken whole, and none is above `longest`; below `still` the search ends once they no longer halve
  constexpr double near = 1e-3, still = 1e-8, end = 1e-13, longest = 0.5;
  const int nv = m_.nv();
  position trial = at;
  double before = 1;
  set(at);
  for (int k = 0; k < 60 && std::isfinite(at.open); ++k) {
    for (int i = 0; i < t_.rows; ++i)
      right_[i] = -error_[i];
    solve_.solve(g_.jacobian(), t_.rows, nv, row_scale_.data(), fixed ? fixed : none_.data(), zero, right_, step_);
    double most = 0;
    for (int j = 0; j < nv; ++j)
      most = std::max(most, std::fabs(step_[j]) / column_scale_[index(j)]);
    bool fell = false;
    for (int halvings = 0; halvings < 20 && !fell; ++halvings) {
      const double share = std::ldexp(most > longest ? longest / most : 1, -halvings);
      step(at, step_, share, trial);
      set(trial);
      fell = most < near || trial.open < at.open * (1 - 1e-4 * share);
    }
    if (!fell) {
      set(at);
      return;
    }
    std::swap(at, trial);
    // steps of equations that agree fall by their squares: one that isn't half of the one before is rounding
    if (most < end || (most < still && most > before / 2)) // or rounding
      return;
    before = most;
  }
}

const elimination &near_motion::factor(const position &at, double zero) {
  g_.set_position(at.q.data());
  k_.factor(g_.jacobian(), row_scale_.data(), column_scale_.data(), 1, zero, nullptr, 0);
  return k_;
}

std::vector<near_motion::position> near_motion::around(const position &base, double zero, double most, double far,
                                                       int n) {
  // shares 1, 1/2, 1/4 and 1/8 of the way: an eighth of `far` is still far beyond few_digits
  constexpr double nearest = 0.1; // of the way
  // A number of positions in directions that are the same in every run: independent coordinates go their way, the others follow.
  const elimination &k = factor(base, zero);
  const int f = k.freedoms();
  std::vector<unsigned char> fixed(none_);
  for (int j = 0; j < f; ++j)
    fixed[index(k.independent()[j])] = 1;
  std::vector<position> found;
  std::vector<double> way(index(m_.nv()), 0.0);
  for (int p = 0; p < n && f > 0; ++p) {
    position at = base;
    for (int halvings = 0; std::ldexp(1, -halvings) >= nearest; ++halvings) {
      const double share = std::ldexp(1, -halvings);
      for (int j = 0; j < m_.nv(); ++j)
        way[index(j)] = fixed[index(j)] ? far * std::sin(1.7 * (j + 1) * (p + 1) + far) * column_scale_[index(j)] : 0;
      step(base, way.data(), share, at);
      close(at, zero, fixed.data());
      if (at.open <= most)
        break;
    }
    if (!(at.open <= most))
      return {};
    found.push_back(std::move(at));
  }
  return found;
}

} // namespace ksl::loops
