// Files that somebody made to do harm, or that a program wrote by mistake: refused at once, with a short sentence.
#include "hostile_texts.hpp"
#include "refusal.hpp"
#ifdef KSL_COUNT_WORK
#include "work.hpp"
#endif

#include "../engine/allocation.hpp"

#include "load/robot_file.hpp"
#include "text/limits.hpp"
#include "text/words.hpp"

#include "ksl/builder.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <vector>

using namespace ksl;
using ksl::test::a_joint, ksl::test::a_link, ksl::test::many, ksl::test::number, ksl::test::repeated, ksl::test::robot,
    ksl::test::sdf;
using ksl::test::check_message;
using ksl::test::refusal;
using ksl::test::refusal_of;
namespace limits = ksl::text::limits;

namespace {

long work() {
#ifdef KSL_COUNT_WORK
  return test::blocks();
#else
  return 0;
#endif
}

std::string refusal_of_text(const std::string &text) {
  return refusal_of([&] { model_of(read_robot_text(text, "r.xml"), {}, {.masses_optional = true}); });
}

std::string refusal_of_file(const std::string &path) {
  return refusal_of([&] { bytes_of_robot_file(path); });
}

/// What a text costs that is loaded or refused: basic blocks of the library, where they are counted, and bytes that are allocated.
struct cost { double blocks, bytes; };

cost cost_of(const std::string &text) {
  const long blocks = work(), bytes = allocated_bytes;
  const std::string message = refusal_of_text(text);
  const cost found{static_cast<double>(work() - blocks), static_cast<double>(allocated_bytes - bytes)};
  CHECK(message.size() < 5000);
  return found;
}

/// The part of the cost of size 4 n that grows with the square, from the costs of n, 2 n and 4 n: for a + b n + c n² it is
/// 16 c n² / (cost of 4 n).  Of n log n it is a few hundredths.
double share_of_square(double one, double two, double four) {
  return four > 0 ? 16.0 / 6.0 * (four - 3 * two + 2 * one) / four : 0;
}

} // namespace

TEST_CASE("hostile: the work is in proportion to the size") {
  cost_of(robot(a_link("a"))); // what is made once
  for (const test::hostile_text &each : test::hostile_texts()) {
    const std::string title = each.title;
    CAPTURE(title);
    cost costs[3];
    for (std::size_t k = 0; k < 3; ++k)
      costs[k] = cost_of(each.of_size(each.small << k));
    const auto [one, two, four] = costs;
    const double blocks = share_of_square(one.blocks, two.blocks, four.blocks),
                 bytes = share_of_square(one.bytes, two.bytes, four.bytes);
    if (std::getenv("KSL_COSTS"))
      std::printf("%-40s %12.0f blocks, %6.3f of them with the square; %12.0f bytes, %6.3f\n", title.c_str(),
                  four.blocks, blocks, four.bytes, bytes);
    CHECK(blocks < 0.11); // of maps it is up to 0.08
    CHECK(bytes < 0.3);   // vectors double: that is up to a quarter by itself
  }
}

