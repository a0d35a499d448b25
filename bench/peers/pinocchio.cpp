// Pinocchio through its headers, as its users call it: a model of its own joint types, one state at a time.
// Compiled several times (peers.mk): with gcc and clang, with and without Eigen's vectorisation, and against the
// compiled library of the wheel.  BENCH_FEW_OPERATIONS leaves out what bench/arm.mk doesn't count: the rest compiles in a fraction of the time.
#include "../peer.h"

#include <pinocchio/multibody/model.hpp>
#include <pinocchio/multibody/data.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#ifndef BENCH_FEW_OPERATIONS
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/centroidal.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#endif

#include <string>
#include <vector>

namespace {

namespace pin = pinocchio;
#ifdef BENCH_FEW_OPERATIONS
/// Pinocchio's joint types that URDF files have, without those that no file here has.  What is compiled for each of them is the same.
template <class S, int options> struct few_joints : pin::JointCollectionDefaultTpl<S, options> {
  using all = pin::JointCollectionDefaultTpl<S, options>;
  using JointModelVariant =
      boost::variant<typename all::JointModelRX, typename all::JointModelRY, typename all::JointModelRZ,
                     typename all::JointModelFreeFlyer, typename all::JointModelRevoluteUnaligned,
                     typename all::JointModelPX, typename all::JointModelPY, typename all::JointModelPZ,
                     typename all::JointModelPrismaticUnaligned,
                     boost::recursive_wrapper<pin::JointModelMimicTpl<S, options, few_joints>>>;
  using JointDataVariant =
      boost::variant<typename all::JointDataRX, typename all::JointDataRY, typename all::JointDataRZ,
                     typename all::JointDataFreeFlyer, typename all::JointDataRevoluteUnaligned,
                     typename all::JointDataPX, typename all::JointDataPY, typename all::JointDataPZ,
                     typename all::JointDataPrismaticUnaligned,
                     boost::recursive_wrapper<pin::JointDataMimicTpl<S, options, few_joints>>>;
};
using Model = pin::ModelTpl<double, 0, few_joints>;
using Data = pin::DataTpl<double, 0, few_joints>;
using JointModel = pin::JointModelTpl<double, 0, few_joints>;
#else
using pin::Data;
using pin::JointModel;
using pin::Model;
#endif
using vector = Eigen::VectorXd;
#ifdef PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION
using row = Eigen::Ref<const vector>; // what the compiled functions are instantiated for
#else
using row = Eigen::Map<const vector>;
#endif

using in = const row &;

row row_at(const std::vector<double> &x, Eigen::Index k, Eigen::Index n) {
  return Eigen::Map<const vector>(x.data() + k * n, n);
}

struct self {
  Model model;
  Data data;
  size_t n;
  std::vector<double> q, v, a, tau;
  pin::JointIndex joint;         ///< which operations about one frame are about,
  pin::FrameIndex frame;         ///< and its frame
  Data::Matrix6x J{6, model.nv}; ///< columns of joints that don't carry the frame are zero and stay so
  pin::Motion motion;
};

/// The joint types that Pinocchio's URDF reader would choose.
JointModel joint_of(const bench_joint &j) {
  const Eigen::Vector3d axis(j.axis[0], j.axis[1], j.axis[2]);
  const bool turning = j.kind == bench_revolute;
  if (j.kind == bench_floating)
    return pin::JointModelFreeFlyer();
  if (axis == Eigen::Vector3d::UnitX())
    return turning ? JointModel(pin::JointModelRX()) : JointModel(pin::JointModelPX());
  if (axis == Eigen::Vector3d::UnitY())
    return turning ? JointModel(pin::JointModelRY()) : JointModel(pin::JointModelPY());
  if (axis == Eigen::Vector3d::UnitZ())
    return turning ? JointModel(pin::JointModelRZ()) : JointModel(pin::JointModelPZ());
  return turning ? JointModel(pin::JointModelRevoluteUnaligned(axis))
                 : JointModel(pin::JointModelPrismaticUnaligned(axis));
}

Model model_of(const bench_model &m) {
  Model model;
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
  const auto joint = static_cast<pin::JointIndex>(m.frame + 1);
  model.addFrame(pin::Frame("frame", joint, 0, pin::SE3::Identity(), pin::OP_FRAME));
  model.gravity.linear() = Eigen::Vector3d(m.gravity[0], m.gravity[1], m.gravity[2]);
  return model;
}

void *create(const bench_model *m, const bench_states *few, const bench_states *) {
  for (int i = 0; i < m->joints; ++i)
    if (m->joint[i].kind == bench_other)
      return nullptr;
  const Model model = model_of(*m);
  if (model.nq != m->nq || model.nv != m->nv)
    return nullptr;
  const size_t nq = few->n * static_cast<size_t>(m->nq), nv = few->n * static_cast<size_t>(m->nv);
  auto *s = new self{model,
                     Data(model),
                     few->n,
                     {few->q, few->q + nq},
                     {few->v, few->v + nv},
                     {few->a, few->a + nv},
                     {few->tau, few->tau + nv},
                     static_cast<pin::JointIndex>(m->frame + 1),
                     model.getFrameId("frame")};
  s->J.setZero();
  return s;
}

void destroy(void *p) { delete static_cast<self *>(p); }

/// Row by row, whatever the order in memory.
template <class Matrix> double *put(const Matrix &x, double *out) {
  for (Eigen::Index i = 0; i < x.rows(); ++i)
    for (Eigen::Index j = 0; j < x.cols(); ++j)
      *out++ = x(i, j);
  return out;
}

/// Pinocchio fills the upper triangle only.
template <class Matrix> double *put_symmetric(const Matrix &M, double *out) {
  for (Eigen::Index i = 0; i < M.rows(); ++i)
    for (Eigen::Index j = 0; j < M.cols(); ++j)
      *out++ = i < j ? M(i, j) : M(j, i);
  return out;
}

double *put_wrenches(const self &s, in, double *out) {
  for (size_t i = 1; i < static_cast<size_t>(s.model.njoints); ++i)
    out = put(s.data.f[i].toVector(), out);
  return out;
}

double *put_poses(const self &s, in, double *out) {
  for (size_t i = 1; i < static_cast<size_t>(s.model.njoints); ++i)
    out = put(s.data.oMi[i].translation(), put(s.data.oMi[i].rotation(), out));
  return out;
}

/// An operation: evaluate computes it for one state, put copies the result.
struct operation {
  bench_operation op;
  void (*run)(self &, double *out);
};

template <class Evaluate, class Put>
operation one_state(const char *name, const char *variant, Evaluate, Put) {
  const auto run = [](self &s, double *out) {
    const Eigen::Index nq = s.model.nq, nv = s.model.nv;
    for (size_t k = 0; k < s.n; ++k) {
      const Eigen::Index i = static_cast<Eigen::Index>(k);
      const row v = row_at(s.v, i, nv);
      Evaluate()(s, row_at(s.q, i, nq), v, row_at(s.a, i, nv), row_at(s.tau, i, nv));
      asm volatile("" ::: "memory");
      if (out)
        out = Put()(s, v, out);
    }
  };
  return {{name, variant, 0, 0, 1}, run};
}

// The arguments of each evaluation: model and workspace, q, v, a, tau; of each put: those, v, where to.
#define EVALUATE(...) [](self &s, in q, in v, in a, in tau) { (void)q, (void)v, (void)a, (void)tau, __VA_ARGS__; }
#define PUT(...) [](const self &s, in v, double *out) { return (void)v, __VA_ARGS__; }
#define PUT_SYMMETRIC(matrix) PUT(put_symmetric(s.data.matrix, out))

const operation operations[] = {
    one_state("rnea", "", EVALUATE(pin::rnea(s.model, s.data, q, v, a)), PUT(put(s.data.tau, out))),
    one_state("reactions", "", EVALUATE(pin::rnea(s.model, s.data, q, v, a)), PUT(put_wrenches(s, v, out))),
    one_state("aba", "LOCAL", EVALUATE(pin::aba(s.model, s.data, q, v, tau, pin::Convention::LOCAL)),
              PUT(put(s.data.ddq, out))),
    one_state("aba", "WORLD", EVALUATE(pin::aba(s.model, s.data, q, v, tau, pin::Convention::WORLD)),
              PUT(put(s.data.ddq, out))),
    one_state("crba", "LOCAL", EVALUATE(pin::crba(s.model, s.data, q, pin::Convention::LOCAL)), PUT_SYMMETRIC(M)),
    one_state("crba", "WORLD", EVALUATE(pin::crba(s.model, s.data, q, pin::Convention::WORLD)), PUT_SYMMETRIC(M)),
    one_state("inverse_dynamics_derivatives", "", EVALUATE(pin::computeRNEADerivatives(s.model, s.data, q, v, a)),
              PUT(put_symmetric(s.data.M, put(s.data.dtau_dv, put(s.data.dtau_dq, out))))),
#ifndef BENCH_FEW_OPERATIONS
    one_state("fk", "LOCAL + update", EVALUATE(pin::forwardKinematics(s.model, s.data, q)), PUT(put_poses(s, v, out))),
    one_state("forward_dynamics_derivatives", "", EVALUATE(pin::computeABADerivatives(s.model, s.data, q, v, tau)),
              PUT(put_symmetric(s.data.Minv, put(s.data.ddq_dv, put(s.data.ddq_dq, out))))),
    one_state("mass_matrix_inverse", "", EVALUATE(pin::computeMinverse(s.model, s.data, q)), PUT_SYMMETRIC(Minv)),
    one_state("coriolis_matrix", "", EVALUATE(pin::computeCoriolisMatrix(s.model, s.data, q, v)),
              PUT(put((s.data.C * v).eval(), out))),
    one_state("centroidal_momentum_matrix", "ccrba", EVALUATE(pin::ccrba(s.model, s.data, q, v)),
              PUT(put(s.data.Ag, out))),
    one_state("centroidal_momentum_matrix", "map", EVALUATE(pin::computeCentroidalMap(s.model, s.data, q)),
              PUT(put(s.data.Ag, out))),
    one_state("center_of_mass_jacobian", "", EVALUATE(pin::jacobianCenterOfMass(s.model, s.data, q, false)),
              PUT(put(s.data.Jcom, out))),
    one_state("jacobian", "joint", EVALUATE(pin::computeJointJacobian(s.model, s.data, q, s.joint, s.J)),
              PUT(put(s.J, out))),
    one_state("jacobian", "frame", EVALUATE(pin::computeFrameJacobian(s.model, s.data, q, s.frame, pin::LOCAL, s.J)),
              PUT(put(s.J, out))),
    one_state("frame_velocity", "",
              EVALUATE(pin::forwardKinematics(s.model, s.data, q, v),
                       s.motion = pin::getFrameVelocity(s.model, s.data, s.frame, pin::LOCAL)),
              PUT(put(s.motion.toVector(), out))),
    one_state("frame_acceleration", "",
              EVALUATE(pin::forwardKinematics(s.model, s.data, q, v, a),
                       s.motion = pin::getFrameAcceleration(s.model, s.data, s.frame, pin::LOCAL)),
              PUT(put(s.motion.toVector(), out))),
    one_state("inverse_dynamics_regressor", "", EVALUATE(pin::computeJointTorqueRegressor(s.model, s.data, q, v, a)),
              PUT(put(s.data.jointTorqueRegressor, out))),
#endif
};

#define BENCH_STRING(x) #x
#define BENCH_VERSION(x) BENCH_STRING(x)
const std::vector<bench_operation> names = [] {
  std::vector<bench_operation> all;
  for (const operation &x : operations)
    all.push_back(x.op);
  return all;
}();

const bench_peer table = {BENCH_NAME,
                          BENCH_LIBRARY,
                          PINOCCHIO_VERSION,
                          static_cast<int>(names.size()),
                          names.data(),
                          create,
                          destroy,
                          [](void *p, int i, double *out) { operations[i].run(*static_cast<self *>(p), out); },
                          [](void *) -> size_t { return 0; }};

} // namespace

const bench_peer *bench_peer_table(void) { return &table; }
