// KSL behind the C ABI of peer.h; built with gcc and with clang.  It also converts a robot file to the flat arrays from
// which all peers make their models.
#include "ksl/batch.hpp"
#include "ksl/dynamics.hpp"

#include "engine/kernels/kernels.hpp"

#include "../quantities.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <numeric>
#include <type_traits>
#include <vector>

namespace {

using A = ksl::algebra<double>;
using numbers = std::vector<double>;

/// The same rows in both precisions.
struct rows {
  numbers in_double;
  std::vector<float> in_float;

  rows(const double *x, size_t n) : in_double(x, x + n), in_float(x, x + n) {}
  const numbers &of(double) const { return in_double; }
  const std::vector<float> &of(float) const { return in_float; }
};

ksl::model load(const char *urdf, bool floating) {
  ksl::model_options options;
  options.floating_base = floating;
  return ksl::load(urdf, options, {.mimic_independent = true});
}

/// Arguments of a call on one state, and where its results go.
struct arguments {
  const double *q, *v, *a, *tau;
  double *x, *y, *z;
  double *efforts; ///< which reactions come with
  bool timed;
  int link, n;      ///< the link whose frame is asked for; how many joints there are,
  const int *links; ///< and the links that they carry
  ksl::frame_options how;
  ksl::reaction_request request;
};

struct self {
  bench_model m;
  ksl::model model;
  ksl::data data{model};
  size_t few, many;
  numbers q, v, a, tau;
  rows many_q, many_v, many_a, many_tau;
  numbers out;
  std::vector<float> out_single;
  std::vector<int> links; ///< carried by the moving joints
  numbers efforts = numbers(static_cast<size_t>(model.nv()));
  arguments given{};

  self(const bench_model &bench, const bench_states &one, const bench_states &batch)
      : m(bench), model(load(m.urdf, m.floating_base)), few(one.n), many(batch.n), q(one.q, one.q + one.n * nq()),
        v(one.v, one.v + one.n * nv()), a(one.a, one.a + one.n * nv()), tau(one.tau, one.tau + one.n * nv()),
        many_q(batch.q, batch.n * nq()), many_v(batch.v, batch.n * nv()), many_a(batch.a, batch.n * nv()),
        many_tau(batch.tau, batch.n * nv()) {
    for (int i = 0; i < model.moving_joints(); ++i)
      links.push_back(model.joints()[static_cast<size_t>(i)].link);
    given.efforts = efforts.data();
    given.n = given.request.n = static_cast<int>(links.size());
    given.links = given.request.link = links.data();
    given.link = links[static_cast<size_t>(m.frame)];
  }

