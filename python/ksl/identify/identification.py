"""Inertial parameters of links from a recorded motion, such that bodies of positive density have them.

    from ksl.identification import identify
    found = identify(model, q, v, a, tau)
    found.parameters        # (links, 10)
    found.base.names        # the combinations that the motion identifies
    found.base_values       # their values, and found.base_deviations

Joint efforts are a linear function of the parameters (:meth:`ksl.Model.inverse_dynamics_regressor`).  The sum of squared residuals, each
divided by the standard deviation of its joint's noise, is minimised together with the distance from a prior.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from ksl.base.errors import near_names, unknown_name
from ksl.identify.base_parameters import BaseParameters, check_tolerance, links_once, moving_links, of_regressor
from ksl.identify.certificate import Certificate, EffortFacts, certificate
from ksl.identify.chance import rare
from ksl.identify.consistency import Array, is_consistent, nearest_consistent
from ksl.identify.fit import Fit, small_length
from ksl.mechanism.given import mapping, number, numbers
from ksl.model.model import Model
from ksl.mechanism.joint_kinds import units_of
from ksl.mechanism.states import External, items_of


@dataclass(frozen=True, repr=False)
class Identification:
    """What a motion says about the parameters of some links."""

    links: tuple[str, ...]
    parameters: Array
    """(links, 10): m, m cx, m cy, m cz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz of each link.  A body of positive density has them."""
    covariance: Array
    """(10 · links, 10 · links), of motion and prior together, linearised; what the motion doesn't identify is as uncertain as the prior."""
    base: BaseParameters
    """The combinations that the motion identifies."""
    base_values: Array
    base_covariance: Array
    residuals: Array
    """(n, nv): the efforts that were given, less those of the parameters."""
    noise: Array
    """(nv): standard deviation of each joint's efforts, as given or as estimated from the residuals."""
    free: bool
    """Did least squares by itself give consistent parameters?  If not, the constraint that they be so is at work."""
    certificate: Certificate
    """How far the minimum was found, and whether prior, bodies and noise agree with the motion."""
    model: Model = field(repr=False)
    """The model with these parameters."""

    @property
    def base_deviations(self) -> Array:
        """Standard deviations of the base values."""
        return np.asarray(np.sqrt(np.diag(self.base_covariance)))

    @property
    def converged(self) -> bool:
        """Is the sum of squares at its minimum, and the noise settled?  `certificate.reason` says why not."""
        return self.certificate.converged

    @property
    def doubts(self) -> tuple[str, ...]:
        """Sentences on what is doubtful: no minimum, a prior or bodies that contradict the motion, residuals that are not the noise.  Empty if nothing is."""
        return self.certificate.doubts

    def __repr__(self) -> str:
        n, nv = self.residuals.shape
        with np.errstate(invalid="ignore"):
            left = float(np.sqrt(np.mean(self.residuals**2)))
        at_work = "" if self.free else "; the constraint that bodies be possible is at work"
        head = f"<ksl identification: {len(self.links)} links, {len(self.base)} combinations of their parameters from {n} samples of {nv} efforts, residuals {left:.3g} rms"
        return "\n  ".join([head + at_work, *str(self.certificate).splitlines()]) + ">"


def identify(
    model: Model,
    q: ArrayLike,
    v: ArrayLike,
    a: ArrayLike,
    tau: ArrayLike,
    links: Iterable[str] | None = None,
    external: External | None = None,
    prior: Mapping[str, ArrayLike] | None = None,
    prior_deviation: float = 1.0,
    noise: ArrayLike | None = None,
    tolerance: float = 1e-4,
) -> Identification:
    """Inertial parameters of links from a motion and the joint efforts that it took.

    q (n, nq), v, a and tau (n, nv): samples.  tau: what :meth:`ksl.Model.inverse_dynamics` of this model gives, N m or N: Sᵀ f, and what
    friction, rotors and so on need only if `physics=` of the model names them.
    external: {link: (6) or (n, 6)}, wrenches as in :meth:`ksl.Model.inverse_dynamics`, in the links' axes.
    links: those to identify; by default all links that move and have mass.  The others keep the parameters of the model.
    prior: {link: ten numbers}, in place of the model's.  Parameters that no body can have are first replaced by near ones that a body can.
    prior_deviation: how far parameters may be from the prior, as a standard deviation relative to the size of the body: 1 means that
    its mass may as well be twice as large, and its centroid anywhere within it.  The prior decides what the motion doesn't identify,
    and hardly anything else.
    noise: standard deviation of each joint's efforts (nv); by default estimated from the residuals of least squares without prior, and from those of
    possible bodies if none explain the efforts.
    tolerance: of what counts as identified; see :func:`ksl.identify.base_parameters.of_motion`.

    The least sum of squares among parameters of bodies is found, a convex problem (Wensing, Kim, Slotine, RA-L 3, 2018), by a primal-dual
    interior point method where least squares by itself gives impossible ones.  `certificate` bounds what is left to the minimum, and says
    whether prior, bodies and noise agree with the motion; `doubts` has the sentences.  O(n · nv · (10 links)²).
    Raises ValueError for arrays that don't fit, numbers that aren't finite, links without mass, and links that are named twice.
    """
    if not isinstance(model, Model):
        raise ValueError(f"model is {type(model).__name__}; expected a ksl.Model")
    q, v, a, tau = (numbers(model.in_order(x, what), what) for x, what in ((q, "q"), (v, "v"), (a, "a"), (tau, "tau")))
    _check_motion(model, q, v, a, tau)
    check_tolerance(tolerance)
    names = tuple(_links_with_mass(model) if links is None else links_once(model, links))
    start = _prior(model, names, {} if prior is None else prior)
    if not 0 < number(prior_deviation, "prior_deviation") < np.inf:
        raise ValueError(f"prior_deviation={prior_deviation}; expected a positive number")
    fit = Fit(model, names, start, prior_deviation, (q, v, a), tau, _wrenches(external, len(tau)))
    rounds, change = 1, 0.0
    if noise is not None:
        fit.weigh(_given_noise(noise, model.nv))
    else:
        rounds, change = fit.estimate_noise()
    base = of_regressor(fit.stacked, names, tolerance)
    minimum = fit.solve()
    if noise is None and fit.excess(minimum) > rare(len(base)):  # no possible bodies explain the efforts
        minimum, rounds, change = fit.solve_with_noise()
    parameters, root = fit.parameters(minimum.x), fit.root_of_covariance()
    return Identification(
        links=names,
        parameters=parameters,
        covariance=root @ root.T,
        base=base,
        base_values=base.values(parameters),
        base_covariance=(base.matrix @ root) @ (base.matrix @ root).T,
        residuals=fit.residuals(parameters),
        noise=fit.sigma,
        free=minimum.free,
        certificate=certificate(fit, parameters, minimum, base, _efforts_of(model), noise is not None, rounds, change),
        model=model.with_parameters(dict(zip(names, parameters))),
    )


