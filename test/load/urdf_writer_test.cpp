// What is written is what was read, number by number.
#include "refusal.hpp"

#include "ksl/engine/model/joints.hpp"
#include "ksl/urdf.hpp"
#include "robot_files.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <pthread.h>
#include <random>
#include <string>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>
#include <vector>

using namespace ksl;

namespace {

bool same_bits(const void *a, const void *b, std::size_t n) { return std::memcmp(a, b, n) == 0; }

/// All that a model is made of, but lines and remarks.
void check_same(const robot_description &a, const robot_description &b) {
  CHECK(a.name == b.name);
  REQUIRE((a.links.size() == b.links.size() && a.joints.size() == b.joints.size()));
  for (std::size_t i = 0; i < a.links.size(); ++i) {
    CHECK(a.links[i].name == b.links[i].name);
    CHECK(a.links[i].has_inertial == b.links[i].has_inertial);
    CHECK(same_bits(&a.links[i].inertia, &b.links[i].inertia, sizeof a.links[i].inertia));
  }
  for (std::size_t i = 0; i < a.joints.size(); ++i) {
    const joint_description &x = a.joints[i], &y = b.joints[i];
    CAPTURE(x.name);
    CHECK((x.name == y.name && x.kind == y.kind && x.parent == y.parent && x.child == y.child));
    CHECK(same_bits(&x.placement, &y.placement, sizeof x.placement));
    if (row_of(x.kind).has_axis)
      CHECK(same_bits(&x.axis, &y.axis, sizeof x.axis));
    CHECK(same_bits(&x.axis2, &y.axis2, sizeof x.axis2));
    CHECK((x.pitch == y.pitch && x.lower == y.lower && x.upper == y.upper && x.effort == y.effort &&
           x.velocity == y.velocity));
    CHECK((x.damping == y.damping && x.friction == y.friction));
    for (std::size_t c = 0; c < x.further.size(); ++c)
      CHECK((x.further[c].lower == y.further[c].lower && x.further[c].upper == y.further[c].upper));
  }
}

/// Reads, writes, reads; and the second text is the first.
void check_round_trip(const robot_description &robot) {
  const std::string text = urdf_text(robot);
  const robot_description again = read_urdf_text(text, "again.urdf");
  check_same(robot, again);
  robot_description bare = again;
  bare.unused = robot.unused; // the remarks
  CHECK(urdf_text(bare) == text);
}

std::string robot_of(const std::string &inertial, const std::string &joint) {
  return "<robot name=\"r\" version=\"1.1\"><link name=\"a\"/><link name=\"b\"><inertial>" + inertial +
         "</inertial></link>" + joint + "</robot>";
}

} // namespace

TEST_CASE("urdf: the robots that ship with KSL, and every kind of joint") {
  for (const std::string &file : {robot_file("panda"), robot_file("ur5"), std::string(every_kind_file)})
    check_round_trip(read_urdf(file));
}

TEST_CASE("urdf: numbers of many digits, angles, quaternions, axes of any length") {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto words = [&](int n) {
    std::string text;
    for (int i = 0; i < n; ++i) {
      char word[40];
      std::snprintf(word, sizeof word, "%.17g ", normal(random));
      text += word;
    }
    return text;
  };
  for (int k = 0; k < 200; ++k) {
    const std::string placement =
        k % 2
            ? "rpy=\"" + words(3) + "\""
            : std::string("quat_xyzw=\"0.18257418583505536 0.3651483716701107 0.5477225575051661 0.7302967433402214\"");
    const std::string inertial = "<origin xyz=\"" + words(3) + "\" " + placement + "/><mass value=\"" + words(1) +
                                 "\"/><inertia ixx=\"3.1\" ixy=\"" + words(1) +
                                 "\" ixz=\"0.1\" iyy=\"4.2\" iyz=\"-0\" izz=\"5\"/>";
    std::string positive = inertial;
    const std::size_t minus = positive.find("value=\"-");
    if (minus != positive.npos)
      positive.erase(minus + 7, 1);
    check_round_trip(
        read_urdf_text(robot_of(positive, "<joint name=\"j\" type=\"helical\"><origin xyz=\"" + words(3) + "\" " +
                                              placement + "/><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"" +
                                              words(3) + "\"/><screw_thread_pitch value=\"" + words(1) +
                                              "\"/><limit lower=\"-7e-300\" upper=\"0.1\" effort=\"1e22\" "
                                              "velocity=\"3\"/><dynamics friction=\"0.3\"/></joint>"),
                       "r.urdf"));
  }
}

