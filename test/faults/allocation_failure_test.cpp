// Every call that is written by hand, in C and in C++, where each of its allocations fails in turn (starve.hpp).  Calls of algorithms
// are in starved_faces.hpp.
#include "starve.hpp"

#include "ksl/builder.hpp"
#include "ksl/dynamics.hpp"
#include "ksl/inverse_kinematics.hpp"
#include "ksl/section.hpp"
#include "ksl/surgery.hpp"
#include "ksl/urdf.hpp"
#include "robot_files.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <vector>

#include <pugixml.hpp>

namespace {

using starve::end;
using starve::of_call;
using starve::of_status;
using thread = starve::thread;

std::string contents(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The paths of robots, and the same robots as texts.
const std::string urdf = coupled_file, sdf = sdf_file, scratch = "starved_robot.urdf";

/// Under a sanitizer pugixml's memory fails too: it calls malloc otherwise, which belongs to the sanitizer.
#ifndef COUNTS_MALLOC
const bool counts_pugixml = [] {
  pugi::set_memory_management_functions([](std::size_t n) -> void * { return ::operator new(n, std::nothrow); },
                                        [](void *p) { ::operator delete(p); });
  return true;
}();
#endif

/// A call from C that makes a model: null in the end or a model that is like the others.
template <class Make> void makes_model(const char *name, Make make) {
  ksl_model_t *made = nullptr;
  const auto run = [&] {
    made = reinterpret_cast<ksl_model_t *>(1); // what a failing call replaces
    return of_status(make(&made));
  };
  int joints = -1;
  const auto after = [&](end found) {
    CHECK((made != nullptr) == (found == end::usual));
    if (made) {
      joints = joints < 0 ? ksl_model_joints(made) : joints;
      CHECK(ksl_model_joints(made) == joints);
    }
    ksl_model_free(made);
  };
  starve::call(name, thread::this_one, run, after);
}

/// A call from C that is refused with this status, whether or not there is memory for the message.
template <class Call> void refused(const char *name, ksl_status_t status, Call call) {
  for (const thread where : {thread::this_one, thread::new_one})
    starve::call(name, where, [&] { return of_status(call(), status); }, [](end) {});
}

/// A call from C++ that returns something, which is freed in the end.
template <class Make> void makes(const char *name, Make make) {
  std::optional<decltype(make())> made;
  starve::call(
      name, thread::this_one, [&] { return of_call([&] { made.emplace(make()); }); }, [&](end) { made.reset(); });
}

struct c_robot {
  ksl_model_t *m = nullptr;
  ksl_data_t *d = nullptr;
  explicit c_robot(const std::string &path = urdf) {
    REQUIRE(ksl_model_load(path.c_str(), nullptr, &m) == KSL_OK);
    REQUIRE(ksl_data_create(m, &d) == KSL_OK);
  }
  ~c_robot() {
    ksl_data_free(d);
    ksl_model_free(m);
  }
  c_robot(const c_robot &) = delete;
};

ksl::SE3<double> at(double x) { return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {x, 0, 0}}; }

} // namespace

TEST_CASE("the counter counts, and allocations fail where they are told to, in other threads too") {
  const long before = allocations;
  ::operator delete(::operator new(100));
  CHECK(allocations > before);
  // a call that allocates and hides it; a call that is not told of the failure; both are caught
  fail_allocation(2, false);
  void *const first = ::operator new(1, std::nothrow), *const second = ::operator new(1, std::nothrow),
              *const third = ::operator new(1, std::nothrow);
  CHECK(stop_failing_allocations() == 1);
  CHECK(first);
  CHECK(!second);
  CHECK(third);
  ::operator delete(first), ::operator delete(third);
  long failed = 0, counted = 0;
  std::thread([&] {
    const long start = allocations;
    fail_allocation(1, true);
    void *const none = ::operator new(1, std::nothrow);
    failed = stop_failing_allocations() + (none != nullptr);
    ::operator delete(::operator new(1));
    counted = allocations - start;
  }).join();
  CHECK(failed >= 1); // operator new throws for itself, too
  CHECK(counted >= 2);
#ifdef COUNTS_MALLOC
  // a block that is left behind is seen
  const long live = live_blocks;
  void *const left = std::malloc(8);
  CHECK(live_blocks == live + 1);
  std::free(left);
  CHECK(live_blocks == live);
#endif
}