def _efforts_of(model: Model) -> EffortFacts:
    """Names, kinds and gears of the nv numbers of tau."""
    out = EffortFacts([""] * model.nv, np.zeros(model.nv, dtype=bool), np.ones(model.nv))
    for joint in model.joints:
        for k, unit in enumerate(units_of(joint)[1] if joint.nv else ()):
            at = joint.v_index + k
            out.names[at] = joint.name if joint.nv == 1 else f"{joint.name}[{k}]"
            out.are_forces[at], out.gears[at] = unit == "m", joint.gear_ratio
    return out


def _check_motion(model: Model, q: Array, v: Array, a: Array, tau: Array) -> None:
    for name, x, width in (("q", q, model.nq), ("v", v, model.nv), ("a", a, model.nv), ("tau", tau, model.nv)):
        if x.ndim != 2 or x.shape[1] != width or len(x) != len(q):
            raise ValueError(f"{name}: expected shape ({len(q) if q.ndim == 2 else 'n'}, {width}), a row for each sample; found {x.shape}")
        if not np.isfinite(x).all():
            row, column = np.argwhere(~np.isfinite(x))[0]
            raise ValueError(f"{name}: sample {row}, number {column} is {x[row, column]}; leave out samples that aren't finite")
    if not len(q):
        raise ValueError("q: no samples; a motion needs at least one")


def _wrenches(external: External | None, n: int) -> dict[str, Array]:
    """External wrenches, each (n, 6)."""
    out = {}
    for link, given in items_of(external):
        f = numbers(given, f"external[{link!r}]")
        if f.shape not in ((6,), (1, 6), (n, 6)):
            raise ValueError(f"external[{link!r}] has shape {f.shape}; expected (6,), or ({n}, 6) with a row for each sample")
        out[link] = np.broadcast_to(f, (n, 6))
    return out


def _links_with_mass(model: Model) -> list[str]:
    moving = set(moving_links(model))
    return [link.name for link in model.links if link.name in moving and link.mass > 0]


def _prior(model: Model, names: tuple[str, ...], given: Mapping[str, ArrayLike]) -> Array:
    if not names:
        raise ValueError(f"{model.name or model.file}: no link to identify: none that moves has mass; name some in `links`, with a prior")
    chosen = dict(mapping(given, "prior", "{link: ten numbers}"))
    unknown = [link for link in chosen if link not in names]
    if unknown:
        raise ValueError(f"prior: {unknown[0]!r} is not among the links to identify; {near_names(unknown[0], names)}they are {', '.join(names)}")
    known = {link.name: link.parameters for link in model.links}
    for name in names:
        if name not in known:
            raise ValueError(unknown_name(f"links: {model.name or model.file}", "link", name, known))
    for name, ten in chosen.items():
        phi = numbers(ten, f"prior: link {name}")
        if phi.shape != (10,) or not np.isfinite(phi).all():
            raise ValueError(f"prior: link {name} has {phi.size} numbers, or some that aren't finite; expected ten: m, m c, Ixx, Ixy, Iyy, Ixz, Iyz, Izz")
    out = np.array([chosen.get(name, known[name]) for name in names], dtype=float)
    for name, phi in zip(names, out):
        if not phi[0] > 0:
            raise ValueError(f"prior: link {name} has mass {phi[0]} kg; give a positive one in `prior`, or leave the link out of `links`")
    return np.where(is_consistent(out)[:, None], out, nearest_consistent(out, length=small_length(model)))


def _given_noise(noise: ArrayLike, nv: int) -> Array:
    sigma = numbers(noise, "noise")
    if sigma.shape not in ((), (1,), (nv,)) or not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise ValueError(f"noise: expected {nv} positive standard deviations, one for each joint velocity, or one for all; found {noise!r}")
    return np.broadcast_to(sigma, (nv,)).copy()
