// Positions as plain numbers, and their tangents.
//
// Operators are functions of all nq numbers of a position, in an open neighbourhood of the unit quaternions: they divide quaternions by their
// length first.  KSL's derivatives are along joint velocities, so that T(q), nv × nq, stands between the two: a change dq of the numbers is
// the displacement T(q) dq.  T is the identity except for the joints whose velocity is a twist in the child's axes.
#pragma once

#include "ksl/model.hpp"

#include <cmath>
#include <vector>

namespace operators {

/// The joints whose velocity is not the rate of their position, and where their numbers are in q and v.
enum class turning : unsigned char { spherical, floating, planar };
struct turning_joint {
  turning kind;
  int q, v;
};

/// Which numbers of q and v are those of other joints: n of them, one for one.
struct plain_numbers { int q, v, n; };

/// Three numbers.
template <class S> struct three {
  S x, y, z;
  friend three operator+(three a, three b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend three operator*(S s, three a) { return {s * a.x, s * a.y, s * a.z}; }
  friend three cross(three a, three b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
  friend S dot(three a, three b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
};

template <class S> three<S> at(const S *x) { return {x[0], x[1], x[2]}; }
template <class S> void put(three<S> a, S *x) { x[0] = a.x, x[1] = a.y, x[2] = a.z; }
template <class S> void add(three<S> a, S *x) { x[0] += a.x, x[1] += a.y, x[2] += a.z; }

/// A quaternion, of any length: x y z, w.
template <class S> struct quaternion {
  three<S> u;
  S w;
  explicit quaternion(const S *q) : u(at(q)), w(q[3]) {}
  S squared() const { return dot(u, u) + w * w; }
  /// The vector part of q* p; twice that for unit q is the angular velocity in the child's axes where the rate of q is p.
  three<S> turned_by(const quaternion &p) const { return w * p.u + (-p.w) * u + S(-1) * cross(u, p.u); }
  /// The transpose of the same, a map of p: adds scale × it to out (4).
  void add_transposed(three<S> g, S scale, S *out) const {
    add(scale * (w * g + cross(u, g)), out);
    out[3] -= scale * dot(u, g);
  }
  /// R x and Rᵀ x for the unit quaternion along q.
  three<S> rotate(three<S> x) const { return turn(x, S(1)); }
  three<S> rotate_back(three<S> x) const { return turn(x, S(-1)); }

private:
  three<S> turn(three<S> x, S sign) const {
    const three<S> c = cross(u, x);
    return x + (S(2) / squared()) * ((sign * w) * c + cross(u, c));
  }
};

/// Rᵀ of a planar joint at an angle, times (x, y); with the angle negated R.
template <class S> void turn_plane(S angle, S x, S y, S &out_x, S &out_y) {
  const S c = std::cos(angle), s = std::sin(angle);
  out_x = c * x + s * y, out_y = c * y - s * x;
}

class tangent {
public:
  explicit tangent(const ksl::model &m);

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  bool is_plain() const { return joints_.empty(); }
  bool has_quaternions() const { return quaternions_; }

  /// The positions with unit quaternions; NaN where a quaternion is zero.
  template <class S> void normalise(const S *q, S *out) const;
  /// v = T(q) dq.
  template <class S> void apply(const S *q, const S *dq, S *v) const;
  /// out += T(q)ᵀ g.
  template <class S> void add_pulled(const S *q, const S *g, S *out) const;
  /// v = (derivative of T along dq₂) dq.  It is symmetric but for what second derivatives along velocities are not.
  template <class S> void apply_change(const S *q, const S *dq, const S *dq2, S *v) const;
  /// out += (derivative of T along dq2)ᵀ g.
  template <class S> void add_pulled_change(const S *q, const S *g, const S *dq2, S *out) const;
  /// The rates of the numbers of a position with unit quaternions that moves at v, L(q) v, and out = L(q)ᵀ g.
  template <class S> void lift(const S *q, const S *v, S *rate) const;
  template <class S> void pull_lift(const S *q, const S *g, S *out) const;

private:
  int nq_, nv_;
  bool quaternions_ = false;
  std::vector<turning_joint> joints_;
  std::vector<plain_numbers> plain_;
};

inline tangent::tangent(const ksl::model &m) : nq_(m.nq()), nv_(m.nv()), quaternions_(!m.quaternions().empty()) {
  for (int j = 0; j < m.moving_joints(); ++j) {
    const ksl::joint_row &joint = m.joints()[static_cast<std::size_t>(j)];
    const ksl::joint_kind_row kind = ksl::row_of(joint.kind);
    if (kind.velocity_is_rate)
      plain_.push_back({joint.q_index, joint.v_index, kind.nv});
    else
      joints_.push_back({kind.quaternion == 0   ? turning::spherical
                         : kind.quaternion == 3 ? turning::floating
                                                : turning::planar,
                         joint.q_index, joint.v_index});
  }
}

template <class S> void tangent::normalise(const S *q, S *out) const {
  for (int i = 0; i < nq_; ++i)
    out[i] = q[i];
  for (const turning_joint &j : joints_)
    if (j.kind != turning::planar) {
      S *const p = out + j.q + (j.kind == turning::floating ? 3 : 0);
      const S scale = S(1) / std::sqrt(quaternion<S>(p).squared());
      for (int i = 0; i < 4; ++i)
        p[i] *= scale;
    }
}

template <class S> void tangent::apply(const S *q, const S *dq, S *v) const {
  for (const plain_numbers &p : plain_)
    for (int i = 0; i < p.n; ++i)
      v[p.v + i] = dq[p.q + i];
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const d = dq + j.q;
    S *const out = v + j.v;
    if (j.kind == turning::planar) {
      turn_plane(x[2], d[0], d[1], out[0], out[1]);
      out[2] = d[2];
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear);
    if (linear)
      put(p.rotate_back(at(d)), out);
    put(S(2) / p.squared() * p.turned_by(quaternion<S>(d + linear)), out + linear);
  }
}

template <class S> void tangent::add_pulled(const S *q, const S *g, S *out) const {
  for (const plain_numbers &p : plain_)
    for (int i = 0; i < p.n; ++i)
      out[p.q + i] += g[p.v + i];
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const f = g + j.v;
    S *const to = out + j.q;
    if (j.kind == turning::planar) {
      S a, b;
      turn_plane(-x[2], f[0], f[1], a, b);
      to[0] += a, to[1] += b, to[2] += f[2];
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear);
    if (linear)
      add(p.rotate(at(f)), to);
    p.add_transposed(at(f + linear), S(2) / p.squared(), to + linear);
  }
}

template <class S> void tangent::apply_change(const S *q, const S *dq, const S *dq2, S *v) const {
  for (int i = 0; i < nv_; ++i)
    v[i] = S(0);
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const d = dq + j.q, *const e = dq2 + j.q;
    S *const out = v + j.v;
    if (j.kind == turning::planar) {
      S a, b;
      turn_plane(x[2], d[0], d[1], a, b);
      out[0] = e[2] * b, out[1] = -e[2] * a;
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear), d4(d + linear), e4(e + linear);
    const S scale = S(2) / p.squared(), along = dot(p.u, e4.u) + p.w * e4.w;
    if (linear)
      put(S(-1) * cross(scale * p.turned_by(e4), p.rotate_back(at(d))), out);
    put(scale * (e4.turned_by(d4) + (-scale * along) * p.turned_by(d4)), out + linear);
  }
}

template <class S> void tangent::add_pulled_change(const S *q, const S *g, const S *dq2, S *out) const {
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const f = g + j.v, *const e = dq2 + j.q;
    S *const to = out + j.q;
    if (j.kind == turning::planar) {
      S a, b;
      turn_plane(-x[2], -e[2] * f[1], e[2] * f[0], a, b);
      to[0] += a, to[1] += b;
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear), e4(e + linear);
    const S scale = S(2) / p.squared(), along = dot(p.u, e4.u) + p.w * e4.w;
    if (linear)
      add(p.rotate(cross(scale * p.turned_by(e4), at(f))), to);
    e4.add_transposed(at(f + linear), scale, to + linear);
    p.add_transposed(at(f + linear), -scale * scale * along, to + linear);
  }
}