TEST_CASE("robots are read, from files and texts, from C") {
  const std::string text = contents(urdf), model_of_sdf = contents(sdf);
  makes_model("ksl_model_load, URDF", [&](ksl_model_t **m) { return ksl_model_load(urdf.c_str(), nullptr, m); });
  makes_model("ksl_model_load, SDF", [&](ksl_model_t **m) { return ksl_model_load(sdf.c_str(), nullptr, m); });
  makes_model("ksl_model_load_memory, URDF",
              [&](ksl_model_t **m) { return ksl_model_load_memory(text.data(), text.size(), nullptr, m); });
  makes_model("ksl_model_load_memory, SDF", [&](ksl_model_t **m) {
    return ksl_model_load_memory(model_of_sdf.data(), model_of_sdf.size(), nullptr, m);
  });
  const ksl_payload_t payload = {"a payload whose link has a rather long name", 1, {0, 0, 0}},
                      held = {"tool", 1, {0, 0, 0.1}};
  ksl_model_options_t options = ksl_model_options();
  options.floating_base = true, options.payloads_n = 1, options.payloads = &held,
  options.physics.damping = options.physics.rotor_bodies = true;
  makes_model("with payload, physics and floating base",
              [&](ksl_model_t **m) { return ksl_model_load(urdf.c_str(), &options, m); });
  options.payloads = &payload;
  ksl_model_t *m = nullptr;
  refused("with a payload on no link", KSL_BAD_DESCRIPTION, [&] { return ksl_model_load(urdf.c_str(), &options, &m); });
}

TEST_CASE("and refused, from C") {
  ksl_model_t *m = nullptr;
  refused("a missing file", KSL_BAD_DESCRIPTION,
          [&] { return ksl_model_load("there is no such file, and its name is long", nullptr, &m); });
  refused("a folder", KSL_BAD_DESCRIPTION, [&] { return ksl_model_load("/", nullptr, &m); });
  for (
      const std::string &text :
      {std::string(
           "<robot name='twice'><link name='a link with a long name'/><link name='a link with a long name'/></robot>"),
       std::string("<robot name='torn'><link name='a'"), std::string("no XML"), std::string("<robot name='empty'/>"),
       std::string(1, '\0'),
       std::string(
           "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='turning round'><parent link='a'/><child link='b'/></joint></robot>"),
       std::string(
           "<sdf version='1.7'><model name='m'><link name='l'/><joint name='j' type='revolute'><parent>l</parent><child>nobody at all</child></joint></model></sdf>")})
    refused(text.c_str(), KSL_BAD_DESCRIPTION,
            [&] { return ksl_model_load_memory(text.data(), text.size(), nullptr, &m); });
  refused("no path", KSL_BAD_ARGUMENT, [&] { return ksl_model_load(nullptr, nullptr, &m); });
}

