// Encodings of files: UTF-16 of either byte order, UTF-8 with every kind of fault, Latin-1; and files that can't be read.
#include "refusal.hpp"

#include "load/robot_file.hpp"

#include <filesystem>
#include <string>

using namespace ksl;
using ksl::test::check_message;

namespace {

/// A robot with one link of this name.
std::string named(const std::string &name) { return "<robot name=\"r\">\n<link name=\"" + name + "\"/>\n</robot>"; }
std::u16string named(const std::u16string &name) {
  return u"<robot name=\"r\">\n<link name=\"" + name + u"\"/>\n</robot>";
}

enum class byte_order { little, big };

std::string bytes_of(const std::u16string &text, byte_order order) {
  std::string bytes;
  for (const char16_t unit : text) {
    const char high = static_cast<char>(unit >> 8), low = static_cast<char>(unit & 0xff);
    bytes += order == byte_order::little ? low : high;
    bytes += order == byte_order::little ? high : low;
  }
  return bytes;
}

/// The name of the only link, and whether the encoding was guessed.
struct found {
  std::string name;
  bool guessed;
  bool operator==(const found &) const = default;
};

found read(const std::string &bytes) {
  const robot_description robot = read_urdf_text(bytes, "r.urdf");
  REQUIRE(robot.links.size() == 1);
  CHECK(robot.links[0].at.line == 2);
  if (!robot.warnings.empty())
    CHECK(robot.warnings[0].find("the text is not UTF-8, first in line") == 0);
  return {robot.links[0].name, !robot.warnings.empty()};
}

/// The same bytes, each taken for a character of Latin-1.
std::string from_latin1(const std::string &bytes) {
  std::string text;
  for (const char c : bytes)
    if (const auto u = static_cast<unsigned char>(c); u < 0x80)
      text += c;
    else
      text += static_cast<char>(0xc0 | u >> 6), text += static_cast<char>(0x80 | (u & 0x3f));
  return text;
}

} // namespace

TEST_CASE("UTF-16 of either byte order, with characters of one to four bytes in UTF-8") {
  const struct {
    std::u16string utf16;
    std::string utf8;
  } cases[] = {
      {u"arm", "arm"},
      {u"caf\u00e9", "caf\xc3\xa9"},
      {u"5\u20ac", "5\xe2\x82\xac"},
      {u"\ufffd", "\xef\xbf\xbd"},
      {u"robot \U0001f916", "robot \xf0\x9f\xa4\x96"},
      {u"\U00010000\U0010ffff", "\xf0\x90\x80\x80\xf4\x8f\xbf\xbf"},
      // half a pair is no character: high without low, low alone, two high ones, high before a letter
      {std::u16string(1, char16_t(0xd83e)) + u"x", "\xef\xbf\xbdx"},
      {std::u16string(1, char16_t(0xdd16)) + u"x", "\xef\xbf\xbdx"},
      {std::u16string(2, char16_t(0xd83e)), "\xef\xbf\xbd\xef\xbf\xbd"},
      {std::u16string(1, char16_t(0xd83e)) + u"\ue000", "\xef\xbf\xbd\xee\x80\x80"},
  };
  for (const auto &each : cases)
    for (const byte_order order : {byte_order::little, byte_order::big}) {
      CAPTURE(each.utf8);
      const std::string bytes = bytes_of(named(each.utf16), order);
      CHECK(read(bytes) == found{each.utf8, false}); // recognised by its first character
      CHECK(read(bytes_of(u"\ufeff", order) + bytes) == found{each.utf8, false});
    }
}

TEST_CASE("UTF-16 that ends within a character") {
  const std::string text = bytes_of(named(u"arm"), byte_order::little);
  check_message(test::refusal(text + '<'),
                {"r.urdf:3: broken XML, text outside of <robot>"}); // a byte too many, behind the robot
  const std::u16string open = u"<robot name=\"r\">\n<link name=\"a";
  check_message(test::refusal(bytes_of(open, byte_order::big) + '\0'), {"r.urdf:2: broken XML"});
  check_message(
      test::refusal(bytes_of(open, byte_order::big) + bytes_of(std::u16string(1, char16_t(0xd83e)), byte_order::big)),
      {"r.urdf:2: broken XML"});
}

TEST_CASE("UTF-8 is taken as it is, and what isn't UTF-8 as Latin-1, with a warning") {
  for (const char *right :
       {"\xc2\x80", "\xdf\xbf", "\xe0\xa0\x80", "\xec\x80\x80", "\xed\x9f\xbf", "\xee\x80\x80", "\xef\xbf\xbd",
        "\xf0\x90\x80\x80", "\xf1\x80\x80\x80", "\xf3\xbf\xbf\xbf", "\xf4\x8f\xbf\xbf"}) {
    CAPTURE(from_latin1(right));
    CHECK(read(named(std::string(right))) == found{right, false});
  }
  // a continuation alone; overlong forms of two, three and four bytes; a surrogate; beyond U+10FFFF; bytes that no character has;
  // a second, third or fourth byte that is no continuation
  for (const char *wrong :
       {"\xa0", "\xbf", "\xc0\xa0", "\xc1\xbf", "\xe0\x9f\xbf", "\xe0\xa0y", "\xf0\x8f\xbf\xbf", "\xed\xa0\xa0",
        "\xed\xbf\xbf", "\xf4\x90\xa0\xa0", "\xf5\xa0\xa0\xa0", "\xff", "\xc3y", "\xe2y\xac", "\xf0\x9f\xa4y"}) {
    CAPTURE(from_latin1(wrong));
    CHECK(read(named(std::string(wrong))) == found{from_latin1(wrong), true});
  }
  // the end of the file cuts a character, behind the robot
  check_message(test::refusal(named(std::string("arm")) + "\xe2"), {"r.urdf:3: broken XML, text outside of <robot>"});
}

TEST_CASE("line ends: a lone carriage return ends a line, also the last one") {
  const robot_description robot =
      read_urdf_text("<robot name=\"r\">\r<link name=\"a\"/>\r\n<link name=\"b\"/><joint name=\"j\" type=\"fixed\">"
                     "<parent link=\"a\"/><child link=\"b\"/></joint></robot>\r",
                     "r.urdf");
  CHECK((robot.links[0].at.line == 2 && robot.links[1].at.line == 3));
}

TEST_CASE("files that the system can't read are refused with its reason") {
  const auto refusal = [](const std::string &path) { return test::refusal_of([&] { read_urdf(path); }); };
  check_message(refusal(std::string(10000, 'x')), {"the file can't be read", "permissions"});
#if defined(__linux__)
  check_message(refusal("/proc/self/mem"),
                {"/proc/self/mem: the file can't be read", "permissions"}); // it opens, and no byte can be read
#endif
}

TEST_CASE("an SDF file in Latin-1 is read with a warning, too") {
  const robot_description robot =
      read_robot_text("<sdf version=\"1.10\"><model name=\"m\"><link name=\"caf\xe9\"/></model></sdf>", "r.sdf", {});
  CHECK(robot.links.back().name == "caf\xc3\xa9");
  CHECK(robot.warnings[0].find("read as Latin-1") != std::string::npos);
}
