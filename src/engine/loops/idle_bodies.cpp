// How bodies that turn alone are found, at one closed position:
//
//     left_     N (freedoms, nv), a basis of { v : K v = 0, v = 0 at drives };
//     twists_   Ξ_b = J_b Nᵀ (6, freedoms) of each body b: its twist for each motion of that basis;
//     body b turns alone if { x : Ξ_o x = 0 for all other bodies o } has dimension one and Ξ_b x is a rotation, ω · v = 0.
//
// Two dimensions or more are a body that also slides, or turns about two lines: such freedoms need drives.
//
// Of a rod on a ball of the tree, whose other end a ball of a loop holds: the rod's three angular velocities move its far end, but for those along
// the line of both balls.  left_ has a row with ω ∥ n, all other bodies have Ξ = 0 for it, and so the rod turns alone.
#include "engine/loops/idle_bodies.hpp"

#include "engine/loops/elimination.hpp"
#include "engine/loops/geometry.hpp"
#include "engine/loops/own_memory.hpp"
#include "engine/loops/vectors.hpp"
#include "engine/model/canonical_axes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace ksl::loops {
namespace {

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// Motions of other bodies, relative to the largest, below which these stand still; how far mass may be from even, relative to it and to a length.
constexpr double still = 1e-8, even = 1e-6;

class finder {
public:
  finder(const model &m, const std::vector<double> &q)
      : m_(m), t_(m.loop_tables()), g_(m, t_), memory_([this](arena &memory) { g_.lay_out(memory); }), q_(q) {
    g_.set_position(q.data());
    set_left();
    if (freedoms_ > 0)
      set_twists();
  }

  std::vector<idle_body> find() {
    std::vector<idle_body> found;
    for (std::size_t b = 0; b < bodies_.size() && freedoms_ > 0; ++b)
      if (std::optional<idle_body> body = idle(static_cast<int>(b)))
        found.push_back(std::move(*body));
    choose_coordinates(found);
    return found;
  }

private:
  /// Vectors [−U⁻¹ U_i; 1] of elimination.hpp, scaled back, a column at a time:
  /// Zero at all but one coordinate, which moves by a length of one: what a matrix (rows, columns) leaves of motions, by elimination.
  template <class Take>
  void null_space(const std::vector<double> &A, int rows, int columns, const double *row_scale,
                  const double *column_scale, double size, double zero, Take take) const {
    elimination k;
    const own_memory memory([&](arena &pieces) { k.lay_out(pieces, rows, columns); });
    k.factor(A.data(), row_scale, column_scale, size, zero, nullptr, 0);
    std::vector<double> x(index(columns));
    for (int j = 0; j < k.freedoms(); ++j) {
      std::fill(x.begin(), x.end(), 0.0);
      const double unit = column_scale[k.independent()[j]];
      x[index(k.independent()[j])] = unit;
      for (int i = 0; i < k.rank; ++i)
        x[index(k.column[i])] = k.element(i, j) * unit;
      take(x);
    }
  }

  /// left_ (freedoms, nv): motions that the loops allow while the drives stand still.
  /// Below K a row e_d for each drive, 1 at its coordinate, scaled so that its element is 1, too.
  void set_left() {
    const int nv = m_.nv(), rows = t_.rows + static_cast<int>(t_.drives.size());
    std::vector<double> A(g_.jacobian(), g_.jacobian() + index(t_.rows * nv)), scale = t_.row_scale;
    A.resize(index(rows * nv), 0.0);
    for (std::size_t d = 0; d < t_.drives.size(); ++d) {
      A[index((t_.rows + static_cast<int>(d)) * nv + t_.drives[d])] = 1;
      scale.push_back(1 / t_.column_scale[index(t_.drives[d])]);
    }
    null_space(A, rows, nv, scale.data(), t_.column_scale.data(), g_.size(), g_.zero(),
               [this](const std::vector<double> &x) { left_.insert(left_.end(), x.begin(), x.end()), ++freedoms_; });
  }

  /// bodies_: a link of each body that counts.  twists_ (bodies, 6, freedoms): of these, as lengths, in the link's axes.
  /// A body counts if mass would move with it, or if a loop ends at it: others are parts of joints.
  void set_twists() {
    const model_view<double> &view = m_.view();
    std::vector<bool> counts(index(view.bodies), false);
    const auto count = [&](int link) { counts[index(view.link[link].body)] = true; };
    for (int l = 0; l < view.links; ++l)
      if (const spatial_inertia<double> &I = view.link[l].inertia; I.m != 0 || I.Ixx + I.Iyy + I.Izz != 0)
        count(l);
    for (const auto &loop : m_.loops())
      count(loop.predecessor), count(loop.successor);
    for (int b = 1; b < view.bodies; ++b)
      if (counts[index(b)])
        bodies_.push_back(view.body[b].link);
    const int nv = m_.nv();
    std::vector<double> J(index(6 * nv));
    for (const int link : bodies_) {
      state_view<double> s;
      s.q = q_.data(), s.links = {1, &link}, s.result[0] = J.data();
      g_.tree().call(rows::jacobian, g_.rest(), s);
      for (int i = 0; i < 6; ++i)
        for (int k = 0; k < freedoms_; ++k) {
          double sum = 0;
          for (int v = 0; v < nv; ++v)
            sum += J[index(i * nv + v)] * left_[index(k * nv + v)];
          twists_.push_back(i < 3 ? sum : sum * t_.length);
          largest_ = std::max(largest_, std::fabs(twists_.back()));
        }
    }
  }