TEST_CASE("urdf: zeros keep their signs") {
  check_round_trip(read_urdf_text(
      robot_of(
          "<origin xyz=\"0 0 -0\"/><mass value=\"2\"/><inertia ixx=\"1\" ixy=\"-0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/>",
          "<joint name=\"j\" type=\"revolute\"><origin xyz=\"-0 0 0\"/><parent link=\"a\"/><child link=\"b\"/>"
          "<axis xyz=\"0 -0 1\"/><limit lower=\"-0\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>"),
      "r.urdf"));
}

TEST_CASE("urdf: what no file gave is written to rounding") {
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 100; ++k) {
    robot_description robot = read_urdf(every_kind_file);
    using A = algebra<double>;
    const auto turn = [](double x, double y, double z) {
      const screw<double> s = {{0, 0, 0}, {x, y, z}};
      SE3<double> D;
      A::SE3_exp(&s, &D);
      return D;
    };
    SE3<double> D = turn(normal(random), normal(random), normal(random));
    if (k % 3 == 0) { // pitch is a right angle
      const SE3<double> roll = turn(normal(random), 0, 0),
                        pitch = turn(0, k % 2 ? 1.5707963267948966 : -1.5707963267948966, 0);
      D = turn(0, 0, normal(random));
      A::product_dd(&D, &pitch, &D);
      A::product_dd(&D, &roll, &D);
    }
    robot.joints[2].placement.R = D.R;
    robot.links[1].inertia.h.x *= 1.0000001;
    const robot_description again = read_urdf_text(urdf_text(robot), "again.urdf");
    const mat3x3<double> &R = robot.joints[2].placement.R, &Q = again.joints[2].placement.R;
    for (const double difference :
         {R.m00 - Q.m00, R.m10 - Q.m10, R.m20 - Q.m20, R.m01 - Q.m01, R.m11 - Q.m11, R.m21 - Q.m21})
      CHECK(std::fabs(difference) < 1e-15);
    CHECK(again.links[1].inertia.h.x == doctest::Approx(robot.links[1].inertia.h.x).epsilon(1e-15));
    CHECK(again.links[1].inertia.Iyy == doctest::Approx(robot.links[1].inertia.Iyy).epsilon(1e-15));
  }
}

TEST_CASE("urdf: names, and what isn't written") {
  robot_description robot = read_urdf_text(
      "<robot name=\"a &lt;b&gt; &quot;c&quot;\"><link name=\"&amp;\"><visual/></link></robot>", "r.urdf");
  robot.floating_base = true;
  robot.gravity = {0, 0, -1.62};
  const std::string text = urdf_text(robot);
  CHECK(read_urdf_text(text, "again.urdf").links[0].name == "&");
  CHECK(read_urdf_text(text, "again.urdf").name == "a <b> \"c\"");
  for (const char *part :
       {"<!-- not written: visual (1 link) -->", "<!-- the root floats -->", "<!-- gravity 0 0 -1.62 -->"})
    CHECK(text.find(part) != text.npos);
  CHECK(test::refusal_of([&] {
          write_urdf(robot, "/nowhere/robot.urdf");
        }).find("/nowhere/robot.urdf: the robot can't be written") == 0);
}

