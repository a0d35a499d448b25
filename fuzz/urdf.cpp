// Any text, read as a robot file: URDF, unless its root says otherwise.
#include "robot_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *bytes, std::size_t size) {
  ksl::fuzz::loaded(bytes, size);
  return 0;
}
