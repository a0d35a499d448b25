// The engine's templates in another scalar: float, compiled here from the headers alone.
#include "owned_workspace.hpp"

#include "ksl/engine/energy.hpp"
#include "ksl/engine/reactions.hpp"
#include "ksl/dynamics.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

namespace {

template <class T> ksl::vec3<T> to(const ksl::vec3<double> &v) { return {T(v.x), T(v.y), T(v.z)}; }

template <class T> ksl::SE3<T> to(const ksl::SE3<double> &D) {
  const auto &R = D.R;
  return {{T(R.m00), T(R.m10), T(R.m20), T(R.m01), T(R.m11), T(R.m21), T(R.m02), T(R.m12), T(R.m22)}, to<T>(D.t)};
}

template <class T> ksl::plane_turn<T> to(const ksl::plane_turn<double> &a) { return {T(a.sine), T(a.cosine)}; }

template <class T> ksl::spatial_inertia<T> to(const ksl::spatial_inertia<double> &I) {
  return {T(I.m), to<T>(I.h), T(I.Ixx), T(I.Iyy), T(I.Izz), T(I.Ixy), T(I.Iyz), T(I.Izx)};
}

/// A model's arrays in another scalar.
template <class T> struct arrays {
  std::vector<ksl::body<T>> bodies;
  std::vector<ksl::link<T>> links;
  std::vector<T> inertia, after_sine, after_cosine;
  ksl::model_view<T> model;

  explicit arrays(const ksl::model_view<double> &m)
      : inertia(ksl::room_for<T>(10, m.bodies)), after_sine(m.after_sine, m.after_sine + ksl::room_for_angles(m.nq)),
        after_cosine(m.after_cosine, m.after_cosine + ksl::room_for_angles(m.nq)) {
    for (int i = 0; i < m.bodies; ++i) {
      const ksl::body<double> &b = m.body[i];
      bodies.push_back({b.kind, b.parent, b.q_index, b.v_index, b.v_end, b.chain, b.link, to<T>(b.placement), to<T>(b.before),
                        to<T>(b.lean), to<T>(b.after), b.straight, to<T>(b.inertia)});
      ksl::body_at<T>(i).put(bodies.back().inertia, inertia.data());
    }
    for (int i = 0; i < m.links; ++i) {
      const ksl::link<double> &l = m.link[i];
      const ksl::link_turn<T> turn = {to<T>(l.turn.about_z), T(l.turn.sense), {l.turn.slot[0], l.turn.slot[1], l.turn.slot[2]}};
      links.push_back({l.body, l.parent, l.first, l.along_axis, turn, to<T>(l.pose), to<T>(l.inertia)});
    }
    model = {m.bodies, m.links, m.nq, m.nv, to<T>(m.gravity), bodies.data(), links.data(),
             inertia.data(), after_sine.data(), after_cosine.data(), m.first_angle, m.angles_end};
  }
};

/// Efforts, reactions of all links' joints in world axes, and energies.
template <class T> std::vector<T> everything(const ksl::model_view<double> &m, const std::vector<double> &q,
                                             const std::vector<double> &v, const std::vector<double> &a) {
  arrays<T> x(m);
  owned_workspace<T> workspace(x.model);
  const ksl::data_view<T> data = workspace.view();
  const std::vector<T> qt(q.begin(), q.end()), vt(v.begin(), v.end()), at(a.begin(), a.end());
  std::vector<int> links;
  for (int l = 0; l < m.links; ++l)
    links.push_back(l);
  ksl::reaction_request request;
  request.n = m.links;
  request.link = links.data();
  request.axes = request.at = ksl::wrench_frame::world;
  const std::size_t nv = v.size(), n = links.size();
  std::vector<T> out(nv + 6 * n + 2);
  const T push[6] = {1, 2, 3, 4, 5, 6};
  const ksl::external_wrenches<T> external = {1, &links.back(), push};
  ksl::inverse_dynamics<T>(x.model, data, qt.data(), vt.data(), at.data(), external, out.data());
  ksl::reactions<T>(x.model, data, external, request, out.data() + nv);
  ksl::energy<T>(x.model, data, qt.data(), vt.data(), &out[nv + 6 * n], &out[nv + 6 * n + 1]);
  return out;
}

} // namespace

TEST_CASE("float follows double to its own precision, double from headers equals the library") {
  for (const char *robot : {"ur5", "panda"}) {
    const ksl::model m = ksl::load(std::string(KSL_EXAMPLES "/robots/") + robot + ".urdf");
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 20; ++k) {
      std::vector<double> q, v, a;
      for (int i = 0; i < m.nv(); ++i)
        q.push_back(normal(random)), v.push_back(normal(random)), a.push_back(normal(random));
      const std::vector<double> exact = everything<double>(m.view(), q, v, a);
      const std::vector<float> single = everything<float>(m.view(), q, v, a);
      double scale = 0, worst = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) {
        scale = std::fmax(scale, std::fabs(exact[i]));
        worst = std::fmax(worst, std::fabs(exact[i] - single[i]));
      }
      CHECK(worst < 3e-6 * scale);
      CHECK(worst > 1e-9 * scale); // it was computed in float

      ksl::data d(m);
      std::vector<double> tau(v.size());
      const int last = m.view().links - 1;
      const double push[6] = {1, 2, 3, 4, 5, 6};
      ksl::inverse_dynamics(m, d, q.data(), v.data(), a.data(), tau.data(), {1, &last, push});
      for (std::size_t i = 0; i < tau.size(); ++i)
        CHECK(std::fabs(tau[i] - exact[i]) < 1e-13 * scale);
    }
  }
}
