// The message with which a text or a robot is refused, and what it must say.
#pragma once

#include "description/structure/check.hpp"
#include "load/urdf.hpp"

#include <doctest/doctest.h>

#include <initializer_list>
#include <string>
#include <vector>

namespace ksl::test {

/// The message of the description_error that `call` throws; "accepted" when it throws none.
template <class Call> std::string refusal_of(Call call) {
  try {
    call();
  } catch (const description_error &error) {
    return error.what();
  }
  return "accepted";
}

inline std::string refusal(const std::string &text, const read_options &options = {}) {
  return refusal_of([&] { read_urdf_text(text, "r.urdf", options); });
}

/// Every part stands in the message, which is one line and one sentence.
inline void check_message(const std::string &message, std::initializer_list<const char *> parts) {
  CAPTURE(message);
  for (const char *part : parts) {
    CAPTURE(part);
    CHECK(message.find(part) != std::string::npos);
  }
  CHECK(message.find('\n') == std::string::npos);
  CHECK(message.find(". ") == std::string::npos);
}

struct wrong_text {
  const char *title;
  std::string text;
  std::initializer_list<const char *> says;
};

/// Each text is refused so; `refused` gives the message.
template <class Refused> void check_all(const std::vector<wrong_text> &cases, Refused refused) {
  for (const wrong_text &each : cases) {
    CAPTURE(each.title);
    check_message(refused(each.text), each.says);
  }
}

} // namespace ksl::test
