// Memory of its own for what is otherwise laid out in that of a workspace.
#pragma once

#include "ksl/engine/lanes/workspace.hpp"

#include <cstddef>
#include <memory>
#include <vector>

namespace ksl::loops {

class own_memory {
public:
  /// lay(memory) lays out all that is wanted; it is called twice.
  template <class Lay> explicit own_memory(Lay lay) {
    arena measure;
    lay(measure);
    memory_.resize(measure.used() + 64);
    void *begin = memory_.data();
    std::size_t space = memory_.size();
    arena memory(std::align(64, measure.used(), begin, space));
    lay(memory);
  }

private:
  std::vector<std::byte> memory_;
};

} // namespace ksl::loops
