// Reactions that rigid bodies leave open, and how they are split (closed_state.hpp).
//
// Redundant equations leave multipliers λ with Kᵀ λ = 0, which no motion tells.  Each makes a pattern u: wrenches through all joints that balance
// among themselves, at any motion.  Reactions x are known up to x − Σ η_k u_k, and η follows from a rule: least energy ½ xᵀ C x in the compliances of
// joints, or least norm.
//
// A door on two hinges has five redundant equations, and five patterns.  One is a force along the line of the hinges, on the door at one of them and
// back at the other: how they share the door's weight.
//
//     a pattern, (joints + loops, 6):   [ joint 0 of the tree: force, moment | joint 1 | … | loop 0 | loop 1 | … ]
//
//     patterns_:   0 ……………… open_ ……………… free_ ……………… redundant
//                   no energy     energy in       a wrench along directions in
//                   anywhere      compliances     which nothing resists
//
// Patterns are orthonormal, and within each group conjugate by the matrices that sorted them, uᵢᵀ C uₖ = 0, so that each η is a quotient of two numbers.
// null_lambda_ has their multipliers; what turns or scales patterns does the same to these.
#include "engine/loops/closed_state.hpp"

#include <algorithm>
#include <cmath>

namespace ksl::loops {

namespace {

double dot(const double *x, const double *y, int n) {
  double sum = 0;
  for (int i = 0; i < n; ++i)
    sum += x[i] * y[i];
  return sum;
}
void add(double factor, const double *x, int n, double *y) {
  for (int i = 0; i < n; ++i)
    y[i] += factor * x[i];
}

/// Rounding of the elements of a pattern, whose norm is 1.
constexpr double of_elements = 1e-13;

} // namespace

reaction_request closed_state::all_joints() const {
  reaction_request request;
  request.n = joints(), request.link = joint_links_;
  return request;
}

int closed_state::set_patterns(const double *q) {
  const int redundant = t_.rows - k_.rank, length = pattern_length(), loops = static_cast<int>(t_.loops.size());
  if (patterns_known_ == redundant)
    return open_;
  patterns_known_ = redundant;
  const reaction_request request = all_joints();
  for (int k = 0; k < redundant; ++k) {
    double *const x = patterns_ + k * length, *const lambda = null_lambda_ + k * t_.rows;
    k_.null_vector(k, lambda);
    g_.wrenches(lambda, wrench_links_, wrenches_, at_joints_);
    state_view<double> s;
    const reaction_result<double> wanted = {&request, x};
    s.q = q, s.v = s.a = zero_, s.external = {2 * loops, wrench_links_, wrenches_, expressed_in::frame};
    s.reactions_n = 1, s.reactions = &wanted, s.result[0] = tree_;
    // statics: the wrenches of the loops' joints alone, on a mechanism at rest without weight
    g_.tree().call_weightless(rows::inverse_dynamics_with_reactions, g_.rest(), s);
    std::copy_n(at_joints_, 6 * loops, x + 6 * joints());
    for (int pass = 0; pass < 2; ++pass)
      for (int j = 0; j < k; ++j) {
        // what is taken off a pattern is taken off its multipliers, too: they stay those of this pattern
        const double along = dot(x, pattern(j), length);
        add(-along, pattern(j), length, x);
        add(-along, null_lambda_ + j * t_.rows, t_.rows, lambda);
      }
    const double inverse = 1 / std::sqrt(dot(x, x, length));
    for (int i = 0; i < length; ++i)
      x[i] *= inverse;
    for (int i = 0; i < t_.rows; ++i)
      lambda[i] *= inverse;
  }
  open_ = free_ = t_.loose.empty() ? redundant : take_apart(t_.loose, redundant);
  if (!t_.compliances.empty())
    open_ = take_apart(t_.compliances, free_);
  return open_;
}

/// The patterns without components that no combination of them reaches with more than `least`: these are rounding, or due to few digits.  What
/// is left is made orthonormal again, from which zeros stay zeros.
void closed_state::copy_patterns(int n, double least, double *out) const {
  const int length = pattern_length();
  std::copy_n(patterns_, n * length, out);
  for (int i = 0; i < length; ++i) {
    double square = 0; // of what the patterns have there: for any orthonormal basis of them the same
    for (int k = 0; k < n; ++k)
      square += out[k * length + i] * out[k * length + i];
    for (int k = 0; k < n && !(square > least * least); ++k)
      out[k * length + i] = 0;
  }
  for (int k = 0; k < n; ++k) {
    double *const x = out + k * length;
    for (int pass = 0; pass < 2; ++pass)
      for (int j = 0; j < k; ++j)
        add(-dot(x, out + j * length, length), out + j * length, length, x);
    const double norm = std::sqrt(dot(x, x, length));
    for (int i = 0; i < length && norm > 0; ++i)
      x[i] = std::fabs(x[i]) > of_elements ? x[i] / norm : 0;
  }
}

namespace {

/// x · C y, with matrices of joints.
double energy(const tables::matrices_of_joints &of, const double *x, const double *y) {
  double sum = 0;
  for (const auto &[joint, C] : of)
    for (std::size_t i = 0; i < 6; ++i)
      sum += x[6 * joint + static_cast<int>(i)] * dot(C.data() + 6 * i, y + 6 * joint, 6);
  return sum;
}

/// The largest energy that rounding of its elements gives a pattern.
double least_energy(const tables::matrices_of_joints &of) {
  double largest = 0;
  for (const auto &[joint, C] : of)
    for (std::size_t i = 0; i < 6; ++i)
      largest = std::max(largest, C[7 * i]);
  return of_elements * of_elements * largest;
}

} // namespace

/// Turns the first n patterns into others, orthonormal too, whose energies with each other are zero by these matrices of joints.  Returns how
/// many of them have no energy; they come first.
///
/// Energies in bending and in stretching, or of large and small mechanisms, may differ by any power of ten.  So an energy counts as none
/// beside the terms that made it, and not beside those of other patterns.
int closed_state::take_apart(const tables::matrices_of_joints &of, int n) {
  const int length = pattern_length();
  // stiff_ from n on has the energies of patterns that an earlier call has set aside; they stay
  double *const terms = stiff_; // until the energies are known: the sum of the terms that made each
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k)
      energy_[i * n + k] = energy(of, pattern(i), pattern(k));
    terms[i] = std::fabs(energy_[i * n + i]);
  }
  for (int sweep = 0; sweep < 60; ++sweep) { // Jacobi's method
    bool turned = false;
    for (int i = 0; i < n; ++i)
      for (int k = i + 1; k < n; ++k) {
        const double xy = energy_[i * n + k], xx = energy_[i * n + i], yy = energy_[k * n + k];
        if (!(std::fabs(xy) > 1e-15 * std::sqrt(terms[i]) * std::sqrt(terms[k])))
          continue;
        turned = true;
        // the smaller turn that makes xᵀ C y zero: t² + 2 ζ t − 1 = 0 (Golub and Van Loan, Matrix Computations, 8.5.2)
        const double zeta = (yy - xx) / (2 * xy),
                     t = std::copysign(1.0, zeta) / (std::fabs(zeta) + std::hypot(1.0, zeta)),
                     c = 1 / std::hypot(1.0, t), s = c * t;
        const auto turn = [c, s](double *x, double *y, int count, int stride) {
          for (int j = 0; j < count; ++j) {
            const double old = x[j * stride];
            x[j * stride] = c * old - s * y[j * stride], y[j * stride] = s * old + c * y[j * stride];
          }
        };
        turn(energy_ + i * n, energy_ + k * n, n, 1);
        turn(energy_ + i, energy_ + k, n, n);
        turn(patterns_ + i * length, patterns_ + k * length, length, 1);
        turn(null_lambda_ + i * t_.rows, null_lambda_ + k * t_.rows, t_.rows, 1);
        // xᵀ C x becomes c² xx − 2 c s xy + s² yy: the sum of the magnitudes of these terms, whatever they cancel to
        const double x = terms[i], y = terms[k], both = 2 * std::fabs(c * s * xy);
        terms[i] = c * c * x + both + s * s * y, terms[k] = s * s * x + both + c * c * y;
      }
    if (!turned)
      break;
  }
  const double least = least_energy(of);
  int without = 0;
  for (int k = 0; k < n; ++k) {
    // energies are now diagonal: u_iᵀ C u_k = 0 for i ≠ k
    const bool is_open = !(energy_[k * n + k] > std::max(1e-12 * terms[k], least));
    stiff_[k] = energy_[k * n + k];
    if (!is_open)
      continue;
    std::swap(stiff_[k], stiff_[without]);
    std::swap_ranges(patterns_ + k * length, patterns_ + (k + 1) * length, patterns_ + without * length);
    std::swap_ranges(null_lambda_ + k * t_.rows, null_lambda_ + (k + 1) * t_.rows, null_lambda_ + without * t_.rows);
    ++without;
  }
  return without;
}

