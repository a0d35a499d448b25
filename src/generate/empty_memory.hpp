// Memory whose numbers are of no step until they are written: a result that depends on one that isn't is found out.
//
// All bits are 1: a recording is an int, and −1 is its place of no step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace ksl::generate {

class empty_memory {
public:
  explicit empty_memory(std::size_t bytes) : memory_(bytes + 64) { std::memset(memory_.data(), 0xff, memory_.size()); }
  /// Aligned to 64 bytes.
  std::byte *begin() {
    const auto misaligned = reinterpret_cast<std::uintptr_t>(memory_.data()) % 64;
    return memory_.data() + (64 - misaligned) % 64;
  }

private:
  std::vector<std::byte> memory_;
};

} // namespace ksl::generate
