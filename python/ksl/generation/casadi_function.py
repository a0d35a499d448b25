"""`ksl.casadi_function`: an algorithm of one mechanism as a function of CasADi."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ksl.base.errors import ArgumentError, of_argument
from ksl.base.extras import missing
from ksl.generation.arguments import arguments_given
from ksl.generation.casadi_files import casadi_source, checked_derivatives
from ksl.generation.compiled import built
from ksl.generation.compiler import find_compiler
from ksl.generation.open_reactions import Undetermined
from ksl.generation.requests import functions_of

if TYPE_CHECKING:
    from ksl.model.model import Model

PREFIX = "ksl_inner_"
"""What names in the text begin with that CasADi doesn't look for."""


def casadi_function(
    model: Model, algorithm: str, arguments: Sequence[str] = (), derivatives: int = 1, undetermined: Undetermined = "refuse", compiler: str | None = None
) -> Any:
    """An algorithm of a robot as a compiled casadi.Function with derivatives, for numbers and in expressions.

    algorithm: the name of a call, with links or joints behind a colon: "inverse_dynamics", "jacobian:tool0", "reactions:elbow+base".  All else has the
        defaults of the model's call.
    arguments: inputs besides, as in :func:`ksl.generate`: "external:LINK" (6, links), "gravity" (3), "payload:LINK" and "parameters:LINK" (10, links).
    derivatives: 1, the Jacobian; 2, also the second derivatives of weighted sums of the results, which Ipopt's exact Hessian takes.
    undetermined: as in :func:`ksl.generate`.
    compiler: as in :meth:`Model.compile`.

    The function has the name of the algorithm, `reactions` or `jacobian_tool0`, inputs q (nq), v (nv), … and results by their names.  A result (joints, 6)
    is a matrix; of three axes the first two are rows, of four the last two columns; zeros that the mechanism implies are not stored.  Units and frames
    are those of the model's call, and so are the bits.  Derivatives by q are those by each of its numbers: of a quaternion, which moves on a sphere, too.

    The compiler and the cache are those of :meth:`Model.compile`.  The first call compiles: inverse dynamics of an arm takes half a second, with second derivatives
    2 s; those of forward dynamics take 17 s.
    Raises ModuleNotFoundError without CasADi (`pip install 'ksl[casadi]'`), CompilerError, ArgumentError for what isn't known, and ValueError for closed
    mechanisms and exact dry friction, whose derivatives aren't generated.

        tau = ksl.casadi_function(m, "inverse_dynamics")
        tau(q, v, a), tau.jacobian()
    """
    if said := missing("casadi", extra="casadi"):
        raise ModuleNotFoundError(f"a function of CasADi {said}", name="casadi")
    import casadi

    if not isinstance(algorithm, str):
        raise ArgumentError(f"algorithm={algorithm!r}: expected the name of one algorithm, as 'inverse_dynamics'")
    if undetermined not in ("refuse", "least-norm"):
        raise of_argument(ArgumentError, "undetermined", ": expected refuse or least-norm", undetermined)
    if model.nv == 0:
        raise ArgumentError(f"{model.name} has no joint that moves: there is nothing to compute")
    functions = functions_of(model, [algorithm], arguments_given(model, arguments), False, undetermined)
    text = casadi_source(model, functions, "", PREFIX, "", checked_derivatives(derivatives), undetermined)
    return casadi.external(functions[0].name, str(built(text, find_compiler(compiler))))