TEST_CASE("workspaces, queries and single calls, from C") {
  c_robot r(every_kind_file);
  ksl_data_t *d = nullptr;
  starve::call(
      "ksl_data_create", thread::this_one,
      [&] {
        d = reinterpret_cast<ksl_data_t *>(1);
        return of_status(ksl_data_create(r.m, &d));
      },
      [&](end found) {
        CHECK((d != nullptr) == (found == end::usual));
        ksl_data_free(d);
      });
  const std::size_t nq = static_cast<std::size_t>(ksl_model_nq(r.m)), nv = static_cast<std::size_t>(ksl_model_nv(r.m));
  std::vector<double> q(nq), v(nv, 0.1), uniform(nq, 0.3), wrenches(6 * 100), out(nv);
  std::vector<int> rows(nv + 1), columns(static_cast<std::size_t>(ksl_model_tree_elements(r.m))), list(100);
  REQUIRE(ksl_neutral(r.m, q.data()) == KSL_OK);
  const int joint = 0;
  ksl_joint_info_t info;
  ksl_SE3_t pose;
  const ksl_section_t section = ksl_section(1);
  // none of these allocates, even on a thread that has made no call before
  const auto all = [&] {
    bool fine =
        ksl_neutral(r.m, q.data()) == KSL_OK && ksl_random_position(r.m, uniform.data(), out.data() - 0) == KSL_OK;
    fine &= ksl_model_tree(r.m, rows.data(), columns.data()) == KSL_OK && ksl_model_support(r.m, 3, list.data()) > 0;
    fine &= ksl_model_subtree_links(r.m, 0, list.data()) > 0 && ksl_model_subtree_mass(r.m, 0) > 0 &&
            ksl_model_mass(r.m) > 0;
    fine &=
        ksl_model_joint_info(r.m, 0, &info) == KSL_OK && ksl_model_link_parameters(r.m, 1, wrenches.data()) == KSL_OK;
    fine &=
        ksl_model_joint(r.m, "sleeve_on_nut") >= 0 && ksl_model_link(r.m, "satellite") >= 0 && ksl_instruction_set();
    fine &= ksl_inverse_dynamics(r.m, r.d, q.data(), v.data(), v.data(), nullptr, out.data()) == KSL_OK;
    fine &= ksl_reactions(r.m, r.d, 1, &joint, nullptr, nullptr, wrenches.data()) == KSL_OK;
    fine &= ksl_frame_pose(r.m, r.d, q.data(), 1, &pose) == KSL_OK;
    fine &= ksl_section_wrench(r.m, r.d, q.data(), v.data(), v.data(), nullptr, &section, wrenches.data()) == KSL_OK;
    return fine;
  };
  out.resize(std::max(nq, nv));
  REQUIRE(all());
  bool fine = false;
  std::thread([&] {
    const long before = allocations;
    fail_allocation(1, true);
    fine = all();
    stop_failing_allocations();
    fine = fine && allocations == before;
  }).join();
  CHECK(fine);
  refused("an unknown name", KSL_OK,
          [&] { return ksl_model_joint(r.m, "a joint that the model does not have") == -1 ? KSL_OK : KSL_FAILED; });
  v[0] = NAN;
  refused("a number that is not finite", KSL_BAD_ARGUMENT,
          [&] { return ksl_inverse_dynamics(r.m, r.d, q.data(), v.data(), v.data(), nullptr, out.data()); });
}

TEST_CASE("inverse kinematics, from C and C++") {
  c_robot r(robot_file("ur5"));
  const ksl::model m = ksl::load(robot_file("ur5"));
  const int frame = ksl_model_link(r.m, "tool0");
  const std::size_t n = 8, nq = static_cast<std::size_t>(m.nq());
  std::vector<double> start(n * nq, 0.4), target(n * 16), q(n * nq), expected;
  ksl::data d(m);
  for (std::size_t k = 0; k < n; ++k)
    ksl::frame_poses(m, d, start.data(), 1, &frame, &target[16 * k]);
  const ksl_wanted_frame_t wanted = {frame, 1, 1};
  const ksl::wanted_frame same = {frame, 1, 1};
  ksl::inverse_kinematics_options options;
  options.frames_n = 1, options.frames = &same;
  ksl::inverse_kinematics_batch<double> batch;
  batch.n = n, batch.target = {target.data(), 16}, batch.q = {q.data(), m.nq()};
  const auto after = [&](end found) {
    if (expected.empty())
      expected = q;
    CHECK((found == end::usual ? q == expected : q == std::vector<double>(n * nq, -7)));
    std::fill(q.begin(), q.end(), -7);
  };
  std::fill(q.begin(), q.end(), -7);
  starve::call(
      "ksl_inverse_kinematics", thread::new_one,
      [&] {
        return of_status(ksl_inverse_kinematics(r.m, n, 1, &wanted, target.data(), 16, nullptr, 0, nullptr, q.data(),
                                                m.nq(), nullptr, 0, nullptr, nullptr, nullptr, 2));
      },
      after);
  starve::call(
      "ksl::inverse_kinematics", thread::new_one,
      [&] { return of_call([&] { ksl::inverse_kinematics(m, options, batch, 2); }); }, after);
}