TEST_CASE("urdf: a file appears complete or not at all") {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("ksl_urdf_" + std::to_string(getpid()));
  const std::filesystem::path file = folder / "robot.urdf", link = folder / "link.urdf";
  const auto text = [&] {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto files = [&] { return std::distance(std::filesystem::directory_iterator(folder), {}); };
  std::filesystem::create_directory(folder);
  std::ofstream(file) << "the old one";
  std::filesystem::create_symlink(file, link);
  const robot_description robot = read_urdf_text("<robot name='r'><link name='a'/></robot>", "r.urdf");

  // a disk that is full after 20 bytes, for the file and through a link to it
  rlimit before{}, few{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  few = before;
  few.rlim_cur = 20;
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  REQUIRE(setrlimit(RLIMIT_FSIZE, &few) == 0);
  const std::string said = test::refusal_of([&] { write_urdf(robot, file.string()); });
  const std::string said_of_link = test::refusal_of([&] { write_urdf(robot, link.string()); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK(said.find("the robot can't be written") != said.npos);
  CHECK(said_of_link.find("the robot can't be written") != said.npos);
  CHECK((text() == "the old one" && files() == 2));

  write_urdf(robot, link.string());
  CHECK((text() == urdf_text(robot) && files() == 2 && std::filesystem::is_symlink(link)));
  write_urdf(robot, "/dev/null");
  CHECK(std::filesystem::is_character_file("/dev/null"));
  std::filesystem::remove_all(folder);
}

TEST_CASE("urdf: no other file is touched, the mode is that of new files, and names may be long") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("ksl_others_" + std::to_string(getpid()));
  const fs::path file = folder / "arm.urdf", notes = folder / "arm.urdf.part", victim = folder / "victim";
  const robot_description robot = read_urdf_text("<robot name='r'><link name='a'/></robot>", "r.urdf");
  const auto text = [](const fs::path &path) {
    std::ifstream in(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto files = [&] { return std::distance(fs::directory_iterator(folder), {}); };
  fs::create_directory(folder);
  std::ofstream(notes) << "mine";
  const mode_t mask = umask(027);
  write_urdf(robot, file.string());
  umask(mask);
  CHECK((text(file) == urdf_text(robot) && text(notes) == "mine" && files() == 2));
  struct stat found{};
  REQUIRE(stat(file.c_str(), &found) == 0);
  CHECK((found.st_mode & 07777) == 0640);

  fs::remove(notes);
  std::ofstream(victim) << "mine";
  fs::create_symlink(victim, notes);
  write_urdf(robot, file.string());
  CHECK((text(file) == urdf_text(robot) && text(victim) == "mine" && fs::is_symlink(notes) && files() == 3));

  const fs::path longest = folder / (std::string(250, 'n') + ".urdf");
  write_urdf(robot, longest.string());
  CHECK(text(longest) == urdf_text(robot));

  const fs::path taken = folder / "taken.urdf"; // a folder can't be replaced
  fs::create_directory(taken);
  const std::string said = test::refusal_of([&] { write_urdf(robot, taken.string()); });
  CHECK(said.find("the robot can't be written") != std::string::npos);
  CHECK(files() == 5);
  fs::remove_all(folder);
}

TEST_CASE("urdf: several writers at once give one whole file") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("ksl_writers_" + std::to_string(getpid()));
  const fs::path file = folder / "arm.urdf";
  std::array<robot_description, 4> robots;
  for (std::size_t k = 0; k < robots.size(); ++k) {
    robots[k] = read_urdf_text("<robot name='r'><link name='a'/></robot>", "r.urdf");
    robots[k].name = std::string(20'000 * (k + 1), static_cast<char>('a' + k));
  }
  fs::create_directory(folder);
  std::array<int, 4> refused{};
  std::vector<std::thread> writers;
  for (std::size_t k = 0; k < robots.size(); ++k)
    writers.emplace_back([&, k] {
      for (int turn = 0; turn < 100; ++turn)
        refused[k] += test::refusal_of([&] { write_urdf(robots[k], file.string()); }) != "accepted";
    });
  for (std::thread &writer : writers)
    writer.join();
  CHECK(refused == std::array<int, 4>{});
  CHECK(std::distance(fs::directory_iterator(folder), {}) == 1);
  std::ifstream in(file);
  const std::string found(std::istreambuf_iterator<char>(in), {});
  CHECK(std::any_of(robots.begin(), robots.end(), [&](const robot_description &r) { return found == urdf_text(r); }));
  fs::remove_all(folder);
}

TEST_CASE("urdf: signals don't end writing into a pipe whose reader is slow") {
  const std::string pipe = std::filesystem::temp_directory_path() / ("ksl_pipe_" + std::to_string(getpid()));
  robot_description robot = read_urdf_text("<robot name='r'><link name='a'/></robot>", "r.urdf");
  robot.name = std::string(1'000'000, 'r'); // more than a pipe holds
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const int reader = open(pipe.c_str(), O_RDONLY | O_NONBLOCK);
  REQUIRE(reader >= 0);
  static std::atomic<int> heard;
  heard = 0;
  struct sigaction count{}, earlier{};
  count.sa_handler = [](int) { ++heard; }; // without SA_RESTART: calls that wait end
  sigaction(SIGUSR1, &count, &earlier);
  const pthread_t writer = pthread_self();
  std::string found;
  std::atomic<bool> done{false};
  const auto in_pipe = [&] {
    int bytes = 0;
    ioctl(reader, FIONREAD, &bytes);
    return bytes;
  };
#ifdef F_GETPIPE_SZ
  const int room = fcntl(reader, F_GETPIPE_SZ);
#else
  const int room = 16 << 10; // of a pipe of macOS, at first
#endif
  std::thread slow([&] {
    while (!done && in_pipe() < room / 2) // the writer is about to fill it, and waits then
      std::this_thread::yield();
    for (int k = 0; k < 20; ++k) {
      const int before = heard;
      pthread_kill(writer, SIGUSR1);
      while (!done && heard == before)
        std::this_thread::yield();
    }
    std::vector<char> part(1 << 16);
    for (ssize_t n = 1; n != 0 || (found.empty() && !done);) // nothing comes before the other end is open
      if (n = read(reader, part.data(), part.size()); n > 0)
        found.append(part.data(), static_cast<std::size_t>(n));
  });
  const std::string refused = test::refusal_of([&] { write_urdf(robot, pipe); });
  done = true;
  slow.join();
  close(reader);
  sigaction(SIGUSR1, &earlier, nullptr);
  CHECK(refused == "accepted");
  CHECK(heard == 20);
  CHECK(found == urdf_text(robot));
  std::filesystem::remove(pipe);
}

TEST_CASE(
    "urdf: a file below a file can't be written; through a link that leads nowhere, and in a very deep folder, files are written") {
  namespace fs = std::filesystem;
  const fs::path here = fs::current_path(),
                 folder = fs::temp_directory_path() / ("ksl_places_" + std::to_string(getpid()));
  const robot_description robot = read_urdf_text("<robot name='r'><link name='a'/></robot>", "r.urdf");
  const auto text = [](const char *path) {
    std::ifstream in(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  fs::create_directory(folder);
  fs::current_path(folder);
  std::ofstream("file") << "mine";
  CHECK(test::refusal_of([&] { write_urdf(robot, "file/robot.urdf"); }).find("the robot can't be written") !=
        std::string::npos);
  CHECK(text("file") == "mine");
  fs::create_symlink("new.urdf", "link.urdf");
  write_urdf(robot, "link.urdf");
  CHECK(text("new.urdf") == urdf_text(robot));
  CHECK(fs::is_symlink("link.urdf"));
  const std::string name(200, 'd');
  for (int depth = 0; depth < 25; ++depth) { // 5000 characters, of which PATH_MAX allows 4096
    REQUIRE(mkdir(name.c_str(), 0700) == 0);
    REQUIRE(chdir(name.c_str()) == 0);
  }
  std::ofstream("robot.urdf") << "the old one";
  write_urdf(robot, "robot.urdf");
  CHECK(text("robot.urdf") == urdf_text(robot));
  REQUIRE(unlink("robot.urdf") == 0);
  for (int depth = 0; depth < 25; ++depth) {
    REQUIRE(chdir("..") == 0);
    REQUIRE(rmdir(name.c_str()) == 0);
  }
  fs::current_path(here);
  fs::remove_all(folder);
}

TEST_CASE("urdf: what was changed after it was read is written as it is now") {
  const std::string thread =
      "<joint name=\"j\" type=\"screw\"><parent link=\"a\"/><child link=\"b\"/><origin rpy=\"0.1 0.2 0.3\"/><axis xyz=\"0 3 4\"/>"
      "<screw_thread_pitch value=\"0.005\"/></joint>";
  robot_description robot = read_urdf_text(
      robot_of("<mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>", thread),
      "r.urdf");
  check_round_trip(robot);
  joint_description &j = robot.joints[0];
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(0.001, 0.1);
  for (int k = 0; k < 200; ++k) {
    j.pitch = number(random); // not every number is read from some metres a revolution
    CHECK(*read_urdf_text(urdf_text(robot), "again.urdf").joints[0].pitch == doctest::Approx(*j.pitch).epsilon(3e-16));
  }
  j.placement.R = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  j.axis = {0.6, 0.8, 0};
  const joint_description again = read_urdf_text(urdf_text(robot), "again.urdf").joints[0];
  CHECK(same_bits(&again.placement, &j.placement, sizeof j.placement));
  CHECK((std::fabs(again.axis.x - 0.6) < 1e-15 && std::fabs(again.axis.y - 0.8) < 1e-15 && again.axis.z == 0));
  CHECK(urdf_text(robot).find("rpy") == std::string::npos);
}

TEST_CASE("urdf: any number of an inertia, and any angle of a placement, may be changed after it was read") {
  const auto read = [](const char *rpy) {
    return read_urdf_text(
        robot_of(
            "<origin xyz=\"0.1 0.2 0.3\" rpy=\"0.3 0.2 0.1\"/><mass value=\"2\"/><inertia ixx=\"1\" iyy=\"1.1\" izz=\"1.2\" ixy=\"0.1\" ixz=\"0.2\" iyz=\"0.3\"/>",
            "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/><origin rpy=\"" +
                std::string(rpy) + "\"/></joint>"),
        "r.urdf");
  };
  using inertia = spatial_inertia<double>;
  const auto numbers = [](inertia &I) {
    return std::array<double *, 10>{&I.m, &I.h.x, &I.h.y, &I.h.z, &I.Ixx, &I.Iyy, &I.Izz, &I.Ixy, &I.Iyz, &I.Izx};
  };
  for (std::size_t changed = 0; changed < 10; ++changed) {
    robot_description robot = read("0 0 0");
    *numbers(robot.links[1].inertia)[changed] += 0.01;
    robot_description again = read_urdf_text(urdf_text(robot), "again.urdf");
    for (std::size_t i = 0; i < 10; ++i)
      CHECK(std::fabs(*numbers(again.links[1].inertia)[i] - *numbers(robot.links[1].inertia)[i]) < 2e-15);
  }
  robot_description wheel = read("0 0 0"); // turns and weighs nothing
  wheel.links[1].inertia = {0, {0, 0, 0}, 1, 1.5, 2, 0.1, 0.2, 0.3};
  robot_description wheel_again = read_urdf_text(urdf_text(wheel), "again.urdf");
  for (std::size_t i = 0; i < 10; ++i)
    CHECK(*numbers(wheel_again.links[1].inertia)[i] == *numbers(wheel.links[1].inertia)[i]);
  wheel.gravity = {1, 2, 3};
  CHECK(urdf_text(wheel).find("gravity 1 2 3") != std::string::npos);
  const char *const turns[][2] = {{"0 0 0.5", "0 0 0.7"},   {"0 0 0.5", "0 0 -0.5"}, {"0 0.5 0", "0 -0.5 0"},
                                  {"0 0 0.5", "0.2 0 0.5"}, {"0.3 0 0", "0.6 0 0"},  {"0.3 0 0", "-0.3 0 0"}};
  for (const auto &[before, after] : turns) {
    robot_description robot = read(before);
    const mat3x3<double> R = robot.joints[0].placement.R = read(after).joints[0].placement.R;
    const mat3x3<double> again = read_urdf_text(urdf_text(robot), "again.urdf").joints[0].placement.R;
    for (const auto element :
         {&mat3x3<double>::m00, &mat3x3<double>::m10, &mat3x3<double>::m20, &mat3x3<double>::m01, &mat3x3<double>::m11,
          &mat3x3<double>::m21, &mat3x3<double>::m02, &mat3x3<double>::m12, &mat3x3<double>::m22})
      CHECK(std::fabs(again.*element - R.*element) < 1e-15);
  }
}

TEST_CASE("urdf: a quaternion of a joint alone asks for version 1.1; joints that follow others") {
  const std::string ends = "<parent link=\"a\"/><child link=\"b\"/>";
  const robot_description turned = read_urdf_text(
      "<robot name=\"r\" version=\"1.1\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"fixed\">" + ends +
          "<origin quat_xyzw=\"0 0 0.6 0.8\"/></joint></robot>",
      "r.urdf");
  CHECK(urdf_text(turned).find("version=\"1.1\"") != std::string::npos);
  check_round_trip(turned);
}