TEST_CASE("hostile: limits are said") {
  const std::string long_name(limits::name_bytes + 1, 'n'), longest_name(limits::name_bytes, 'n');
  const auto attributes = [](std::size_t n) {
    return robot("<link name=\"a\"" + many(n - 1, [](std::size_t i) { return " x" + number(i) + "=\"\""; }) + "/>");
  };
  const auto deep = [](std::size_t n) {
    return robot(a_link("a") + "\n" + repeated(n - 1, "<z>") + repeated(n - 1, "</z>"));
  };
  const auto value = [](std::size_t n) {
    return robot(a_link("a") + "\n<material name=\"m\" x=\"" + std::string(n, 'v') + "\"/>");
  };
  const auto text = [](std::size_t n) {
    return robot(a_link("a") + "\n<material>" + std::string(n, 'v') + "</material>");
  };
  check_message(refusal(attributes(limits::attributes)), {"accepted"});
  check_message(refusal(attributes(limits::attributes + 1)),
                {"r.urdf:2: link a: <link> has 1001 attributes, more than 1000"});
  check_message(refusal(deep(limits::depth)), {"accepted"});
  check_message(refusal(deep(limits::depth + 1)),
                {"r.urdf:3: <z> is in 100 other elements; at most 100 may be in each other"});
  check_message(refusal(value(limits::value_bytes)), {"accepted"});
  check_message(refusal(value(limits::value_bytes + 1)),
                {"r.urdf:3: ", "x of <material> has 1048577 bytes, more than 1 MiB"});
  check_message(refusal(text(limits::value_bytes)), {"accepted"});
  check_message(refusal(text(limits::value_bytes + 1)),
                {"r.urdf:3: ", "the text in <material> has 1048577 bytes, more than 1 MiB"});
  check_message(refusal(robot(a_link(longest_name))), {"accepted"});
  check_message(refusal(robot(a_link(long_name))),
                {"r.urdf:2: ", "name of <link> has 1001 bytes, more than 1000", "\"nnnn"});
  check_message(refusal(robot(a_link("a") + "<" + long_name + "/>")),
                {"r.urdf:2: ", "the name of an element has 1001 bytes, more than 1000"});
  check_message(refusal(robot(a_link("a") + "<z " + long_name + "=\"\"/>")),
                {"r.urdf:2: ", "the name of an attribute", "1001 bytes, more than 1000"});
  check_message(refusal_of_text(sdf("<model name=\"" + longest_name + "\"><link name=\"a\"/></model>")),
                {"r.xml:2: ", "bytes, more than 1000"});
  check_message(refusal(robot(a_link("a") + repeated(limits::elements, "<z/>"))),
                {"r.urdf: the file has more than 1000000 elements"});
  check_message(refusal(std::string(limits::file_bytes + 1, ' ')),
                {"r.urdf: the file has 67108865 bytes, more than 64 MiB"});
  const std::string links = many(limits::links, [](std::size_t i) { return a_link("l" + number(i)) + "\n"; });
  check_message(refusal(robot(links + a_link("one_more"))), {"r.urdf:100002: the file has more than 100000 links"});
  check_message(refusal(robot(a_link("a") + "\n" + repeated(limits::joints + 1, a_joint("j", "a", "a")))),
                {"r.urdf:3: the file has more than 100000 joints"});
  check_message(refusal_of_text(sdf(many(limits::links + 1, [](std::size_t i) { return a_link("l" + number(i)); }))),
                {"r.xml:2: ", "more than 100000 links"});
}

TEST_CASE("hostile: a model has at most 40,000 coordinates, since an int counts the elements of its mass matrix") {
  const auto floating = [](std::size_t n) {
    return robot(a_link("a") + many(n, [](std::size_t i) {
                   return a_link("l" + number(i)) + a_joint("j" + number(i), "a", "l" + number(i), "floating");
                 }));
  };
  check_message(refusal_of_text(floating(6666)), {"accepted"});
  check_message(refusal_of_text(floating(6667)), {"r.xml: the robot has 40002 coordinates, more than 40000"});
}

TEST_CASE("hostile: numbers whose products overflow make no model") {
  const auto heavy = [](const std::string &name) {
    return "<link name=\"" + name +
           "\"><inertial><mass value=\"1e308\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" "
           "izz=\"1\"/></inertial></link>";
  };
  check_message(refusal_of_text(robot(heavy("a") + heavy("b") + a_joint("j", "a", "b", "revolute"))),
                {"r.xml: link a: ", "not finite", "correct masses"});
  const std::string far = "<origin xyz=\"1e308 0 0\"/>";
  check_message(refusal_of_text(robot(a_link("a") + a_link("b") + heavy("c") + a_joint("j", "a", "b", "fixed", far) +
                                      a_joint("k", "b", "c", "revolute", far))),
                {"r.xml: link c: ", "not finite"});
}

