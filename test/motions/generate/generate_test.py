"""ksl.motions.generate and `ksl motion`: what is made keeps to the limits, has the rates that it says, and is read back without a word."""

import itertools
import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import ksl
from ksl.base.errors import MotionError
from ksl.base_parameters import structural
from ksl.motions.generate import Waypoints, chirp, excitation, minimum_jerk, read_waypoints, template, trapezoid, write_motion
from ksl.motions.generate.excitation import Series, _Search
from ksl.motions.generate.generated import limits_of
from ksl.motions.reading import read_motion
from ksl_command import run_ksl
from linkages import FOURBAR, four_bar

MAKE = {
    "minjerk": minimum_jerk,
    "trapezoid": trapezoid,
    "chirp": lambda m, **o: chirp(m, duration=5, **o),
    "excite": lambda m, **o: excitation(m, iterations=60, **o),
}


@pytest.fixture(scope="module", params=["ur5", "panda"])
def model(request, examples):
    return ksl.load(examples / f"robots/{request.param}.urdf")


LINK = '<inertial><origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
JOINT = '<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><origin xyz="0.4 0 0"/><axis xyz="0 0 1"/>{{limit}}</joint>'
TWO = f'<robot name="two"><link name="a"/><link name="b">{LINK}</link><link name="c">{LINK}</link>{JOINT.format("hip", "a", "b")}{JOINT.format("knee", "b", "c")}</robot>'


@pytest.fixture
def two(robot):
    return robot(TWO.format(limit='<limit lower="-2" upper="2" effort="100" velocity="1.5"/>'))


def used(model, m):
    """Shares of the limits of position, speed and effort."""
    lower, upper = (np.array([getattr(model.joint(n), side) for n in model.joint_names]) for side in ("lower", "upper"))
    speed, effort = (np.array([getattr(model.joint(n), what) for n in model.joint_names]) for what in ("velocity", "effort"))
    tau = model.inverse_dynamics(m.q, m.v, m.a)
    position = np.abs(m.q - (lower + upper) / 2) / ((upper - lower) / 2)
    return [(x / of).max() for x, of in ((position, 1.0), (np.abs(m.v), speed), (np.abs(tau), effort))]


@pytest.mark.parametrize("kind", MAKE)
def test_limits_of_the_file_are_kept(model, kind):
    position, speed, effort = used(model, MAKE[kind](model).motion)
    assert position <= 0.9 + 1e-6 and speed <= 0.8 + 1e-9 and effort <= 0.8 + 1e-3
    assert max(speed, effort) > 0.6  # nor is it slower than it must be


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("kind", MAKE)
def test_they_are_read_back_without_a_word(model, kind, suffix, tmp_path):
    made = MAKE[kind](model)
    write_motion(model, made, tmp_path / f"motion.{suffix}")
    m = read_motion(model, tmp_path / f"motion.{suffix}")
    assert m.differentiated == m.contradictions == m.doubts == m.source.notes == []
    for name in ("time", "q", "v", "a"):
        np.testing.assert_allclose(getattr(m, name), getattr(made.motion, name), rtol=1e-13, atol=1e-13)
    assert [f.name for f in tmp_path.iterdir()] == [f"motion.{suffix}"]


@pytest.mark.parametrize("kind", MAKE)
def test_rates_are_the_derivatives_of_positions(two, kind):
    """By central differences; between waypoints, where trapezoids have corners, on average."""
    m = MAKE[kind](two, rate=2000.0).motion
    h = m.time[1] - m.time[0]
    tolerance = 2 * np.abs(m.a).max() * h  # of corners
    assert (m.q[2:] - m.q[:-2]) / (2 * h) == pytest.approx(m.v[1:-1], abs=tolerance)
    off = np.abs((m.v[2:] - m.v[:-2]) / (2 * h) - m.a[1:-1])
    assert np.quantile(off, 0.98) < 1e-3 * np.abs(m.a).max()


