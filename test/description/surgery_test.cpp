// Robots made from other robots: structure, names and refusals.  That their dynamics are right is a law,
// test/laws/surgery_test.py.
#include "ksl/surgery.hpp"
#include "robots.hpp"
#include "same_numbers.hpp"
#include "robot_files.hpp"

#include <algorithm>

using namespace ksl::test;

namespace {

ksl::model_options floating() {
  ksl::model_options options;
  options.floating_base = true;
  return options;
}

const ksl::model &every_kind() {
  static const ksl::model m = ksl::load(every_kind_file);
  return m;
}

const ksl::SE3<double> beside = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.1, 0.2, 0.3}};

template <class Call> void check_refused(Call call, std::initializer_list<const char *> parts) {
  std::string message = "accepted";
  try {
    call();
  } catch (const ksl::description_error &e) {
    message = e.what();
  }
  CAPTURE(message);
  for (const char *part : parts) {
    CAPTURE(part);
    CHECK(message.find(part) != std::string::npos);
  }
}

const ksl::robot_description &described() { return every_kind().description(); }

} // namespace

TEST_CASE("surgery: the model of a model's description is a copy") {
  ksl::model_options options = floating();
  options.gravity = {1, 2, 3};
  options.payloads = {{"tool", 2, {0.1, 0, 0}}};
  const ksl::model m = ksl::load(every_kind_file, options);
  const ksl::model copy(m.description());
  check_same(m, copy);
  check_same(copy, ksl::model(copy.description()));
  CHECK(copy.description().warnings == m.description().warnings);
}

TEST_CASE("surgery: another root, and back again") {
  const ksl::model arm = ksl::load(robot_file("panda"), floating());
  const std::string hand = arm.links().back().name, root = arm.links()[0].name;
  const ksl::model turned(ksl::with_root(arm.description(), hand));
  CHECK((turned.links()[0].name == hand && turned.nv() == arm.nv()));
  CHECK(turned.mass() == doctest::Approx(arm.mass()));
  CHECK(turned.joints()[1].name == "panda_joint7");
  CHECK(turned.links()[static_cast<std::size_t>(turned.joints()[1].link)].name == "panda_joint7_frame");
  const ksl::robot_description back = ksl::with_root(turned.description(), root), twice = ksl::with_root(back, hand);
  CHECK(twice.links.size() == turned.links().size()); // the frames are there already
  const ksl::model again(back);
  CHECK(again.links()[0].name == root);
  const std::vector<double> x = some_state(arm);
  ksl::data d(arm), e(again);
  const ksl::SE3<double> a = ksl::frame_pose(arm, d, x.data(), arm.find_link(hand)),
                         b = ksl::frame_pose(again, e, x.data(), again.find_link(hand));
  CHECK((std::fabs(a.t.x - b.t.x) < 1e-14 && std::fabs(a.R.m01 - b.R.m01) < 1e-14));
  check_refused([&] { ksl::with_root(described(), "nut"); }, {"joint socket is spherical", "link nut", "take a root"});
  check_refused([&] { ksl::with_root(described(), "toool"); }, {"no link \"toool\"", "did you mean \"tool\"?"});
}

TEST_CASE("surgery: frozen joints") {
  const ksl::model m(ksl::with_frozen_joints(
      described(), {{"shoulder", {0.5}}, {"socket", {0, 0, 0.6, 0.8}}, {"free", {1, 2, 3, 0, 0, 0, 1}}}));
  CHECK(m.nv() == every_kind().nv() - 1 - 3 - 6);
  CHECK(ksl::row_of(m.joints()[static_cast<std::size_t>(m.find_joint("socket"))].kind).nv == 0);
  const ksl::model stone(ksl::with_frozen_joints(ksl::load(every_kind_file, floating()).description(),
                                                 {{"floating_base", {1, 2, 3, 0, 0, 0, 1}}}));
  CHECK((stone.nv() == every_kind().nv() && stone.links()[0].name == "world_"));
  check_refused([&] { ksl::with_frozen_joints(described(), {{"shoulder", {0.5, 1}}}); },
                {"joint shoulder", "2 numbers", "has 1 in q"});
  check_refused([&] { ksl::with_frozen_joints(described(), {{"socket", {0, 0, 0, 2}}}); },
                {"joint socket", "length 2"});
  check_refused([&] { ksl::with_frozen_joints(described(), {{"shoulder", {std::nan("")}}}); },
                {"joint shoulder", "a position that is not finite"});
  check_refused([&] { ksl::with_frozen_joints(described(), {{"floating_base", {1}}}); },
                {"no joint \"floating_base\""});
}

