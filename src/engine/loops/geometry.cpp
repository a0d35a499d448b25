// The frames of a loop, and where the numbers of its equations lie:
//
//                ┌─ link of the predecessor ── on_predecessor ─▸ frame p ─┐
//     world ─────┤                                                        │ relative = p⁻¹ s
//                └─ link of the successor ──── on_successor ───▸ frame s ─┘
//
//     K_ (rows, nv): row first_row + i, column v:   Σ ± r_c T_i · J_c,   c the coordinates of the loop that are v, r = 1, or follow it
//
// T_i has the axes of s, where it is constant; J_c is turned with the links.  So a product of both needs one of them in the axes of the other: forces
// and moments go to the world once for each loop, which is less than all columns to s.
#include "engine/loops/geometry.hpp"

#include "engine/loops/joint_position.hpp"
#include "engine/loops/vectors.hpp"

#include <cmath>

namespace ksl::loops {

using A = algebra<double>;
using vector = vec3<double>;
void geometry::lay_out(arena &memory, int externals) {
  const int links = static_cast<int>(t_.links.size()), nv = tree_.of().nv(),
            joints = static_cast<int>(tree_.of().joints().size());
  poses_ = memory.take<double>(16 * links);
  columns_ = memory.take<screw<double>>(static_cast<std::ptrdiff_t>(t_.columns.size()));
  at_ = memory.take<frames>(static_cast<std::ptrdiff_t>(t_.loops.size()));
  K_ = memory.take<double>(static_cast<std::ptrdiff_t>(t_.rows) * nv);
  twists_ = memory.take<double>(6 * links), accelerations_ = memory.take<double>(6 * links);
  // all rows that this room calls of the tree in rest(): a further one has to be named here, or it would write beyond
  for (const algorithm_row *row : // measured once, though memory is laid out twice
       {&rows::frame_poses, &rows::frame_velocities, &rows::frame_accelerations, &rows::mass_matrix,
        &rows::inverse_dynamics, &rows::inverse_dynamics_with_reactions, &rows::inverse_dynamics_derivatives,
        &rows::effort_parts, &rows::jacobian, &rows::integrate, &rows::difference})
    if (!is_measured_)
      rest_bytes_ = std::max(rest_bytes_, tree_.bytes(*row, links, joints, externals));
  is_measured_ = true;
  rest_ = memory.take<std::byte>(static_cast<std::ptrdiff_t>(rest_bytes_));
}

/// poses_ are (4, 4) row by row, and the numbers of mat3x3 go column by column.
SE3<double> geometry::pose(int slot) const {
  const double *const x = poses_ + 16 * slot;
  return {{x[0], x[4], x[8], x[1], x[5], x[9], x[2], x[6], x[10]}, {x[3], x[7], x[11]}};
}

void geometry::set_columns(const double *q) {
  for (std::size_t k = 0; k < t_.columns.size(); ++k) {
    const column &c = t_.columns[k];
    const mat3x3<double> R = pose(c.link).R;
    screw<double> s = c.twist;
    if (c.angle >= 0) { // about an axis of the parent's side: turned back by the second angle in the child's axes
      // Rodrigues' formula: R(u, α) x = x cos α + u × x sin α + u (u · x) (1 − cos α)
      const double angle = -q[c.angle], sine = std::sin(angle), cosine = std::cos(angle);
      const vector u = c.about, x = s.ang, ux = cross(u, x);
      const double along = dot(u, x) * (1 - cosine);
      s.ang = {x.x * cosine + ux.x * sine + u.x * along, x.y * cosine + ux.y * sine + u.y * along,
               x.z * cosine + ux.z * sine + u.z * along};
    }
    columns_[k] = {turned(R, s.lin), turned(R, s.ang)};
  }
}

void geometry::set_rows_of_universal(const loop &l, frames &f) const {
  // the one moment that the joint transmits is about the normal of both axes, of which the predecessor has the first
  const vector first = turned_back(f.relative.R, l.axis), normal = cross(first, l.axis2);
  const double n = length(normal);
  f.T[3].ang = n > 0 ? vector{normal.x / n, normal.y / n, normal.z / n} : vector{0, 0, 0};
}

screw<double> geometry::column_at_successor(int loop, int column) const {
  const SE3<double> &at = at_[loop].successor;
  const screw<double> &at_child = columns_[column];
  // the twist of a unit velocity, taken from the child's origin to the joint's: v + ω × r
  const vector arm = difference(at.t, pose(t_.columns[static_cast<std::size_t>(column)].link).t);
  return {turned_back(at.R, sum(at_child.lin, cross(at_child.ang, arm))), turned_back(at.R, at_child.ang)};
}

vec3<double> geometry::first_axis(int loop) const {
  return turned_back(at_[loop].relative.R, t_.loops[static_cast<std::size_t>(loop)].axis);
}

void geometry::set_position(const double *q) {
  const int nv = tree_.of().nv();
  state_view<double> s;
  s.q = q, s.links = {static_cast<int>(t_.links.size()), t_.links.data()}, s.result[0] = poses_;
  tree_.call(rows::frame_poses, rest_, s);
  set_columns(q);
  std::fill_n(K_, static_cast<std::ptrdiff_t>(t_.rows) * nv, 0.0);
  size_ = 1;
  for (std::size_t n = 0; n < t_.loops.size(); ++n) {
    const loop &l = t_.loops[n];
    frames &f = at_[n];
    f.predecessor = product(pose(l.predecessor), l.on_predecessor);
    f.successor = product(pose(l.successor), l.on_successor);
    // relative is the displacement of the joint: what it has beyond the joint's own motion is the error, and V_s − V_p its rate
    A::product_dinvd(&f.predecessor, &f.successor, &f.relative);
    std::copy_n(l.T, 6, f.T);
    if (row_has_two_axes(l.kind))
      set_rows_of_universal(l, f);
    vector force[6], moment[6]; // in world axes, in which the columns are
    double force_size[6], moment_size[6];
    for (int i = 0; i < l.rows; ++i) {
      force[i] = turned(f.successor.R, f.T[i].lin), moment[i] = turned(f.successor.R, f.T[i].ang);
      const double scale = t_.row_scale[static_cast<std::size_t>(l.first_row + i)];
      force_size[i] = length(f.T[i].lin) * scale, moment_size[i] = length(f.T[i].ang) * scale;
    }
    for (int k = l.support_begin; k < l.support_end; ++k) {
      const support &side = t_.supports[static_cast<std::size_t>(k)];
      const column &c = t_.columns[static_cast<std::size_t>(side.column)];
      const screw<double> &at_child = columns_[side.column];
      const vector arm = difference(f.successor.t, pose(c.link).t), moved = sum(at_child.lin, cross(at_child.ang, arm));
      // K_ij: what the wrench T_i does along the motion that coordinate j gives the successor relative to the predecessor.  A follower's
      // columns are its leader's, times the multiplier.  |f| |v| + |m| |ω| bounds the terms before they cancel, whatever the position.
      const double factor = side.sign * c.factor,
                   scale = std::fabs(factor) * t_.column_scale[static_cast<std::size_t>(c.v)];
      const double translation = scale * length(moved), rotation = scale * c.turning;
      double *const out = K_ + static_cast<std::ptrdiff_t>(l.first_row) * nv + c.v;
      for (int i = 0; i < l.rows; ++i) {
        out[i * nv] += factor * (dot(force[i], moved) + dot(moment[i], at_child.ang));
        size_ = std::max(size_, translation * force_size[i] + rotation * moment_size[i]);
      }
    }
  }
}

void geometry::error(double *out) const {
  for (std::size_t n = 0; n < t_.loops.size(); ++n) {
    const loop &l = t_.loops[n];
    const screw<double> left = displacement_left(l, at_[n].relative);
    for (int i = 0; i < l.rows; ++i)
      out[l.first_row + i] = work(at_[n].T[i], left);
  }
}

double geometry::zero() const {
  double opened = 0;
  for (std::size_t n = 0; n < t_.loops.size(); ++n) {
    const loop &l = t_.loops[n];
    const screw<double> left = displacement_left(l, at_[n].relative);
    for (int i = 0; i < l.rows; ++i)
      opened = std::fmax(opened,
                         std::fabs(work(at_[n].T[i], left)) * t_.row_scale[static_cast<std::size_t>(l.first_row + i)]);
  }
  return size_ * rank_within(t_, opened / t_.length);
}

/// terms: Σ_j |v_j| / C_j in lengths, times the largest element of R K C, bounds the terms of each equation as a length, and divided by R_i in its
/// own unit.
void geometry::velocity(const double *v, double *out, double *terms) const {
  const int nv = tree_.of().nv();
  const double size = terms ? sum_of_terms(v) * size_ : 0;
  for (int i = 0; i < t_.rows; ++i) {
    double value = 0;
    for (int j = 0; j < nv; ++j)
      value += K_[i * nv + j] * v[j];
    out[i] = value;
    if (terms)
      terms[i] = size / t_.row_scale[static_cast<std::size_t>(i)];
  }
}

/// As lengths, and before they cancel: a body that doesn't turn may hang on joints that do.
double geometry::sum_of_terms(const double *v) const {
  double sum = 0;
  for (int j = 0; j < tree_.of().nv(); ++j)
    sum += std::fabs(v[j]) / t_.column_scale[static_cast<std::size_t>(j)];
  return sum;
}

// Tᵀ (V_s − V_p) = 0 with T constant in s.  V and its rate A come from the tree about the world's origin, in world axes, and Ad(s⁻¹) takes them to s;
// d/dt (Ad(s⁻¹) V) = Ad(s⁻¹) (A − V_s × V), hence A_s − A_p − V_s × (V_s − V_p), the term V_s × V_s being zero.
void geometry::acceleration(const double *q, const double *v, const double *a, double *out, double *terms) {
  state_view<double> s;
  s.q = q, s.v = v, s.a = a, s.links = {static_cast<int>(t_.links.size()), t_.links.data()};
  s.frame.axes = s.frame.at = expressed_in::world;
  s.result[0] = twists_;
  tree_.call(rows::frame_velocities, rest_, s);
  s.result[0] = accelerations_;
  tree_.call(rows::frame_accelerations, rest_, s);
  // lengths a second²: accelerations, and centripetal ones, of K̇ v, along the mechanism's length
  const double speed = terms ? sum_of_terms(v) : 0,
               own = terms ? (sum_of_terms(a) + speed * speed / t_.length) * size_ : 0;
  for (std::size_t n = 0; n < t_.loops.size(); ++n) {
    const loop &l = t_.loops[n];
    const frames &f = at_[n];
    const screw<double> to = at_frame(f.successor, screw_of(twists_ + 6 * l.successor)),
                        relative = difference(to, at_frame(f.successor, screw_of(twists_ + 6 * l.predecessor)));
    const screw<double> to_rate = at_frame(f.successor, screw_of(accelerations_ + 6 * l.successor)),
                        from_rate = at_frame(f.successor, screw_of(accelerations_ + 6 * l.predecessor));
    // A_s − A_p − V_s × (V_s − V_p) is the rate of the relative twist as the successor sees it, in whose axes T is constant
    const screw<double> moved = cross(to, relative), rate = difference(difference(to_rate, from_rate), moved);
    for (int i = 0; i < l.rows; ++i) {
      double value = work(f.T[i], rate);
      if (i == 3 && row_has_two_axes(l.kind)) { // the normal of both axes turns in the successor
        const vector first = turned_back(f.relative.R, l.axis), normal = cross(first, l.axis2);
        const vector moving = cross(cross(first, relative.ang), l.axis2);
        // d/dt (n · ω) = n · ω̇ + (Ṅ − n (n · Ṅ)) · ω / |N|, n = N / |N|.  Its last term, by the rate of |N|, is zero where velocities keep the loop closed.
        if (const double n_length = length(normal); n_length > 0)
          value +=
              (dot(moving, relative.ang) - dot(normal, moving) / (n_length * n_length) * dot(normal, relative.ang)) /
              n_length;
      }
      out[l.first_row + i] = value;
      if (terms)
        terms[l.first_row + i] = magnitude(f.T[i], to_rate) + magnitude(f.T[i], from_rate) + magnitude(f.T[i], moved) +
                                 own / t_.row_scale[static_cast<std::size_t>(l.first_row + i)];
    }
  }
}

coscrew<double> geometry::wrench(int loop, const double *lambda) const {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  coscrew<double> w = {{0, 0, 0}, {0, 0, 0}};
  for (int i = 0; i < l.rows; ++i) {
    const coscrew<double> &T = at_[loop].T[i];
    const double x = lambda[l.first_row + i];
    w.lin = {w.lin.x + x * T.lin.x, w.lin.y + x * T.lin.y, w.lin.z + x * T.lin.z};
    w.ang = {w.ang.x + x * T.ang.x, w.ang.y + x * T.ang.y, w.ang.z + x * T.ang.z};
  }
  return w;
}

/// The twist of the successor relative to the predecessor for velocities dq, at the joint's frame on the successor.
screw<double> geometry::relative_twist(int loop, const double *dq) const {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  screw<double> W = {{0, 0, 0}, {0, 0, 0}};
  for (int c = l.support_begin; c < l.support_end; ++c) {
    const support &side = t_.supports[static_cast<std::size_t>(c)];
    const column &of = t_.columns[static_cast<std::size_t>(side.column)];
    W = sum(W, scaled(side.sign * of.factor * dq[of.v], column_at_successor(loop, side.column)));
  }
  return W;
}

/// A wrench at the joint's frame on the successor, on that (side 0), or the opposite one on the predecessor (1): at the link's origin, in its
/// axes.
void geometry::move_to_link(int loop, int side, const coscrew<double> &w, double *six) const {
  const ksl::loops::loop &l = t_.loops[static_cast<std::size_t>(loop)];
  const SE3<double> link = pose(side == 0 ? l.successor : l.predecessor);
  SE3<double> D;
  A::product_dinvd(&link, &at_[loop].successor, &D);
  const vector force = turned(D.R, w.lin), moment = sum(turned(D.R, w.ang), cross(D.t, force));
  const double sign = side == 0 ? 1 : -1, found[] = {force.x, force.y, force.z, moment.x, moment.y, moment.z};
  for (int c = 0; c < 6; ++c)
    six[c] = sign * found[c];
}

void geometry::wrenches(const double *lambda, int *links, double *on_links, double *at_joints) const {
  for (int n = 0; n < static_cast<int>(t_.loops.size()); ++n) {
    const loop &l = t_.loops[static_cast<std::size_t>(n)];
    const coscrew<double> w = wrench(n, lambda);
    const double joint[] = {w.lin.x, w.lin.y, w.lin.z, w.ang.x, w.ang.y, w.ang.z};
    std::copy_n(joint, 6, at_joints + 6 * n);
    for (int side = 0; side < 2; ++side) {
      move_to_link(n, side, w, on_links + 6 * (2 * n + side));
      links[2 * n + side] = t_.links[static_cast<std::size_t>(side == 0 ? l.successor : l.predecessor)];
    }
  }
}

/// Of f = Σ λ T, whose T are constant in the successor's axes: df = Σ dλ T there, and, seen from the predecessor, in whose axes its link's wrench is,
/// df + W ×* f, W the twist of the successor relative to the predecessor for dq.
void geometry::wrench_variations(const double *lambda, const double *dlambda, const double *dq, double *on_links,
                                 double *at_joints) const {
  for (int n = 0; n < static_cast<int>(t_.loops.size()); ++n) {
    const loop &l = t_.loops[static_cast<std::size_t>(n)];
    const screw<double> W = relative_twist(n, dq);
    const coscrew<double> f = wrench(n, lambda);
    coscrew<double> df = wrench(n, dlambda);
    if (row_has_two_axes(
            l.kind)) { // its last wrench is the normal of both axes, the first of which the predecessor has
      const vector u1 = first_axis(n), dN = cross(cross(u1, W.ang), l.axis2);
      const double size = length(cross(u1, l.axis2));
      df.ang = sum(df.ang, scaled(size > 0 ? lambda[l.first_row + l.rows - 1] / size : 0, dN));
    }
    // the successor's axes turn and move with it as the predecessor sees them: ad* of W
    const coscrew<double> seen = {sum(df.lin, cross(W.ang, f.lin)),
                                  sum(df.ang, sum(cross(W.ang, f.ang), cross(W.lin, f.lin)))};
    move_to_link(n, 0, df, on_links + 12 * n);
    move_to_link(n, 1, seen, on_links + 12 * n + 6);
    const double joint[] = {df.lin.x, df.lin.y, df.lin.z, df.ang.x, df.ang.y, df.ang.z};
    std::copy_n(joint, 6, at_joints + 6 * n);
  }
}

} // namespace ksl::loops
