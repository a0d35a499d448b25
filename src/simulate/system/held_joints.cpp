// Who asks, and when:
//
//     each evaluation    add_friction, then hold, around forward dynamics       efforts for the modes as they are
//     the event search   margin, along a step                                   when what is held is let go
//     an event           let_go, impact, settle                                 modes, which stay until the next one
#include "simulate/system/held_joints.hpp"

#include <cmath>
#include <limits>

namespace ksl::simulating {

/// Smaller pivots of A_hh, relative to the largest, belong to coordinates that others hold already, through loops for example.
constexpr double least_pivot = 1e-12;
/// How far beyond its friction a held effort may be, relative to it, before the coordinate slips: what a root of F − |λ| leaves.
constexpr double slack = 1e-9;
/// How far beyond in the margin: what slips then moves the way it is pushed, and doesn't where the push is the friction itself but for rounding.
constexpr double verge = 1e-11;
/// Accelerations of which efforts that hold leave less than this share are none.
constexpr double cancelled = 1e-11;
/// Accelerations of which more than this share is left are those of a dead centre: no effort there holds the joint.
constexpr double not_held = 1e-6;
/// Speeds below this, of the largest, at least 1 rad/s or m/s, are those of a rest: joints that stand since another one stopped.
constexpr double rest = 1e-12;
/// Changes of modes at one instant, for each coordinate, before those that are found are taken.
constexpr int tries_of_each = 50;

held_joints::held_joints(const exact_laws &laws, int nv, std::size_t runs)
    : laws_(laws), nv_(static_cast<std::size_t>(nv)), mode_(runs * nv_, mode::free), friction_(nv_, 0),
      holding_(nv_, 0), left_(nv_, 0), let_go_(nv_, mode::free), let_go_at_(nv_, 0), matrix_(nv_ * nv_), right_(nv_),
      response_(nv_), lets_go_(runs, 0) {
  set_brakes(false);
}

void held_joints::set_brakes(bool engaged) {
  for (std::size_t k = 0; k < nv_; ++k)
    friction_[k] = (laws_.friction ? laws_.friction[k] : 0) + (engaged && laws_.brake ? laws_.brake[k] : 0);
}

void held_joints::add_friction(std::size_t n, double *tau) const {
  for (std::size_t run = 0; run < n; ++run)
    for (std::size_t k = 0; k < nv_; ++k) {
      if (mode_[run * nv_ + k] == mode::slides_up)
        tau[run * nv_ + k] -= friction_[k];
      if (mode_[run * nv_ + k] == mode::slides_down)
        tau[run * nv_ + k] += friction_[k];
    }
}

double held_joints::margin(int k) const {
  if (left_[static_cast<std::size_t>(k)] != 0)
    return -std::numeric_limits<double>::infinity();
  // F − |λ| where friction holds; at a limit λ may have either sign, but pulls by F at most: λ ≥ −F at the lower, λ ≤ F at the upper one
  const double held_back = (1 + verge) * friction(k);
  if (at(k) == mode::sticks)
    return held_back - std::fabs(holding(k));
  return held_back + (at(k) == mode::at_lower ? holding(k) : -holding(k));
}

// λ holds against a push of −λ: what sticks slides that way.  At a dead centre, where λ means nothing, it goes as its acceleration does.
held_joints::mode held_joints::way_out(int k) const {
  const double left = left_[static_cast<std::size_t>(k)];
  if (at(k) != mode::sticks)
    return !(friction(k) > 0) ? mode::free : at(k) == mode::at_lower ? mode::slides_up : mode::slides_down;
  return (left != 0 ? -left : holding(k)) > 0 ? mode::slides_down : mode::slides_up;
}

void held_joints::list_held() {
  held_.clear();
  for (int k = 0; k < static_cast<int>(nv_); ++k)
    if (holds(k))
      held_.push_back(k);
}

const unsigned char *held_joints::flags() {
  list_held();
  flags_.assign(nv_, 0);
  for (const int k : held_)
    flags_[static_cast<std::size_t>(k)] = 1;
  return held_.empty() ? nullptr : flags_.data();
}

/// Solves A_hh x = right for the columns that are there, into right_: elimination with the largest diagonal element as the pivot.
void held_joints::solve(const double *right) {
  // A_hh is symmetric and positive semidefinite: the largest diagonal element is the largest of all, and pivots on the diagonal are stable
  const std::size_t n = held_.size();
  for (std::size_t i = 0; i < n; ++i) {
    right_[i] = right[i];
    for (std::size_t j = 0; j < n; ++j)
      matrix_[i * n + j] = columns_[j * nv_ + static_cast<std::size_t>(held_[i])];
  }
  pivot_.clear();
  used_.assign(n, 0);
  double largest = 0;
  for (std::size_t step = 0; step < n; ++step) {
    std::size_t p = n;
    for (std::size_t i = 0; i < n; ++i)
      if (!used_[i] && (p == n || matrix_[i * n + i] > matrix_[p * n + p]))
        p = i;
    largest = std::fmax(largest, matrix_[p * n + p]);
    if (!(matrix_[p * n + p] > least_pivot * largest))
      break;
    used_[p] = 1, pivot_.push_back(static_cast<int>(p));
    for (std::size_t i = 0; i < n; ++i)
      if (!used_[i]) {
        const double factor = matrix_[i * n + p] / matrix_[p * n + p];
        for (std::size_t j = 0; j < n; ++j)
          matrix_[i * n + j] -= factor * matrix_[p * n + j];
        right_[i] -= factor * right_[p];
      }
  }
  for (std::size_t i = 0; i < n; ++i)
    if (!used_[i])
      right_[i] = 0;
  for (std::size_t step = pivot_.size(); step-- > 0;) {
    const std::size_t p = static_cast<std::size_t>(pivot_[step]);
    for (std::size_t later = step + 1; later < pivot_.size(); ++later)
      right_[p] -=
          matrix_[p * n + static_cast<std::size_t>(pivot_[later])] * right_[static_cast<std::size_t>(pivot_[later])];
    right_[p] /= matrix_[p * n + p];
  }
}

void held_joints::hold(held_mechanism &of, std::size_t n, const double *q, double *a) {
  all_held_.clear();
  for (std::size_t k = 0; k < n * nv_; ++k)
    if (mode_[k] >= mode::sticks)
      all_held_.push_back({k / nv_, static_cast<int>(k % nv_)});
  std::fill(lets_go_.begin(), lets_go_.end(), 0);
  any_ = !all_held_.empty();
  if (!any_)
    return;
  all_columns_.resize(all_held_.size() * nv_);
  of.responses(q, all_held_, all_columns_.data());
  // (held of all runs, nv): the columns of a run follow one another
  for (std::size_t i = 0; i < all_held_.size(); i += held_.size()) {
    const std::size_t run = all_held_[i].run;
    now_ = run * nv_;
    list_held();
    columns_ = all_columns_.data() + i * nv_;
    resist(a + now_, 1);
    for (std::size_t j = 0; j < held_.size(); ++j)
      holding_[static_cast<std::size_t>(held_[j])] = right_[j];
    for (const int k : held_)
      lets_go_[run] |= margin(k) <= 0;
  }
  now_ = 0;
}

/// Adds what the efforts of (1), right_, cause to accelerations, which lie `stride` apart.  What is held, or others hold through loops, has
/// none, exactly: it doesn't creep.
void held_joints::resist(double *a, std::ptrdiff_t stride) {
  wanted_.clear();
  for (const int k : held_)
    wanted_.push_back(-a[k * stride]);
  solve(wanted_.data());
  for (std::size_t i = 0; i < nv_; ++i) {
    double &x = a[static_cast<std::ptrdiff_t>(i) * stride], terms = std::fabs(x);
    for (std::size_t j = 0; j < held_.size(); ++j) {
      // a = a₀ + A λ; the terms are what its rounding is relative to
      const double caused = columns_[j * nv_ + i] * right_[j];
      x += caused, terms += std::fabs(caused);
    }
    const bool is_held = holds(static_cast<int>(i));
    left_[i] = is_held && std::fabs(x) > not_held * terms ? x : 0;
    if (is_held || std::fabs(x) <= cancelled * terms)
      x = 0;
  }
}

void held_joints::hold_derivatives(double *x) {
  const std::ptrdiff_t nv = static_cast<std::ptrdiff_t>(nv_);
  for (std::ptrdiff_t c = 0; any_ && c < nv; ++c)
    resist(x + c, nv);
}

void held_joints::let_go(int k) {
  const std::size_t i = static_cast<std::size_t>(k);
  let_go_[i] = at(k), let_go_at_[i] = std::fabs(holding_[i]);
  at(k) = way_out(k);
}

/// How wrong the mode of a coordinate without velocity is, relative to what holds it there or did: a held one by what its effort lacks, one
/// that was let go by the effort that would keep it from moving back.  Not above zero: it is right.
double held_joints::wrong(held_mechanism &of, const double *q, const double *a, int k) {
  const std::size_t i = static_cast<std::size_t>(k);
  if (holds(k)) {
    if (left_[i] != 0)
      return 2;
    const double beyond = -margin(k) / std::fmax(std::fabs(holding(k)), friction(k));
    return beyond - (at(k) == mode::sticks ? slack : 0);
  }
  if (let_go_[i] == mode::free)
    return 0;
  // Let go upwards, it accelerates downwards: what held it would hold it again.  Wrong by the effort |a_k| / A_kk that stops it.
  const bool goes_up = at(k) == mode::slides_up || (at(k) == mode::free && let_go_[i] == mode::at_lower);
  if (!((goes_up ? -a[k] : a[k]) > 0))
    return 0;
  of.responses(q, {{0, k}}, response_.data());
  return std::fabs(a[k]) / response_[i] / std::fmax(friction(k), let_go_at_[i]) - slack;
}

/// Starts with all held that are at rest, and changes the mode that is most wrong, one at a time; in the end, where that may go round in
/// circles, the first that is wrong, which can't: Murty, Note on a Bard-type scheme for solving the complementarity problem (1974).
bool held_joints::settle(held_mechanism &of, double t, std::size_t run, const double *q, double *v, double *a,
                         double *power, int slides) {
  const int nv = static_cast<int>(nv_);
  double largest = 1;
  for (int k = 0; k < nv; ++k)
    largest = std::fmax(largest, std::fabs(v[k]));
  for (int k = 0; k < nv; ++k) {
    if (k == slides)
      continue;
    let_go_[static_cast<std::size_t>(k)] = mode::free;
    if (at(k) == mode::at_lower || at(k) == mode::at_upper)
      continue;
    if (!(friction(k) > 0))
      at(k) = mode::free;
    else if (std::fabs(v[k]) <= rest * largest || at(k) == mode::sticks)
      at(k) = mode::sticks;
    else
      at(k) = v[k] > 0 ? mode::slides_up : mode::slides_down;
  }
  for (int tries = 0; tries <= tries_of_each * nv; ++tries) {
    // complementarity: each mode is right where its effort is within bounds (held), or its acceleration leads away (let go)
    if (!of.accelerate(t, run, 1, q, v, a, power))
      return false;
    int worst = -1;
    double most = 0;
    for (int k = 0; k < nv && (worst < 0 || tries <= 2 * nv); ++k)
      if (const double x = wrong(of, q, a, k); x > most)
        worst = k, most = x;
    if (worst < 0)
      break;
    if (holds(worst))
      let_go(worst);
    else
      at(worst) = let_go_[static_cast<std::size_t>(worst)];
  }
  for (int k = 0; k < nv; ++k)
    if (at(k) == mode::sticks || (any_ && a[k] == 0 && std::fabs(v[k]) <= rest * largest))
      v[k] = 0;
  return true;
}

// v⁺ = v + A_·h Λ, with Λ = ∫λ over the impact: (1) for velocities.  Coordinates that lie on limits take part as long
// as their Λ pushes; it is solved again without those that would pull, at most nv times.
void held_joints::impact(held_mechanism &of, const double *q, const unsigned char *hits, double *v) {
  const std::size_t nv = nv_;
  std::vector<unsigned char> resists(hits, hits + nv);
  for (std::size_t k = 0; k < nv; ++k)
    resists[k] |= mode_[k] == mode::at_lower || mode_[k] == mode::at_upper;
  for (bool settled = false; !settled;) {
    held_.clear(), all_held_.clear();
    std::vector<double> jump;
    for (std::size_t k = 0; k < nv; ++k)
      if (resists[k]) {
        held_.push_back(static_cast<int>(k)), all_held_.push_back({0, held_.back()});
        // Newton's law of impact: A_hh ∫λ = −(1 + e) v at what hits, −v at limits that are not passed
        jump.push_back(-(hits[k] ? 1 + laws_.restitution[k] : 1) * v[k]);
      }
    all_columns_.resize(held_.size() * nv);
    of.responses(q, all_held_, columns_ = all_columns_.data());
    solve(jump.data());
    settled = true;
    for (std::size_t j = 0; j < held_.size(); ++j) { // a limit that would have to pull lets go
      const std::size_t k = static_cast<std::size_t>(held_[j]);
      if (!hits[k] && (mode_[k] == mode::at_lower ? right_[j] < 0 : right_[j] > 0))
        resists[k] = 0, mode_[k] = mode::free, settled = false;
    }
  }
  for (std::size_t j = 0; j < held_.size(); ++j)
    for (std::size_t i = 0; i < nv; ++i)
      v[i] += columns_[j * nv + i] * right_[j];
  for (std::size_t k = 0; k < nv; ++k) {
    if (!hits[k] && resists[k])
      v[k] = 0;
    if (mode_[k] == mode::sticks && v[k] != 0)
      mode_[k] = mode::free; // settle() says how it slides
  }
}

} // namespace ksl::simulating
