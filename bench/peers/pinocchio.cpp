// Pinocchio through its headers, as its users call it: a model of its own joint types, one state at a time.
// Compiled several times (peers.mk): with gcc and clang, with and without Eigen's vectorisation, and against the
// compiled library of the wheel.
#include "../peer.h"

#include <pinocchio/multibody/model.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <string>
#include <vector>

namespace {

namespace pin = pinocchio;
using vector = Eigen::VectorXd;
#ifdef PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION
using row = Eigen::Ref<const vector>; // what the compiled functions are instantiated for
#else
using row = Eigen::Map<const vector>;
#endif

row row_at(const std::vector<double> &x, Eigen::Index k, Eigen::Index n) {
  return Eigen::Map<const vector>(x.data() + k * n, n);
}

const bench_operation operations[] = {
    {"rnea", "", 0, 0, 1},
    {"reactions", "", 0, 0, 1},
    {"aba", "LOCAL", 0, 0, 1},
    {"aba", "WORLD", 0, 0, 1},
    {"crba", "LOCAL", 0, 0, 1},
    {"crba", "WORLD", 0, 0, 1},
    {"fk", "LOCAL + update", 0, 0, 1},
};

struct self {
  pin::Model model;
  pin::Data data;
  size_t n;
  std::vector<double> q, v, a, tau;
};

/// The joint types that Pinocchio's URDF reader would choose.
pin::JointModel joint_of(const bench_joint &j) {
  const Eigen::Vector3d axis(j.axis[0], j.axis[1], j.axis[2]);
  const bool turning = j.kind == bench_revolute;
  if (j.kind == bench_floating)
    return pin::JointModelFreeFlyer();
  if (axis == Eigen::Vector3d::UnitX())
    return turning ? pin::JointModel(pin::JointModelRX()) : pin::JointModel(pin::JointModelPX());
  if (axis == Eigen::Vector3d::UnitY())
    return turning ? pin::JointModel(pin::JointModelRY()) : pin::JointModel(pin::JointModelPY());
  if (axis == Eigen::Vector3d::UnitZ())
    return turning ? pin::JointModel(pin::JointModelRZ()) : pin::JointModel(pin::JointModelPZ());
  return turning ? pin::JointModel(pin::JointModelRevoluteUnaligned(axis))
                 : pin::JointModel(pin::JointModelPrismaticUnaligned(axis));
}

pin::Model model_of(const bench_model &m) {
  pin::Model model;
  for (int i = 0; i < m.joints; ++i) {
    const bench_joint &j = m.joint[i];
    Eigen::Matrix3d R, I;
    R << j.rotation[0], j.rotation[1], j.rotation[2], j.rotation[3], j.rotation[4], j.rotation[5], j.rotation[6],
        j.rotation[7], j.rotation[8];
    I << j.inertia[0], j.inertia[3], j.inertia[5], j.inertia[3], j.inertia[1], j.inertia[4], j.inertia[5], j.inertia[4],
        j.inertia[2];
    const pin::SE3 placement(R, Eigen::Vector3d(j.position[0], j.position[1], j.position[2]));
    const auto id =
        model.addJoint(static_cast<pin::JointIndex>(j.parent + 1), joint_of(j), placement, "joint" + std::to_string(i));
    model.appendBodyToJoint(id, pin::Inertia(j.mass, Eigen::Vector3d(j.centroid[0], j.centroid[1], j.centroid[2]), I));
  }
  model.gravity.linear() = Eigen::Vector3d(m.gravity[0], m.gravity[1], m.gravity[2]);
  return model;
}

void *create(const bench_model *m, const bench_states *few, const bench_states *) {
  pin::Model model = model_of(*m);
  if (model.nq != m->nq || model.nv != m->nv)
    return nullptr;
  const size_t nq = few->n * static_cast<size_t>(m->nq), nv = few->n * static_cast<size_t>(m->nv);
  return new self{model,
                  pin::Data(model),
                  few->n,
                  {few->q, few->q + nq},
                  {few->v, few->v + nv},
                  {few->a, few->a + nv},
                  {few->tau, few->tau + nv}};
}

void destroy(void *p) { delete static_cast<self *>(p); }

double *put(const vector &x, double *out) {
  std::copy(x.data(), x.data() + x.size(), out);
  return out + x.size();
}

/// Pinocchio fills the upper triangle only.
double *put_symmetric(const Eigen::MatrixXd &M, double *out) {
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    for (Eigen::Index j = 0; j < M.cols(); ++j)
      *out++ = i < j ? M(i, j) : M(j, i);
  return out;
}

double *put_wrenches(const self &s, double *out) {
  for (size_t i = 1; i < static_cast<size_t>(s.model.njoints); ++i)
    for (int k = 0; k < 6; ++k)
      *out++ = s.data.f[i].toVector()[k];
  return out;
}

double *put_poses(const self &s, double *out) {
  for (size_t i = 1; i < static_cast<size_t>(s.model.njoints); ++i) {
    for (int k = 0; k < 9; ++k)
      *out++ = s.data.oMi[i].rotation()(k / 3, k % 3);
    for (int k = 0; k < 3; ++k)
      *out++ = s.data.oMi[i].translation()[k];
  }
  return out;
}

/// One evaluation for each state; put copies a result if it is wanted.
template <class Evaluate, class Put> void each(self &s, double *out, Evaluate evaluate, Put put_result) {
  const Eigen::Index nq = s.model.nq, nv = s.model.nv;
  for (size_t k = 0; k < s.n; ++k) {
    const Eigen::Index i = static_cast<Eigen::Index>(k);
    evaluate(row_at(s.q, i, nq), row_at(s.v, i, nv), row_at(s.a, i, nv), row_at(s.tau, i, nv));
    asm volatile("" ::: "memory");
    if (out)
      out = put_result(out);
  }
}

void run(void *p, int operation, double *out) {
  self &s = *static_cast<self *>(p);
  const pin::Model &model = s.model;
  pin::Data &data = s.data;
  const auto rnea = [&](const auto &q, const auto &v, const auto &a, const auto &) { pin::rnea(model, data, q, v, a); };
  const auto acceleration = [&](double *o) { return put(data.ddq, o); };
  const auto matrix = [&](double *o) { return put_symmetric(data.M, o); };
  switch (operation) {
  case 0:
    return each(s, out, rnea, [&](double *o) { return put(data.tau, o); });
  case 1:
    return each(s, out, rnea, [&](double *o) { return put_wrenches(s, o); });
  case 2:
    return each(
        s, out,
        [&](const auto &q, const auto &v, const auto &, const auto &tau) {
          pin::aba(model, data, q, v, tau, pin::Convention::LOCAL);
        },
        acceleration);
  case 3:
    return each(
        s, out,
        [&](const auto &q, const auto &v, const auto &, const auto &tau) {
          pin::aba(model, data, q, v, tau, pin::Convention::WORLD);
        },
        acceleration);
  case 4:
    return each(
        s, out,
        [&](const auto &q, const auto &, const auto &, const auto &) {
          pin::crba(model, data, q, pin::Convention::LOCAL);
        },
        matrix);
  case 5:
    return each(
        s, out,
        [&](const auto &q, const auto &, const auto &, const auto &) {
          pin::crba(model, data, q, pin::Convention::WORLD);
        },
        matrix);
  default:
    return each(
        s, out,
        [&](const auto &q, const auto &, const auto &, const auto &) { pin::forwardKinematics(model, data, q); },
        [&](double *o) { return put_poses(s, o); });
  }
}

#define BENCH_STRING(x) #x
#define BENCH_VERSION(x) BENCH_STRING(x)
const bench_peer table = {BENCH_NAME,
                          BENCH_LIBRARY,
                          PINOCCHIO_VERSION,
                          sizeof operations / sizeof *operations,
                          operations,
                          create,
                          destroy,
                          run,
                          [](void *) -> size_t { return 0; }};

} // namespace

const bench_peer *bench_peer_table(void) { return &table; }
