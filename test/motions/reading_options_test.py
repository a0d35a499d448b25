"""Maps of columns, degrees, resampling and a window of time: in Python and as options of the command."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import ksl
from ksl.mechanism.joint_kinds import columns_of
from ksl.motions.reading import read_motion
from ksl.motions.reading_options import check_options

DEGREE = np.pi / 180


def text(columns: dict[str, np.ndarray]) -> str:
    return ",".join(columns) + "\n" + "".join(",".join(repr(float(x)) for x in row) + "\n" for row in zip(*columns.values()))


@pytest.fixture
def time() -> np.ndarray:
    return np.arange(12) * 0.25


@pytest.mark.parametrize(("x", "good"), [(2, True), (2.5, True), (np.float32(2), True), (None, True), (True, False), ("2", False), ([2.0], False)])
@pytest.mark.parametrize("name", ["resample", "start", "stop", "smooth"])
def test_numbers_are_no_words_and_no_lists(name, x, good):
    if good:
        check_options("load.toml", {name: x})
    else:
        with pytest.raises(ksl.MotionError, match=rf"^load\.toml: {name} is {re.escape(repr(x))}; expected a number$"):
            check_options("load.toml", {name: x})


# maps


TOML = """
[columns]
"Axis 1 (deg)" = { to = "hip", unit = "deg", sign = -1 }
counts = { to = "slide", scale = 0.001, offset = -2 }
t_ms = { to = "time", unit = "ms" }
"""
CSV = "from,to,unit,sign,scale,offset\nAxis 1 (deg),hip,deg,-1,,\ncounts,slide,,,0.001,-2\nt_ms,time,ms,,,\n"
GERMAN = CSV.replace(",", ";")


@pytest.mark.parametrize("form", [TOML, CSV, GERMAN])
def test_maps_from_files(leg, written, time, form):
    path = written(text({"t_ms": 1000 * time, "Axis 1 (deg)": 10 * time, "counts": 100 * time, "mode": time}))
    m = read_motion(leg, path, map=written(form, "map.toml"), ignore_extra=True)
    assert np.array_equal(m.time, time)
    assert m.q == pytest.approx(np.column_stack([-10 * DEGREE * time, 0.1 * time - 2]), abs=1e-15)
    assert m.source.notes == [
        "column 't_ms' is taken as the time",
        "times were converted from ms to s",
        f"columns by the map {written(form, 'map.toml')}: 'Axis 1 (deg)' is hip (× -1 in deg), 'counts' is slide (× 0.001 -2)",
        "converted from deg to rad: hip",
        "columns that are not used: 'mode'",
    ]


def test_times_in_minutes_by_their_name(leg, written, time):
    found = read_motion(leg, written(text({"Time [min]": time / 60, "hip [deg]": 90 * time, "slide": time})))
    assert found.time == pytest.approx(time, abs=1e-12) and found.q[:, 0] == pytest.approx(np.pi / 2 * time)
    assert found.source.notes == ["column 'Time [min]' is taken as the time", "times were converted from min to s", "converted from deg to rad: hip"]


@pytest.mark.parametrize("rule", ["offset = 5", "sign = -1", "offset = 5, sign = -1"])
def test_times_have_neither_sign_nor_offset(leg, written, time, refusal, rule):
    path = written(text({"ms": 1000 * time, "hip": time, "slide": time}))
    by = written(f'[columns]\nms = {{ to = "time", unit = "ms", {rule} }}\n', "map.toml")
    with pytest.raises(ksl.MotionError, match="column 'ms' holds times, which take a unit or a scale, and neither sign nor offset"):
        read_motion(leg, path, map=by)


def test_a_map_of_two_columns_and_a_mapping(leg, written, time):
    path = written(text({"time": time, "j1": 2 * time, "j2": 3 * time}))
    by_file = read_motion(leg, path, map=written("j1,slide\nj2,hip\n", "map.csv"))
    by_mapping = read_motion(leg, path, map={"j1": "slide", "j2": "hip"})
    flat = read_motion(leg, path, map=written('j1 = "slide"\nj2 = "hip"\n', "map.toml"))
    for m in (by_file, by_mapping, flat):
        assert np.array_equal(m.q, np.column_stack([3 * time, 2 * time]))


def test_rates_are_mapped_with_their_joint(leg, written, time):
    """The offset is of positions alone; a velocity in degrees is one in degrees a second."""
    path = written(text({"time": time, "j1": 90 - 10 * time, "j1.v": -10 + 0 * time, "slide": time}))
    m = read_motion(leg, path, map={"columns": {"j1": {"to": "hip", "unit": "deg", "sign": -1, "offset": 90}}})
    assert m.q[:, 0] == pytest.approx(10 * DEGREE * time, abs=1e-15) and m.v[:, 0] == pytest.approx(10 * DEGREE + 0 * time, abs=1e-15)


@pytest.mark.parametrize("ignored", ['"mode"', "[1]", '["mode", 1]', "{ mode = 1 }"])
def test_what_is_ignored_is_a_list_of_columns(leg, written, time, ignored):
    path = written(text({"time": time, "hip": time, "slide": time, "mode": time}))
    with pytest.raises(ksl.MotionError, match=r'map\.toml: ignore is a list of columns: ignore = \["name", …\]$'):
        read_motion(leg, path, map=written(f"ignore = {ignored}\n", "map.toml"))


def test_ignored_columns_and_joints_at_rest(leg, written, time):
    form = 'ignore = ["mode"]\n[constants]\nslide = 0.25\n'
    m = read_motion(leg, written(text({"time": time, "hip": np.sin(time), "mode": time})), map=written(form, "map.toml"))
    assert np.array_equal(m.q[:, 1], 0.25 + 0 * time) and not m.v[:, 1].any() and not m.a[:, 1].any()
    assert any(note.endswith("says: slide = 0.25") for note in m.source.notes)
    assert m.differentiated == ["velocities and accelerations of hip differentiated from a quintic spline through the samples"]


def test_joints_of_bags_by_a_map(leg, tmp_path):
    import ros_bags_test

    path = ros_bags_test.write(tmp_path, "mcap", [(log, s, ["left_hip", "rail"], q, v, []) for log, s, _, q, v, _ in ros_bags_test.leg_messages()])
    m = read_motion(leg, path, map={"left_hip": "hip", "rail": "slide"})
    assert m.v[:, 0] == pytest.approx(2 * m.time) and m.v[:, 1] == pytest.approx(1 + 0 * m.time)


BAD_MAPS = {
    "absent column": ({"j9": "hip"}, "map: column 'j9' is not in "),
    "absent column, near": ({"Hip1": "hip"}, "did you mean 'hip1'?"),
    "unknown joint": ({"hip1": "hips"}, "map: column 'hip1' is to be 'hips', which no joint of leg has; did you mean 'hip'?"),
    "twice": ({"hip1": "hip", "slide": "hip"}, "map: columns 'hip1' and 'slide' are both to be 'hip'"),
    "both": ({"hip1": "slide"}, "column 'slide' would be the position of joint slide, but map maps 'hip1' to it, too"),
    "unit": ({"hip1": {"to": "hip", "unit": "mm"}}, "map: column 'hip1' is in 'mm', but expected rad"),
    "key": ({"hip1": {"to": "hip", "offset_": 2}}, "map: column 'hip1' has the unknown key 'offset_'; did you mean 'offset'?"),
    "sign": ({"hip1": {"to": "hip", "sign": 2}}, "map: column 'hip1' has sign 2; expected 1 or -1"),
    "scale": ({"hip1": {"to": "hip", "scale": 0}}, "map: column 'hip1' has scale 0; for a joint at rest give its position in [constants]"),
    "number": ({"hip1": {"to": "hip", "scale": "2"}}, "map: column 'hip1' has scale '2'; expected a number"),
    "no rule": ({"hip1": 3}, "map: column 'hip1' is 3; expected \"name\""),
    "constant": ({"columns": {"hip1": "hip"}, "constants": {"slides": 1}}, "map: [constants] names 'slides', which no joint of leg has; did you mean 'slide'?"),
    "constant and column": ({"columns": {"hip1": "hip"}, "constants": {"slide": 1}}, "map: 'slide' is a constant, but "),
    "constant, no number": ({"columns": {}, "constants": {"slide": "x"}}, "map: constants.slide is 'x'; expected a position"),
    "table": ({"columns": {}, "column": {}}, "map: unknown table 'column'; did you mean 'columns'"),
}


@pytest.mark.parametrize("what", BAD_MAPS)
def test_maps_that_are_refused(leg, written, time, what):
    columns, sentence = BAD_MAPS[what]
    with pytest.raises(ksl.MotionError) as e:
        read_motion(leg, written(text({"time": time, "hip1": time, "slide": time})), map=columns)
    assert sentence in str(e.value), str(e.value)


BAD_FILES = {
    "TOML": ("[columns]\nhip = \n", "is not TOML"),
    "three columns": ("j1,hip,x\n", "expected the columns from,to,unit,sign,scale,offset"),
    "one column": ("hip\n", "expected a TOML file with [columns], or a CSV table"),
    "scale": ("from,to,scale\nj1,hip,x\n", ":2: scale is 'x'; expected a number"),
    "repeated": ("j1,hip\nj1,slide\n", ":2: column 'j1' stands in the map twice"),
    "half": ("j1,hip\nj2,\n", ":2: expected a column of the file and a column of the motion"),
    "no text": (b"\xff\xff\xff", "is not text"),
}


@pytest.mark.parametrize("what", BAD_FILES)
def test_files_of_maps_that_are_refused(leg, written, time, what):
    content, sentence = BAD_FILES[what]
    path = written(content, "map.any")
    with pytest.raises(ksl.MotionError) as e:
        read_motion(leg, written(text({"time": time, "hip": time, "slide": time})), map=path)
    assert str(e.value).startswith(str(path)) and sentence in str(e.value), str(e.value)


# degrees


def test_degrees_are_of_angles_and_their_rates(leg, written, time):
    columns = {"time": time, "hip": 90 * time, "hip.v": 90 + 0 * time, "hip.a": 0 * time, "slide": time, "slide.v": 1 + 0 * time, "slide.a": 0 * time}
    m = read_motion(leg, written(text(columns)), degrees=True)
    assert m.q == pytest.approx(np.column_stack([np.pi / 2 * time, time]), abs=1e-15)
    assert m.v == pytest.approx(np.column_stack([np.pi / 2 + 0 * time, 1 + 0 * time]), abs=1e-15)
    assert m.source.notes == ["converted from deg to rad: hip", "converted from deg/s to rad/s: hip.v", "converted from deg/s² to rad/s²: hip.a"]


def test_units_that_the_file_gives_come_before_degrees(leg, written, time):
    m = read_motion(leg, written("time,hip,slide\ns,rad,m\n" + text({"time": time, "hip": time, "slide": time}).split("\n", 1)[1]), degrees=True)
    assert np.array_equal(m.q[:, 0], time) and m.source.notes == []


def test_degrees_of_joints_with_several_coordinates(robot, written):
    link = '<link name="{0}"/><joint name="{0}" type="{2}"><parent link="{1}"/><child link="{0}"/><axis2 xyz="0 1 0"/></joint>'
    chain = [link.format(kind, parent, kind) for parent, kind in (("ground", "planar"), ("planar", "cylindrical"), ("cylindrical", "spherical"))]
    m = robot(f'<robot name="r"><link name="ground"/>{"".join(chain)}</robot>', masses="optional")
    t = np.linspace(0, 1, 7)
    names = [c for j in m.joints[:3] for c in columns_of(j)[0]]
    q = read_motion(m, written(text({"time": t} | {c: 0 * t + (c == "spherical.qw" or 10 * (".q" not in c)) for c in names})), degrees=True).q
    assert q[0] == pytest.approx([10, 10, 10 * DEGREE, 10 * DEGREE, 10, 0, 0, 0, 1])


# resampling, and a window


def test_resampling_is_exact_for_quintics(leg, written):
    """Of uneven samples; rates that are given are resampled with them."""
    rng = np.random.default_rng(3)
    t = np.sort(np.append(rng.uniform(0, 2, 30), [0.0, 2.0]))
    p = [np.polynomial.Polynomial(c) for c in rng.normal(size=(2, 6))]
    columns = {"time": t, "hip": p[0](t), "slide": p[1](t)}
    at = np.arange(21) / 10
    m = read_motion(leg, written(text(columns)), resample=10)
    assert np.allclose(m.time, at, rtol=0, atol=1e-15) and m.q == pytest.approx(np.column_stack([x(at) for x in p]), abs=1e-9)
    assert m.v == pytest.approx(np.column_stack([x.deriv()(at) for x in p]), abs=1e-7)
    assert m.source.samples == 21 and m.source.step == pytest.approx(0.1)
    assert m.source.notes == [f"resampled to 10 Hz (21 samples) from 32 samples with a median step of {np.median(np.diff(t)):.6g} s, on quintic splines"]
    given = read_motion(leg, written(text(columns | {"hip.v": p[0].deriv()(t)})), resample=10)
    assert given.v[:, 0] == pytest.approx(p[0].deriv()(at), abs=1e-9)


def test_quaternions_between_few_samples_have_unit_length(flying, written):
    """A spline through quaternions 0.6 rad apart leaves the sphere by up to a thousandth: nobody is told of that, and positions are not touched."""
    t = np.linspace(0, 4, 14)
    of = lambda t: np.column_stack([3 * t, 5 + t, 7 - t, *(np.array([[1], [2], [2]]) / 3 * np.sin(t)), np.cos(t)])
    values = of(t).T
    m = read_motion(flying, written(text({"time": t} | {f"floating_base.{c}": x for c, x in zip("x y z qx qy qz qw".split(), values)})), resample=50)
    assert np.allclose(np.linalg.norm(m.q[:, 3:], axis=1), 1, rtol=0, atol=1e-14) and m.contradictions == []
    assert m.q == pytest.approx(of(m.time), abs=2e-3) and m.q[:, :3] == pytest.approx(of(m.time)[:, :3], abs=1e-12)


def test_quaternions_are_resampled(flying, written):
    """A body that turns about z at 2 rad/s, by more than a turn, in a file whose quaternions change their sign."""
    t = np.linspace(0, 4, 161)
    zero = 0 * t
    sign = np.where(np.random.default_rng(1).uniform(size=161) < 0.5, -1, 1)
    values = [t, zero, zero, zero, zero, sign * np.sin(t), sign * np.cos(t)]
    m = read_motion(flying, written(text({"time": t} | {f"floating_base.{c}": x for c, x in zip("x y z qx qy qz qw".split(), values)})), resample=100)
    assert np.allclose(np.linalg.norm(m.q[:, 3:], axis=1), 1, rtol=0, atol=1e-14)
    turned = np.column_stack([np.sin(m.time), np.cos(m.time)]) * sign[0]
    assert m.q[:, 5:] == pytest.approx(turned, abs=1e-9) and m.v[:, 5] == pytest.approx(2 + 0 * m.time, abs=1e-6)


@pytest.mark.parametrize(
    "rate, sentence", [(0, "(resample=) is 0; expected samples a second"), (1e9, "makes 2.75e+09 samples of 2.75 s"), (0.1, "makes 1.27 samples")]
)
def test_rates_that_are_refused(leg, written, time, refusal, rate, sentence):
    assert sentence in refusal(leg, written(text({"time": time, "hip": time, "slide": time})), resample=rate)


def test_faults_of_resampled_motions_are_named_where_they_are(leg, written, time, refusal):
    few = written(text({"time": time[:5], "hip": time[:5], "slide": time[:5]}))
    assert refusal(leg, few, resample=10) == ": 5 samples, but resampling needs at least 6"


def test_a_window_of_time(leg, written, time, refusal):
    path = written(text({"time": time, "hip": np.where(time < 0.5, np.inf, time), "slide": time}))
    assert refusal(leg, path).startswith(":2: column 'hip' is infinite")
    m = read_motion(leg, path, start=0.5, stop=2)
    assert np.array_equal(m.time, time[2:9]) and m.source.notes == ["used is the part from 0.5 s to 2 s"]
    bad = written(text({"time": time, "hip": np.where(time == 1.5, -np.inf, time), "slide": time}))
    assert refusal(leg, bad, start=0.5).startswith(":8: column 'hip' is infinite"), "the line is that of the file"
    assert refusal(leg, path, start=5) == ": no samples from 5 s; its times are 0 s to 2.75 s: check --from and --to (start=, stop=)"
    assert "--from (start=) is nan; expected a time" in refusal(leg, path, start=float("nan"))


@pytest.mark.parametrize("unit, factor", [("s", 1), ("ms", 1e3), ("us", 1e6), ("min", 1 / 60)])
def test_units_of_times(leg, written, time, unit, factor):
    m = read_motion(leg, written(text({"time": time * factor, "hip": time, "slide": time})), time_unit=unit)
    assert m.time == pytest.approx(time, abs=1e-12)
    assert m.source.notes == ([f"times were converted from {unit} to s"] if unit != "s" else [])


def test_clock_times_have_their_unit(leg, written, time):
    rows = "".join(f"0:00:{t:05.2f},{t},{t}\n" for t in time)
    assert read_motion(leg, written("time,hip,slide\n" + rows), time_unit="ms").time == pytest.approx(time, abs=1e-12)


def test_units_of_times_that_are_refused(leg, written, time, refusal):
    columns = {"hip": time, "slide": time}
    assert "is 'm'; expected s, ms, us, ns or min" in refusal(leg, written(text({"time": time} | columns)), time_unit="m")
    assert "column 'time [ms]' is in ms, but --time-unit (time_unit=) is 'us'" in refusal(leg, written(text({"time [ms]": time} | columns)), time_unit="us")


# the command


def loads(*arguments) -> tuple[int, str]:
    from ksl.commands import app

    result = CliRunner().invoke(app, ["loads", *map(str, arguments)])
    return result.exit_code, " ".join(result.output.split())


def test_options_of_the_command(leg, written, time, tmp_path):
    rows = {"Zeit": time, "j1": 10 * np.sin(time), "j2": np.cos(time), "mode": time}
    motion, columns = written(text(rows)), written('j1 = "hip"\nj2 = "slide"\n', "map.toml")
    out = tmp_path / "out"
    status, said = loads(
        leg.file, motion, "-o", out, "--map", columns, "--degrees", "--resample", 20, "--from", 0.5, "--to", 2.5, "--ignore-extra", "--positions-only"
    )
    assert status == 0, said
    for note in (
        "column 'Zeit' is taken as the time, in s",
        "converted from deg to rad: hip",
        "used is the part from 0.5 s to 2.5 s",
        "resampled to 20 Hz (41 samples)",
        "not used: 'mode'",
    ):
        assert note in said, note
    import pyarrow.parquet as pq

    table = pq.read_table(out / "wrenches.parquet")
    assert len(table) == 41 * len(leg.joints)
    made = json.loads(table.schema.metadata[b"ksl"])
    (case,) = made["cases"]
    assert (case["motion"], case["format"], case["samples"], case["step"]) == (str(motion), "CSV", 41, pytest.approx(0.05))
    assert "converted from deg to rad: hip" in case["reading"]
    assert {i["role"] for i in made["inputs"]} == {"robot", "motion", "map"} and made["options"]["resample"] == 20
    assert "# motion: " + str(motion) + ", CSV, 41 samples, median step 0.05 s, from 0.5 s to 2.5 s" in (out / "summary.csv").read_text()


def test_mistakes_on_the_command_line(leg, written, time, tmp_path):
    motion = written(text({"time": time, "hip": time, "slide": time}))
    out = tmp_path / "out"
    assert loads(motion, leg.file, "-o", out) == (2, f"ksl: {motion} is no robot file, but {leg.file} is: the robot comes first, then the motion")
    results = tmp_path / "results"
    results.mkdir()
    for name in ("wrenches.parquet", "wrenches.mcap"):
        (results / name).touch()
    assert "holds the wrenches that `ksl loads` has computed, not a motion; give the motion's file" in loads(leg.file, results, "-o", out)[1]
    assert "holds results of `ksl loads`, and no robot; the robot's file comes first" in loads(results, motion, "-o", out)[1]
    status, said = loads(leg.file, motion, "-o", out, "--map", tmp_path / "absent.toml")
    assert status == 2 and said == f"ksl: {tmp_path}/absent.toml: can't be read (No such file or directory); give a map of columns, a TOML or a CSV file"
    status, said = loads(leg.file, motion, "-o", out, "--topic", "/joint_states")
    assert status == 2 and "--topic (topic=) chooses among the topics of a bag" in said
    assert not out.exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"degrees": "yes"}, "degrees is 'yes'; expected true or false"),
        ({"smooth": "20"}, "smooth is '20'; expected a number"),
        ({"time_unit": 3}, "time_unit is 3"),
        ({"map": 3}, "map is 3"),
    ],
)
def test_values_that_no_option_has(tmp_path, options, words):
    """From programs and from files of load cases and sweeps, which hold anything."""
    with pytest.raises(ksl.MotionError, match=words):
        ksl.read_motion(None, tmp_path / "none.csv", **options)


def test_the_model_comes_first(leg, written):
    with pytest.raises(ValueError, match="model is str; expected a model"):
        read_motion(leg.file, written("time,hip,slide\n"))


@pytest.mark.parametrize(
    ("names", "rules", "v", "said"),
    [
        ("x x.v", {"x": {"to": "hip", "scale": 2.0}}, 2.0, None), ("x x.v", {"x": "hip", "x.v": {"to": "hip.v", "scale": 3.0}}, 3.0, None), ("x x.v", {"x": "hip", "x.v": "slide.v"}, None, "slide.v"),
        ("x hip.v", {"x": {"to": "hip", "scale": 2.0}}, 1.0, None), ("x.v hip", {"x.v": "hip.v"}, 1.0, None),
    ],
)  # fmt: skip
def test_rates_of_a_mapped_joint_are_mapped_with_it(leg, written, names, rules, v, said):
    """By its scale, unless the map says something else of them."""
    t = np.arange(8.0)
    path = written(
        "time,slide," + ",".join(names.split()) + "\n" + "".join(f"{k},0,{k},1\n" if not names.startswith("x.v") else f"{k},0,1,{k}\n" for k in range(8))
    )
    motion = read_motion(leg, path, map=rules)
    if said is None:
        assert motion.v[:, 0] == pytest.approx(v + 0 * t) and not any("velocities of hip" in line for line in motion.differentiated)
    else:
        assert motion.v[:, 1] == pytest.approx(1 + 0 * t) and any("hip" in line for line in motion.differentiated)
