"""A joint that is held stands, whatever its numbers are: exact, rounded, noisy; and one that moves slowly moves."""

from dataclasses import replace

import numpy as np
import pytest

import ksl
from chains import SLIDE
from ksl.base.rounding import OF_POSITIONS
from ksl.load_cases.wrench_table import motion_of_arrays
from ksl.mechanism.lengths import extent
from ksl.motions.motion import complete
from ksl.motions.signal.standing import WINDOW, _rounded, standing_of_integrated

TIME = np.arange(1000) * 0.004
RANDOM = np.random.default_rng(7)
NOISE = RANDOM.standard_normal(len(TIME))

PENDULUM = """<robot name="r"><link name="wall"/><link name="rod"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="pin" type="revolute"><parent link="wall"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="100" velocity="5"/><dynamics friction="3" damping="0.5"/></joint></robot>"""


@pytest.fixture(scope="module")
def pendulum():
    return ksl.load_string(PENDULUM, physics=("exact friction", "damping"))


def minimum_jerk(x):
    x = np.clip(x, 0, 1)
    return x**3 * (10 - 15 * x + 6 * x * x)


def motion(model, q, v=None, time=TIME):
    return motion_of_arrays(model, time, q[:, None], None if v is None else v[:, None], None if v is None else np.zeros((len(q), 1)))


HELD = {  # what a joint that is held looks like in a file
    "constant": 0 * TIME,
    "rounding in memory": 1e-16 * NOISE,
    "noise of a good encoder": 1e-7 * NOISE,
    "noise of a bad encoder": 1e-4 * NOISE,
    "noise, rounded": np.round(3e-4 * NOISE, 4),
    "one count now and then": 1e-5 * (np.arange(len(TIME)) % 97 == 50),
    "between two counts": 2e-5 * (NOISE > 0),
}


@pytest.mark.parametrize("how", HELD)
def test_a_joint_that_is_held_stands(pendulum, how):
    """Its dry friction has no sign, its drive no power, and its effort is that of the weight."""
    held = motion(pendulum, 0.9 + HELD[how])
    assert held.stands.all() and not held.resolved_v.any()
    noise = float(np.ptp(HELD[how]))
    assert held.resolution[0] <= max(10 * noise, 1e-13) / 0.004, "what is stated is of the size of the noise over a step"
    run = ksl.compute_loads(pendulum, held)
    (row,) = [row for row in run.results[0].rows if row["joint"] == "pin"]
    assert row["effort_peak"] == pytest.approx(2 * 9.81 * 0.5 * np.cos(0.9), rel=3e-3) and not held.doubts and not run.results[0].doubts
    counts = ("speed_peak", "power_peak", "work_positive", "work_negative", "power_mean", "friction_peak", "damping_peak")
    assert [row[name] for name in counts] == [0.0] * len(counts)


def test_a_joint_that_a_simulated_controller_holds_stands(examples, tmp_path):
    """Its rates are the error of the integration, of either sign, whether its motion comes as arrays, as positions or in a file that KSL wrote."""
    m, time, hold = ksl.load(examples / "robots/ur5.urdf"), TIME[:100], np.array([0, -0.8, 0.9, 0, 0.3, 0])
    run = m.simulate(hold, np.zeros(6), time, efforts=ksl.simulation.PD(hold, 400.0, 40.0, gravity=True))
    assert np.abs(run.v).max() > 1e-12, "or nothing is tested"
    names = ",".join(f"{name}{end}" for end in ("", ".v", ".a") for name in m.joint_names)
    np.savetxt(tmp_path / "m.csv", np.column_stack([time, run.q, run.v, run.a]), delimiter=",", header=f"time,{names}", comments="", fmt="%.15g")
    for given in ((time, run.q, run.v, run.a), (time, run.q, run.v), (time, run.q), tmp_path / "m.csv"):
        for row in ksl.compute_loads(m, given).results[0].rows[:6]:
            assert [row[name] for name in ("speed_peak", "power_peak", "work_positive", "work_negative")] == [0.0] * 4, row["joint"]


