// Orocos KDL from the distribution: chains with its chain solvers, trees (inverse dynamics only) with its tree solver.
// KDL has no floating base.
#include "../peer.h"

#include <kdl/chain.hpp>
#include <kdl/chaindynparam.hpp>
#include <kdl/chainfdsolver_recursive_newton_euler.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainidsolver_recursive_newton_euler.hpp>
#include <kdl/config.h>
#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace {

const bench_operation operations[] = {
    {"rnea", "", 0, 0, 1}, {"aba", "mass matrix and solve", 0, 0, 1}, {"crba", "", 0, 0, 1}, {"fk", "", 0, 0, 1}};

struct chain_solvers {
  KDL::ChainIdSolver_RNE inverse;
  KDL::ChainFdSolver_RNE forward;
  KDL::ChainDynParam matrix;
  KDL::ChainFkSolverPos_recursive poses;
  chain_solvers(const KDL::Chain &c, const KDL::Vector &g) : inverse(c, g), forward(c, g), matrix(c, g), poses(c) {}
};

struct self {
  bench_model m;
  KDL::Chain chain;
  KDL::Tree tree;
  std::unique_ptr<chain_solvers> serial; ///< none for trees
  std::unique_ptr<KDL::TreeIdSolver_RNE> branched;
  size_t n;
  std::vector<KDL::JntArray> q, v, a, tau;
  KDL::JntArray result;
  KDL::JntSpaceInertiaMatrix M;
  std::vector<KDL::Frame> frames;
  KDL::Wrenches none;
  KDL::WrenchMap none_by_name;
};

KDL::Segment segment_of(const bench_joint &j, int i) {
  const double *R = j.rotation, *p = j.position, *I = j.inertia;
  const KDL::Frame frame(KDL::Rotation(R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]),
                         KDL::Vector(p[0], p[1], p[2]));
  const KDL::Vector axis(j.axis[0], j.axis[1], j.axis[2]);
  const std::string number = std::to_string(i);
  const KDL::Joint joint("joint" + number, frame.p, frame.M * axis,
                         j.kind == bench_prismatic ? KDL::Joint::TransAxis : KDL::Joint::RotAxis);
  return KDL::Segment("body" + number, joint, frame,
                      KDL::RigidBodyInertia(j.mass, KDL::Vector(j.centroid[0], j.centroid[1], j.centroid[2]),
                                            KDL::RotationalInertia(I[0], I[1], I[2], I[3], I[5], I[4])));
}

std::vector<KDL::JntArray> arrays(const double *x, size_t n, int columns) {
  std::vector<KDL::JntArray> rows(n, KDL::JntArray(static_cast<unsigned>(columns)));
  for (size_t k = 0; k < n; ++k)
    for (int i = 0; i < columns; ++i)
      rows[k](static_cast<unsigned>(i)) = *x++;
  return rows;
}

void *create(const bench_model *m, const bench_states *few, const bench_states *) {
  for (int i = 0; i < m->joints; ++i)
    if (m->joint[i].kind > bench_prismatic)
      return nullptr;
  auto s = std::make_unique<self>();
  s->m = *m;
  bool is_chain = true;
  for (int i = 0; i < m->joints; ++i) {
    const KDL::Segment segment = segment_of(m->joint[i], i);
    const int parent = m->joint[i].parent;
    is_chain = is_chain && parent == i - 1;
    s->chain.addSegment(segment);
    s->tree.addSegment(segment, parent < 0 ? "root" : "body" + std::to_string(parent));
  }
  const KDL::Vector gravity(m->gravity[0], m->gravity[1], m->gravity[2]);
  if (is_chain)
    s->serial = std::make_unique<chain_solvers>(s->chain, gravity);
  else
    s->branched = std::make_unique<KDL::TreeIdSolver_RNE>(s->tree, gravity);
  s->n = few->n;
  s->q = arrays(few->q, few->n, m->nq), s->v = arrays(few->v, few->n, m->nv);
  s->a = arrays(few->a, few->n, m->nv), s->tau = arrays(few->tau, few->n, m->nv);
  const unsigned joints = static_cast<unsigned>(m->joints);
  s->result.resize(joints), s->M.resize(joints), s->frames.resize(joints);
  s->none.assign(joints, KDL::Wrench::Zero());
  return s.release();
}

void destroy(void *p) { delete static_cast<self *>(p); }

/// False if the solvers for trees don't have the operation.
bool evaluate(self &s, int operation, size_t k) {
  if (!s.serial)
    return operation == 0 && s.branched->CartToJnt(s.q[k], s.v[k], s.a[k], s.none_by_name, s.result) >= 0;
  switch (operation) {
  case 0: return s.serial->inverse.CartToJnt(s.q[k], s.v[k], s.a[k], s.none, s.result) >= 0;
  case 1: return s.serial->forward.CartToJnt(s.q[k], s.v[k], s.tau[k], s.none, s.result) >= 0;
  case 2: return s.serial->matrix.JntToMass(s.q[k], s.M) >= 0;
  default: return s.serial->poses.JntToCart(s.q[k], s.frames) >= 0;
  }
}

double *put(const self &s, int operation, double *out) {
  const unsigned nv = static_cast<unsigned>(s.m.nv);
  if (operation <= 1)
    for (unsigned i = 0; i < nv; ++i)
      *out++ = s.result(i);
  else if (operation == 2)
    for (unsigned i = 0; i < nv * nv; ++i)
      *out++ = s.M(i / nv, i % nv);
  else
    for (const KDL::Frame &f : s.frames) {
      out = std::copy(f.M.data, f.M.data + 9, out);
      out = std::copy(f.p.data, f.p.data + 3, out);
    }
  return out;
}

void run(void *p, int operation, double *out) {
  self &s = *static_cast<self *>(p);
  for (size_t k = 0; k < s.n; ++k) {
    if (!evaluate(s, operation, k))
      return;
    asm volatile("" ::: "memory");
    if (out)
      out = put(s, operation, out);
  }
}

const bench_peer table = {
    "KDL", "KDL", KDL_VERSION_STRING, 4, operations, create, destroy, run, [](void *) -> size_t { return 0; }};

} // namespace

const bench_peer *bench_peer_table(void) { return &table; }
