// KSL behind the C ABI of peer.h; built with gcc and with clang.  It also converts a robot file to the flat arrays from which
// all peers make their models.
#include "ksl/batch.hpp"
#include "ksl/dynamics.hpp"

#include "engine/kernels.hpp"

#include "../peer.h"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <stdexcept>

namespace {

using A = ksl::algebra<double>;
using numbers = std::vector<double>;

const bench_operation operations[] = {
    {"rnea", "", 0, 0, 1}, {"reactions", "", 0, 0, 1}, {"aba", "", 0, 0, 1},  {"crba", "", 0, 0, 1},
    {"fk", "", 0, 0, 1},   {"rnea", "", 1, 0, 1},      {"aba", "", 1, 0, 1},  {"crba", "", 1, 0, 1},
    {"rnea", "", 1, 1, 1}, {"aba", "", 1, 1, 1},       {"crba", "", 1, 1, 1}, {"rnea", "", 1, 0, 2},
    {"rnea", "", 1, 1, 2},
};

/// Rows of states in both precisions, and memory for results.
struct rows {
  size_t n;
  numbers q, v, a, tau, out;
  std::vector<float> qf, vf, af, tauf, outf;

  rows(const bench_states &s, int nq, int nv, int width, bool batch) : n(s.n) {
    const auto take = [&](numbers &x, std::vector<float> &single, const double *from, int columns) {
      x.assign(from, from + n * static_cast<size_t>(columns));
      if (batch)
        single.assign(x.begin(), x.end());
    };
    take(q, qf, s.q, nq);
    take(v, vf, s.v, nv);
    take(a, af, s.a, nv);
    take(tau, tauf, s.tau, nv);
    out.resize((batch ? n : 1) * static_cast<size_t>(width));
    outf.resize(batch ? out.size() : 0);
  }
};

ksl::model load(const char *urdf, bool floating) {
  ksl::model_options options;
  options.floating_base = floating;
  return ksl::load(urdf, options, true);
}

struct self {
  ksl::model model;
  ksl::data data{model};
  rows few, many;
  std::vector<int> links; ///< carried by the moving joints
  ksl::reaction_request request;
  std::vector<double> tau = std::vector<double>(static_cast<size_t>(model.nv()));

  self(const bench_model &m, const bench_states &one, const bench_states &batch)
      : model(load(m.urdf, m.floating_base)), few(one, m.nq, m.nv, width(m), false),
        many(batch, m.nq, m.nv, m.nv, true) {
    for (int i = 0; i < model.moving_joints(); ++i)
      links.push_back(model.joints()[static_cast<size_t>(i)].link);
    request.n = static_cast<int>(links.size());
    request.link = links.data();
  }