@pytest.mark.parametrize(("kind", "size"), [("revolute", 1.0), ("prismatic", 1.0), ("prismatic", 1e-6)])
@pytest.mark.parametrize("at", [0.0, -0.5])
@pytest.mark.parametrize(("share", "stands"), [(0.99, True), (1.01, False)])
def test_what_a_program_that_integrates_may_be_off_is_no_motion(kind, size, share, stands, at):
    """A drift of twice a billionth, of 1 rad or of the robot's extent and of the position, within the middle half."""
    b = ksl.Builder("arm").add_link("wall").add_link("arm", 1.0, (0, 0, 0), 0.01 * size**2 * np.eye(3))
    m = b.add_joint("pin", kind, "wall", "arm", axis=(1, 0, 0), limits=(-size, size)).build()
    unit = 1.0 if kind == "revolute" else extent(m)
    way = 4e-9 * share * (1 + abs(at)) * unit
    assert motion(m, at * unit + way * np.arange(1000) / 999, np.full(1000, way / TIME[-1])).stands.all() == stands


@pytest.mark.parametrize("how", [*(how for how in HELD if how != "noise, rounded"), "a drift", "a slow drift of rates"])
@pytest.mark.parametrize("kind", ["translation", "cylindrical"])
def test_each_coordinate_of_a_joint_stands_or_moves_for_itself(how, kind):
    """Behind another joint, so that places in q and v are not those in the joint."""
    b = ksl.Builder("arm").add_link("wall").add_link("post", 1.0, (0, 0, 0.1), 0.1 * np.eye(3)).add_link("arm", 1.0, (0, 0, 0.1), 0.1 * np.eye(3))
    b.add_joint("turn", "continuous", "wall", "post", axis=(0, 0, 1))
    m = b.add_joint("slides", kind, "post", "arm", **({"axis": (1, 0, 0)} if kind == "cylindrical" else {})).build()
    swing = np.column_stack([(0.3 + 0.1 * k) * np.sin((3 + k) * TIME + 0.3) for k in range(m.nv)])
    rate = np.gradient(swing, TIME, axis=0)
    for column in range(m.nv):
        q, v = swing.copy(), rate.copy()
        drift = how not in HELD
        q[:, column] = 0.4 + (1e-12 * TIME if drift else HELD[how])
        v[:, column] = 1e-12
        given = (TIME, q, v, np.zeros_like(q)) if how == "a slow drift of rates" else (TIME, q)
        stands = motion_of_arrays(m, *given).stands
        assert stands[:, column].all() and not np.delete(stands, column, axis=1).any()


@pytest.fixture(scope="module")
def slides_behind_a_turn():
    b = ksl.Builder("arm").add_link("wall").add_link("post", 1.0, (0, 0, 0.1), 0.1 * np.eye(3)).add_link("arm", 1.0, (0, 0, 0.1), 0.1 * np.eye(3))
    return b.add_joint("turn", "continuous", "wall", "post", axis=(0, 0, 1)).add_joint("slides", "translation", "post", "arm").build()


@pytest.mark.parametrize("column", [1, 2, 3])
def test_noise_beside_a_joint_that_goes_far(slides_behind_a_turn, column):
    """Every coordinate is judged by its own positions, here behind a hinge that goes by 0.1 rad in each sample."""
    q = np.column_stack([0.1 * np.arange(1000), *np.sin(np.outer([3, 4, 5], TIME))])
    q[:, column] = 0.4 + 1e-5 * NOISE
    stands = motion_of_arrays(slides_behind_a_turn, TIME, q).stands
    assert stands[:, column].all() and not np.delete(stands, column, axis=1).any()


@pytest.mark.parametrize("column", [1, 2, 3])
def test_an_integrated_coordinate_stands_for_itself(slides_behind_a_turn, column):
    swing = np.column_stack([0.3 * np.sin(TIME + 0.3), *np.sin(np.outer([3, 4, 5], TIME))])
    swing[:, column] = 0.4 + 0.4e-10 * NOISE.clip(-1, 1)
    found = standing_of_integrated(slides_behind_a_turn.joints[:2], TIME, swing, np.gradient(swing, TIME, axis=0), 1e-10, 1e-10)
    assert found.stands[:, column].all() and found.held[:, column].all() and not np.delete(found.stands, column, axis=1).any()
    assert found.rate[column] == pytest.approx(1e-10 * (1 + np.abs(swing[:, column]).max()) / 0.004)