  size_t nq() const { return static_cast<size_t>(m.nq); }
  size_t nv() const { return static_cast<size_t>(m.nv); }
};

struct operation {
  const char *name;
  void (*one)(const ksl::model &, ksl::data &, const arguments &); ///< null if this KSL lacks it, like the next two
  void (*in_double)(const ksl::model &, const ksl::batch_view<double> &, int threads);
  void (*in_float)(const ksl::model &, const ksl::batch_view<float> &, int threads);
  int parts = 1;                                 ///< results, equally large
  int (*numbers)(const bench_model &) = nullptr; ///< of the result of one state; null: as in the common layout
  /// Brings a result into the common layout; null: copies it.
  void (*put)(const bench_model &, const double *v, const double *result, double *out) = nullptr;
  bool one_frame = false; ///< about the frame of one link; others get the links of all joints
};

/// The call as a function, or null if its arguments don't fit any function of this KSL.
template <class Function, class Call> constexpr Function *if_there(Call call) {
  if constexpr (std::is_convertible_v<Call, Function *>)
    return call;
  else
    return nullptr;
}

using one_state = void(const ksl::model &, ksl::data &, const arguments &);
template <class S> using batch = void(const ksl::model &, const ksl::batch_view<S> &, int);

// Names of functions are looked up by their arguments, when the lambda is used: one that is missing is no error.
#define ONE_STATE(function, ...)                                                                                       \
  if_there<one_state>([](const auto &m, auto &d, const auto &s) -> decltype(function(m, d, __VA_ARGS__)) {             \
    function(m, d, __VA_ARGS__);                                                                                       \
  })
#define BATCH(function, S)                                                                                             \
  if_there<batch<S>>([](const auto &m, const auto &b, int threads) -> decltype(function##_batch(m, b, threads)) {      \
    function##_batch(m, b, threads);                                                                                   \
  })
#define BOTH(function, ...) ONE_STATE(function, __VA_ARGS__), BATCH(function, double), BATCH(function, float)
#define NAMED(function, ...) #function, BOTH(function, __VA_ARGS__)

/// The rotation and the position of a pose, 4×4.
void put_poses(const bench_model &m, const double *, const double *pose, double *out) {
  for (int k = 0; k < m.joints; ++k, pose += 16)
    for (int i = 0; i < 12; ++i)
      *out++ = i < 9 ? pose[i / 3 * 4 + i % 3] : pose[(i - 9) * 4 + 3];
}

void put_product_with_v(const bench_model &m, const double *v, const double *C, double *out) {
  for (int i = 0; i < m.nv; ++i)
    out[i] = std::inner_product(v, v + m.nv, C + i * m.nv, 0.0);
}

void put_symmetric(const bench_model &m, const double *, const double *M, double *out) {
  for (int i = 0; i < m.nv; ++i)
    for (int j = 0; j < m.nv; ++j)
      *out++ = M[std::min(i, j) * m.nv + std::max(i, j)];
}

/// Elements of the lower triangle that aren't zero by the shape of the tree, row by row: visit(row, column).
template <class Visit> void over_tree(const bench_model &m, Visit visit) {
  std::vector<std::vector<int>> path(static_cast<size_t>(m.joints)); // coordinates from the ground to each joint
  int row = 0;
  for (size_t i = 0; i < path.size(); ++i) {
    if (m.joint[i].parent >= 0)
      path[i] = path[static_cast<size_t>(m.joint[i].parent)];
    for (int k = 0; k < m.joint[i].nv; ++k, ++row) {
      path[i].push_back(row);
      for (const int column : path[i])
        visit(row, column);
    }
  }
}

int tree_elements(const bench_model &m) {
  int n = 0;
  over_tree(m, [&](int, int) { ++n; });
  return n;
}

void put_tree(const bench_model &m, const double *, const double *element, double *out) {
  std::fill_n(out, m.nv * m.nv, 0.0);
  over_tree(m, [&](int i, int j) { out[i * m.nv + j] = out[j * m.nv + i] = *element++; });
}

int poses(const bench_model &m) { return 16 * m.joints; }

constexpr operation operations[] = {
    {"rnea", BOTH(inverse_dynamics, s.q, s.v, s.a, s.x)},
    {"reactions", ONE_STATE(inverse_dynamics_with_reactions, s.q, s.v, s.a, s.efforts, s.request, s.x), {}, {}},
    {"aba", BOTH(forward_dynamics, s.q, s.v, s.tau, s.x)},
    {"crba", BOTH(mass_matrix, s.q, s.x)},
    {"crba_upper", BOTH(mass_matrix_upper, s.q, s.x), 1, matrices<1>, put_symmetric},
    {"crba_tree", BOTH(mass_matrix_tree, s.q, s.x), 1, tree_elements, put_tree},
    // One call computes the poses of all bodies; those of links are composed for the comparison, and in batches.
    {"fk", BOTH(frame_poses, s.q, s.timed ? 0 : s.n, s.links, s.x), 1, poses, put_poses},
    {NAMED(inverse_dynamics_derivatives, s.q, s.v, s.a, s.x, s.y, s.z), 3},
#ifndef BENCH_FEW_OPERATIONS
    {NAMED(reactions_derivatives, s.q, s.v, s.a, s.request, s.x, s.y, s.z), 3},
    {NAMED(forward_dynamics_derivatives, s.q, s.v, s.tau, s.x, s.y, s.z), 3},
    {NAMED(mass_matrix_inverse, s.q, s.x)},
    {NAMED(coriolis_matrix, s.q, s.v, s.x), 1, matrices<1>, put_product_with_v},
    {NAMED(centroidal_momentum_matrix, s.q, ksl::component_order::linear_first, s.x)},
    {NAMED(center_of_mass_jacobian, s.q, s.x)},
    {NAMED(jacobian, s.q, s.link, s.how, s.x), 1, {}, {}, true},
    {NAMED(frame_velocity, s.q, s.v, s.link, s.how, s.x), 1, {}, {}, true},
    {NAMED(frame_acceleration, s.q, s.v, s.a, s.link, s.how, s.x), 1, {}, {}, true},
    {NAMED(inverse_dynamics_regressor, s.q, s.v, s.a, s.n, s.links, s.x)},
#endif
};

static_assert(std::none_of(std::begin(operations), std::end(operations),
                           [](const operation &o) { return (o.in_double || o.in_float) && !o.one; }),
              "this KSL has an operation, but its call has other arguments than those above");

/// What this KSL can do: every operation on one state, and in batches, in double and float, on one thread and on two.
struct entry {
  bench_operation op;
  const operation *how;
};

const std::vector<entry> entries = [] {
  std::vector<entry> all;
  for (const operation &o : operations) {
    if (o.one)
      all.push_back({{o.name, "", 0, 0, 1}, &o});
    for (const int threads : {1, 2})
      for (const int single : {0, 1})
        if (single ? !!o.in_float : !!o.in_double)
          all.push_back({{o.name, "", 1, single, threads}, &o});
  }
  return all;
}();

const std::vector<bench_operation> names = [] {
  std::vector<bench_operation> all;
  for (const entry &e : entries)
    all.push_back(e.op);
  return all;
}();

size_t numbers_of(const bench_model &m, const operation &o) {
  return static_cast<size_t>((o.numbers ? o.numbers : quantity_of(o.name).width)(m));
}

/// Brings the result of one state into the common layout; returns where the next one goes.
template <class S>
double *put(const bench_model &m, const operation &o, const double *v, const S *result, double *out) {
  const numbers same(result, result + numbers_of(m, o));
  if (o.put)
    o.put(m, v, same.data(), out);
  else
    std::copy(same.begin(), same.end(), out);
  return out + quantity_of(o.name).width(m);
}

void *create(const bench_model *m, const bench_states *few, const bench_states *many) {
  try {
    return new self(*m, *few, *many);
  } catch (const std::exception &e) {
    std::fprintf(stderr, "KSL: %s\n", e.what());
    return nullptr;
  }
}

void destroy(void *p) { delete static_cast<self *>(p); }

/// A loop over single states, as a control loop would call it.
void each(self &s, const operation &o, double *out) {
  const size_t nq = s.nq(), nv = s.nv(), n = numbers_of(s.m, o), part = n / static_cast<size_t>(o.parts);
  if (s.out.size() < n)
    s.out.resize(n);
  arguments given = s.given;
  given.timed = !out;
  given.x = s.out.data(), given.y = given.x + part, given.z = given.y + part; // as many as there are parts
  for (size_t k = 0; k < s.few; ++k) {
    given.q = &s.q[k * nq], given.v = &s.v[k * nv], given.a = &s.a[k * nv], given.tau = &s.tau[k * nv];
    o.one(s.model, s.data, given);
    asm volatile("" ::: "memory");
    if (out)
      out = put(s.m, o, given.v, s.out.data(), out);
  }
}

/// Results of all states are one array for each part.
template <class S> void whole_batch(self &s, const operation &o, int threads, std::vector<S> &result, double *out) {
  const size_t n = numbers_of(s.m, o), parts = static_cast<size_t>(o.parts), part = n / parts;
  if (result.size() < s.many * n) // before the first timed run
    result.resize(s.many * n);
  ksl::batch_view<S> b;
  b.n = s.many;
  b.q = {s.many_q.of(S()).data(), s.m.nq};
  b.v = {s.many_v.of(S()).data(), s.m.nv};
  b.a = {s.many_a.of(S()).data(), s.m.nv};
  b.tau = {s.many_tau.of(S()).data(), s.m.nv};
  b.links = o.one_frame ? ksl::link_list{1, &s.given.link} : ksl::link_list{s.given.n, s.given.links};
  b.joints = &s.given.request;
  for (size_t i = 0; i < parts; ++i)
    b.result[i] = {result.data() + i * s.many * part, static_cast<std::ptrdiff_t>(part)};
  if constexpr (std::is_same_v<S, float>)
    o.in_float(s.model, b, threads);
  else
    o.in_double(s.model, b, threads);
  std::vector<S> state(out ? n : 0);
  for (size_t k = 0; out && k < s.many; ++k) {
    for (size_t i = 0; i < parts; ++i)
      std::copy_n(&result[(i * s.many + k) * part], part, &state[i * part]);
    out = put(s.m, o, &s.many_v.in_double[k * s.nv()], state.data(), out);
  }
}

void run(void *p, int i, double *out) {
  self &s = *static_cast<self *>(p);
  const auto &[op, how] = entries[static_cast<size_t>(i)];
  if (!op.batch)
    each(s, *how, out);
  else if (op.single)
    whole_batch(s, *how, op.threads, s.out_single, out);
  else
    whole_batch(s, *how, op.threads, s.out, out);
}

/// Bytes of workspace per lane in double precision, for inverse dynamics.
size_t state_bytes(void *p) {
  const self &s = *static_cast<self *>(p);
  const auto &kernel = ksl::kernels().inverse_dynamics->in_double;
  return kernel.batch(s.model.view(), {}, 0, 0, nullptr).bytes / static_cast<size_t>(kernel.lanes);
}

#ifdef __clang__
#define BENCH_COMPILER "clang"
#else
#define BENCH_COMPILER "gcc"
#endif
const bench_peer table = {"KSL, " BENCH_COMPILER,
                          "KSL",
                          __VERSION__,
                          static_cast<int>(names.size()),
                          names.data(),
                          create,
                          destroy,
                          run,
                          state_bytes};

/// Frame of a moving joint in its body's canonical frame.
const ksl::SE3<double> &joint_frame(const ksl::model &m, int joint) {
  return m.view().link[m.joints()[static_cast<size_t>(joint)].link].pose;
}

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

int kind_of(ksl::joint_kind kind) {
  switch (kind) {
  case ksl::joint_kind::revolute:
  case ksl::joint_kind::continuous: return bench_revolute;
  case ksl::joint_kind::prismatic: return bench_prismatic;
  case ksl::joint_kind::floating: return bench_floating;
  default: return bench_other;
  }
}

/// The joint that carries a body; −1: it is at rest.  A body within a joint of several axes has no link, and is carried as its parent is.
int carrier(const ksl::model &m, int body) {
  for (; body > 0; body = m.view().body[body].parent)
    for (int i = 0; i < m.moving_joints(); ++i)
      if (m.view().link[m.joints()[static_cast<size_t>(i)].link].body == body)
        return i;
  return -1;
}

bench_joint describe_joint(const ksl::model &m, int i) {
  const ksl::model_view<double> view = m.view();
  const ksl::joint_row &row = m.joints()[static_cast<size_t>(i)];
  const ksl::joint_row *next = i + 1 < m.moving_joints() ? &row + 1 : nullptr;
  const int body = view.link[row.link].body;
  bench_joint j{};
  j.kind = kind_of(row.kind);
  j.nq = (next ? next->q_index : m.nq()) - row.q_index;
  j.nv = (next ? next->v_index : m.nv()) - row.v_index;
  j.parent = carrier(m, view.body[body].parent);
  ksl::SE3<double> D, in_parent = view.body[0].placement;
  if (j.parent >= 0)
    A::SE3_inverted(&joint_frame(m, j.parent), &in_parent);
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

/// The last of the joints with the most joints below them on the way to the base.
int deepest(const std::vector<bench_joint> &joints) {
  std::vector<int> depth;
  for (const bench_joint &j : joints)
    depth.push_back(j.parent < 0 ? 0 : depth[static_cast<size_t>(j.parent)] + 1);
  const auto found = std::max_element(depth.rbegin(), depth.rend());
  return static_cast<int>(depth.rend() - found) - 1;
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
    *out = {urdf, floating, m.moving_joints(), m.nq(), m.nv(), joints->data(), deepest(*joints), {0, 0, -9.81}};
    return true;
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s\n", e.what());
    return false;
  }
}

/// The instruction set in use; null if KSL_ISA names one that isn't built or doesn't run here.
extern "C" __attribute__((visibility("default"))) const char *bench_instruction_set() {
  try {
    return ksl::instruction_set();
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s\n", e.what());
    return nullptr;
  }
}