  static int width(const bench_model &m) { return std::max(m.nv * m.nv, 12 * m.joints); }
};

void *create(const bench_model *m, const bench_states *few, const bench_states *many) {
  try {
    return new self(*m, *few, *many);
  } catch (const std::exception &e) {
    std::fprintf(stderr, "KSL: %s\n", e.what());
    return nullptr;
  }
}

void destroy(void *p) { delete static_cast<self *>(p); }

/// Frame of a moving joint in its body's canonical frame.
const ksl::SE3<double> &joint_frame(const ksl::model &m, int joint) {
  return m.view().link[m.joints()[static_cast<size_t>(joint)].link].pose;
}

/// Poses of the joints' frames, which are those of the links that they carry.
void put_poses(self &s, const double *q, double *out) {
  double pose[16];
  for (int link : s.links) {
    ksl::frame_poses(s.model, s.data, q, 1, &link, pose);
    for (int i = 0; i < 12; ++i)
      *out++ = i < 9 ? pose[i / 3 * 4 + i % 3] : pose[(i - 9) * 4 + 3];
  }
}

/// A loop over single states, as a control loop would call it.
template <class Evaluate> void each(self &s, int width, double *out, Evaluate evaluate) {
  const size_t nq = static_cast<size_t>(s.model.nq()), nv = static_cast<size_t>(s.model.nv());
  double *result = s.few.out.data();
  for (size_t k = 0; k < s.few.n; ++k) {
    evaluate(&s.few.q[k * nq], &s.few.v[k * nv], &s.few.a[k * nv], &s.few.tau[k * nv], result);
    asm volatile("" ::: "memory");
    if (out)
      out = std::copy(result, result + width, out);
  }
}

void one_state(self &s, int operation, double *out) {
  const ksl::model &m = s.model;
  ksl::data &d = s.data;
  const int nv = m.nv(), joints = m.moving_joints();
  using in = const double *;
  switch (operation) {
  case 0:
    return each(s, nv, out, [&](in q, in v, in a, in, double *x) { ksl::inverse_dynamics(m, d, q, v, a, x); });
  case 1:
    return each(s, 6 * joints, out, [&](in q, in v, in a, in, double *x) {
      ksl::inverse_dynamics_with_reactions(m, d, q, v, a, s.tau.data(), s.request, x);
    });
  case 2:
    return each(s, nv, out, [&](in q, in v, in, in tau, double *x) { ksl::forward_dynamics(m, d, q, v, tau, x); });
  case 3:
    return each(s, nv * nv, out, [&](in q, in, in, in, double *x) { ksl::mass_matrix(m, d, q, x); });
  default:
    return each(s, 12 * joints, out, [&](in q, in, in, in, double *x) {
      ksl::frame_poses(m, d, q, 0, static_cast<const int *>(nullptr), x); // computes the poses of all bodies
      if (out)
        put_poses(s, q, x);
    });
  }
}

template <class S> void whole_batch(self &s, const bench_operation &o, const std::vector<S> &q, const std::vector<S> &v,
                                    const std::vector<S> &a, const std::vector<S> &tau, std::vector<S> &result,
                                    double *out) {
  const int nv = s.model.nv(), width = o.name[0] == 'c' ? nv * nv : nv;
  if (result.size() < s.many.n * static_cast<size_t>(width)) // before the first timed run
    result.resize(s.many.n * static_cast<size_t>(width));
  ksl::batch_view<S> batch;
  batch.n = s.many.n;
  batch.q = {q.data(), s.model.nq()};
  batch.v = {v.data(), nv};
  batch.a = {a.data(), nv};
  batch.tau = {tau.data(), nv};
  batch.result[0] = {result.data(), width};
  switch (o.name[0]) {
  case 'r':
    ksl::inverse_dynamics_batch(s.model, batch, o.threads);
    break;
  case 'a':
    ksl::forward_dynamics_batch(s.model, batch, o.threads);
    break;
  default:
    ksl::mass_matrix_batch(s.model, batch, o.threads);
  }
  if (out)
    std::copy_n(result.begin(), s.many.n * static_cast<size_t>(width), out);
}

void run(void *p, int operation, double *out) {
  self &s = *static_cast<self *>(p);
  const bench_operation &o = operations[operation];
  if (!o.batch)
    return one_state(s, operation, out);
  if (o.single)
    whole_batch(s, o, s.many.qf, s.many.vf, s.many.af, s.many.tauf, s.many.outf, out);
  else
    whole_batch(s, o, s.many.q, s.many.v, s.many.a, s.many.tau, s.many.out, out);
}

/// Bytes of workspace per lane in double precision, for inverse dynamics.
size_t state_bytes(void *p) {
  const self &s = *static_cast<self *>(p);
  const auto &kernel = ksl::kernels().inverse_dynamics->in_double;
  return kernel.batch(s.model.view(), {}, 0, 0, nullptr) / static_cast<size_t>(kernel.lanes);
}

#ifdef __clang__
#define BENCH_COMPILER "clang"
#else
#define BENCH_COMPILER "gcc"
#endif
const bench_peer table = {"KSL, " BENCH_COMPILER,
                          "KSL",
                          __VERSION__,
                          sizeof operations / sizeof *operations,
                          operations,
                          create,
                          destroy,
                          run,
                          state_bytes};

/// Inertia about the centroid, in the joint's axes, of a body given in its canonical frame.
void put_inertia(const ksl::spatial_inertia<double> &canonical, const ksl::SE3<double> &frame, bench_joint &j) {
  ksl::SE3<double> inverse;
  ksl::spatial_inertia<double> I;
  A::SE3_inverted(&frame, &inverse);
  A::spatial_inertia_transformed(&canonical, &inverse, &I);
  j.mass = I.m;
  const double divisor = I.m > 0 ? I.m : 1; // a body without mass has no first moment either
  const double x = I.h.x / divisor, y = I.h.y / divisor, z = I.h.z / divisor;
  const double about[6] = {I.Ixx - I.m * (y * y + z * z), I.Iyy - I.m * (z * z + x * x), I.Izz - I.m * (x * x + y * y),
                           I.Ixy + I.m * x * y,           I.Iyz + I.m * y * z,           I.Izx + I.m * z * x};
  j.centroid[0] = x, j.centroid[1] = y, j.centroid[2] = z;
  std::copy(about, about + 6, j.inertia);
}

bench_joint describe_joint(const ksl::model &m, int i) {
  const ksl::model_view<double> view = m.view();
  const ksl::joint_row &row = m.joints()[static_cast<size_t>(i)];
  const int body = view.link[row.link].body, parent = view.body[body].parent;
  bench_joint j{};
  j.kind = row.kind == ksl::joint_kind::floating    ? bench_floating
           : row.kind == ksl::joint_kind::prismatic ? bench_prismatic
                                                    : bench_revolute;
  j.parent = -1;
  ksl::SE3<double> D, in_parent = view.body[0].placement;
  if (parent > 0) { // the joint that carries the parent body
    for (j.parent = 0; view.link[m.joints()[static_cast<size_t>(j.parent)].link].body != parent;)
      ++j.parent;
    A::SE3_inverted(&joint_frame(m, j.parent), &in_parent);
  }
  A::product_dd(&in_parent, &view.body[body].placement, &D);
  double theta0[2] = {view.body[body].theta0.sine, view.body[body].theta0.cosine};
  A::product_drdrz(&D.R, theta0, &D.R);
  A::product_dd(&D, &joint_frame(m, i), &D);
  const double R[9] = {D.R.m00, D.R.m01, D.R.m02, D.R.m10, D.R.m11, D.R.m12, D.R.m20, D.R.m21, D.R.m22};
  std::copy(R, R + 9, j.rotation);
  j.position[0] = D.t.x, j.position[1] = D.t.y, j.position[2] = D.t.z;
  j.axis[0] = row.axis.x, j.axis[1] = row.axis.y, j.axis[2] = row.axis.z;
  put_inertia(ksl::own_inertia<double>(view, body), joint_frame(m, i), j);
  return j;
}

} // namespace

const bench_peer *bench_peer_table(void) { return &table; }

/// Fills a model from a robot file; its joints stay until the process ends.  False where the file is no robot.
extern "C" __attribute__((visibility("default"))) bool bench_describe(const char *urdf, int floating,
                                                                      bench_model *out) {
  try {
    const ksl::model m = load(urdf, floating);
    auto *joints = new std::vector<bench_joint>;
    for (int i = 0; i < m.moving_joints(); ++i)
      joints->push_back(describe_joint(m, i));
    *out = {urdf, floating, m.moving_joints(), m.nq(), m.nv(), joints->data(), {0, 0, -9.81}};
    return true;
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s\n", e.what());
    return false;
  }
}

/// The instruction set in use.
extern "C" __attribute__((visibility("default"))) const char *bench_instruction_set() { return ksl::instruction_set(); }
