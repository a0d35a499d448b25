// MuJoCo's C library from its wheel.  The calls compute only what is measured: no collisions, no constraints, no
// passive forces.  MuJoCo expresses a floating base's velocity in other axes; states and results are converted outside
// the timed runs.
#include "../quantities.hpp"

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace {

using numbers = std::vector<double>;

std::string text(std::initializer_list<double> x) {
  std::string all;
  char one[32];
  for (double e : x) {
    std::snprintf(one, sizeof one, "%.17g ", e);
    all += one;
  }
  return all;
}

/// A unit quaternion w x y z of a rotation, row-major.
std::string quaternion(const double R[9]) {
  double q[4], best = 0;
  for (int k = 0; k < 4; ++k) { // the longest column is the one that is computed without cancellation
    const double s[3] = {k == 0 || k == 1 ? 1.0 : -1.0, k == 0 || k == 2 ? 1.0 : -1.0, k == 0 || k == 3 ? 1.0 : -1.0};
    const double square = 1 + s[0] * R[0] + s[1] * R[4] + s[2] * R[8];
    if (square <= best)
      continue;
    best = square;
    const double wx = R[7] - R[5], wy = R[2] - R[6], wz = R[3] - R[1], xy = R[1] + R[3], xz = R[2] + R[6],
                 yz = R[5] + R[7];
    const double columns[4][4] = {
        {square, wx, wy, wz}, {wx, square, xy, xz}, {wy, xy, square, yz}, {wz, xz, yz, square}};
    std::copy(columns[k], columns[k] + 4, q);
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return text({q[0] / length, q[1] / length, q[2] / length, q[3] / length});
}

std::string body(const bench_model &m, int i) {
  const bench_joint &j = m.joint[i];
  const double *p = j.position, *c = j.centroid, *I = j.inertia, *a = j.axis;
  std::string xml = "<body pos='" + text({p[0], p[1], p[2]}) + "' quat='" + quaternion(j.rotation) + "'>";
  xml += j.kind == bench_floating ? std::string("<freejoint/>")
                                  : std::string("<joint type='") + (j.kind == bench_prismatic ? "slide" : "hinge") +
                                        "' axis='" + text({a[0], a[1], a[2]}) + "'/>";
  xml += "<inertial pos='" + text({c[0], c[1], c[2]}) + "' mass='" + text({j.mass}) + "' fullinertia='" +
         text({I[0], I[1], I[2], I[3], I[5], I[4]}) + "'/>";
  for (int k = i + 1; k < m.joints; ++k)
    if (m.joint[k].parent == i)
      xml += body(m, k);
  return xml + "</body>";
}

mjModel *compile(const bench_model &m) {
  std::string xml = "<mujoco><compiler angle='radian' inertiafromgeom='false'/><option gravity='" +
                    text({m.gravity[0], m.gravity[1], m.gravity[2]}) + "'/><worldbody>";
  for (int i = 0; i < m.joints; ++i)
    if (m.joint[i].parent < 0)
      xml += body(m, i);
  xml += "</worldbody></mujoco>";
  char error[500] = "";
  mjSpec *spec = mj_parseXMLString(xml.c_str(), nullptr, error, sizeof error);
  mjModel *model = spec ? mj_compile(spec, nullptr) : nullptr;
  if (!model)
    std::fprintf(stderr, "MuJoCo does not take %s: %s\n", m.urdf, spec ? mjs_getError(spec) : error);
  if (spec)
    mj_deleteSpec(spec);
  return model;
}

/// y = R x, or Rᵀ x, for the quaternion [x y z w].
void turn(const double q[4], bool inverse, const double x[3], double y[3]) {
  const double wxyz[4] = {q[3], inverse ? -q[0] : q[0], inverse ? -q[1] : q[1], inverse ? -q[2] : q[2]};
  mju_rotVecQuat(y, x, wxyz);
}

struct self {
  bench_model m;
  mjModel *model;
  mjData *data;
  size_t n;
  numbers q, v, a, tau, q_given;
  numbers full, result; ///< matrices
};

/// States in MuJoCo's conventions: quaternion w x y z, linear velocity and its derivative in world axes.
void convert(self &s) {
  if (!s.m.floating_base)
    return;
  const size_t nq = static_cast<size_t>(s.m.nq), nv = static_cast<size_t>(s.m.nv);
  for (size_t k = 0; k < s.n; ++k) {
    const double *given = &s.q_given[k * nq + 3];
    double *q = &s.q[k * nq + 3], *v = &s.v[k * nv], *a = &s.a[k * nv], *tau = &s.tau[k * nv], cross[3];
    q[0] = given[3], q[1] = given[0], q[2] = given[1], q[3] = given[2];
    mju_cross(cross, v + 3, v);
    for (int i = 0; i < 3; ++i)
      a[i] += cross[i];
    double turned[3];
    for (double *x : {v, a, tau}) {
      turn(given, false, x, turned);
      std::copy(turned, turned + 3, x);
    }
  }
}

void *create(const bench_model *m, const bench_states *few, const bench_states *) {
  for (int i = 0; i < m->joints; ++i)
    if (m->joint[i].kind == bench_other)
      return nullptr;
  mjModel *model = compile(*m);
  if (!model)
    return nullptr;
  const size_t nq = few->n * static_cast<size_t>(m->nq), nv = few->n * static_cast<size_t>(m->nv);
  auto *s = new self{*m,
                     model,
                     mj_makeData(model),
                     few->n,
                     {few->q, few->q + nq},
                     {few->v, few->v + nv},
                     {few->a, few->a + nv},
                     {few->tau, few->tau + nv},
                     {few->q, few->q + nq},
                     {},
                     {}};
  const size_t most = static_cast<size_t>(m->nv) * std::max(static_cast<size_t>(m->nv), size_t{6});
  s->full.resize(most), s->result.resize(most);
  convert(*s);
  return s;
}

void destroy(void *p) {
  self *s = static_cast<self *>(p);
  mj_deleteData(s->data);
  mj_deleteModel(s->model);
  delete s;
}

/// Converts efforts, accelerations or a row of M to the common conventions; q is that of the state as given.
void put_back(const self &s, size_t k, const double *x, bool acceleration, double *out) {
  std::copy(x, x + s.m.nv, out);
  if (!s.m.floating_base)
    return;
  turn(&s.q_given[k * static_cast<size_t>(s.m.nq) + 3], true, x, out);
  if (acceleration) {
    double v[3], cross[3];
    const double *world = &s.v[k * static_cast<size_t>(s.m.nv)];
    turn(&s.q_given[k * static_cast<size_t>(s.m.nq) + 3], true, world, v);
    mju_cross(cross, world + 3, v);
    for (int i = 0; i < 3; ++i)
      out[i] -= cross[i];
  }
}

void put_efforts(const self &s, size_t k, double *out) { put_back(s, k, s.result.data(), false, out); }
void put_accelerations(const self &s, size_t k, double *out) { put_back(s, k, s.result.data(), true, out); }

/// Rows that are multiplied by velocities.
template <int n> void put_rows(const self &s, size_t k, double *out) {
  for (int i = 0; i < n; ++i)
    put_back(s, k, &s.result[static_cast<size_t>(i * s.m.nv)], false, out + i * s.m.nv);
}

/// A symmetric matrix, whose columns are converted like its rows.
void put_matrix(const self &s, size_t k, const numbers &M, double *out) {
  const int nv = s.m.nv;
  numbers half(M.size()), row(static_cast<size_t>(nv));
  for (int i = 0; i < nv; ++i)
    put_back(s, k, &M[static_cast<size_t>(i * nv)], false, &half[static_cast<size_t>(i * nv)]);
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nv; ++i)
      row[static_cast<size_t>(i)] = half[static_cast<size_t>(i * nv + j)];
    put_back(s, k, row.data(), false, out + j * nv);
  }
}