  /// Does a body turn alone, and only about one line?
  /// A holds the twists of all bodies but b, (6 (bodies − 1), freedoms): its null space are the combinations of left_ that move none of them.
  std::optional<idle_body> idle(int b) const {
    const int others = 6 * (static_cast<int>(bodies_.size()) - 1), block = 6 * freedoms_;
    std::vector<double> A(twists_.begin(), twists_.begin() + b * block);
    A.insert(A.end(), twists_.begin() + (b + 1) * block, twists_.end());
    const std::vector<double> ones(index(std::max(others, freedoms_)), 1.0);
    std::vector<std::vector<double>> alone;
    null_space(A, others, freedoms_, ones.data(), ones.data(), 1, still * largest_,
               [&](const std::vector<double> &x) { alone.push_back(x); });
    if (alone.size() != 1)
      return {};
    double twist[6] = {};
    for (int i = 0; i < 6; ++i)
      for (int k = 0; k < freedoms_; ++k)
        twist[i] += twists_[index(b * block + i * freedoms_ + k)] * alone[0][index(k)];
    // moving = v, turning = L ω: all twists are lengths.  Pitch zero is |ω · v| / ω² ≪ L, and the point of the line nearest to the origin ω × v / ω².
    const vec3<double> moving = {twist[0], twist[1], twist[2]}, turning = {twist[3], twist[4], twist[5]};
    const double speed = length(turning);
    if (!(speed > still * largest_) || std::fabs(dot(moving, turning)) > still * speed * speed)
      return {};
    idle_body found{
        bodies_[index(b)], scaled(1 / speed, turning), -1, {}, std::vector<double>(index(m_.nv()), 0.0), false};
    found.is_even = is_even(found, scaled(t_.length / (speed * speed), cross(turning, moving)));
    double most = 0;
    for (int v = 0; v < m_.nv(); ++v) {
      for (int k = 0; k < freedoms_; ++k)
        found.motion[index(v)] += left_[index(k * m_.nv() + v)] * alone[0][index(k)];
      most = std::max(most, std::fabs(found.motion[index(v)]) / t_.column_scale[index(v)]);
    }
    for (int v = 0; v < m_.nv(); ++v)
      if (std::fabs(found.motion[index(v)]) > still * most * t_.column_scale[index(v)])
        found.moved.push_back(v);
    return found;
  }

  /// Is the mass of a body the same all round its line?  point: of the line, in the link's frame.
  bool is_even(const idle_body &body, const vec3<double> &point) const {
    const model_view<double> &view = m_.view();
    const ksl::link<double> &own = view.link[body.link];
    const vec3<double> n = turned(own.pose.R, body.direction), at = sum(own.pose.t, turned(own.pose.R, point));
    spatial_inertia<double> I{}; // about the origin of the body's frame
    for (int l = 0; l < view.links; ++l)
      if (const spatial_inertia<double> &J = view.link[l].inertia; view.link[l].body == own.body) {
        I.m += J.m, I.h = sum(I.h, J.h);
        I.Ixx += J.Ixx, I.Iyy += J.Iyy, I.Izz += J.Izz, I.Ixy += J.Ixy, I.Iyz += J.Iyz, I.Izx += J.Izx;
      }
    const vec3<double> c = I.m > 0 ? scaled(1 / I.m, I.h) : at;
    if (length(cross(difference(c, at), n)) > even * t_.length)
      return false;
    // Steiner: I_c = I + m [c]×², with I about the frame's origin
    const auto about_centre = [&](const vec3<double> &x) -> vec3<double> {
      const vec3<double> Ix = {I.Ixx * x.x + I.Ixy * x.y + I.Izx * x.z, I.Ixy * x.x + I.Iyy * x.y + I.Iyz * x.z,
                               I.Izx * x.x + I.Iyz * x.y + I.Izz * x.z};
      return sum(Ix, scaled(I.m, cross(c, cross(c, x))));
    };
    // the same all round: n is a principal axis, and the moments about x and y, any two axes across it, are equal and have no product
    const mat3x3<double> R = frame_with_z(n);
    const vec3<double> x = {R.m00, R.m10, R.m20}, y = {R.m01, R.m11, R.m21};
    const vec3<double> Ix = about_centre(x), Iy = about_centre(y);
    const double least = even * (std::fabs(dot(x, Ix)) + std::fabs(dot(y, Iy)));
    return std::fabs(dot(n, Ix)) <= least && std::fabs(dot(n, Iy)) <= least && std::fabs(dot(x, Iy)) <= least &&
           std::fabs(dot(x, Ix) - dot(y, Iy)) <= least;
  }

