// ksl/spatial.hpp: what compiles is the algebra, number for number; what physics doesn't have doesn't compile.
#include "ksl/spatial.hpp"
#include "ksl/pack.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <concepts>
#include <cstddef>

namespace {

struct a_frame;
struct b_frame;
struct c_frame;

template <class X, class Y>
concept adds = requires(X x, Y y) { x + y; };
template <class X, class Y>
concept subtracts = requires(X x, Y y) { x - y; };
template <class X, class Y>
concept accumulates = requires(X x, Y y) { x += y; };
template <class X, class Y>
concept multiplies = requires(X x, Y y) { x * y; };
template <class X, class Y>
concept divides = requires(X x, Y y) { x / y; };
template <class X, class Y>
concept dots = requires(X x, Y y) { dot(x, y); };
template <class X, class Y>
concept crosses = requires(X x, Y y) { cross(x, y); };
template <class X, class Y>
concept assigns = requires(X x, Y y) { x = y; };
template <class X, class Y>
concept constructs = requires(Y y) { X(y); };
template <class X, class Y>
concept divides_left = requires(X x, Y y) { inverse_times(x, y); };
template <class X>
concept exponential = requires(X x) { exp(x); };
template <class X>
concept logarithm = requires(X x) { log(x); };

template <class T> struct refusals {
  template <class F> using twist = ksl::twist<T, F>;
  template <class F> using wrench = ksl::wrench<T, F>;
  template <class F> using acceleration = ksl::acceleration<T, F>;
  template <class F> using momentum = ksl::momentum<T, F>;
  template <class F> using inertia = ksl::rigid_inertia<T, F>;
  template <class X, class Y> using pose = ksl::pose<T, X, Y>;
  using A = a_frame;
  using B = b_frame;
  using C = c_frame;
  using U = ksl::unnamed;

  // kinds
  static_assert(adds<twist<U>, twist<U>> && subtracts<twist<B>, twist<B>> && accumulates<twist<B>, twist<B>>);
  static_assert(adds<wrench<U>, wrench<U>> && subtracts<wrench<B>, wrench<B>>);
  static_assert(!adds<twist<U>, wrench<U>> && !adds<wrench<U>, twist<U>> && !subtracts<wrench<U>, twist<U>>);
  static_assert(!adds<twist<U>, acceleration<U>> && !adds<wrench<U>, momentum<U>> &&
                !accumulates<wrench<U>, momentum<U>>);
  static_assert(!adds<pose<U, U>, pose<U, U>> && !adds<pose<U, U>, twist<U>> && !adds<inertia<U>, twist<U>>);
  static_assert(adds<inertia<U>, inertia<U>> && !subtracts<inertia<U>, inertia<U>>);
  static_assert(!adds<twist<U>, T> && !adds<T, twist<U>> && !adds<twist<U>, ksl::screw<T>> &&
                !adds<twist<U>, ksl::vec3<T>>);

  // products
  static_assert(multiplies<T, twist<U>> && multiplies<wrench<B>, T> && multiplies<int, wrench<B>> &&
                divides<momentum<B>, T>);
  static_assert(!divides<T, twist<U>> && !divides<twist<U>, twist<U>>);
  static_assert(!multiplies<pose<U, U>, T> && !multiplies<T, pose<U, U>> && !multiplies<pose<U, U>, ksl::screw<T>>);
  static_assert(!multiplies<twist<U>, twist<U>> && !multiplies<wrench<U>, wrench<U>> &&
                !multiplies<twist<U>, pose<U, U>>);
  static_assert(!multiplies<inertia<U>, wrench<U>> && !multiplies<inertia<U>, momentum<U>> &&
                !multiplies<twist<U>, inertia<U>>);
  static_assert(!multiplies<inertia<U>, inertia<U>> && !multiplies<inertia<U>, pose<U, U>>);
  static_assert(dots<wrench<U>, twist<U>> && dots<momentum<U>, twist<U>>);
  static_assert(!dots<twist<U>, twist<U>> && !dots<wrench<U>, wrench<U>> && !dots<wrench<U>, acceleration<U>>);
  static_assert(crosses<twist<U>, twist<U>> && crosses<twist<U>, wrench<U>> && crosses<twist<U>, momentum<U>>);
  static_assert(!crosses<wrench<U>, wrench<U>> && !crosses<wrench<U>, twist<U>> && !crosses<acceleration<U>, twist<U>>);
  static_assert(exponential<twist<B>> && !exponential<wrench<B>> && !exponential<acceleration<B>>);
  static_assert(logarithm<pose<A, B>> && !logarithm<twist<B>>);

  // frames
  static_assert(!adds<twist<A>, twist<B>> && !subtracts<wrench<A>, wrench<B>> && !accumulates<wrench<A>, wrench<B>>);
  static_assert(!adds<inertia<A>, inertia<B>>);
  static_assert(multiplies<pose<A, B>, twist<B>> && multiplies<pose<A, B>, wrench<B>> &&
                multiplies<pose<A, B>, inertia<B>>);
  static_assert(!multiplies<pose<A, B>, twist<C>> && !multiplies<pose<A, B>, twist<A>> &&
                !multiplies<pose<A, B>, wrench<C>>);
  static_assert(!multiplies<pose<A, B>, inertia<C>> && !multiplies<inertia<A>, twist<B>> &&
                !multiplies<inertia<A>, acceleration<B>>);
  static_assert(divides_left<pose<A, B>, twist<A>> && divides_left<pose<A, B>, wrench<A>> &&
                !divides_left<pose<A, B>, twist<B>> && !divides_left<pose<A, B>, wrench<C>> &&
                divides_left<pose<A, B>, pose<A, C>> && !divides_left<pose<A, B>, pose<B, C>>);
  static_assert(multiplies<pose<A, B>, pose<B, C>> && !multiplies<pose<A, B>, pose<C, B>> &&
                !multiplies<pose<A, B>, pose<A, B>>);
  static_assert(dots<wrench<B>, twist<B>> && !dots<wrench<A>, twist<B>> && !dots<momentum<A>, twist<B>>);
  static_assert(!crosses<twist<A>, twist<B>> && !crosses<twist<A>, wrench<B>>);

  // a frame without a name is a frame, not a joker
  static_assert(!adds<twist<U>, twist<B>> && !multiplies<pose<A, B>, twist<U>> && !multiplies<pose<U, U>, twist<B>>);

  // no way round by assignment or construction; the plain struct is a door in both directions, an explicit one
  static_assert(!assigns<twist<A>, twist<B>> && !assigns<twist<A>, wrench<A>> && !assigns<pose<A, B>, pose<B, A>>);
  static_assert(!constructs<twist<A>, twist<B>> && !constructs<twist<A>, acceleration<A>> &&
                !constructs<wrench<A>, momentum<A>>);
  static_assert(!constructs<pose<A, B>, pose<B, A>> && !constructs<inertia<A>, inertia<B>>);
  static_assert(constructs<twist<A>, ksl::screw<T>> && !constructs<twist<A>, ksl::coscrew<T>> &&
                !assigns<twist<A>, ksl::screw<T>>);
  static_assert(!std::convertible_to<twist<A>, ksl::screw<T>> && !std::convertible_to<ksl::SE3<T>, pose<A, B>>);

  // frames and kinds of results
  template <class Y, class X> static constexpr bool is = std::same_as<Y, X>;
  static_assert(is<decltype(pose<A, B>() * twist<B>()), twist<A>> &&
                is<decltype(pose<A, B>() * wrench<B>()), wrench<A>>);
  static_assert(is<decltype(pose<A, B>() * pose<B, C>()), pose<A, C>> &&
                is<decltype(pose<A, B>().inverse()), pose<B, A>>);
  static_assert(is<decltype(inertia<A>() * twist<A>()), momentum<A>> &&
                is<decltype(inertia<A>() * acceleration<A>()), wrench<A>>);
  static_assert(is<decltype(cross(twist<A>(), twist<A>())), acceleration<A>> &&
                is<decltype(cross(twist<A>(), momentum<A>())), wrench<A>>);
  static_assert(is<decltype(cross(twist<A>(), wrench<A>())), wrench<A>> &&
                is<decltype(dot(wrench<A>(), twist<A>())), T>);
  static_assert(is<decltype(exp(twist<A>())), pose<A, A>> && is<decltype(log(pose<A, B>())), twist<A>>);
  static_assert(is<decltype(twist<U>().template named<A>()), twist<A>> && is<ksl::twist<T>, twist<U>>);

  // layout
  static_assert(ksl::same_as_plain<twist<A>> && ksl::same_as_plain<wrench<B>> && ksl::same_as_plain<pose<A, B>> &&
                ksl::same_as_plain<inertia<C>>);
  static_assert(sizeof(twist<A>) == 6 * sizeof(T) && sizeof(pose<A, B>) == 12 * sizeof(T) &&
                sizeof(inertia<A>) == 10 * sizeof(T));
};
template struct refusals<double>;
template struct refusals<float>;
static_assert(!adds<ksl::twist<double>, ksl::twist<float>> && !multiplies<ksl::pose<double>, ksl::twist<float>>);

template <class T> struct values {
  ksl::vec3<T> v1{T(0.3), T(-1.2), T(0.7)}, v2{T(1.5), T(0.4), T(-0.9)}, v3{T(-0.2), T(0.8), T(1.1)};
  ksl::twist<T, b_frame> v{v1, v2}, w{v2, v3};
  ksl::acceleration<T, b_frame> dv{v3, v1};
  ksl::wrench<T, b_frame> f{v2, v1};
  ksl::pose<T, b_frame, b_frame> X = exp(ksl::twist<T, b_frame>{v3, v1});
  ksl::pose<T, a_frame, b_frame> ab = X.template named<a_frame, b_frame>();
  ksl::pose<T, b_frame, c_frame> bc = exp(w).template named<b_frame, c_frame>();
  ksl::pose<T, a_frame, c_frame> ac = exp(w).template named<a_frame, c_frame>();
  ksl::twist<T, a_frame> a{v2, v1};
  ksl::wrench<T, a_frame> fa{v1, v3};
  ksl::rigid_inertia<T, b_frame> M =
      ksl::rigid_inertia<T, b_frame>::about_centroid(T(2), v1, T(0.3), T(0.4), T(0.5), T(0.01), T(-0.02), T(0.03));
};

/// The same bits: what the types add to the algebra is nothing.
template <class Value> bool same(const Value &x, const typename Value::plain_type &y) {
  return std::memcmp(&x, &y, sizeof x) == 0;
}

template <class T> bool near(T x, T y) { return std::fabs(x - y) <= 64 * ksl::math<T>::epsilon * (1 + std::fabs(y)); }
template <class Kind, class T, class F>
bool near(const ksl::spatial_vector<Kind, T, F> &x, const ksl::spatial_vector<Kind, T, F> &y) {
  return near(x.lin.x, y.lin.x) && near(x.lin.y, y.lin.y) && near(x.lin.z, y.lin.z) && near(x.ang.x, y.ang.x) &&
         near(x.ang.y, y.ang.y) && near(x.ang.z, y.ang.z);
}

} // namespace

