// The golden program of the engine: a hash of the results of every algorithm, in double and in float, one state and batches in lanes,
// whose bits must be equal; and of every kind of joint.  Robots and states are made by integer arithmetic.
#include "batch/compute_batch.hpp"
#include "engine/run/compute.hpp"
#include "hash.h"
#include "ksl/dynamics.hpp"

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace {

constexpr std::size_t states = 9;

ksl::link_description link(int i) {
  ksl::link_description l;
  l.name = "link" + std::to_string(i);
  l.has_inertial = true;
  // binary fractions: a body of 1 kg or more whose moments are those of a solid
  l.inertia = {1.0 + i % 3, {0.125, -0.25 * (i % 2), 0.0625}, 1.5, 1.25, 1.0 + 0.25 * (i % 4), 0.03125, -0.0625,
               0.015625};
  return l;
}

ksl::joint_description joint(ksl::joint_kind kind, int parent, int child) {
  ksl::joint_description j;
  j.name = "joint" + std::to_string(child);
  j.kind = kind, j.parent = parent, j.child = child;
  // columns of lengths 1: Pythagorean triples and quadruples, rounded once each
  j.placement = {{0.6, 0.8, 0, -0.8, 0.6, 0, 0, 0, 1}, {0.25 * child, 0.5, -0.125}};
  j.axis = child % 2 ? ksl::vec3<double>{0, 0.6, 0.8} : ksl::vec3<double>{1.0 / 3, 2.0 / 3, 2.0 / 3};
  j.axis2 = {0.8, 0, -0.6};
  j.pitch = 0.3125;
  const bool one = ksl::row_of(kind).nv == 1; // springs and rotors are for those
  j.damping = 0.5, j.friction = 0.25, j.armature = one ? 0.125 : 0, j.spring_stiffness = one ? 0.75 : 0,
  j.spring_rest = one ? 0.5 : 0;
  return j;
}

ksl::robot_description tree(const std::vector<ksl::joint_kind> &kinds) {
  ksl::robot_description r;
  r.name = "golden";
  r.links.push_back(link(0));
  for (int i = 1; i <= static_cast<int>(kinds.size()); ++i) {
    r.links.push_back(link(i));
    r.joints.push_back(joint(kinds[static_cast<std::size_t>(i - 1)], i < 4 ? i - 1 : i / 2, i));
  }
  return r;
}

/// Every kind of joint, on a base that floats, with physics; and revolute joints two of which follow others.
ksl::model every_kind() {
  std::vector<ksl::joint_kind> kinds;
  for (ksl::joint_kind kind : ksl::joint_kinds)
    if (kind != ksl::joint_kind::fixed)
      kinds.push_back(kind);
  kinds.push_back(ksl::joint_kind::fixed);
  ksl::model_options options;
  options.floating_base = true;
  options.physics = ksl::physics_options{.damping = true, .friction = true, .armature = true, .spring = true};
  return ksl::model(tree(kinds), options);
}
ksl::model coupled() {
  ksl::robot_description r = tree(std::vector<ksl::joint_kind>(6, ksl::joint_kind::revolute));
  r.joints[2].mimic = {"joint1", 0.5, 0.25, {}};
  r.joints[4].mimic = {"joint4", -2, 0, {}};
  return ksl::model(r);
}

template <class S> void add(uint64_t &hash, S x) {
  if constexpr (sizeof(S) == 8)
    golden_add_double(&hash, x);
  else
    golden_add_float(&hash, x);
}

template <class S> std::vector<S> numbers(std::size_t n, uint64_t &state) {
  std::vector<S> x(n);
  for (S &y : x)
    y = static_cast<S>(golden_number(&state));
  return x;
}

/// All results of an algorithm on one robot, one state after the other; the batch must be the same bits.
template <class S> bool add_results(const ksl::algorithm_row &row, const ksl::model &m, uint64_t &hash) {
  if ((m.followers() && row.mimic == ksl::mimic_by::refusal))
    return true;
  ksl::data d(m);
  uint64_t seed = 7;
  const std::size_t nq = static_cast<std::size_t>(m.nq()), nv = static_cast<std::size_t>(m.nv());
  std::vector<S> q = numbers<S>(states * nq, seed), q1 = numbers<S>(states * nq, seed),
                 v = numbers<S>(states * nv, seed), a = numbers<S>(states * nv, seed),
                 tau = numbers<S>(states * nv, seed), push = numbers<S>(states * 12, seed),
                 fraction = numbers<S>(states, seed);
  for (std::vector<S> *x : {&q, &q1})
    for (std::size_t k = 0; k < states; ++k)
      for (const ksl::model::quaternion_in_q &quaternion : m.quaternions()) {
        S *const p = &(*x)[k * nq + static_cast<std::size_t>(quaternion.q_index)]; // (1, 2, 2, 4)/5, in four orders
        for (std::size_t i = 0; i < 4; ++i)
          p[i] = S((i + k) % 4 == 0 ? 0.8 : (i + k) % 4 == 1 ? 0.2 : 0.4);
      }
  const int last = static_cast<int>(m.links().size()) - 1, pushed[2] = {last, last / 2}, links[3] = {last, 1, last / 2};
  std::vector<int> children;
  for (int j = 0; j < m.moving_joints(); ++j)
    children.push_back(m.joints()[static_cast<std::size_t>(j)].link);
  ksl::reaction_request request;
  request.n = static_cast<int>(children.size()), request.link = children.data();
  const int least = ksl::least_links(row.request), links_n = least ? least : 3;
  const ksl::extents of = {m.nq(), m.nv(), links_n, request.n, m.tree_elements(), static_cast<int>(m.links().size())};

  std::vector<std::vector<S>> one, all;
  const bool reactions = row.request == ksl::request_kind::reactions;
  std::vector<std::size_t> width;
  for (int r = 0; r < row.results; ++r)
    width.push_back(static_cast<std::size_t>(numbers_of(row.result[r], of)));
  if (reactions)
    width.push_back(6 * children.size());
  for (std::size_t w : width)
    one.emplace_back(states * w, S(0)), all.emplace_back(states * w, S(0));

  for (std::size_t k = 0; k < states; ++k) {
    ksl::state_view<S> s;
    s.q = &q[k * nq], s.q1 = &q1[k * nq], s.v = &v[k * nv], s.a = &a[k * nv], s.tau = &tau[k * nv],
    s.fraction = &fraction[k];
    for (ksl::input x : {ksl::input::v, ksl::input::a, ksl::input::tau})
      if (!row.reads(x))
        input_of(s, x) = d.zero<S>();
    if (row.external != ksl::external_use::none)
      s.external = {2, pushed, &push[12 * k], ksl::expressed_in::frame};
    s.links = {links_n, links}, s.joints = &request;
    ksl::reaction_result<S> wanted = {&request, nullptr};
    for (std::size_t r = 0; r < width.size(); ++r)
      (r < static_cast<std::size_t>(row.results) ? s.result[r] : wanted.out) = &one[r][k * width[r]];
    if (reactions)
      s.reactions_n = 1, s.reactions = &wanted;
    ksl::compute<S>(row, m, d, s);
  }
  ksl::batch_view<S> b;
  const auto rows = [](const std::vector<S> &x, std::size_t w) {
    return ksl::rows_view<const S>{x.data(), static_cast<std::ptrdiff_t>(w)};
  };
  b.n = states, b.q = rows(q, nq), b.q1 = rows(q1, nq), b.v = rows(v, nv), b.a = rows(a, nv), b.tau = rows(tau, nv),
  b.fraction = rows(fraction, 1);
  const ksl::external_rows<S> external[2] = {{pushed[0], {push.data(), 12}}, {pushed[1], {push.data() + 6, 12}}};
  b.external_n = 2, b.external = external, b.links = {links_n, links}, b.joints = &request;
  ksl::reaction_rows<S> wanted{request, {}};
  for (std::size_t r = 0; r < width.size(); ++r)
    (r < static_cast<std::size_t>(row.results) ? b.result[r] : wanted.out) =
        ksl::rows_view<S>{all[r].data(), static_cast<std::ptrdiff_t>(width[r])};
  if (reactions)
    b.reactions_n = 1, b.reactions = &wanted;
  ksl::compute_batch(row, m, b, 1);

  bool same = true;
  for (std::size_t r = 0; r < width.size(); ++r)
    for (std::size_t i = 0; i < one[r].size(); ++i) {
      uint64_t x = golden_start, y = golden_start;
      add(x, one[r][i]), add(y, all[r][i]), add(hash, one[r][i]);
      same = same && x == y;
    }
  if (!same)
    std::fprintf(stderr, "%s of %s: a batch has other bits than one state\n", row.name, m.description().name.c_str());
  return same;
}

void report(const std::string &name, const char *precision, uint64_t hash) {
  std::printf("%s %s\t%016" PRIx64 "\t", name.c_str(), precision, hash);
  const char *before = "";
  for (int i = 0; golden_libm_names[i]; ++i)
    if (golden_libm >> i & 1)
      std::printf("%s%s", before, golden_libm_names[i]), before = " ";
  std::printf("\n");
}

/// One line for each precision: of these algorithms on these robots.
bool compare(const std::string &name, const std::vector<const ksl::algorithm_row *> &algorithms,
             const std::vector<const ksl::model *> &robots) {
  bool same = true;
  for (int bytes : {8, 4}) {
    uint64_t hash = golden_start;
    golden_libm = 0;
    for (const ksl::algorithm_row *row : algorithms)
      for (const ksl::model *m : robots)
        same = (bytes == 8 ? add_results<double>(*row, *m, hash) : add_results<float>(*row, *m, hash)) && same;
    report(name, bytes == 8 ? "double" : "float", hash);
  }
  return same;
}

} // namespace

int main() {
  golden_replaces = 0;
  const ksl::model every = every_kind(), follows = coupled();
  golden_replaces = 1;
  bool same = true;
  std::vector<const ksl::algorithm_row *> all; // but for those that mechanisms with loops need, and that are private
  for (const ksl::algorithm_row *row : ksl::rows::all)
    if (row->loops != ksl::loops_by::plan)
      all.push_back(row);
  for (const ksl::algorithm_row *row : all)
    same = compare(std::string("algorithm ") + row->name, {row}, {&every, &follows}) && same;
  for (ksl::joint_kind kind : ksl::joint_kinds) {
    golden_replaces = 0;
    const ksl::model m(tree({kind, ksl::joint_kind::revolute, kind}));
    golden_replaces = 1;
    same = compare(std::string("kind ") + ksl::row_of(kind).name, all, {&m}) && same;
  }
  std::fprintf(stderr, "%s\n", ksl::instruction_set());
  return same ? 0 : 1;
}
