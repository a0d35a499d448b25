"""Dynamics that torch differentiates: :func:`differentiable`."""

from __future__ import annotations

from ksl.base.extras import require_version
from ksl.model.model import Model

require_version("ksl.torch", "torch")

from ksl.operators.torch_arrays import TorchCalls  # noqa: E402

__all__ = ["TorchCalls", "differentiable"]


def differentiable(model: Model, threads: int | None = None) -> TorchCalls:
    """The calls of a model for tensors, which torch differentiates: :class:`ksl.operators.calls.Calls` has them all.

    model: a tree, or a closed mechanism, whose gradients are along it.  It is immutable, so that compiled programs may hold it.
    threads: the most threads for large batches; None or 0 is all cores that the process may use.  Results don't depend on it.

    Arrays are those of the CPU, or of a graphics card that the model has code for (:meth:`ksl.Model.compile`), float32 or float64, all of one type:
    others raise TypeError or ValueError, which name the argument.  A call costs what the call of the model does, its gradient as docs/derivatives.md
    says: two and a half times that of inverse dynamics.

        d = ksl.torch.differentiable(m)
        q = torch.tensor(q, requires_grad=True)
        (d.inverse_dynamics(q, v, a) ** 2).sum().backward()
        by_q = q.grad                                                               # (6,)
    """
    return TorchCalls(model, threads)
