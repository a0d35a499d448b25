"""The balance of power: its round-off, from where on it is doubted, and what enters it, in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from hinged_rods import ROD
from ksl.base.errors import MotionError
from ksl.load_cases.case_result import compute_case
from ksl.load_cases.force_elements import element_ranges
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import PowerBalance, power_round_off, untold
from ksl.motions.motion import Motion


@pytest.mark.parametrize(
    ("kinetic", "potential", "q", "v", "effort", "watts"),
    [(4, 0, 0, 2, 9, 8e-12), (0, 7, 0, 0, 9, 14e-12), (0, 0, 3, 0, 5, 30e-12), (4, 7, 3, 2, 5, 52e-12 + 1.44e-12), (4, 0, 3, 0, 0, 8e-12)],
)
def test_round_off_of_powers(kinetic, potential, q, v, effort, watts):
    """u (K + U + q τ) / dt with u = 1e-12, and 3e-14 q / dt² of an acceleration with the momentum 2 K / v; the shortest dt is 0.5 s."""
    time = np.array([0.0, 0.5, 2.0])
    of = lambda x, columns=(): np.full((3, *columns), -float(x)) * [[1.0], [0.5], [0.0]] if columns else np.array([x, -x / 2, 0.0])
    assert power_round_off(time, of(kinetic), of(potential), of(q, (1,)), of(v, (1,)), effort) == pytest.approx(watts, rel=1e-12, abs=0)


@pytest.mark.parametrize(
    ("drive", "rate", "more", "residual", "doubtful"),
    [
        (2.0, 1.981, {}, 0.0095, False), (2.0, 1.979, {}, 0.0105, True), (0.0, 0.0, {}, 0.0, False), (1e-3, 0.0, {"round_off": 1e-3}, 1.0, False),
        (1.01e-3, 0.0, {"round_off": 1e-3}, 1.0, True), (1e-3, 0.0, {"exchanged": 100.0}, 0.01, False), (1e-3, 0.0, {"exchanged": 99.0}, 0.0101, True),
        (2.0, 1.0, {"dissipation": np.ones(2)}, 0.0, False), (2.0, 3.0, {"external": np.ones(2)}, 0.0, False), (1.0, 0.0, {"dissipation": np.full(2, 4.0)}, 0.75, True),
    ],
)  # fmt: skip
def test_power_balances_are_doubted_from_a_hundredth_on(drive, rate, more, residual, doubtful):
    none = np.zeros(2)
    balance = PowerBalance(
        np.array([drive, 0]),
        more.pop("external", none) * [1, 0],
        none,
        np.array([rate, 0]),
        **{k: x * [1, 0] if k == "dissipation" else x for k, x in more.items()},
    )
    assert balance.relative_residual == pytest.approx(residual, rel=2e-2, abs=1e-12) and balance.doubtful == doubtful


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_balance_beyond_the_range_is_refused(robot):
    """A speed that ends at once: wrenches and energies are numbers, and the rate of the energy is none."""
    v = np.where(np.arange(8) < 4, 1e74, 0.0)[:, None]
    with pytest.raises(MotionError, match="motion: power balance: energy or power of all joints is not finite"):
        compute_case(LoadCase(robot(ROD), Motion(1e-170 * np.arange(8), np.zeros((8, 1)), v, np.zeros((8, 1)))))


@pytest.mark.parametrize(("samples", "balanced"), [(5, False), (6, True)])
def test_balances_of_short_motions(robot, samples, balanced):
    t = np.arange(float(samples))
    found = compute_case(LoadCase(robot(ROD), Motion(t, t[:, None] ** 2, 2 * t[:, None], np.full((samples, 1), 2.0)))).balance
    assert (found is not None) == balanced and (not balanced or found.relative_residual < 1e-9)


@pytest.mark.parametrize("mass", [2.0, 1e-3])
@pytest.mark.parametrize("before", [True, False])
def test_a_power_balance_at_a_jump_of_the_acceleration(robot, before, mass):
    """The sample there may have the acceleration of either side."""
    t = np.linspace(0, 2, 41)
    v = np.where(t < 1, t, 1 - 3 * (t - 1))
    q, a = np.where(t < 1, t**2 / 2, 1 / 2 + (t - 1) - 1.5 * (t - 1) ** 2), np.where((t < 1) | (before & (t == 1)), 1.0, -3.0)
    m = robot(ROD.replace('mass value="2"', f'mass value="{mass}"'))
    balance = compute_case(LoadCase(m, Motion(t, q[:, None], v[:, None], a[:, None], corner_times=np.array([1.0])))).balance
    assert balance.relative_residual < 1e-9 and balance.largest_power == pytest.approx(0.25 * mass * np.abs(a * v).max())


def test_round_off_is_that_of_the_largest_effort(robot):
    """Of a rod that weighs a gram, and swings about a vertical axis."""
    m, t = robot(ROD.replace('mass value="2"', 'mass value="1e-3"')), np.linspace(0, 1, 30)
    q, v, a = np.sin(9 * t)[:, None], 9 * np.cos(9 * t)[:, None], -81 * np.sin(9 * t)[:, None]
    balance = compute_case(LoadCase(m, Motion(t, q, v, a))).balance
    kinetic, potential = m.energy(q, v)
    assert balance.round_off == pytest.approx(power_round_off(t, kinetic, potential, q, v, 1e-3 * 0.25 * np.abs(a).max()), rel=1e-9)
    assert balance.exchanged == pytest.approx(np.abs(np.gradient(kinetic, t)).max(), rel=1e-12)


def test_dampers_between_points_turn_power_into_heat(robot):
    """c l̇² and the damping of the joint: the balance closes with both, and not without."""
    damper = '<force_element name="d" damping="3"><link1 link="wall" xyz="1 0.5 0"/><link2 link="rod" xyz="0.5 0 0"/></force_element>'
    m = robot(ROD.replace("</joint>", '<dynamics damping="0.4"/></joint>').replace("</robot>", damper + "</robot>"), physics=["damping", "force elements"])
    t = np.linspace(0, 2, 400)
    q, v = np.sin(3 * t), 3 * np.cos(3 * t)
    balance = compute_case(LoadCase(m, Motion(t, q[:, None], v[:, None], -9 * q[:, None]))).balance
    way = 0.5 * np.column_stack([np.cos(q), np.sin(q)]) - [1, 0.5]
    rate = np.sum(way * 0.5 * np.column_stack([-np.sin(q), np.cos(q)]) * v[:, None], axis=1) / np.linalg.norm(way, axis=1)
    assert balance.dissipation == pytest.approx(0.4 * v**2 + 3 * rate**2, rel=1e-9, abs=1e-12) and balance.relative_residual < 1e-6
    case, length = LoadCase(m, Motion(t, q[:, None], v[:, None], -9 * q[:, None])), np.linalg.norm(way, axis=1)
    (found,) = element_ranges(case)
    assert (*found.length, *found.tension) == pytest.approx((length.min(), length.max(), 3 * rate.min(), 3 * rate.max()), rel=1e-9)
    for physics in ((), ("damping",)):
        assert element_ranges(replace(case, model=m.with_physics(physics))) == []


@pytest.mark.parametrize(("events", "missed"), [([], True), ([0.5, 2.5, 9.0], True), ([1.5], False), ([2.0], False), ([-1.0, 0.0], True)])
def test_energy_that_an_event_changes_is_not_missed(events, missed):
    """Of a step by 3 J between samples 1 s and 2 s."""
    time, energy = np.arange(5.0), np.array([0, 0, 3.0, 3, 3])
    found = untold(time, energy, 0 * time, np.array(events), 0.0)
    assert (found is not None) == missed and (not missed or (found.begin, found.end, found.change, found.by_powers) == (1, 2, 3, 0))