TEST_CASE_TEMPLATE("every operator is its function of the algebra", T, double, float) {
  using A = ksl::algebra<T>;
  const values<T> x;
  ksl::screw<T> s;
  ksl::coscrew<T> c;
  ksl::SE3<T> D;
  ksl::spatial_inertia<T> I;

  A::add_ss(&x.v.plain(), &x.w.plain(), &s);
  CHECK(same(x.v + x.w, s));
  A::subtract_ss(&x.v.plain(), &x.w.plain(), &s);
  CHECK(same(x.v - x.w, s));
  A::screw_inverted(&x.v.plain(), &s);
  CHECK(same(-x.v, s));
  A::product_as(T(3), &x.v.plain(), &s);
  CHECK((same(3 * x.v, s) && same(x.v * T(3), s)));
  A::add_cc(&x.f.plain(), &x.f.plain(), &c);
  CHECK((same(x.f + x.f, c) && same(T(2) * x.f, c) && same(x.f / T(0.5), c)));
  A::product_Ads(&x.ab.plain(), &x.v.plain(), &s);
  CHECK(same(x.ab * x.v, s));
  A::product_Ads(&x.ab.plain(), &x.dv.plain(), &s);
  CHECK(same(x.ab * x.dv, s));
  A::product_CoAdc(&x.ab.plain(), &x.f.plain(), &c);
  CHECK(same(x.ab * x.f, c));
  A::product_dd(&x.ab.plain(), &x.bc.plain(), &D);
  CHECK(same(x.ab * x.bc, D));
  A::product_Adinvs(&x.ab.plain(), &x.a.plain(), &s);
  CHECK(same(inverse_times(x.ab, x.a), s));
  A::product_CoAdinvc(&x.ab.plain(), &x.fa.plain(), &c);
  CHECK(same(inverse_times(x.ab, x.fa), c));
  A::product_dinvd(&x.ab.plain(), &x.ac.plain(), &D);
  CHECK(same(inverse_times(x.ab, x.ac), D));
  A::SE3_inverted(&x.ab.plain(), &D);
  CHECK(same(x.ab.inverse(), D));
  A::spatial_inertia_transformed(&x.M.plain(), &x.ab.plain(), &I);
  CHECK(same(x.ab * x.M, I));
  A::spatial_inertia_added(&x.M.plain(), &x.M.plain(), &I);
  CHECK(same(x.M + x.M, I));
  A::product_Ms(&x.M.plain(), &x.v.plain(), &c);
  CHECK(same(x.M * x.v, c));
  A::product_Ms(&x.M.plain(), &x.dv.plain(), &c);
  CHECK(same(x.M * x.dv, c));
  A::cross_ss(&x.v.plain(), &x.w.plain(), &s);
  CHECK(same(cross(x.v, x.w), s));
  A::cross_sc(&x.v.plain(), &x.f.plain(), &c);
  CHECK(same(cross(x.v, x.f), c));
  A::SE3_exp(&x.w.plain(), &D);
  CHECK(same(exp(x.w), D));
  A::SE3_log(&x.ab.plain(), &s);
  CHECK(same(log(x.ab), s));
  CHECK(dot(x.f, x.v) == A::dot_cs(&x.f.plain(), &x.v.plain()));
  const ksl::momentum<T, b_frame> p = x.M * x.v;
  CHECK(dot(p, x.v) == A::dot_cs(&p.plain(), &x.v.plain()));
  A::subtract_cc(&x.f.plain(), &p.plain(), &c);
  CHECK(same(x.f - ksl::wrench<T, b_frame>(p.plain()), c));
  A::coscrew_inverted(&x.f.plain(), &c);
  CHECK(same(-x.f, c));
  ksl::rigid_inertia<T, b_frame> twice(x.M.plain());
  twice += x.M;
  CHECK(same(twice, (x.M + x.M).plain()));
  // the same numbers under another name
  CHECK((same(x.v.template named<a_frame>(), x.v.plain()) && same(x.M.template named<a_frame>(), x.M.plain())));

  ksl::twist<T, b_frame> sum = x.v;
  sum += x.w;
  sum *= T(2);
  sum -= x.w;
  sum /= T(4);
  CHECK(near(sum, (x.v + x.v + x.w) / T(4)));
}