TEST_CASE("the builder, from C") {
  const auto steps = std::vector<std::function<ksl_status_t(ksl_builder_t *)>>{
      [](ksl_builder_t *b) { return ksl_builder_add_link(b, "the link that carries all others", nullptr); },
      [](ksl_builder_t *b) {
        const ksl_link_mass_t mass = {1, {0, 0, 0.1}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        return ksl_builder_add_link(b, "the link that is carried by it", &mass);
      },
      [](ksl_builder_t *b) {
        static const double axis[3] = {0, 0, 1};
        ksl_joint_options_t options = ksl_joint_options();
        options.axis = axis;
        return ksl_builder_add_joint(b, "the joint between the two of them", "revolute",
                                     "the link that carries all others", "the link that is carried by it", nullptr,
                                     &options);
      },
      [](ksl_builder_t *b) {
        const ksl_link_mass_t mass = {1, {0, 0, 0.1}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        const ksl_dh_row_t rows[2] = {{0.1, 0.2, 0.3, 0.4, nullptr, mass}, {0.1, 0.2, 0.3, 0.4, "prismatic", mass}};
        return ksl_builder_add_dh_chain(b, "the link that is carried by it", 2, rows, KSL_DH_STANDARD,
                                        "an arm in addition_");
      }};
  ksl_builder_t *b = nullptr;
  starve::call(
      "ksl_builder_create", thread::this_one,
      [&] { return of_status(ksl_builder_create("a robot with quite a long name", &b)); },
      [&](end found) {
        CHECK((b != nullptr) == (found == end::usual));
        ksl_builder_free(b);
        b = nullptr;
      });
  // after a step that failed, the builder is as it was: the same step succeeds
  for (std::size_t i = 0; i < steps.size(); ++i) {
    CAPTURE(i);
    const auto begin = [&] {
      b = nullptr;
      REQUIRE(ksl_builder_create("robot", &b) == KSL_OK);
      for (std::size_t k = 0; k < i; ++k)
        REQUIRE(steps[k](b) == KSL_OK);
    };
    begin();
    starve::call(
        "a step", thread::this_one, [&] { return of_status(steps[i](b)); },
        [&](end found) {
          if (found == end::no_memory)
            CHECK(steps[i](b) == KSL_OK);
          ksl_builder_free(b);
          begin();
        });
    ksl_builder_free(b);
  }
  b = nullptr;
  REQUIRE(ksl_builder_create("robot", &b) == KSL_OK);
  for (const auto &step : steps)
    REQUIRE(step(b) == KSL_OK);
  refused("a second link of that name", KSL_BAD_DESCRIPTION,
          [&] { return ksl_builder_add_link(b, "the link that is carried by it", nullptr); });
  makes_model("ksl_builder_build", [&](ksl_model_t **m) { return ksl_builder_build(b, nullptr, m); });
  ksl_builder_free(b);
}

TEST_CASE("models from models, from C") {
  c_robot r(every_kind_file), other(robot_file("ur5"));
  const int tool = ksl_model_link(r.m, "tool"), slide = ksl_model_joint(r.m, "slide");
  REQUIRE((tool >= 0 && slide >= 0));
  const ksl_link_mass_t mass = {1, {0, 0, 0.1}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const double zero[7] = {}, gravity[3] = {0, 0, -1.6}, parameters[10] = {1, 0, 0, 0, 1, 0, 1, 0, 0, 1};
  const ksl_physics_t physics = {true, true, true, true, true, true, false, true, 0};
  makes_model("with_root",
              [&](ksl_model_t **m) { return ksl_model_with_root(other.m, ksl_model_link(other.m, "tool0"), m); });
  makes_model("with_frozen_joints",
              [&](ksl_model_t **m) { return ksl_model_with_frozen_joints(r.m, 1, &slide, zero, m); });
  makes_model("with_payload", [&](ksl_model_t **m) { return ksl_model_with_payload(r.m, tool, &mass, m); });
  makes_model("merged",
              [&](ksl_model_t **m) { return ksl_model_merged(r.m, other.m, tool, nullptr, "the other one's ", m); });
  makes_model("subtree", [&](ksl_model_t **m) { return ksl_model_subtree(r.m, tool, m); });
  makes_model("with_frame",
              [&](ksl_model_t **m) { return ksl_model_with_frame(r.m, "a frame with a long name", tool, nullptr, m); });
  makes_model("with_physics", [&](ksl_model_t **m) { return ksl_model_with_physics(r.m, &physics, m); });
  makes_model("with_parameters",
              [&](ksl_model_t **m) { return ksl_model_with_parameters(r.m, 1, &tool, parameters, m); });
  makes_model("with_gravity", [&](ksl_model_t **m) { return ksl_model_with_gravity(r.m, gravity, m); });
}

TEST_CASE("robots are written: the file is whole or not touched") {
  c_robot r(every_kind_file);
  const ksl::model m = ksl::load(every_kind_file);
  const std::string whole = ksl::urdf_text(m.description()), before = "what was there before";
  const auto put = [&] { std::ofstream(scratch, std::ios::binary) << before; };
  const auto after = [&](end found) {
    const std::string text = contents(scratch);
    CHECK((found == end::usual ? text == whole : text == before));
    put();
  };
  put();
  starve::call(
      "ksl_model_write_urdf", thread::this_one, [&] { return of_status(ksl_model_write_urdf(r.m, scratch.c_str())); },
      after);
  starve::call(
      "ksl::write_urdf", thread::this_one, [&] { return of_call([&] { ksl::write_urdf(m.description(), scratch); }); },
      after);
  std::optional<std::string> text;
  starve::call(
      "ksl::urdf_text", thread::this_one,
      [&] { return of_call([&] { text.emplace(ksl::urdf_text(m.description())); }); },
      [&](end found) {
        CHECK((found == end::usual ? *text == whole : !text));
        text.reset();
      });
  ksl::robot_description long_name = m.description();
  long_name.name = std::string(40'000, 'x'); // which XML libraries keep in a block of its own
  starve::call(
      "ksl::urdf_text with a long name", thread::this_one,
      [&] { return of_call([&] { text.emplace(ksl::urdf_text(long_name)); }); },
      [&](end found) {
        CHECK((found == end::usual ? text->find(long_name.name) != std::string::npos : !text));
        text.reset();
      });
  refused("where nothing can be written", KSL_BAD_DESCRIPTION,
          [&] { return ksl_model_write_urdf(r.m, "/there is no such folder/robot.urdf"); });
  std::remove(scratch.c_str());
}

TEST_CASE("C++: models, workspaces, the builder, models from models") {
  const ksl::model m = ksl::load(every_kind_file), other = ksl::load(robot_file("ur5"));
  const ksl::robot_description &robot = m.description();
  const std::string text = contents(urdf);
  makes("load, URDF", [&] { return ksl::load(urdf); });
  makes("load, SDF", [&] { return ksl::load(sdf); });
  makes("load_text", [&] { return ksl::load_text(text); });
  makes("a copy", [&] { return ksl::model(m); });
  makes("model of a description", [&] { return ksl::model(robot); });
  makes("data", [&] { return ksl::data(m); });
  makes("with_inertias", [&] { return m.with_inertias({{1, {1, {0, 0, 0}, 1, 1, 1, 0, 0, 0}}}); });
  makes("with_gravity", [&] { return m.with_gravity({0, 0, -1}); });
  makes("tree_columns", [&] { return m.tree_columns(); });
  makes("support", [&] { return m.support(5); });
  makes("subtree_links", [&] { return m.subtree_links(0); });
  makes("with_root", [&] { return ksl::with_root(other.description(), "tool0"); });
  makes("with_frozen_joints", [&] { return ksl::with_frozen_joints(robot, {{"slide", {0.1}}}); });
  makes("with_payload", [&] { return ksl::with_payload(robot, "tool", {1, {0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}}); });
  makes("merged", [&] { return ksl::merged(robot, other.description(), "tool", at(0.1), "the other one's "); });
  makes("subtree", [&] { return ksl::subtree(robot, "tool"); });
  makes("with_frame", [&] { return ksl::with_frame(robot, "a frame with a long name", "tool", at(0.1)); });
  makes("physics_named", [&] { return ksl::physics_named({"damping", "friction"}); });
  makes("names_of", [&] { return ksl::names_of(ksl::physics_options()); });
  makes("builder", [&] {
    ksl::builder b("a robot with quite a long name");
    b.add_link("the link that carries all others")
        .add_link("the link that is carried by it", {1, {0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}});
    ksl::joint_options options;
    options.axis = ksl::vec3<double>{0, 0, 1};
    b.add_joint("the joint between the two of them", ksl::joint_kind::revolute, "the link that carries all others",
                "the link that is carried by it", at(0), options);
    return b.build();
  });
  for (const thread where : {thread::this_one, thread::new_one})
    starve::call(
        "load, refused", where,
        [&] { return of_call([&] { ksl::load("there is no such file, and its name is long"); }, true); }, [](end) {});
}

TEST_CASE("what has been tried") {
  MESSAGE(starve::all().calls << " calls, of which " << starve::all().failures << " ended for want of memory");
  CHECK(starve::all().failures > 20'000);
}
