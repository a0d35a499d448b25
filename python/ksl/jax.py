"""Dynamics that JAX differentiates: :func:`differentiable`."""

from __future__ import annotations

from ksl.base.extras import require_version
from ksl.model.model import Model

require_version("ksl.jax", "jax")

from ksl.operators.jax_arrays import JaxCalls  # noqa: E402

__all__ = ["JaxCalls", "differentiable"]


def differentiable(model: Model, threads: int | None = None) -> JaxCalls:
    """The calls of a model for JAX arrays, which JAX differentiates: :class:`ksl.operators.calls.Calls` has them all.

    model: a tree, or a closed mechanism, whose gradients are along it.  It is immutable, so that compiled programs may hold it.
    threads: the most threads for large batches; None or 0 is all cores that the process may use.  Results don't depend on it.

    Arrays are those of the CPU, or of a graphics card that the model has code for (:meth:`ksl.Model.compile`), float32 or float64, all of one type:
    others raise TypeError or ValueError, which name the argument.  A call costs what the call of the model does, its gradient as docs/derivatives.md
    says: two and a half times that of inverse dynamics.

        d = ksl.jax.differentiable(m)
        by_q = jax.grad(lambda q: (d.inverse_dynamics(q, v, a) ** 2).sum())(q)      # (6,)
        twist = jax.jit(d.frame_velocities)(q, v)[-1]                               # (6,): of the last link
    """
    return JaxCalls(model, threads)