void put_mass_matrix(const self &s, size_t k, double *out) {
  numbers full(s.full.size());
  mj_fullM(s.model, s.data, full.data());
  put_matrix(s, k, full, out);
}

void put_inverse(const self &s, size_t k, double *out) { put_matrix(s, k, s.result, out); }

void put_poses(const self &s, size_t, double *out) {
  for (int i = 0; i < s.m.joints; ++i, out += 12) {
    std::copy_n(s.data->xmat + 9 * (i + 1), 9, out);
    std::copy_n(s.data->xpos + 3 * (i + 1), 3, out + 9);
  }
}

/// The Jacobian, which MuJoCo gives in world axes, in those of the frame.
void put_jacobian(const self &s, size_t k, double *out) {
  const int nv = s.m.nv;
  numbers world(static_cast<size_t>(6 * nv));
  put_rows<6>(s, k, world.data());
  for (int half = 0; half < 2; ++half)
    mju_mulMatTMat(out + half * 3 * nv, s.data->xmat + 9 * (s.m.frame + 1), &world[static_cast<size_t>(half * 3 * nv)],
                   3, 3, nv);
}

/// MuJoCo's twists are angular first.
void put_twist(const self &s, size_t, double *out) {
  std::copy_n(&s.result[3], 3, out);
  std::copy_n(&s.result[0], 3, out + 3);
}

