// Robot files that somebody made to do harm, of any size: tests count what they cost, and bench/growth.cpp times it.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace ksl::test {

inline std::string many(std::size_t n, const std::function<std::string(std::size_t)> &each) {
  std::string text;
  for (std::size_t i = 0; i < n; ++i)
    text += each(i);
  return text;
}

inline std::string repeated(std::size_t n, const std::string &each) {
  return many(n, [&](std::size_t) { return each; });
}

inline std::string robot(const std::string &inside) { return "<robot name=\"r\">\n" + inside + "</robot>"; }
inline std::string sdf(const std::string &model) {
  return "<sdf version=\"1.10\">\n<model name=\"m\">" + model + "</model></sdf>";
}
inline std::string a_link(const std::string &name) { return "<link name=\"" + name + "\"/>"; }
inline std::string a_joint(const std::string &name, const std::string &parent, const std::string &child,
                           const std::string &type = "fixed", const std::string &inside = "") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + inside + "</joint>";
}
inline std::string number(std::size_t i) { return std::to_string(i); }

struct hostile_text {
  const char *title;
  std::size_t small,
      large; ///< work is counted for small, 2 small and 4 small, beyond what limits change; time is measured for large
  std::function<std::string(std::size_t)> of_size;
};

inline std::vector<hostile_text> hostile_texts() {
  using std::size_t, std::string;
  const auto two_links = [](const string &xyz) {
    return robot(a_link("a") + a_link("b") + a_joint("j", "a", "b", "fixed", "<origin xyz=\"" + xyz + "\"/>"));
  };
  const auto chain = [](size_t links, const std::function<string(size_t)> &inside) {
    const string with_mass =
        "<inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial>";
    return robot("<link name=\"l0\"/>" + many(links, [&](size_t i) {
                   return "<link name=\"l" + number(i + 1) + "\">" + with_mass + "</link>" +
                          a_joint("j" + number(i), "l" + number(i), "l" + number(i + 1), "revolute", inside(i));
                 }));
  };
  const auto each_on = [](size_t i) {
    return a_link("l" + number(i)) + a_joint("j" + number(i), "a", "l" + number(i));
  };
  const auto attributes = [](size_t n) { return many(n, [](size_t i) { return " x" + number(i) + "=\"\""; }); };
  const auto elements = [](size_t n) { return many(n, [](size_t i) { return "<e" + number(i) + "/>"; }); };
  return {
      {"attributes of one element", 1100, 40'000,
       [=](size_t n) { return robot("<link name=\"a\"" + attributes(n) + "/>"); }},
      {"attributes of many elements", 50, 400,
       [=](size_t n) { return robot(a_link("a") + repeated(n, "<z" + attributes(500) + "/>")); }},
      {"links of one name", 500, 40'000, [](size_t n) { return robot(repeated(n, a_link("a"))); }},
      {"depth", 500, 40'000, [](size_t n) { return robot(a_link("a") + repeated(n, "<a>") + repeated(n, "</a>")); }},
      {"models in models", 500, 40'000,
       [](size_t n) {
         return sdf(repeated(n, "<model name=\"m\">") + "<link name=\"a\"/>" + repeated(n, "</model>"));
       }},
      {"numbers in one attribute", 500, 400'000, [=](size_t n) { return two_links(repeated(n, "0 ")); }},
      {"digits of one number", 500, 900'000, [=](size_t n) { return two_links("0." + string(n, '1')); }},
      {"materials", 500, 40'000, [](size_t n) { return robot(a_link("a") + repeated(n, "<material name=\"m\"/>")); }},
      {"unknown elements", 500, 40'000, [=](size_t n) { return robot(a_link("a") + elements(n)); }},
      {"unknown elements in a link", 500, 40'000,
       [=](size_t n) { return robot("<link name=\"a\">" + elements(n) + "</link>"); }},
      {"texts", 500, 40'000, [](size_t n) { return robot(a_link("a") + repeated(n, "<material/>x")); }},
      {"joints on one link", 500, 40'000, [=](size_t n) { return robot(a_link("a") + many(n, each_on)); }},
      {"a chain", 500, 10'000, [=](size_t n) { return chain(n, [](size_t) { return ""; }); }},
      {"a chain of followers", 1000, 10'000,
       [=](size_t n) {
         return chain(n, [](size_t i) { return i ? "<mimic joint=\"j" + number(i - 1) + "\"/>" : ""; });
       }},
      {"followers of one joint", 1000, 10'000,
       [=](size_t n) {
         return chain(n, [=](size_t i) { return i + 1 < n ? "<mimic joint=\"j" + number(n - 1) + "\"/>" : ""; });
       }},
      {"transmissions", 500, 10'000,
       [](size_t n) {
         return robot(a_link("a") + many(n, [](size_t i) {
                        return a_link("l" + number(i)) + a_joint("j" + number(i), "a", "l" + number(i), "continuous") +
                               "<transmission><joint name=\"j" + number(i) +
                               "\"/><actuator><drake:gear_ratio value=\"2\"/></actuator></transmission>";
                      }));
       }},
      {"a name like 2,000 others", 50, 2000,
       [](size_t n) {
         return robot(many(n, [](size_t i) { return a_link(string(900, 'x') + number(10'000 + i)); }) +
                      a_joint("j", string(905, 'x'), "b"));
       }},
      {"a tag that does not end", 500, 1'000'000, [](size_t n) { return "<robot name='" + string(n, 'x'); }},
      {"SDF: links that float", 500, 10'000,
       [](size_t n) { return sdf(many(n, [](size_t i) { return a_link("l" + number(i)); })); }},
      {"SDF: frames on frames", 500, 10'000,
       [](size_t n) {
         return sdf(a_link("f") + many(n, [](size_t i) {
                      return "<frame name=\"f" + number(i) + "\" attached_to=\"f" + (i ? number(i - 1) : "") + "\"/>";
                    }));
       }},
      {"SDF: poses relative to each other", 500, 10'000,
       [](size_t n) {
         return sdf("<link name=\"l\"/>" + many(n, [](size_t i) {
                      return "<link name=\"l" + number(i) + "\"><pose relative_to=\"l" + (i ? number(i - 1) : "") +
                             "\">0 0 1 0 0 0</pose></link>";
                    }));
       }},
      {"SDF: models that are placed", 500, 10'000,
       [](size_t n) {
         return sdf("<link name=\"l\"/>" + many(n, [](size_t i) {
                      return "<model name=\"m" + number(i) + "\" placement_frame=\"l\"><link name=\"l\"/></model>";
                    }));
       }},
  };
}

} // namespace ksl::test
