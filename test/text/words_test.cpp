#include "text/characters.hpp"
#include "text/words.hpp"

#include <doctest/doctest.h>

#include <clocale>
#include <cmath>
#include <locale>

namespace {

using namespace ksl::text;

/// A locale whose decimal sign is a comma, whether or not the system has one.
struct comma : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

} // namespace

TEST_CASE("numbers are read whole, with blanks around and a leading plus") {
  CHECK(number_in("1.5") == 1.5);
  CHECK(number_in(" \t-2e-3\r\n") == -2e-3);
  CHECK(number_in("+.5") == 0.5);
  CHECK(number_in("7.") == 7);
  CHECK(number_in("0.1") == 0.1);
  CHECK(number_in("5e-324") == 5e-324);
  for (const char *bad : {"",    " ",   "+",    "-",        "+-1",   "++1",  "1,5",  "1 2",   "0x10", "1e",   "nan",
                          "NaN", "inf", "-inf", "infinity", "1e400", "1.5m", "${x}", "1.2.3", "--1",  "1e5.5"}) {
    CAPTURE(bad);
    CHECK(!number_in(bad));
  }
}

TEST_CASE("a number below the least double is the nearest one, zero; one above the largest has none") {
  for (const char *tiny : {"1e-400", "2e-324", "0.001e-330", "1e-99999999999999999999", "+1e-400", "10e-400"}) {
    CAPTURE(tiny);
    CHECK(number_in(tiny) == 0.0);
  }
  CHECK(number_in("0." + std::string(400, '0') + "1") == 0.0);
  CHECK(number_in("0." + std::string(400, '0') + "1e401") == 1.0);
  CHECK(number_in("1" + std::string(400, '0') + "e-400") == 1.0);
  REQUIRE(number_in("-1e-400").has_value());
  CHECK(std::signbit(*number_in("-1e-400")));
  for (const char *huge : {"1e400", "-1e400", "1e99999999999999999999", "1000e306"}) {
    CAPTURE(huge);
    CHECK(!number_in(huge));
    CHECK(number_fault(huge) == "which is beyond the largest double, 1.8e308");
  }
  CHECK(!number_in("1" + std::string(400, '0')));
  CHECK(number_fault("nan") == "not a finite number");
}

TEST_CASE("numbers don't depend on the locale") {
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new comma));
  const std::string c_before = std::setlocale(LC_ALL, nullptr);
  for (const char *name : {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE"})
    if (std::setlocale(LC_ALL, name))
      break;
  CHECK(number_in("1.5") == 1.5);
  CHECK(!number_in("1,5"));
  CHECK(shown(1234.5) == "1234.5");
  std::setlocale(LC_ALL, c_before.c_str());
  std::locale::global(before);
}

TEST_CASE("numbers are shown with six digits") {
  CHECK(shown(0.086) == "0.086");
  CHECK(shown(-1) == "-1");
  CHECK(shown(1.0 / 3) == "0.333333");
  CHECK(shown(1e-12) == "1e-12");
}

TEST_CASE("the nearest name is within a slip or two") {
  CHECK(nearest("base_lnk", {"tool", "base_link", "base"}) == "base_link");
  CHECK(nearest("revolut", {"fixed", "revolute", "continuous"}) == "revolute");
  CHECK(nearest("Base", {"base"}) == "base");
  CHECK(nearest("elephant", {"tool", "base_link"}).empty());
  CHECK(nearest("a", {"b"}) == "b");
  CHECK(nearest("x", {}).empty());
  CHECK(suggestion("tol", {"tool"}, "go on") == "; did you mean \"tool\"?");
  CHECK(suggestion("elephant", {"tool"}, "go on") == "; go on");
}

TEST_CASE("words, lists and quotes") {
  CHECK(split("  1\t2\n3 ").size() == 3);
  CHECK(split(" ").empty());
  CHECK(listed({"a", "b", "c"}) == "a, b, c");
  CHECK(listed({"a", "b", "c", "d"}, 2) == "a, b and 2 more");
  CHECK(listed({"a", "b", "c"}, 2) == "a, b, c");
  CHECK(listed({std::string(200, 'x'), "b"}) == std::string(100, 'x') + "..., b");
  CHECK(printable("a\tb\x1b[m\x7f\xc2\x85\xe2\x80\xae\xe2\x81\xa6\xff\xc3") ==
        "a b\\x1b[m\\x7f\\u0085\\u202e\\u2066\\xff\\xc3");
  CHECK(printable("\xc3\xa9 \xf0\x9f\xa4\x96 \xe2\x82\xac") == "\xc3\xa9 \xf0\x9f\xa4\x96 \xe2\x82\xac");
  CHECK(
      printable("\xd8\x9c\xe2\x80\x8e\xe2\x80\x8f\xe2\x80\xa8\xe2\x80\xaf\xe2\x81\xa5\xe2\x81\xa9\xe2\x81\xaa\r\n") ==
      "\\u061c\\u200e\\u200f\\u2028\xe2\x80\xaf\xe2\x81\xa5\\u2069\xe2\x81\xaa  "); // marks of direction, and their neighbours
  CHECK(shortened(std::string(9, '\x80'), 4) == "...");                             // no character begins there
  CHECK(shortened_in_middle(std::string(9, '\x80'), 4) == "...");
  CHECK(shortened_in_middle("abcdefgh", 8) == "abcdefgh");
  CHECK(shortened_in_middle("abcdefghi", 8) == "abcd...fghi");
  CHECK(shortened_in_middle("abc\xc3\xa9"
                            "fgh\xc3\xa9"
                            "jkl",
                            8) == "abc...jkl"); // characters of two bytes stay whole
  CHECK(quoted("a\nb") == "\"a b\"");
  CHECK(quoted(std::string(100, 'x')) == '"' + std::string(60, 'x') + "...\"");
  // é is two bytes, of which the second would be the 61st
  CHECK(quoted(std::string(59, 'x') + "\xc3\xa9zz") == '"' + std::string(59, 'x') + "...\"");
}
