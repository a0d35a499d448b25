// Times of robot files that somebody made to do harm, for each megabyte.  docs/trust.md promises at most 1 s.  The work that they cause
// is counted by test/load/hostile_test.cpp.
#include "load/hostile_texts.hpp"

#include "ksl/builder.hpp"
#include "load/robot_file.hpp"
#include "limits.hpp"

#include <algorithm>
#include <cstdio>

int main() {
  std::printf("%-40s %8s %14s   promised: at most 1 s/MB\n", "robot file, loaded or refused", "MB", "s/MB");
  for (const ksl::test::hostile_text &each : ksl::test::hostile_texts()) {
    const std::string text = each.of_size(each.large);
    const double megabytes = 1e-6 * static_cast<double>(text.size());
    double least = 1e9;
    for (int turn = 0; turn < 3; ++turn) {
      const double start = own_seconds();
      try {
        ksl::model_of(ksl::read_robot_text(text, "r.xml"), {}, {.masses_optional = true});
      } catch (const ksl::description_error &) { // refused
      }
      least = std::min(least, (own_seconds() - start) / megabytes);
    }
    std::printf("%-40s %8.2f %14.3f\n", each.title, megabytes, least);
  }
}