@pytest.mark.parametrize("kind", MAKE)
def test_motions_begin_at_rest(two, kind):
    m = MAKE[kind](two).motion
    assert m.v[[0, -1]] == pytest.approx(0, abs=1e-5)
    if kind != "trapezoid":
        assert m.a[[0, -1]] == pytest.approx(0, abs=1e-2 if kind == "chirp" else 1e-9)


def test_least_jerk_between_two_points_is_the_known_quintic(two):
    points = Waypoints(np.array([[-1.0, 0.5], [1.0, -0.5]]))
    m = minimum_jerk(two, points, duration=4.0).motion
    u = m.time / 4
    s = 10 * u**3 - 15 * u**4 + 6 * u**5
    assert m.q == pytest.approx(points.positions[0] + s[:, None] * np.diff(points.positions, axis=0), abs=1e-12)


def test_least_jerk_through_waypoints(two):
    """No other curve through them, at rest at both ends, has less: a perturbation that vanishes there adds to the integral."""
    points = Waypoints(np.array([[-1.0, 0.5], [0.8, 0.1], [1.0, -0.5]]), np.array([0.0, 2.0, 3.0]))
    m = minimum_jerk(two, points, rate=1000.0).motion
    assert m.q[[0, 2000, 3000]] == pytest.approx(points.positions, abs=1e-12)
    jerk = np.diff(m.a[:, 0]) / np.diff(m.time)
    t = m.time
    bump = (t / 3) ** 3 * (1 - t / 3) ** 3 * (t - 2)
    more = jerk + np.diff(np.gradient(np.gradient(bump, t), t)) / np.diff(t)
    assert np.sum(more**2) > np.sum(jerk**2) and abs(np.sum((more - jerk)[5:-5] * jerk[5:-5])) < 0.05 * np.sum(np.abs((more - jerk) * jerk))


def test_fastest_trapezoids(two):
    """2 rad with 80 % of 1.5 rad/s and 3 rad/s²: 0.4 s up, 0.4 s down, and 1.6 rad − 0.08 rad … in all d/v + v/a."""
    m = trapezoid(two, Waypoints(np.array([[-1.0, 0.0], [1.0, 0.0]])), acceleration=3.0).motion
    assert m.time[-1] == pytest.approx(2 / 1.2 + 1.2 / 3, rel=1e-5)
    assert np.abs(m.v[:, 0]).max() == pytest.approx(1.2, rel=1e-5) and np.unique(np.round(np.abs(m.a[:, 0]), 3)).tolist() == [0, 3]


@pytest.mark.parametrize("robot", ["panda", "ur5"])
def test_more_acceleration_never_makes_trapezoids_slower(examples, robot):
    """From some acceleration on the efforts are the limit, and the motion is the same for all that are larger."""
    m = ksl.load(examples / f"robots/{robot}.urdf")
    made = [trapezoid(m, acceleration=a) for a in (1.0, 5.0, 10.0, 20.0, 100.0, 1e6, 1e300)]
    lasts = np.array([g.motion.time[-1] for g in made])
    assert (np.diff(lasts) <= 1e-3 * lasts[1:]).all() and lasts[3] < 0.99 * lasts[2] and lasts[3:] == pytest.approx(lasts[3], rel=1e-3)
    last = made[-1].motion
    share = np.abs(m.inverse_dynamics(last.q, last.v, last.a)) / limits_of(m).effort
    assert share.max() == pytest.approx(0.8, rel=0.01)