TEST_CASE_TEMPLATE("laws that need the types of all frames", T, double, float) {
  const values<T> x;
  CHECK(near(dot(x.ab * x.f, x.ab * x.v), dot(x.f, x.v)));
  CHECK(near(x.ab * (x.ab.inverse() * (x.ab * x.v)), x.ab * x.v));
  CHECK((near(inverse_times(x.ab, x.ab * x.v), x.v) && near(inverse_times(x.ab, x.ab * x.f), x.f)));
  CHECK(near(inverse_times(x.ab, x.ac * log(exp(x.w).template named<c_frame, c_frame>())),
             inverse_times(x.ab, x.ac) * log(exp(x.w).template named<c_frame, c_frame>())));
  const ksl::twist<T, c_frame> v_c{x.v1, x.v3};
  CHECK(near((x.ab * x.bc) * v_c, x.ab * (x.bc * v_c)));
  CHECK(near((x.ab * x.M) * (x.ab * x.v), x.ab * (x.M * x.v)));
  CHECK(near(cross(x.ab * x.v, x.ab * x.f), x.ab * cross(x.v, x.f)));
  CHECK(near(x.X * log(x.X), log(x.X)));
  CHECK(near(dot(cross(x.v, x.f), x.w), -dot(x.f, ksl::twist<T, b_frame>(cross(x.v, x.w).plain()))));
  const auto newton_euler = x.M * x.dv + cross(x.v, x.M * x.v);
  CHECK(near(x.ab * newton_euler, (x.ab * x.M) * (x.ab * x.dv) + cross(x.ab * x.v, (x.ab * x.M) * (x.ab * x.v))));
  CHECK(near(log(exp(x.v)), x.v));
}

TEST_CASE("without frames nothing needs a name") {
  ksl::twist<double> v{};
  CHECK((v.lin.x == 0 && v.ang.z == 0));
  v.ang.z = 2;
  const auto X = ksl::pose<double>::identity();
  const ksl::twist<double> w = X * (v + v);
  CHECK(w.ang.z == 4);
  CHECK(dot(ksl::wrench<double>{{0, 0, 0}, {0, 0, 3}}, w) == 12);
}

TEST_CASE("a pack of states is a scalar here too") {
  using lanes = ksl::pack<double, 2>;
  lanes rate(1.0);
  rate.set(1, 2.0);
  const lanes zero(0.0);
  const ksl::twist<lanes, b_frame> v{{zero, zero, zero}, {zero, zero, rate}};
  const ksl::pose<lanes, a_frame, b_frame> ab(ksl::pose<lanes>::identity().R, {zero, lanes(1.0), zero});
  const ksl::twist<lanes, a_frame> moved = ab * (2.0 * v);
  CHECK((moved.lin.x[0] == 2 && moved.lin.x[1] == 4 && moved.ang.z[1] == 4));
}