template <class S> void tangent::lift(const S *q, const S *v, S *rate) const {
  for (const plain_numbers &p : plain_)
    for (int i = 0; i < p.n; ++i)
      rate[p.q + i] = v[p.v + i];
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const f = v + j.v;
    S *const to = rate + j.q;
    if (j.kind == turning::planar) {
      turn_plane(-x[2], f[0], f[1], to[0], to[1]);
      to[2] = f[2];
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear);
    if (linear)
      put(p.rotate(at(f)), to);
    for (int i = 0; i < 4; ++i)
      to[linear + i] = S(0);
    p.add_transposed(at(f + linear), S(0.5), to + linear);
  }
}

template <class S> void tangent::pull_lift(const S *q, const S *g, S *out) const {
  for (const plain_numbers &p : plain_)
    for (int i = 0; i < p.n; ++i)
      out[p.v + i] = g[p.q + i];
  for (const turning_joint &j : joints_) {
    const S *const x = q + j.q, *const f = g + j.q;
    S *const to = out + j.v;
    if (j.kind == turning::planar) {
      turn_plane(x[2], f[0], f[1], to[0], to[1]);
      to[2] = f[2];
      continue;
    }
    const int linear = j.kind == turning::floating ? 3 : 0;
    const quaternion<S> p(x + linear);
    if (linear)
      put(p.rotate_back(at(f)), to);
    put(S(0.5) * p.turned_by(quaternion<S>(f + linear)), to + linear);
  }
}

} // namespace operators