def test_short_ramps_keep_to_limits_of_effort(two):
    """A ramp of a ten-thousandth of the time has the peak of the effort, and instants at equal distances would miss it."""
    points = Waypoints(np.array([[-1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [-1.0, 0.5]]))
    m = trapezoid(two, points, acceleration=1e5, rate=2e4).motion
    assert (np.abs(two.inverse_dynamics(m.q, m.v, m.a)) <= 0.8001 * limits_of(two).effort).all()


def test_times_that_are_too_short_are_refused(two):
    points = Waypoints(np.array([[-1.0, 0.5], [1.0, -0.5]]))
    with pytest.raises(
        MotionError, match=r"minjerk: in 1 s the speed of hip would be 2\.5 of its limit 1\.5 rad/s, at 0\.5 s; the shortest time within all limits is 2\.5 s"
    ):
        minimum_jerk(two, points, duration=1.0)
    with pytest.raises(MotionError, match="duration -1 s: expected a positive number"):
        trapezoid(two, points, duration=-1.0)


@pytest.mark.parametrize("value", [1e-300, 1e-7, 1e10, 1e300, np.inf, np.nan])
@pytest.mark.parametrize("kind", [minimum_jerk, trapezoid, chirp])
def test_durations_and_rates_that_no_motion_has(two, kind, value):
    for name in ("duration", "rate"):
        with pytest.raises(MotionError, match="expected a positive number, 1e-06|chirp from"):
            kind(two, **{name: value})


def test_shortest_durations(two):
    for kind in (minimum_jerk, trapezoid):
        with pytest.raises(MotionError, match=r"in 1e-06 s the \w+ of \w+ would be .* of its limit .* rad/s, at .* s; the shortest time within all limits is"):
            kind(two, duration=1e-6)
    with pytest.raises(MotionError, match="seed -1; expected 0 or more"):
        excitation(two, iterations=1, seed=-1)


def test_waypoints_of_a_table(two, tmp_path):
    path = tmp_path / "points.csv"
    limits = limits_of(two)
    read = lambda text: (path.write_text(text), read_waypoints(two, limits, path))[1]
    points = read("time,knee\n0,1\n3,-1\n")
    assert points.positions.tolist() == [[0, 1], [0, -1]] and points.times.tolist() == [0, 3] and points.notes == ("no column for hip: at rest",)
    assert read("time,hip,knee\n0,0,1\n0,0,-1\n").times is None  # a template that was filled in
    for text, says in {
        "hip,knee\n0,1\n": "1 waypoint; a motion needs at least two",
        "hip,kne\n0,1\n0,0\n": "did you mean 'knee'",
        "hip,knee\n0,1\n0,2.5\n": "waypoint 2: knee 2.5 rad is beyond its upper limit 2 rad",
        "time,hip,knee\n0,0,1\n1,0,1\n1,0,0\n": "waypoint 3: time 1 after 1; times must increase",
    }.items():
        with pytest.raises(MotionError, match=says.replace("?", r"\?")):
            read(text)


def test_a_template_has_the_columns_and_keeps_to_limits(examples, tmp_path):
    panda = ksl.load(examples / "robots/panda.urdf", floating_base=True)
    made = template(panda)
    write_motion(panda, made, tmp_path / "t.csv")
    head, row = (tmp_path / "t.csv").read_text().splitlines()
    assert head.startswith("time,floating_base.x,floating_base.y,floating_base.z,floating_base.qx") and head.count(",") == 14
    assert row.split(",")[7] == "1" and float(row.split(",")[11]) == panda.joint("panda_joint4").upper
    assert made.notes == ["the limits of panda_joint4 exclude zero: at the nearest limit"]


def test_excitation_makes_the_condition_number_small_and_says_it(model):
    found = excitation(model, iterations=400, seed=3)
    base, m = structural(model), found.motion
    W = base.regressor(model.inverse_dynamics_regressor(m.q[:-1:25], m.v[:-1:25], m.a[:-1:25], links=base.links)).reshape(-1, len(base))
    assert np.linalg.cond(W) == pytest.approx(found.facts["condition"], rel=1e-6)
    assert found.facts["condition"] < 0.8 * found.facts["first"] < 100
    assert m.q[0] == pytest.approx(m.q[-1], abs=1e-9)  # one period


def test_excitation_is_the_same_for_the_same_seed_and_iterations(two):
    one, other, third = (excitation(two, iterations=50, seed=s).motion.q for s in (1, 1, 2))
    assert np.array_equal(one, other) and not np.array_equal(one, third)


def test_gravity_that_joints_cannot_hold_is_said(robot):
    weak = robot(
        '<robot name="weak"><link name="a"/><link name="b"><inertial><origin xyz="1 0 0"/><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
        '</inertial></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="50" velocity="1"/></joint></robot>'
    )
    assert any("j: holding still takes 80 % of the limit of the effort or more" in n for n in minimum_jerk(weak).notes)


def test_examples_of_the_page(examples, tmp_path, monkeypatch):
    page = (examples.parent / "docs/generating.md").read_text()
    (tmp_path / "examples").symlink_to(examples)
    monkeypatch.chdir(tmp_path)
    lines = [line.split() for line in page.splitlines() if line.startswith("ksl motion examples")]
    assert len(lines) == 4
    from typer.testing import CliRunner

    from ksl.commands import app

    for line in lines:
        run = CliRunner().invoke(app, line[1:])
        assert run.exit_code == 0, run.output
        assert (tmp_path / line[-1]).exists()
    exec(page.split("```python")[1].split("```")[0], {})
    assert (tmp_path / "pick.csv").exists()


def test_excitation_of_a_closed_mechanism():
    m = four_bar()
    made = excitation(m, period=4, rate=50, iterations=60)
    assert np.abs(m.loop_error(made.motion.q)).max() < 1e-11 and made.facts["parameters"] == len(structural(m)) == 8
    assert made.facts["condition"] <= made.facts["first"] < 1e7 and np.ptp(made.motion.q[:, 0]) > 0.5
    b = ksl.Builder("slider").add_link("ground")
    for name in ("crank", "rod", "slider"):
        b.add_link(name, mass=1.0, inertia=np.eye(3))
    b.add_joint("A", "continuous", "ground", "crank", axis=(0, 0, 1)).add_joint("B", "spherical", "crank", "rod", xyz=(0.1, 0, 0))
    b.add_joint("S", "prismatic", "ground", "slider", axis=(1, 0, 0)).add_loop("C", "spherical", "rod", "slider")
    assert not any("at rest" in note for note in limits_of(b.build(drives=["A"])).notes)  # B follows
    with pytest.raises(MotionError, match="none of 5 candidates can be followed"):  # the rocker's end is out of reach for most of the way
        excitation(ksl.load_string(FOURBAR.replace("0.35 0.04 0.04", "0.62 0.04 0.04"), drives=["A"]), iterations=5)


def command(*arguments):
    return run_ksl("motion", *arguments)


def test_the_command(examples, tmp_path):
    robot = examples / "robots/ur5.urdf"
    run = command(robot, "--kind", "excite", "--iterations", "20", "--seed", "4", "-o", tmp_path / "e.parquet")
    assert run.returncode == 0 and "condition number" in run.stdout and "best of 20 motions with seed 4" in run.stdout, run.stderr
    import pyarrow.parquet as pq

    how = json.loads(pq.read_schema(tmp_path / "e.parquet").metadata[b"ksl"])
    assert how["kind"] == "excite" and how["seed"] == 4 and how["robot"] == "ur5"
    for arguments, says in {
        ("--kind", "jump", "-o", "x.csv"): "--kind jump: expected one of template, minjerk",
        ("--kind", "chirp", "--seed", "3", "-o", "x.csv"): "--seed is for excite, not for chirp; leave it out",
        ("--kind", "chirp", "-o", "x.txt"): "unknown suffix '.txt'; give a name that ends in .csv or .parquet",
        ("--kind", "chirp", "--to", "200", "-o", "x.csv"): "ten samples a period or more",
    }.items():
        run = command(robot, *arguments)
        assert run.returncode == 2 and says in run.stderr and not list(tmp_path.glob("x*")), run.stderr


@pytest.mark.parametrize(("seed", "size"), [(0, 24), (1, 24), (2, 24), (1, 120)])
def test_steps_of_a_search(monkeypatch, seed, size):
    """Forty random candidates, and then steps from the best one: 1.3 times as long after a success, 0.94 times after a failure, of 0.02 to 1.5."""
    costs, seen = np.random.default_rng(seed).random(400), []
    if seed:  # almost only failures, or only successes
        costs = np.concatenate([costs[:40], (1 + costs[40:]) if seed == 1 else np.linspace(0.1, 0.0, 360) * costs[:40].min()])
    monkeypatch.setattr(_Search, "_cost", lambda self, x: (seen.append(x), costs[len(seen) - 1])[1])
    search = _Search(None, None, None, type("Series", (), {"size": size})(), seed)
    length, best = 0.5, np.inf
    for k, cost in enumerate(costs):
        before = search.best
        search.step()
        assert search.tried == k + 1 and search.smallest == min(best, cost)
        assert search.first == search.smallest if k < 40 else search.first == costs[:40].min()
        if k >= 40:
            moved = (seen[k] - before)[seen[k] != before]
            assert len(moved) < size and (len(moved) < 4 or np.sqrt(np.mean(moved**2)) < 4 * length)
            length = min(max(length * (1.3 if cost < best else 0.94), 0.02), 1.5)
        assert search._length == pytest.approx(length)
        best = min(best, cost)
    share = max(4 / size, 0.1)  # of the numbers are changed at once, on average
    changed = [np.sum(seen[k] != seen[j]) for k, j in zip(range(41, 400), range(40, 399), strict=True)]
    assert seed != 1 or np.mean(changed) == pytest.approx(size * share * (2 - share), rel=0.06)


def test_progress_of_a_search_is_told_every_ten_candidates(two):
    told = []
    excitation(two, iterations=35, rate=20.0, progress=lambda share, condition: told.append((share, condition)))
    assert [share for share, _ in told] == pytest.approx([10 / 35, 20 / 35, 30 / 35]) and all(b <= a for (_, a), (_, b) in itertools.pairwise(told))


def test_progress_of_a_search_ends_with_its_time(two, monkeypatch):
    """Ten candidates take a little longer than the time that is given."""
    ticks, told = itertools.count(1000.0, 0.11), []
    monkeypatch.setattr(sys.modules[_Search.__module__], "clock", SimpleNamespace(monotonic=lambda: next(ticks)))
    found = excitation(two, seconds=1.0, rate=20.0, progress=lambda share, condition: told.append(share))
    assert told == [1.0] and found.facts["iterations"] == 10


def test_waypoints_begin_at_their_first_time(two, tmp_path):
    (tmp_path / "points.csv").write_text("time,hip,knee\n2,0,1\n5,1,0.5\n8,0,-1\n")
    points = read_waypoints(two, limits_of(two), tmp_path / "points.csv")
    assert points.times.tolist() == [0, 3, 6] and minimum_jerk(two, points).motion.time[-1] == 6


@pytest.mark.parametrize("effort", [2.0, 1000.0])
def test_the_cost_of_a_candidate(robot, effort):
    """The condition number of the regressor; ten times the share by which efforts are beyond 80 % of their limits is added to it, as a factor."""
    model = robot(TWO.format(limit=f'<limit lower="-2" upper="2" effort="{effort}" velocity="1.5"/>'))
    base, limits = structural(model), limits_of(model)
    series = Series(limits, 5.0)
    search = _Search(model, limits, base, series, 0)
    for seed in range(4):
        x = np.random.default_rng(seed).normal(size=series.size)
        q, v, a = series(x, series.times)
        W = base.regressor(model.inverse_dynamics_regressor(q, v, a, links=base.links)).reshape(-1, len(base))
        beyond = max(0.0, np.abs(model.inverse_dynamics(q, v, a)).max() / (0.8 * effort) - 1)
        assert search._cost(x) == pytest.approx(np.linalg.cond(W) * (1 + 10 * beyond), rel=1e-4) and (beyond > 0) == (effort < 100)