  /// One for each, in which their motions differ most: what is eliminated leaves a regular matrix of these.
  /// Motions of several bodies may have coordinates in common: Gaussian elimination of the rows `motion`, the pivot of each the largest element left
  /// of it as a length, makes the matrix of all rows at the chosen coordinates regular, so that these tell the spins of all.
  void choose_coordinates(std::vector<idle_body> &found) const {
    std::vector<std::vector<double>> motions;
    for (const idle_body &body : found)
      motions.push_back(body.motion);
    for (std::size_t b = 0; b < found.size(); ++b) {
      double most = 0;
      for (int v = 0; v < m_.nv(); ++v)
        if (const double x = std::fabs(motions[b][index(v)]) / t_.column_scale[index(v)]; x > most)
          most = x, found[b].coordinate = v;
      for (std::size_t later = b + 1; later < found.size(); ++later) {
        const std::size_t at = index(found[b].coordinate);
        const double share = motions[later][at] / motions[b][at];
        for (std::size_t v = 0; v < motions[b].size(); ++v)
          motions[later][v] -= share * motions[b][v];
        motions[later][at] = 0;
      }
    }
  }

  const model &m_;
  const tables &t_;
  geometry g_;
  const own_memory memory_;
  const std::vector<double> &q_;
  int freedoms_ = 0; ///< that the drives leave
  std::vector<double> left_, twists_;
  std::vector<int> bodies_;
  double largest_ = 0;
};

} // namespace

std::vector<idle_body> bodies_that_turn_alone(const model &m, const std::vector<double> &q) {
  return m.loop_tables().drives_are_known ? finder(m, q).find() : std::vector<idle_body>();
}

void keep(std::vector<idle_body> bodies, tables &t) {
  double scale = 0; // as that of a drive: neither is rounding beside the other
  for (const double x : t.drive_scale)
    scale = std::max(scale, x);
  for (idle_body &body : bodies)
    (body.is_even ? t.idle : t.uneven).push_back(std::move(body));
  if (t.idle.empty())
    return;
  for (const idle_body &body : t.idle)
    t.is_kept[index(body.coordinate)] = 1;
  t.kept.clear();
  std::vector<double> scales;
  for (int v = 0, drive = 0; v < static_cast<int>(t.is_kept.size()); ++v)
    if (t.is_kept[index(v)]) {
      t.kept.push_back(v);
      scales.push_back(t.is_driven[index(v)] ? t.drive_scale[index(drive++)] : -(scale > 0 ? scale : 1));
    }
  t.kept_scale = std::move(scales);
  // Pivots are taken from low stages first, and what is left without one is independent.  The columns of K at `moved` depend on each other by the
  // body's own motion alone, so that without the body's coordinate, which is last, they are independent: all of stage 0 gets pivots.
  t.stages.assign(t.is_kept.size(), 1);
  for (const idle_body &body : t.idle)
    for (const int v : body.moved)
      t.stages[index(v)] = 0;
  for (const int v : t.kept)
    t.stages[index(v)] = t.is_driven[index(v)] ? 2 : 3;
}

void set_spin_row(const tree_calls &tree, void *rest, const idle_body &body, const double *q, double *jacobian,
                  double *out) {
  const int nv = tree.of().nv();
  state_view<double> s;
  s.q = q, s.links = {1, &body.link}, s.result[0] = jacobian;
  tree.call(rows::jacobian, rest, s);
  const vec3<double> &n = body.direction;
  for (int v = 0; v < nv; ++v)
    out[v] = n.x * jacobian[3 * nv + v] + n.y * jacobian[4 * nv + v] + n.z * jacobian[5 * nv + v];
}

/// n · ω̇, which is the rate of n · ω too, for n fixed in the body: (ω × n) · ω is zero.
double spin_rate(const tree_calls &tree, void *rest, const idle_body &body, const double *q, const double *v,
                 const double *a) {
  double rate[6];
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.links = {1, &body.link}, s.result[0] = rate;
  tree.call(rows::frame_accelerations, rest, s);
  return dot(body.direction, vec3<double>{rate[3], rate[4], rate[5]});
}

} // namespace ksl::loops
