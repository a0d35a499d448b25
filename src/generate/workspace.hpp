// The workspace of an algorithm over recordings.
#pragma once

#include "generate/recording.hpp"
#include "ksl/engine/lanes/workspace.hpp"

#include <cstddef>
#include <cstring>
#include <vector>

namespace ksl::generate {

/// Its numbers are of no step until they are written: a result that depends on one that isn't is found out.
template <class Workspace> class empty_workspace {
public:
  explicit empty_workspace(const model_view<recording> &model) : memory_(workspace_bytes<Workspace>(model) + 64) {
    std::memset(memory_.data(), 0xff, memory_.size());
    const auto misaligned = reinterpret_cast<std::uintptr_t>(memory_.data()) % 64;
    arena pieces(memory_.data() + (64 - misaligned) % 64);
    workspace_.lay_out(pieces, model);
  }
  const Workspace &operator*() const { return workspace_; }

private:
  std::vector<std::byte> memory_;
  Workspace workspace_;
};

} // namespace ksl::generate