TEST_CASE("surgery: merged robots") {
  const ksl::robot_description arm = ksl::load(robot_file("ur5")).description();
  const ksl::model two(ksl::merged(arm, arm, "base_link", beside, "left_"));
  CHECK((two.nv() == 12 && two.find_link("left_tool0") > 0 && two.find_joint("left_mount") > 0));
  CHECK(two.mass() == doctest::Approx(2 * ksl::model(arm).mass()));
  ksl::robot_description flying = arm;
  flying.floating_base = true;
  const ksl::model swarm(ksl::merged(arm, flying, "base_link", beside, "second_"));
  CHECK((swarm.nv() == 18 && swarm.find_joint("second_floating_base") >= 0));
  check_refused([&] { ksl::merged(arm, arm, "base_link", beside); },
                {"both robots have a link named \"base_link\"", "give a prefix"});
  ksl::robot_description renamed = arm;
  for (ksl::link_description &link : renamed.links)
    link.name = "second_" + link.name;
  check_refused([&] { ksl::merged(arm, renamed, "base_link", beside); },
                {"both robots have a joint named \"shoulder_pan\"", "give a prefix"});
  ksl::robot_description doubtful = arm;
  doubtful.warnings = {"a doubt"}, doubtful.unused = {"a tendon (not used)"};
  const ksl::robot_description both =
      ksl::merged(ksl::merged(arm, doubtful, "base_link", beside, "b_"), doubtful, "base_link", beside, "c_");
  CHECK(std::count(both.warnings.begin(), both.warnings.end(), arm.name + ": a doubt") ==
        1); // once, though both have it
  CHECK(std::count(both.unused.begin(), both.unused.end(), arm.name + ": a tendon (not used)") == 1);
  flying.gravity = {0, 0, 0};
  check_refused([&] { ksl::merged(arm, flying, "base_link", beside, "x"); }, {"different gravity"});
}

TEST_CASE("surgery: subtrees, frames, payloads") {
  const ksl::model part(ksl::subtree(described(), "upper"));
  CHECK((part.links()[0].name == "upper" && part.find_link("base") < 0 && part.find_joint("shoulder") < 0 &&
         part.find_joint("wrist") >= 0));
  const ksl::model framed(ksl::with_frame(described(), "camera", "tool", beside));
  CHECK((framed.find_link("camera") > 0 && framed.find_joint("camera_joint") > 0 &&
         framed.mass() == every_kind().mass()));
  check_refused([&] { ksl::with_frame(described(), "tool", "tool", beside); }, {"frame \"tool\"", "another"});
  for (const char *name : {"", "a\nb"})
    check_refused([&] { ksl::with_frame(described(), name, "tool", beside); },
                  {"give it a name without control characters"});
  ksl::link_mass plate = {1, {}, {1, 0, 0, 0, 1, 0, 0, 0, 3}}; // no body has these moments: a warning, once
  ksl::robot_description with_plates = ksl::with_payload(ksl::with_payload(described(), "tool", plate), "tool", plate);
  CHECK(std::count_if(with_plates.warnings.begin(), with_plates.warnings.end(), [](const std::string &line) {
          return line.find("payload on tool") != std::string::npos && line.find("exceeds the sum") != std::string::npos;
        }) == 1);
  const ksl::model heavy(ksl::with_payload(described(), "tool", {2, {0.1, 0, 0}, {}}));
  ksl::model_options with_tool;
  with_tool.payloads = {{"tool", 2, {0.1, 0, 0}}};
  check_same(heavy, ksl::load(every_kind_file, with_tool));
  check_refused([&] { ksl::with_payload(described(), "tool", {-2, {}, {}}); }, {"payload on tool", "negative"});
}

TEST_CASE("surgery: other inertias, the same structure") {
  const ksl::model heavy(ksl::with_payload(described(), "tool", {2, {0.1, 0, 0}, {}}));
  const int tool = heavy.find_link("tool");
  const ksl::model changed =
      every_kind().with_inertias({{tool, heavy.links()[static_cast<std::size_t>(tool)].inertia}});
  check_same(heavy, changed);
  check_same(heavy, ksl::model(changed.description()));
  const std::vector<double> state = some_state(heavy);
  const std::vector<float> x(state.begin(), state.end());
  std::vector<float> one(static_cast<std::size_t>(heavy.nv())), two = one;
  ksl::data d(heavy), e(changed);
  ksl::inverse_dynamics(heavy, d, x.data(), x.data() + heavy.nq(), x.data() + heavy.nq() + heavy.nv(), one.data());
  ksl::inverse_dynamics(changed, e, x.data(), x.data() + heavy.nq(), x.data() + heavy.nq() + heavy.nv(), two.data());
  CHECK(one == two);
  check_refused([&] { every_kind().with_inertias({{tool, {-1, {0, 0, 0}, 0, 0, 0, 0, 0, 0}}}); },
                {"link tool", "negative"});
}

TEST_CASE("surgery: another gravity, the same structure") {
  ksl::model_options sideways;
  sideways.gravity = {{-3, 4, 5}};
  const ksl::model made = every_kind().with_gravity({-3, 4, 5}), loaded = ksl::load(every_kind_file, sideways);
  check_same(loaded, made);
  check_same(loaded, ksl::model(made.description()));
  check_refused([] { every_kind().with_gravity({0, 0, std::nan("")}); }, {"gravity", "finite"});
}

TEST_CASE("queries: supports, subtrees, masses") {
  const ksl::model &m = every_kind();
  std::string joints, links;
  for (const int j : m.support(m.find_link("nut")))
    joints += m.joints()[static_cast<std::size_t>(j)].name + " ";
  for (const int l : m.subtree_links(m.find_joint("release")))
    links += m.links()[static_cast<std::size_t>(l)].name + " ";
  CHECK(joints == "free shoulder socket thread ");
  CHECK(links == "satellite antenna ");
  CHECK(m.subtree_mass(m.find_joint("release")) == doctest::Approx(2.8 + 3.1));
  double sum = 0;
  for (const ksl::link_description &link : m.links())
    sum += link.inertia.m;
  CHECK(m.mass() == sum);
  CHECK(m.joints()[static_cast<std::size_t>(m.joint_above(m.find_link("nut")))].name == "thread");
  CHECK(m.support(0).empty());
}