void closed_state::set_reactions(const double *q, const double *v, const double *a,
                                 const external_wrenches<double> &e) {
  if (t_.rows == k_.rank)
    return;
  const int redundant = t_.rows - k_.rank, loops = static_cast<int>(t_.loops.size());
  set_patterns(q);
  const reaction_request request = all_joints();
  const reaction_result<double> wanted = {&request, reactions_};
  state_view<double> s;
  s.q = q, s.v = zeros_or(v), s.a = zeros_or(a), s.external = all_wrenches(e);
  s.reactions_n = 1, s.reactions = &wanted, s.result[0] = tree_;
  call(rows::inverse_dynamics_with_reactions, s);
  std::copy_n(at_joints_, 6 * loops, reactions_ + 6 * joints());
  // What nothing resists is first, since no stiffness outweighs it; then the energy decides those patterns that store some, and the norm others.
  for (int pass = 0; pass < 2; ++pass)
    for (int k = redundant - 1; k >= 0; --k) {
      // least energy ½ xᵀ C x of x = reactions − Σ η_k u_k: η_k = u_kᵀ C x / u_kᵀ C u_k, since patterns are conjugate; least norm where C is 1
      const double along = k >= free_   ? energy(t_.loose, pattern(k), reactions_) / stiff_[k]
                           : k >= open_ ? energy(t_.compliances, pattern(k), reactions_) / stiff_[k]
                                        : dot(pattern(k), reactions_, pattern_length());
      add(-along, pattern(k), pattern_length(), reactions_);
      add(-along, null_lambda_ + k * t_.rows, t_.rows, lambda_);
    }
}

} // namespace ksl::loops
