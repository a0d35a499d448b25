// KSL: spatial values with checked kinds and frames: pose, twist, acceleration, wrench, momentum, rigid_inertia over any scalar.
//
//     struct world; struct tool;
//     ksl::pose<double, world, tool> X;                  // carries coordinates of tool to world
//     ksl::wrench<double, tool> f;
//     double power = dot(X * f, v_world);                // v_world: ksl::twist<double, world>
//
// Only operations with a physical meaning compile.  A wrench and a twist can't be added, two wrenches have no product, a pose
// can't be scaled.  A vector in frame C can't be combined with a vector in frame B, nor with a pose that carries B to A.  Frames
// are types, empty or only declared, and cost nothing.  Values without a frame are in the frame `unnamed`, which can't be
// combined with any other.
//
// Each type has the members, the size and the layout of its plain struct (ksl/algebra.hpp).  `plain()` returns that struct, and
// the constructor from it is explicit; they give access to the rest of the algebra.
#pragma once

#include "ksl/algebra.hpp"

#include <type_traits>

namespace ksl {

/// The frame of values whose frame has no name.
struct unnamed;

inline namespace KSL_ISA {

#ifdef __OPTIMIZE__
#define KSL_VALUE __attribute__((always_inline)) inline
#else
#define KSL_VALUE inline
#endif

/// Operations that screws and coscrews have in common, under one name.
struct screw_operations {
  template <class T> using plain = ksl::screw<T>;
  template <class T> KSL_VALUE static void add(const screw<T> &a, const screw<T> &b, screw<T> &o) {
    algebra<T>::add_ss(&a, &b, &o);
  }
  template <class T> KSL_VALUE static void subtract(const screw<T> &a, const screw<T> &b, screw<T> &o) {
    algebra<T>::subtract_ss(&a, &b, &o);
  }
  template <class T> KSL_VALUE static void scale(const T &k, const screw<T> &a, screw<T> &o) {
    algebra<T>::product_as(k, &a, &o);
  }
  template <class T> KSL_VALUE static void negate(const screw<T> &a, screw<T> &o) {
    algebra<T>::screw_inverted(&a, &o);
  }
  template <class T> KSL_VALUE static void move(const SE3<T> &D, const screw<T> &a, screw<T> &o) {
    algebra<T>::product_Ads(&D, &a, &o);
  }
  template <class T> KSL_VALUE static void move_back(const SE3<T> &D, const screw<T> &a, screw<T> &o) {
    algebra<T>::product_Adinvs(&D, &a, &o);
  }
  template <class T> KSL_VALUE static void cross(const screw<T> &s, const screw<T> &a, screw<T> &o) {
    algebra<T>::cross_ss(&s, &a, &o);
  }
};

struct coscrew_operations {
  template <class T> using plain = ksl::coscrew<T>;
  template <class T> KSL_VALUE static void add(const coscrew<T> &a, const coscrew<T> &b, coscrew<T> &o) {
    algebra<T>::add_cc(&a, &b, &o);
  }
  template <class T> KSL_VALUE static void subtract(const coscrew<T> &a, const coscrew<T> &b, coscrew<T> &o) {
    algebra<T>::subtract_cc(&a, &b, &o);
  }
  template <class T> KSL_VALUE static void scale(const T &k, const coscrew<T> &a, coscrew<T> &o) {
    algebra<T>::product_ac(k, &a, &o);
  }
  template <class T> KSL_VALUE static void negate(const coscrew<T> &a, coscrew<T> &o) {
    algebra<T>::coscrew_inverted(&a, &o);
  }
  template <class T> KSL_VALUE static void move(const SE3<T> &D, const coscrew<T> &a, coscrew<T> &o) {
    algebra<T>::product_CoAdc(&D, &a, &o);
  }
  template <class T> KSL_VALUE static void move_back(const SE3<T> &D, const coscrew<T> &a, coscrew<T> &o) {
    algebra<T>::product_CoAdinvc(&D, &a, &o);
  }
  template <class T> KSL_VALUE static void cross(const screw<T> &s, const coscrew<T> &a, coscrew<T> &o) {
    algebra<T>::cross_sc(&s, &a, &o);
  }
};

// Kinds; `rate` is the kind of cross(twist, x), the rate of change of an x that is carried along with the twist.
struct acceleration_kind : screw_operations { using rate = acceleration_kind; };
struct twist_kind : screw_operations { using rate = acceleration_kind; };
struct wrench_kind : coscrew_operations { using rate = wrench_kind; };
struct momentum_kind : coscrew_operations { using rate = wrench_kind; };

/// A six-vector of one kind, linear part first, in the axes of frame F and about its origin.
template <class Kind, class T, class F = unnamed> class spatial_vector : private Kind::template plain<T> {
public:
  using plain_type = typename Kind::template plain<T>;
  using plain_type::ang;
  using plain_type::lin;

  /// Uninitialised, as the plain struct; `{}` gives zeros.
  spatial_vector() = default;
  KSL_VALUE spatial_vector(const vec3<T> &linear, const vec3<T> &angular) : plain_type{linear, angular} {}
  KSL_VALUE explicit spatial_vector(const plain_type &numbers) : plain_type(numbers) {}
  /// There is no implicit conversion to another kind or frame; `named<F>()` and `plain()` convert explicitly.
  template <class K, class G> explicit spatial_vector(const spatial_vector<K, T, G> &) = delete;
  spatial_vector(const spatial_vector &) = default;
  spatial_vector &operator=(const spatial_vector &) = default;

  KSL_VALUE const plain_type &plain() const { return *this; }
  KSL_VALUE plain_type &plain() { return *this; }

  /// The same numbers under another frame's name.
  template <class G> KSL_VALUE spatial_vector<Kind, T, G> named() const { return spatial_vector<Kind, T, G>(plain()); }

  /// 6 flops each.
  friend KSL_VALUE spatial_vector operator+(const spatial_vector &a, const spatial_vector &b) {
    spatial_vector o;
    Kind::template add<T>(a, b, o);
    return o;
  }
  friend KSL_VALUE spatial_vector operator-(const spatial_vector &a, const spatial_vector &b) {
    spatial_vector o;
    Kind::template subtract<T>(a, b, o);
    return o;
  }
  friend KSL_VALUE spatial_vector operator-(const spatial_vector &a) {
    spatial_vector o;
    Kind::template negate<T>(a, o);
    return o;
  }
  friend KSL_VALUE spatial_vector operator*(const T &k, const spatial_vector &a) {
    spatial_vector o;
    Kind::template scale<T>(k, a, o);
    return o;
  }
  friend KSL_VALUE spatial_vector operator*(const spatial_vector &a, const T &k) { return k * a; }
  friend KSL_VALUE spatial_vector operator/(const spatial_vector &a, const T &k) {
    return {{a.lin.x / k, a.lin.y / k, a.lin.z / k}, {a.ang.x / k, a.ang.y / k, a.ang.z / k}};
  }
  KSL_VALUE spatial_vector &operator+=(const spatial_vector &b) { return *this = *this + b; }
  KSL_VALUE spatial_vector &operator-=(const spatial_vector &b) { return *this = *this - b; }
  KSL_VALUE spatial_vector &operator*=(const T &k) { return *this = k * *this; }
  KSL_VALUE spatial_vector &operator/=(const T &k) { return *this = *this / k; }
};

/// (v, ω): m/s of the body's point at the origin of F, rad/s.
template <class T, class F = unnamed> using twist = spatial_vector<twist_kind, T, F>;
/// Spatial acceleration: the componentwise rate of a twist in a frame at rest (Featherstone, RBDA 2008, section 2.11);
/// its linear part isn't the acceleration of a point.
template <class T, class F = unnamed> using acceleration = spatial_vector<acceleration_kind, T, F>;
/// (f, τ): N, N m about the origin of F.
template <class T, class F = unnamed> using wrench = spatial_vector<wrench_kind, T, F>;
/// (p, l): N s, N m s about the origin of F.
template <class T, class F = unnamed> using momentum = spatial_vector<momentum_kind, T, F>;

/// D_ab = (R, t): carries coordinates of frame B to frame A, x_a = R x_b + t.
template <class T, class A = unnamed, class B = unnamed> class pose : private SE3<T> {
public:
  using plain_type = SE3<T>;
  using plain_type::R;
  using plain_type::t;

  /// Uninitialised; `identity()` returns the identity.
  pose() = default;
  /// R must be a rotation; this is not checked.
  KSL_VALUE pose(const mat3x3<T> &rotation, const vec3<T> &translation) : plain_type{rotation, translation} {}
  KSL_VALUE explicit pose(const plain_type &numbers) : plain_type(numbers) {}
  template <class C, class D> explicit pose(const pose<T, C, D> &) = delete;
  pose(const pose &) = default;
  pose &operator=(const pose &) = default;

  /// The identity: frame B coincides with frame A.
  KSL_VALUE static pose identity() {
    pose o;
    algebra<T>::SE3_setIdentity(&o);
    return o;
  }

  KSL_VALUE const plain_type &plain() const { return *this; }
  KSL_VALUE plain_type &plain() { return *this; }
  /// The same numbers under other frames' names.
  template <class C, class D> KSL_VALUE pose<T, C, D> named() const { return pose<T, C, D>(plain()); }

  /// D_ba.  15 flops.
  KSL_VALUE pose<T, B, A> inverse() const {
    pose<T, B, A> o;
    algebra<T>::SE3_inverted(this, &o.plain());
    return o;
  }
};

/// A rigid body's inertia in frame F: mass m, first moment h = m × centroid, and Ixx … Izx about the origin of F.
template <class T, class F = unnamed> class rigid_inertia : private spatial_inertia<T> {
public:
  using plain_type = spatial_inertia<T>;
  using plain_type::h;
  using plain_type::Ixx;
  using plain_type::Ixy;
  using plain_type::Iyy;
  using plain_type::Iyz;
  using plain_type::Izx;
  using plain_type::Izz;
  using plain_type::m;

  rigid_inertia() = default;
  KSL_VALUE explicit rigid_inertia(const plain_type &numbers) : plain_type(numbers) {}
  template <class G> explicit rigid_inertia(const rigid_inertia<T, G> &) = delete;
  rigid_inertia(const rigid_inertia &) = default;
  rigid_inertia &operator=(const rigid_inertia &) = default;

  /// From mass, centroid and the elements of the inertia matrix about the centroid, signs included (Ixy = −∫xy dm).
  /// kg, m, kg m².  18 flops.
  KSL_VALUE static rigid_inertia about_centroid(const T &mass, const vec3<T> &centroid, const T &xx, const T &yy,
                                                const T &zz, const T &xy, const T &yz, const T &zx) {
    rigid_inertia o;
    algebra<T>::spatial_inertia_fromMassCentroid(mass, &centroid, xx, yy, zz, xy, yz, zx, &o);
    return o;
  }

  KSL_VALUE const plain_type &plain() const { return *this; }
  KSL_VALUE plain_type &plain() { return *this; }
  template <class G> KSL_VALUE rigid_inertia<T, G> named() const { return rigid_inertia<T, G>(plain()); }

  /// Two bodies welded together.  10 flops.
  friend KSL_VALUE rigid_inertia operator+(const rigid_inertia &a, const rigid_inertia &b) {
    rigid_inertia o;
    algebra<T>::spatial_inertia_added(&a, &b, &o);
    return o;
  }
  KSL_VALUE rigid_inertia &operator+=(const rigid_inertia &b) { return *this = *this + b; }
};

/// D_ac = D_ab D_bc.  63 flops.
template <class T, class A, class B, class C>
KSL_VALUE pose<T, A, C> operator*(const pose<T, A, B> &ab, const pose<T, B, C> &bc) {
  pose<T, A, C> o;
  algebra<T>::product_dd(&ab.plain(), &bc.plain(), &o.plain());
  return o;
}

/// A six-vector of frame B in frame A: Ad(D) for twists and accelerations, CoAd(D) for wrenches and momenta
/// (coscrews (3), (6)).  42 flops.
template <class Kind, class T, class A, class B>
KSL_VALUE spatial_vector<Kind, T, A> operator*(const pose<T, A, B> &ab, const spatial_vector<Kind, T, B> &b) {
  spatial_vector<Kind, T, A> o;
  Kind::template move<T>(ab.plain(), b.plain(), o.plain());
  return o;
}

/// X_ab⁻¹ X_ac = D_bc, without making the inverse.  63 flops.
template <class T, class A, class B, class C>
KSL_VALUE pose<T, B, C> inverse_times(const pose<T, A, B> &ab, const pose<T, A, C> &ac) {
  pose<T, B, C> o;
  algebra<T>::product_dinvd(&ab.plain(), &ac.plain(), &o.plain());
  return o;
}

/// A six-vector of frame A in frame B: `ab.inverse() * a` without making the inverse, Ad(D)⁻¹ for twists and
/// accelerations, CoAd(D)⁻¹ for wrenches and momenta (the inverse of coscrews (3), (6)).  42 flops.
template <class Kind, class T, class A, class B>
KSL_VALUE spatial_vector<Kind, T, B> inverse_times(const pose<T, A, B> &ab, const spatial_vector<Kind, T, A> &a) {
  spatial_vector<Kind, T, B> o;
  Kind::template move_back<T>(ab.plain(), a.plain(), o.plain());
  return o;
}

/// An inertia of frame B in frame A.  120 flops.
template <class T, class A, class B>
KSL_VALUE rigid_inertia<T, A> operator*(const pose<T, A, B> &ab, const rigid_inertia<T, B> &b) {
  rigid_inertia<T, A> o;
  algebra<T>::spatial_inertia_transformed(&b.plain(), &ab.plain(), &o.plain());
  return o;
}

/// The momentum of a body that moves with the twist v.  42 flops.
template <class T, class F> KSL_VALUE momentum<T, F> operator*(const rigid_inertia<T, F> &M, const twist<T, F> &v) {
  momentum<T, F> o;
  algebra<T>::product_Ms(&M.plain(), &v.plain(), &o.plain());
  return o;
}

/// The wrench M a.  On a body that moves with the twist v it takes `M * a + cross(v, M * v)` (RBDA, section 2.14).  42
/// flops.
template <class T, class F>
KSL_VALUE wrench<T, F> operator*(const rigid_inertia<T, F> &M, const acceleration<T, F> &a) {
  wrench<T, F> o;
  algebra<T>::product_Ms(&M.plain(), &a.plain(), &o.plain());
  return o;
}

/// Power f · v + τ · ω, W, the same in every frame (coscrews (2)).  11 flops.
template <class T, class F> KSL_VALUE T dot(const wrench<T, F> &f, const twist<T, F> &v) {
  return algebra<T>::dot_cs(&f.plain(), &v.plain());
}

/// Twice the kinetic energy, where p is the momentum of a body that moves with the twist v, J.  11 flops.
template <class T, class F> KSL_VALUE T dot(const momentum<T, F> &p, const twist<T, F> &v) {
  return algebra<T>::dot_cs(&p.plain(), &v.plain());
}

/// The rate of change of x while it is carried along with the twist v: ad(v) x for a twist or an acceleration,
/// ad*(v) x for a momentum or a wrench (coscrews (12)).  The rate of a twist is an acceleration, that of a momentum a
/// wrench; those of an acceleration and of a wrench, per second, keep their kind.  30 flops.
template <class Kind, class T, class F>
KSL_VALUE spatial_vector<typename Kind::rate, T, F> cross(const twist<T, F> &v, const spatial_vector<Kind, T, F> &x) {
  spatial_vector<typename Kind::rate, T, F> o;
  Kind::template cross<T>(v.plain(), x.plain(), o.plain());
  return o;
}

/// The displacement of a body that moves for unit time with the constant twist v.  96 flops, a root and 2 sines.
template <class T, class F> KSL_VALUE pose<T, F, F> exp(const twist<T, F> &v) {
  pose<T, F, F> o;
  algebra<T>::SE3_exp(&v.plain(), &o.plain());
  return o;
}

/// The twist of smallest |ω| ≤ π whose exponential has the numbers of D_ab.  Its own numbers are the same in A and in
/// B. 83 flops, a root and an arctangent.
template <class T, class A, class B> KSL_VALUE twist<T, A> log(const pose<T, A, B> &ab) {
  twist<T, A> o;
  algebra<T>::SE3_log(&ab.plain(), &o.plain());
  return o;
}

#undef KSL_VALUE

/// Size, layout and trivial copies are those of the plain struct.
template <class Value>
inline constexpr bool same_as_plain =
    sizeof(Value) == sizeof(typename Value::plain_type) && alignof(Value) == alignof(typename Value::plain_type) &&
    std::is_standard_layout_v<Value> && std::is_trivially_copyable_v<Value> &&
    std::is_trivially_default_constructible_v<Value>;

static_assert(same_as_plain<twist<double>> && same_as_plain<acceleration<float>> && same_as_plain<wrench<float>> &&
              same_as_plain<momentum<double>> && same_as_plain<pose<double>> && same_as_plain<rigid_inertia<float>>);

} // namespace KSL_ISA
} // namespace ksl