void positions(self &s) {
  mj_kinematics(s.model, s.data);
  mj_comPos(s.model, s.data);
}

void rnea(self &s, const double *) {
  positions(s);
  mj_comVel(s.model, s.data);
  mj_rne(s.model, s.data, 1, s.result.data());
}

void aba(self &s, const double *tau) {
  positions(s);
  mj_crb(s.model, s.data);
  mj_comVel(s.model, s.data);
  mj_rne(s.model, s.data, 0, s.result.data());
  mj_factorM(s.model, s.data);
  mju_sub(s.full.data(), tau, s.result.data(), s.m.nv);
  mj_solveM(s.model, s.data, s.result.data(), s.full.data(), 1);
}

void crba(self &s, const double *) {
  positions(s);
  mj_crb(s.model, s.data);
}

void inverse(self &s, const double *) {
  positions(s);
  mj_crb(s.model, s.data);
  mj_factorM(s.model, s.data);
  mju_eye(s.full.data(), s.m.nv);
  mj_solveM(s.model, s.data, s.result.data(), s.full.data(), s.m.nv);
}

void momentum_matrix(self &s, const double *) {
  positions(s);
  mj_jacSubtreeCom(s.model, s.data, s.result.data(), 0);
  mju_scl(s.result.data(), s.result.data(), s.model->body_subtreemass[0], 3 * s.m.nv);
  mj_angmomMat(s.model, s.data, s.result.data() + 3 * s.m.nv, 0);
}

void center_of_mass(self &s, const double *) {
  positions(s);
  mj_jacSubtreeCom(s.model, s.data, s.result.data(), 0);
}

void jacobian(self &s, const double *) {
  positions(s);
  mj_jacBody(s.model, s.data, s.result.data(), s.result.data() + 3 * s.m.nv, s.m.frame + 1);
}

void velocity(self &s, const double *) {
  positions(s);
  mj_comVel(s.model, s.data);
  mj_objectVelocity(s.model, s.data, mjOBJ_XBODY, s.m.frame + 1, s.result.data(), 1);
}

const bench_operation operations[] = {
    {"rnea", "kinematics, comPos, comVel, rne", 0, 0, 1},
    {"aba", "crb, factorM, rne, solveM", 0, 0, 1},
    {"crba", "kinematics, comPos, crb", 0, 0, 1},
    {"fk", "kinematics", 0, 0, 1},
    {"mass_matrix_inverse", "crb, factorM, solveM", 0, 0, 1},
    {"centroidal_momentum_matrix", "jacSubtreeCom, angmomMat", 0, 0, 1},
    {"center_of_mass_jacobian", "jacSubtreeCom", 0, 0, 1},
    {"jacobian", "jacBody", 0, 0, 1},
    {"frame_velocity", "comVel, objectVelocity", 0, 0, 1},
};

/// What computes each of them for the state in MuJoCo's workspace, and what copies its result in the common layout.
const struct {
  void (*evaluate)(self &, const double *tau);
  void (*put)(const self &, size_t state, double *out);
} functions[] = {
    {rnea, put_efforts},           {aba, put_accelerations},
    {crba, put_mass_matrix},       {[](self &s, const double *) { mj_kinematics(s.model, s.data); }, put_poses},
    {inverse, put_inverse},        {momentum_matrix, put_rows<6>},
    {center_of_mass, put_rows<3>}, {jacobian, put_jacobian},
    {velocity, put_twist},
};
constexpr int count = sizeof operations / sizeof *operations;
static_assert(count == sizeof functions / sizeof *functions);

void run(void *p, int operation, double *out) {
  self &s = *static_cast<self *>(p);
  const size_t nq = static_cast<size_t>(s.m.nq), nv = static_cast<size_t>(s.m.nv);
  const auto &[evaluate, put] = functions[operation];
  for (size_t k = 0; k < s.n; ++k) {
    std::copy_n(&s.q[k * nq], nq, s.data->qpos);
    std::copy_n(&s.v[k * nv], nv, s.data->qvel);
    std::copy_n(&s.a[k * nv], nv, s.data->qacc);
    evaluate(s, &s.tau[k * nv]);
    asm volatile("" ::: "memory");
    if (!out)
      continue;
    put(s, k, out);
    out += quantity_of(operations[operation].name).width(s.m);
  }
}

const bench_peer table = {"MuJoCo", "MuJoCo",   mj_versionString(),
                          count,    operations, create,
                          destroy,  run,        [](void *) -> size_t { return 0; }};

} // namespace

const bench_peer *bench_peer_table(void) { return &table; }
