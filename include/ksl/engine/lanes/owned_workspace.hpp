// KSL: a workspace that owns its memory, for programs that call the engine's templates with a scalar of their own:
//
//     ksl::owned_workspace<ksl::inverse_dynamics_workspace<my_scalar>> w(model.view());
//     ksl::inverse_dynamics(model.view(), *w, q, v, a, {}, tau);
#pragma once

#include "ksl/engine/lanes/workspace.hpp"

#include <memory>
#include <new>

namespace ksl {
inline namespace KSL_ISA {

/// Workspace: <algorithm>_workspace<T>.  Its numbers are not initialised.  The constructor throws std::bad_alloc.
template <class Workspace> class owned_workspace {
public:
  template <class Model>
  explicit owned_workspace(const Model &model) : memory_(::operator new(workspace_bytes<Workspace>(model), alignment)) {
    arena pieces(memory_.get());
    workspace_.lay_out(pieces, model);
  }
  const Workspace &operator*() const { return workspace_; }
  const Workspace *operator->() const { return &workspace_; }

private:
  static constexpr std::align_val_t alignment{64};
  struct aligned_delete {
    void operator()(void *p) const { ::operator delete(p, alignment); }
  };
  std::unique_ptr<void, aligned_delete> memory_;
  Workspace workspace_;
};

} // namespace KSL_ISA
} // namespace ksl
