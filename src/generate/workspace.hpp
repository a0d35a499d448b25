// The workspace of an algorithm over recordings.
#pragma once

#include "generate/empty_memory.hpp"
#include "generate/recording.hpp"
#include "ksl/engine/lanes/workspace.hpp"

namespace ksl::generate {

/// Its numbers are of no step: what an algorithm reads without having written it makes a result of no step, which record() refuses.
template <class Workspace> class empty_workspace {
public:
  explicit empty_workspace(const model_view<recording> &model) : memory_(workspace_bytes<Workspace>(model)) {
    arena pieces(memory_.begin());
    workspace_.lay_out(pieces, model);
  }
  const Workspace &operator*() const { return workspace_; }

private:
  empty_memory memory_;
  Workspace workspace_;
};

} // namespace ksl::generate
