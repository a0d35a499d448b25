"""The section of the power balance, and its verdict in one line."""

from __future__ import annotations

import numpy as np

from ksl.load_cases.quantities import CAUSES_OF_RESIDUALS, LARGE_RESIDUAL, PowerBalance
from ksl.mechanism.states import Array
from ksl.report.html.charts import Charts, Panel
from ksl.report.html.numbers import Clock, format_share

TOO_FEW = "too few samples to differentiate the energy"
AT_REST = "no power but round-off: nothing moves, or what moves takes no power"


def balance_verdict(b: PowerBalance | None, anchor: str) -> str:
    """One line, which leads to the section."""
    if b is None:
        return f'<p class="balance">Power balance: {TOO_FEW}.</p>'
    if b.at_rest:
        return f'<p class="balance"><a href="#{anchor}">Power balance</a>: {AT_REST}.</p>'
    worse = "" if b.relative_residual <= LARGE_RESIDUAL else " large"
    return f'<p class="balance{worse}"><a href="#{anchor}">Power balance</a>: largest residual {format_share(b.relative_residual)} of the largest power.</p>'


def balance_section(b: PowerBalance | None, time: Array, charts: Charts, clock: Clock, anchor: str) -> str:
    """The section, whose id is `anchor`."""
    if b is None:
        return f'<section id="{anchor}" class="power"><h2>Power balance</h2><p>Not checked: {TOO_FEW}.</p></section>'
    lost, energy = ("", "mechanical energy") if b.dissipation is None else (" − dissipation by damping and friction", "energy, rotors and springs included")
    of_rate = "derivatives of the energies along the simulated velocities and accelerations" if b.integrated else "a spline through the energies"
    text = (
        f"Drive power + power of external wrenches{lost} = rate of change of {energy}, at every sample. The right side comes from "
        f"{of_rate}, not from the dynamics: the two sides agree only if the efforts belong to this motion. "
    )
    text += f"<strong>Here there is {AT_REST}.</strong>" if b.at_rest else _residual(b, time, clock)
    sides = {"rate of energy": b.energy_rate, "drive": b.drive}
    if np.any(b.external):
        sides |= {"external": b.external}
    if b.dissipation is not None:
        sides |= {"− dissipation": -b.dissipation}
    if len(sides) > 2:
        sides |= {" + ".join(list(sides)[1:]).replace("+ −", "−"): b.supplied}
    residual = b.residual
    if b.at_rest:  # curves of rounding errors would look like results
        sides, residual = {name: np.zeros_like(x) for name, x in sides.items()}, np.zeros_like(residual)
    powers = charts.over_time(time, "Power of both sides", [Panel("Power, W", sides, emphasis=True)])
    rest = charts.over_time(time, "Residual, and energy", [Panel("Residual, W", {"residual": residual}), Panel("Energy, J", {"energy": b.energy})])
    return f'<section id="{anchor}" class="power"><h2>Power balance</h2><p>{text}</p><div class="charts">{powers}{rest}</div></section>'


def _residual(b: PowerBalance, time: Array, clock: Clock) -> str:
    worst = int(np.argmax(np.abs(b.residual)))
    text = (
        f"<strong>Largest residual: {format_share(b.relative_residual)} of the largest power</strong>, "
        f"{abs(b.residual[worst]):.3g} W at {clock.text(float(time[worst]))} s."
    )
    if b.relative_residual <= LARGE_RESIDUAL:
        return text
    return text + (f' <strong class="over">That is large</strong>: {CAUSES_OF_RESIDUALS}.')