TEST_CASE("hostile: only regular files are read") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("ksl_hostile_" + std::to_string(getpid()));
  fs::create_directories(folder);
  const std::string pipe = folder / "pipe.urdf", socket_path = folder / "s.urdf", sparse = folder / "sparse.urdf",
                    whole = folder / "whole.urdf";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  socket_path.copy(address.sun_path, sizeof address.sun_path - 1);
  REQUIRE(bind(socket, reinterpret_cast<const sockaddr *>(&address), sizeof address) == 0);
  std::fclose(std::fopen(sparse.c_str(), "wb"));
  fs::resize_file(sparse, std::uintmax_t{8} << 30);

  check_message(refusal_of_file(pipe), {"pipe.urdf: this is a pipe, not a regular file", "ksl.load_string"});
  check_message(refusal_of_file(socket_path), {"s.urdf: this is a socket, not a regular file"});
  check_message(refusal_of_file("/dev/zero"), {"/dev/zero: this is a device, not a regular file"});
  check_message(refusal_of_file(folder), {": this is a folder, not a file"});
  check_message(refusal_of_file(sparse), {"sparse.urdf: the file has 8589934592 bytes, more than 64 MiB"});
  check_message(refusal_of_file(std::string("whole.urdf\0.txt", 15)),
                {"whole.urdf\\x00.txt: the path holds a zero byte"});
  check_message(refusal_of_file(std::string(1'000'000, 'p')), {"ppp", "..."});
  CHECK(refusal_of_file(std::string(1'000'000, 'p')).size() < 2000);
  {
    std::FILE *const file = std::fopen(whole.c_str(), "wb");
    std::fputs("<robot/>", file);
    std::fclose(file);
    fs::create_symlink(whole, folder / "link.urdf");
  }
  CHECK(bytes_of_robot_file(folder / "link.urdf") == "<robot/>");
  rlimit usual{};
  REQUIRE(getrlimit(RLIMIT_NOFILE, &usual) == 0);
  const rlimit none = {0, usual.rlim_max};
  REQUIRE(setrlimit(RLIMIT_NOFILE, &none) == 0);
  const std::string without_descriptors = refusal_of_file(whole);
  REQUIRE(setrlimit(RLIMIT_NOFILE, &usual) == 0);
  check_message(without_descriptors,
                {"whole.urdf: the file can't be read (", "files", "check its path and its permissions"});
  close(socket);
  fs::remove_all(folder);
}