def test_accelerations_that_are_given_are_those_of_stands_too(slides_behind_a_turn):
    """Of the joint that has some: its rates are none there, and its accelerations are as they are."""
    q, none = 0.4 + 1e-6 * RANDOM.standard_normal((1000, 4)), np.zeros((1000, 3))
    found = complete(slides_behind_a_turn, TIME, q, [[None, None], [none, none]])
    assert found.stands.all() and found.held[:, 0].all() and not found.held[:, 1:].any()


def test_rounding_in_memory_over_the_step_is_what_rates_resolve(pendulum):
    """Of a joint that moves; and at a step that changes, that over the shorter one beside the sample."""
    assert motion(pendulum, 8 * np.sin(TIME)).resolution[0] == pytest.approx(OF_POSITIONS * 8 * np.sin(np.pi / 2) / 0.004, rel=1e-5)
    time, rate = np.array([0.0, 1.0, 1.5, 2.5]), OF_POSITIONS * 8.0
    v = rate * np.array([0.99, 1.99, 1.99, 0.99])
    q = np.array([[8.0], [-1], [2], [8]])
    for share, stands in ((1.0, True), (1.02, False)):
        assert (_rounded(pendulum.joints[:1], time, q, share * v[:, None]).stands == stands).all()


def test_a_joint_is_held_but_for_eight_samples_where_it_begins_to_move(pendulum):
    q = 0.9 + 0.5 * np.maximum(TIME - TIME[600], 0)
    found = complete(pendulum, TIME, q[:, None], [[np.where(TIME > TIME[600], 0.5, 1e-8)[:, None], None]])
    assert found.stands[:, 0].tolist() == [True] * 601 + [False] * 399 and found.held[:, 0].tolist() == [True] * 593 + [False] * 407


def test_counts_are_resolved_to_one_of_them(pendulum):
    """And a thousandth, for what rounding adds."""
    assert motion(pendulum, 0.9 + HELD["one count now and then"]).resolution[0] * 0.004 == pytest.approx(1.001e-5, rel=1e-6)


@pytest.mark.parametrize(("share", "noted"), [(0.97e-3, False), (1.03e-3, True)])
def test_a_stand_is_worth_a_line_by_its_share_of_the_largest_rate(pendulum, share, noted):
    """From a thousandth on."""
    noise, ratio = 1e-6, share
    for _ in range(3):
        noise *= share / ratio
        found = motion(pendulum, 0.9 + 0.5 * minimum_jerk(TIME / 2 - 1) + noise * NOISE)
        ratio = found.resolution[0] / np.abs(found.v).max()
    assert ratio == pytest.approx(share, rel=0.02)
    assert any("stands where its position keeps within" in line for line in found.differentiated) == noted


MOVING = {  # slow, small or coarse motions are motions
    "slow": 1e-4 * TIME,
    "slow and rounded": np.round(5e-3 * TIME, 4),
    "slow and noisy": 0.02 * TIME + 1e-5 * NOISE,
    "steps of one count": 0.1 * np.arange(len(TIME)),
    "small": 1e-6 * np.sin(20 * TIME),
    "random": NOISE,
}


@pytest.mark.parametrize("how", MOVING)
def test_a_slow_motion_is_one(pendulum, how):
    moved = motion(pendulum, 0.9 + MOVING[how])
    assert moved.stands.mean() < 0.02 and moved.resolved_v.any()