TEST_CASE("hostile: what XML forbids is no robot file") {
  const auto named = [](const std::string &name) { return robot(a_link("a") + "\n" + a_link(name)); };
  check_message(refusal("<?xml version=\"1.0\"?>\n<!DOCTYPE robot [<!ENTITY a \"b\">]>\n" + robot(a_link("&a;"))),
                {"r.urdf:2: a DOCTYPE", "remove it"});
  check_message(refusal(named("&ohm;")), {"r.urdf:3: ", "\"&ohm;\" is unknown", "&amp;"});
  check_message(refusal(named("R&D")), {"r.urdf:3: ", "an & that begins no reference", "&amp;"});
  check_message(refusal(named("&#;")), {"r.urdf:3: ", "\"&#;\""});
  for (const char *bad : {"&#0;", "&#x0;", "&#27;", "&#x1b;", "&#xD800;", "&#xfffe;", "&#xFFFF;", "&#1114112;",
                          "&#4294967296;", "&#99999999999999999999;"}) {
    CAPTURE(bad);
    check_message(refusal(named(std::string("a") + bad + "b")), {"r.urdf:3: ", bad, "no character that XML allows"});
  }
  check_message(refusal(named("a\x1b[31mb")), {"r.urdf:3: a control character, \\x1b, which XML forbids"});
  check_message(refusal(named("a\xef\xbf\xbf")), {"r.urdf:3: the character U+FFFF, which XML forbids"});
  check_message(refusal(named("a\xef\xbf\xbe")), {"r.urdf:3: the character U+FFFE, which XML forbids"});
  check_message(refusal(named("a\x01") + "\x02&ohm;"),
                {"r.urdf:3: a control character, \\x01"}); // the first fault is named
  for (const char *unknown : {"&a.b;", "&a-b;", "&a_b;", "&a:b;", "&\xc3\xa9;", "&A9z;"})
    check_message(refusal(named(unknown)), {"r.urdf:3: ", unknown, "is unknown"});
  for (const char *bad : {"&#x1G2;", "&#x;", "&#1a;", "&#xFFFE;"})
    check_message(refusal(named(bad)), {"r.urdf:3: ", bad, "no character that XML allows"});
  for (const std::string &endless : {"&" + std::string(80, 'e') + ";", std::string("&e")})
    check_message(refusal(robot(a_link("a")) + "\n" + endless), {"r.urdf:", "an & that begins no reference"});
  CHECK(read_urdf_text("<robot name=\"a&#9;b&#10;c&#13;d&#xe000;\"><link name=\"a\"/></robot>", "r.urdf").name ==
        "a\tb\nc\rd\xee\x80\x80");
  const robot_description read =
      read_urdf_text("<!-- & &x; <!DOCTYPE --><?p & ?><robot name=\"&lt;&gt;&amp;&quot;&apos;&#65;&#x1F916;'>\">"
                     "<link name='a\"'/><![CDATA[ & &x; ]]></robot><!-- & -->",
                     "r.urdf");
  CHECK(read.name == "<>&\"'A\xf0\x9f\xa4\x96'>");
  CHECK(read.links[0].name == "a\"");
  check_message(refusal("<robot>\n<material x=\"1\" y=\"\" x=\"2\"/><link name=\"a\"/></robot>"),
                {"r.urdf:2: ", "<material> gives x twice"});
  check_message(refusal("<robot name=\"r\"><link name=\"a\"/></robot>\n<!-- a remark --><?p ?>\n<robot/>"),
                {"r.urdf:3: broken XML, a second root element <robot>"});
}

TEST_CASE("hostile: messages are short, and show control characters instead of obeying them") {
  const std::string megabyte(1'000'000, 'x'), turned = "a\xe2\x80\xae\xc2\x9b"
                                                       "b";
  const auto size_of = [](const std::string &message) { return message.size(); };
  CHECK(size_of(refusal("<" + megabyte + "/>")) < 1000);
  CHECK(size_of(refusal("<robot><link name=\"a\"/></" + megabyte + ">")) < 1000);
  CHECK(size_of(refusal(robot("<link name=\"a\" " + megabyte + "=\"\" " + megabyte + "=\"\"/>"))) < 1000);
  CHECK(size_of(refusal(robot(a_link("a") + a_joint("j", megabyte, "b")))) < 1000);
  CHECK(size_of(refusal(robot(a_link("a") + a_link("b") + a_joint("j", "a", "b", megabyte)))) < 1000);
  CHECK(size_of(refusal("<robot version=\"" + megabyte + "\"/>")) < 1000);
  const std::string long_name(limits::name_bytes, 'n');
  CHECK(size_of(refusal(robot(many(9, [&](std::size_t i) { return a_link(number(i) + long_name.substr(1)); })))) <
        2000);
  check_message(refusal(robot(a_link(turned) + a_link(turned))), {"\"a\\u202e\\u009bb\""});
  check_message(refusal(robot(a_link(turned) + a_joint("j", turned, turned))), {"link a\\u202e\\u009bb is both"});
  for (const std::string &line : read_urdf_text(robot("<link name=\"" + turned + "\"><z/></link>"), "r.urdf").unused)
    CHECK(line == "unknown element <z> in link a\\u202e\\u009bb, line 2");
  check_message(refusal_of_file("no\xffsuch\x1b"), {"no\\xffsuch\\x1b: there is no such file"});
}