@pytest.mark.parametrize(("kind", "coarsest"), [("revolute", 0.02), ("prismatic", 0.002)])
def test_noise_that_is_too_coarse_for_a_measurement_is_motion(kind, coarsest):
    """What is stated of a joint in one place grows as its noise does, and from 0.02 rad or 2 mm on the joint moves."""
    b = ksl.Builder("arm").add_link("wall").add_link("arm", 1.0, (0, 0, 0), 0.01 * np.eye(3))
    m = b.add_joint("pin", kind, "wall", "arm", axis=(1, 0, 0), limits=(-1, 1)).build()
    stated = motion(m, 0.1 + 1e-4 * coarsest * NOISE).resolution[0] * 0.004
    last = coarsest / (stated / (1e-4 * coarsest))
    assert motion(m, 0.1 + 0.97 * last * NOISE).stands.all() and motion(m, 0.1 + 1.03 * last * NOISE).stands.mean() < 0.02
    assert not motion(m, 4 * coarsest * np.sin(20 * TIME) + coarsest * NOISE).stands.any(), "a swing beside such noise"


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-5, 1e-4])
def test_a_joint_that_comes_to_a_stand(pendulum, noise):
    """It moves for a second, stands for two, and goes back."""
    q = 0.5 * (minimum_jerk(TIME) - minimum_jerk(TIME - 3)) + noise * NOISE
    found = motion(pendulum, q).stands[:, 0]
    assert found[(TIME > 1.02) & (TIME < 2.98)].all()
    assert not found[(TIME > 0.1) & (TIME < 0.9) | (TIME > 3.1) & (TIME < 3.9)].any()
    smooth = complete(pendulum, TIME, q[:, None], [[None, None]], smooth=20.0).stands[:, 0]
    assert smooth[(TIME > 1.1) & (TIME < 2.9)].all() and not smooth[(TIME > 0.2) & (TIME < 0.8)].any()


def test_given_rates_have_a_resolution_of_their_own(pendulum):
    """Rates of a joint that is held are noise; those that positions don't show in their decimals are rates."""
    assert motion(pendulum, 0 * TIME + 0.9, 1e-3 * NOISE).stands.all()
    assert not motion(pendulum, np.round(0.9 + 1e-3 * TIME, 2), 0 * TIME + 1e-3).stands.any()
    turning = motion(pendulum, np.sin(TIME), np.cos(TIME))
    assert turning.stands.sum() == 0 and turning.resolved_v is turning.v, "nothing is copied"


def test_a_line_says_what_stands(pendulum):
    (_, line) = motion(pendulum, 0.9 + 1e-5 * NOISE).differentiated
    assert line.startswith("pin stands where its position keeps within 7.6e-05 rad") and "rad/s are taken as none there" in line
    assert len(motion(pendulum, 0.9 + 0 * TIME).differentiated) == 1, "rounding in memory is not worth one"


@pytest.mark.parametrize(("share", "stands"), [(0.99, True), (1.01, False)])
def test_a_drift_of_twice_the_resolution_is_no_stand(share, stands):
    """Within the middle half of forty samples, 19 steps, though eight of them in a row always keep within it."""
    x = share * 2e-3 / 19 * np.arange(40)
    both = tuple(replace(SLIDE, name=name, q_index=k, v_index=k) for k, name in enumerate("ab"))
    found = standing_of_integrated(both, 0.1 * np.arange(40), np.column_stack([5 * np.arange(40.0), x]), np.ones((40, 2)), 1e-3, 0.0)
    assert found.stands[:, 1].all() == found.held[:, 1].all() == stands and found.stands[:, 1].any() == stands and not found.stands[:, 0].any()


@pytest.mark.parametrize(("width", "stands"), [(0.99, True), (1.01, False)])
def test_a_position_stands_within_the_error_of_its_integration(width, stands):
    """1e-3 + 1e-2 |q|, for eight samples."""
    x = 2.0 - 0.021 * width * (np.arange(40) % 2)
    found = standing_of_integrated([SLIDE], 0.1 * np.arange(40), x[:, None], np.ones((40, 1)), 1e-3, 1e-2)
    assert found.stands.all() == stands and found.stands.any() == stands and found.rate[0] == pytest.approx(0.21)
    eight = standing_of_integrated(
        [SLIDE], np.arange(30.0), np.concatenate([np.arange(11.0), np.full(8, 11.5), np.arange(12.0, 23)])[:, None], np.ones((30, 1)), 1e-3, 0
    )
    assert np.flatnonzero(eight.stands[:, 0]).tolist() == list(range(11, 19)) and not eight.held.any()
    long = np.concatenate([np.arange(11.0), np.full(30, 11.5), np.arange(12.0, 23)])[:, None]
    held = standing_of_integrated([SLIDE], np.arange(52.0), long, np.ones((52, 1)), 1e-3, 0).held
    assert np.flatnonzero(held[:, 0]).tolist() == list(range(11 + WINDOW, 41 - WINDOW)), "but for those near its ends"
