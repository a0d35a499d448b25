"""The report: decimation keeps every extreme; the page loads nothing, holds everything and trusts no name."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ksl_command import run_ksl
from ksl.base.notes import NoteKind, Note, not_used
from ksl.load_cases.provenance import InputFile, Provenance
from ksl.load_cases.quantities import PowerBalance, joint_loads, summarise
from ksl.load_cases.verdict import Use, Verdict
from ksl.mechanism.mechanism import Joint
from ksl.report.html.charts import POINTS, decimate, limits_in_sight
from ksl.report.html.input import CaseCurves, ReportInput
from ksl.report.html.numbers import format_number, peak
from ksl.report.html.page import write_report
from ksl.report.html.stills import largest_load
from ksl.report.html.verdict_section import ComponentsVerdict, verdict_section
from ksl.report.html.rows import exceeds, with_limits

NASTY = """</script><script>alert('1')</script><!-- & "x" <b> \\u003c µ"""


def curve(seed, n):
    return np.random.default_rng(seed).normal(size=n).cumsum()


# ------------------------------------------------------------------------------------------------------------ decimate

lengths = st.integers(1, 30_000)
seeds = st.integers(0, 2**32 - 1)


@given(seeds, lengths, st.integers(2, 4000))
def test_decimation_keeps_extremes_and_ends(seed, n, points):
    x = curve(seed, n)
    kept = decimate(x, points=points)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == n - 1
    assert len(kept) <= points + 2
    assert x[kept].min() == x.min()
    assert x[kept].max() == x.max()


@given(seeds, lengths)
def test_decimation_of_few_samples_keeps_all(seed, n):
    assert decimate(curve(seed, n), points=n).tolist() == list(range(n))


@given(seeds, st.integers(POINTS + 1, 30_000))
def test_decimation_in_a_plane_keeps_extremes_of_both(seed, n):
    x, y = curve(seed, n), curve(seed + 1, n)
    kept = decimate(x, y)
    assert len(kept) <= POINTS + 2
    for z in (x, y):
        assert z[kept].min() == z.min()
        assert z[kept].max() == z.max()


@given(seeds, st.integers(POINTS + 1, 30_000))
def test_decimation_leaves_no_gap(seed, n):
    # two samples of each bucket at least, so neighbours are less than two buckets apart
    assert np.diff(decimate(curve(seed, n))).max() < 2 * -(-n // (POINTS // 2))


def test_decimation_keeps_a_spike_of_one_sample():
    x = np.zeros(100_000)
    x[54_321] = 1
    assert 54_321 in decimate(x)


def test_decimation_of_a_constant():
    kept = decimate(np.ones(100_000))
    assert kept[0] == 0
    assert kept[-1] == 99_999


# ------------------------------------------------------------------------------------------------------------- numbers


@pytest.mark.parametrize(
    ("x", "text"),
    [
        (0.0, "0"),
        (1e-17, "0"),
        (1.0, "1.000"),
        (-12.3456, "-12.35"),
        (9999.6, "10000"),
        (123456.0, "123.5e3"),
        (99999.9, "100.0e3"),
        (-2.5e9, "-2.500e9"),
        (0.0012345, "0.001234"),
        (0.00012346, "123.5e-6"),
        (None, "–"),
        (float("nan"), "–"),
    ],
)
def test_numbers_have_four_significant_digits(x, text):
    assert format_number(x) == text


@given(st.floats(1e-8, 1e12))
def test_numbers_are_right_to_four_digits(x):
    assert float(format_number(x)) == pytest.approx(x, rel=5.01e-4)


# ---------------------------------------------------------------------------------------------------------------- page


class Page(HTMLParser):
    """What a browser would find in a page: texts by element, attributes, script contents."""

    def __init__(self, text):
        super().__init__()
        self.attributes, self.scripts, self.text, self.tags, self._open = [], [], [], [], None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        self._open = tag
        if tag == "script":
            self.scripts.append("")

    def handle_endtag(self, tag):
        self._open = None

    def handle_data(self, data):
        if self._open == "script":
            self.scripts[-1] += data
        elif self._open == "style":
            self.style = data
        else:
            self.text.append(data)

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


def unpack(data):
    return np.frombuffer(base64.b64decode(data), "<f4")


def joints():
    axis = {"nq": 1, "nv": 1, "q_index": 0, "v_index": 0, "has_axis": True}
    turns, slides = {**axis, "has_angle": True}, axis
    none = {"nq": 0, "nv": 0, "q_index": -1, "v_index": -1, "axis": (0.0, 0.0, 0.0)}
    return [
        Joint("hinge", "revolute", "trunk", "arm", **turns, axis=(0.0, 0.0, 1.0), has_limits=True, lower=-1.5, upper=2.5, effort=12.0, velocity=0.5),
        Joint(NASTY, "continuous", "arm", NASTY, **turns, axis=(1.0, 0.0, 0.0)),
        Joint("slide", "prismatic", "arm", "rod", **slides, axis=(0.0, 1.0, 0.0), effort=1e6, velocity=1.0),
        Joint("floating_base", "floating", None, "trunk", nq=7, nv=6, q_index=0, v_index=0, axis=(0.0, 0.0, 0.0)),
        Joint("glue", "fixed", "rod", "tool", **none),
        Joint("base", "fixed", None, "trunk", **none),
    ]


def report(n=500, start=0.0, residual=1.2e-6, balance=True, round_off=0.0):
    time = start + np.sort(np.random.default_rng(0).uniform(0, 8, n))
    s = time - start
    loads = []
    for k, joint in enumerate(joints()):
        wrench = np.stack([(10 + i) * np.cos((i + 1) * s + k) for i in range(6)], axis=1)
        speed, effort = (np.sin(s), 1.1 * wrench @ np.eye(6)[5]) if joint.has_axis else (None, None)
        position = (0.5 + 2.5 * np.cos(s)) if joint.has_axis else None
        loads.append(replace(joint_loads(joint, wrench, speed, effort), position=position))
    drive = 100 * np.cos(s)
    drive[0] = 100.0
    gap = np.zeros(n)
    gap[n // 2] = residual * 100
    power = PowerBalance(drive, np.zeros(n), 100 * np.sin(s), drive - gap, round_off) if balance else None
    facts = [("robot", NASTY), ("samples", str(n))]
    return ReportInput(f"Loads of {NASTY}", facts, [f"unused: {NASTY}"], [summarise(time, x) for x in loads], [CaseCurves(NASTY, time, loads, power)])


@pytest.fixture(scope="module")
def shown():
    return report()


@pytest.fixture(scope="module")
def page(shown, tmp_path_factory):
    return written(shown, tmp_path_factory.mktemp("report"))


def written(shown, folder):
    write_report(folder / "report.html", shown)
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_page_loads_nothing(page):
    loading = {"src", "srcset", "action", "data", "poster", "background", "formaction"}
    assert not [a for a in page.attributes if a[1] in loading]
    assert all(value.startswith("#") for _, name, value in page.attributes if name == "href")
    assert not {"link", "iframe", "object", "embed", "img", "base"} & set(page.tags)
    assert "url(" not in page.style
    assert "@import" not in page.style
    assert [a for a in page.attributes if a[0] == "meta" and a[2].startswith("default-src 'none'; script-src 'sha256-")]


def test_names_are_only_text(page):
    assert len(page.scripts) == 3  # the data, plotly.js, the script that draws
    assert not any("alert(" in script for script in (page.scripts[0], page.scripts[2]))
    assert "b" not in page.tags
    assert page.text.count(f"Loads of {NASTY}") == 2  # in the head and as the heading
    assert f"unused: {' '.join(NASTY.split())}" in page.words
    sections = [value for tag, name, value in page.attributes if tag == "section" and name == "id"]
    assert sections == ["summary", "balance", *(f"joint-{i}" for i in range(6))]


def test_axes_have_powers_of_ten_instead_of_prefixes(page):
    assert 'exponentformat: "power"' in page.scripts[2]
    assert '"SI"' not in page.scripts[2]


def test_scripts_hold_nothing_that_ends_them(page):
    for script in page.scripts:
        assert "</script" not in script.lower()
        assert "<!--" not in script


def test_links_lead_somewhere(page):
    ids = {value for _, name, value in page.attributes if name == "id"}
    targets = {value[1:] for _, name, value in page.attributes if name == "href"}
    assert targets <= ids
    assert {f"joint-{i}" for i in range(6)} <= targets


def test_every_quantity_is_drawn_and_no_peak_is_lost(page, shown):
    charts = json.loads(page.scripts[0])["charts"]
    figures = [value for _, name, value in page.attributes if name == "data-chart"]
    assert figures == [str(i) for i in range(len(charts))]
    assert len(charts) == 2 + 3 * 5 + 3 * 2
    drawn = [unpack(curve["data"]) for chart in charts for panel in chart["panels"] for curve in panel["curves"]]
    expected = [x for j in shown.cases[0].joints for x in (*j.wrench.values(), j.position, j.speed, j.effort, j.power) if x is not None]
    expected += [shown.cases[0].balance.drive, shown.cases[0].balance.energy_rate, shown.cases[0].balance.energy, shown.cases[0].balance.residual]
    for x in expected:
        assert any(np.float32(x.min()) == y.min() and np.float32(x.max()) == y.max() for y in drawn)
    labels = {panel["label"] for chart in charts for panel in chart["panels"]}
    assert labels >= {"Force, N", "Moment, N m", "Speed, rad/s", "Speed, m/s", "Power, W", "Drive torque, N m", "Drive force, N", "Residual, W", "Energy, J"}


def test_decimated_page_keeps_peaks(tmp_path):
    shown = report(20_000)
    charts = json.loads(written(shown, tmp_path).scripts[0])["charts"]
    for chart in charts:
        time = unpack(chart["time"])
        assert len(time) <= max(2, sum(len(panel["curves"]) for panel in chart["panels"])) * POINTS + 2
        assert (np.diff(time) >= 0).all()
        assert all(len(unpack(curve["data"])) == len(time) for panel in chart["panels"] for curve in panel["curves"])
    forces = [unpack(curve["data"]) for curve in charts[2]["panels"][0]["curves"]]
    for y, x in zip(forces, shown.cases[0].joints[0].wrench.values(), strict=False):
        assert y.max() == np.float32(x.max())
        assert y.min() == np.float32(x.min())


def test_residual_is_printed(page):
    assert "largest residual 1.2e-6 of the largest power" in page.words
    assert "Largest residual: 1.2e-6 of the largest power" in page.words
    assert "That is large" not in page.words


def test_large_residual_is_pointed_out(tmp_path):
    assert "That is large" in written(report(residual=0.3), tmp_path).words


def test_rest_is_no_fault(tmp_path):
    page = written(report(residual=0.9, round_off=1e3), tmp_path)
    assert page.words.count("nothing moves") == 2
    assert "large" not in page.words
    assert ("p", "class", "balance") in page.attributes
    powers = [curve for chart in json.loads(page.scripts[0])["charts"][:2] for panel in chart["panels"] for curve in panel["curves"]]
    assert [curve["name"] for curve in powers if unpack(curve["data"]).any()] == ["energy"]


def test_a_joint_at_rest_is_a_point_and_uses_no_speed(tmp_path):
    time = np.linspace(0, 1, 50)
    wrench = np.ones((50, 6)) * (1 + 1e-15 * np.cos(time))[:, None]
    hinge = joint_loads(joints()[0], wrench, 1e-14 * np.sin(time), wrench[:, 5])
    page = written(ReportInput("t", [], [], [summarise(time, hinge)], [CaseCurves("c", time, [hinge], None)]), tmp_path)
    path = json.loads(page.scripts[0])["charts"][-1]
    assert len(unpack(path["time"])) == len(unpack(path["x"]["data"])) == 1  # report.js draws it by a marker
    assert "0.5 rad/s, 0 % used" in page.words


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("huge", [1e200, np.inf, np.nan])
def test_numbers_that_no_chart_can_hold_are_gaps(tmp_path, huge):
    shown = report()
    curve, power = shown.cases[0].joints[0].wrench["axial_force"], shown.cases[0].balance.energy
    curve[7] = power[7] = huge
    page = written(shown, tmp_path)
    drawn = [unpack(c["data"]) for chart in json.loads(page.scripts[0])["charts"] for panel in chart["panels"] for c in panel["curves"]]
    assert sum(not np.isfinite(y).all() for y in drawn) == 2
    shown.cases[0].balance.energy_rate[7] = huge
    assert "That is large" in written(shown, tmp_path).words


def test_missing_balance_is_named(tmp_path):
    assert "Not checked: too few samples" in written(report(balance=False), tmp_path).words


def test_summary_has_units_and_scopes(page):
    heads = {(name, value) for tag, name, value in page.attributes if tag == "th"}
    assert {("scope", "col"), ("scope", "colgroup"), ("scope", "row")} <= heads
    for head in ("axial force, N", "bending moment, N m", "speed, rad/s", "speed, m/s", "power, W", "work, J", "moment, N m"):
        assert head in page.words
    assert ("html", "lang", "en") in page.attributes


def test_summary_is_narrow(page):
    """The wrench and the drive stand in two tables, so that no column is out of sight."""
    text = page.words
    assert text.count("joints: the wrench at the chosen point") == text.count("joints: the drive") == 2
    wrench, drive = text.index("Sliding joints: the wrench"), text.index("Sliding joints: the drive")
    assert wrench < text.index("axial force, N", wrench) < text.index("moment about axis, N m", wrench) < drive < text.index("effort, N", drive)


def test_summary_shows_each_row(page, shown):
    for row in shown.summary:
        for key, value in row.items():
            if isinstance(value, float) and f"{key.removesuffix('_peak')}_at_peak" not in row:  # shown is that one, with its sign
                assert (f"{value:.3f}" if key.endswith("_time") else format_number(value)) in page.text


def test_limits_and_their_use(page):
    assert "0.5 rad/s, 200 % used: exceeded" in page.words
    assert "-1.5 to 2.5 rad" in page.words
    assert "1e+06 N," in page.words
    assert "ground → trunk" in page.words


def test_the_limit_of_the_effort_is_drawn_with_the_effort(page):
    """And not with the moment about the axis at the chosen point, which may be another."""
    panels = [panel for chart in json.loads(page.scripts[0])["charts"] for panel in chart["panels"]]
    assert all(panel["limits"] == [] for panel in panels if panel["label"] in ("Force, N", "Moment, N m"))
    assert [panel["limits"] for panel in panels if panel["curves"][0]["name"] == "drive" and "Drive" in panel["label"]] == [[-12.0, 12.0], [], []]


@pytest.mark.parametrize("relieved", [0, 250, 500])
def test_charts_of_brakes_and_of_drives_that_have_an_effort(tmp_path, relieved):
    """Of the first joint, whose brake holds from this sample on."""
    shown = report()
    case, brakes = shown.cases[0], np.arange(500) >= relieved
    hinge = case.joints[0]
    held = replace(hinge, effort=np.where(brakes, 0.0, hinge.effort), brake=np.where(brakes, hinge.effort, 0.0))
    shown = replace(shown, cases=[replace(case, joints=[held, *case.joints[1:]])])
    charts = json.loads(written(shown, tmp_path).scripts[0])["charts"]
    labels = [panel["label"].split(",")[0] for chart in charts for panel in chart["panels"]]
    assert labels.count("Brake torque") == 1 and labels.count("Power") == (4 if relieved else 3), "of the balance, and of the drives"
    load = largest_load(held)
    assert (load.quantity, load.value) == max((peak(held.brake), "brake"), (peak(held.effort), "effort"))[::-1]


def test_limits_of_positions_are_drawn(page):
    panels = [panel for chart in json.loads(page.scripts[0])["charts"] for panel in chart["panels"] if panel["label"].startswith("Position")]
    assert [panel["limits"] for panel in panels] == [[-1.5, 2.5], [], []]
    assert re.search(r"-1\.5 to 2\.5 rad, motion from -[12][.\d]* to [23][.\d]*: exceeded", page.words)


def test_far_limits_are_not_drawn(page):
    charts = json.loads(page.scripts[0])["charts"]
    paths = [chart for chart in charts if "x" in chart]
    assert [(chart["x"]["limits"], chart["panels"][0]["limits"]) for chart in paths] == [([-0.5, 0.5], [-12.0, 12.0]), ([], []), ([-1.0, 1.0], [])]


@pytest.mark.parametrize(("x", "near"), [([-1, 1], (-3.0, 3.0)), ([0.9, 1], (3.0,)), ([-0.9, 0.9], ()), ([-5, 0], (-3.0,))])
def test_a_limit_is_drawn_where_the_curve_comes_near(x, near):
    assert limits_in_sight(np.array(x), -3.0, 3.0, 3.0) == near
    shifted = tuple(y + 10 for y in near)  # positions: seen from the middle of the range
    assert limits_in_sight(np.array(x) + 10, 7.0, 13.0, 3.0) == shifted


def test_limits_stand_beside_the_peaks(tmp_path):
    """And a limit of 0 is none: files say 0 where they don't know."""
    hinge = replace(joints()[0], effort=0.0, velocity=2.0, lower=0.0, upper=0.0)
    time = np.linspace(0, 1, 50)
    loads = replace(joint_loads(hinge, np.ones((50, 6)), 3 * np.sin(time), np.ones(50)), position=np.cos(time))
    row = with_limits(summarise(time, loads), hinge)
    assert (row["effort_limit"], row["speed_limit"], row["position_lower"], row["position_upper"]) == (None, 2.0, None, None)
    assert exceeds(row, "speed_peak") and not exceeds(row, "effort_peak") and not exceeds(row, "position_highest")
    text = written(ReportInput("t", [], [], [summarise(time, loads)], [CaseCurves("c", time, [loads], None)]), tmp_path).words
    assert "none given (the file says 0)" in text and "none given (the file says 0 for both)" in text
    assert "126 % used: exceeded" in text


def test_clock_times_are_counted_from_the_first_sample(tmp_path):
    shown = report(start=1.7e9)
    page = written(shown, tmp_path)
    assert f"counted from the first sample, at {float(shown.cases[0].time[0])!r} s" in page.words
    data = json.loads(page.scripts[0])
    assert data["charts"][0]["start"] == 0
    assert unpack(data["charts"][0]["time"])[-1] == pytest.approx(shown.cases[0].time[-1] - shown.cases[0].time[0])


def test_round_off_is_zero(tmp_path):
    time = np.linspace(0, 1, 50)
    glue = joint_loads(joints()[4], 1e-16 * np.cos(time)[:, None] * np.ones(6), None, None)
    page = written(ReportInput("t", [], [], [summarise(time, glue)], [CaseCurves("c", time, [glue], None)]), tmp_path)
    assert not json.loads(page.scripts[0])["charts"] and "It carries nothing throughout" in page.words


def test_colours_mean_the_same_in_charts_and_pictures(page):
    """Blue is what the structure carries, orange what the drive exerts: in no chart is a curve of one in the colour of the other."""
    by_colour = {}
    for chart in json.loads(page.scripts[0])["charts"]:
        for panel in chart["panels"]:
            for curve in panel["curves"]:
                by_colour.setdefault(curve["color"], set()).add(panel["label"].partition(",")[0])
    assert by_colour["structure"] | by_colour["structure-2"] <= {"Force", "Moment"} and not by_colour["drive"] & {"Position", "Speed"}
    for colour in by_colour:
        assert page.style.count(f"--{colour}:") == 2, "light and dark"


def test_one_sample(tmp_path):
    time = np.zeros(1)
    glue = joint_loads(joints()[4], np.ones((1, 6)), None, None)
    row = {"joint": "glue", "kind": "fixed", "force_peak": 1.0, "force_peak_time": 0.0, "force_rms": None}
    assert "glue" in written(ReportInput("t", [], [], [row], [CaseCurves("c", time, [glue], None)]), tmp_path).words


# ------------------------------------------------------------------------------------------- verdict, provenance, smoothing


def verdict(share, reasons=()):
    return Verdict((Use(NASTY, "hinge", "effort", "hinge", share, 12 * share, 12.0, "effort", "N m", 1.0),), reasons)


@pytest.mark.parametrize(
    ("limits", "components", "level"), [("green", "amber", "amber"), ("red", "green", "red"), ("amber", "red", "red"), ("green", "green", "green")]
)
def test_limits_and_components_have_one_verdict(limits, components, level):
    """The worse of the two, on one card, with what it holds for."""
    share = {"green": 0.5, "amber": 0.9, "red": 1.2}[limits]
    card = verdict_section(
        verdict(share),
        ComponentsVerdict(components, "motor: 50 % of its rated torque", ["joint b: bearing: life is left out: no C"]),
        [("Payloads", "3 kg on <hand>")],
    )
    assert card.count("<section") == 1 and f'class="verdict {level}"' in card and f'<p class="level">{level.capitalize()}: ' in card
    assert f'Components: <strong class="{components}">' in card and f'robot&#x27;s file: <strong class="{limits}">'.replace("&#x27;", "'") in card
    assert "3 kg on &lt;hand&gt;" in card and "<li>joint b: bearing: life is left out" in card


@pytest.mark.parametrize(
    ("share", "reasons", "level", "words"),
    [
        (0.5, (), "green", "Green: every limit was compared and holds with its margin"),
        (0.5, (f"doubt about {NASTY}",), "amber", "Amber: no limit is exceeded, but this needs a look"),
        (0.9, (), "amber", "Amber: no limit is exceeded"),
        (1.2, (f"doubt about {NASTY}",), "red", "Red: limits are exceeded"),
    ],
)
def test_the_verdict_is_said_in_words(shown, tmp_path, share, reasons, level, words):
    page = written(replace(shown, verdict=verdict(share, reasons)), tmp_path)
    assert words in page.words
    assert ("section", "class", f"verdict {level}") in page.attributes
    assert f"{100 * share:.1f} %" in page.words
    assert (" ".join(f"doubt about {NASTY}".split()) in page.words) == bool(reasons)
    assert ("exceeded" in page.words[page.words.index("Share of its limits") :].split("Summary")[0]) == (level == "red")
    assert "alert(" not in page.scripts[0]


def test_what_made_the_results(shown, tmp_path):
    files = [InputFile("robot", NASTY, "ab" * 32), InputFile("motion", "-", None)]
    made = Provenance(
        "r", [], [{"physics": []}], files, {"on": "child", "strict": True, "gravity": ""}, f"ksl loads {NASTY}", "2030-01-02T03:04:05Z", {"KSL": "9.9"}
    )
    page = written(replace(shown, provenance=made, notes=["first", not_used(Note(NoteKind.VISUALS, f"visual (3 links) {NASTY}"))]), tmp_path)
    for text in (
        "ab" * 32,
        "none, since it could not be read twice",
        "2030-01-02T03:04:05Z",
        "KSL 9.9",
        "on child, strict",
        "Friction, damping, rotor inertias",
    ):
        assert text in page.words
    ignored = page.words[page.words.index("Content of the robot's file that was ignored") :]
    assert "visual (3 links)" in ignored and "first" not in ignored
    assert len(page.scripts) == 3
    physics = written(replace(shown, provenance=replace(made, cases=[{"physics": ["damping"]}])), tmp_path)
    assert "Efforts are the motor's. They include these effects, with the numbers of the robot's file: damping. Left out: friction," in physics.words


def test_the_foot_of_pages_is_a_string_whatever_the_names(page):
    foot = re.search(r'@bottom-left \{ content: ("[^"]*");', page.style)[1]
    text = re.sub(r"\\([0-9a-f]+) ", lambda match: chr(int(match[1], 16)), foot[1:-1])
    assert text.startswith(f"Loads of {NASTY}   ·   KSL ")


def test_raw_and_smoothed_positions(shown, tmp_path):
    case = shown.cases[0]
    raw = case.joints[0].position + 0.01 * np.sin(1e3 * case.time)
    page = written(replace(shown, cases=[replace(case, raw_positions={"hinge": raw})]), tmp_path)
    chart = next(c for c in json.loads(page.scripts[0])["charts"] if c["panels"][0]["curves"][0]["name"] == "raw")
    assert [curve["name"] for curve in chart["panels"][0]["curves"]] == ["raw", "smoothed"]
    assert unpack(chart["panels"][1]["curves"][0]["data"]).max() == pytest.approx(0.01, rel=1e-3)


def test_many_sections_make_thin_curves(tmp_path):
    """100,000 samples and 20 joints stay below 8 MB."""
    time = np.linspace(0, 100, 100_000)
    rng = np.random.default_rng(0)
    loads = []
    for i in range(20):
        joint = replace(joints()[0], name=f"j{i}")
        curves = joint_loads(joint, rng.normal(size=(len(time), 6)), rng.normal(size=len(time)), rng.normal(size=len(time)))
        loads.append(replace(curves, position=rng.normal(size=len(time))))
    write_report(tmp_path / "report.html", ReportInput("t", [], [], [summarise(time, x) for x in loads], [CaseCurves("c", time, loads, None)]))
    pictures = 20 * 30_000  # of a mechanism, in base 64
    assert (tmp_path / "report.html").stat().st_size + pictures < 8e6


MESHES = """<robot name="r"><link name="base"/><link name="arm">
  <inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  VISUALS</link><joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="9" velocity="9"/></joint></robot>"""


@pytest.mark.parametrize(
    ("geometry", "unused", "missing"),
    [
        ('<box size="0.1 0.1 0.1"/>', False, []),
        ('<mesh filename="no.stl"/>', True, ["pictures are without the mesh of the file: no.stl is not found"]),
        ('<mesh filename="package://p/no.stl"/>', True, ["pictures are without the mesh of the file: package://p/no.stl is not found; ROS_PACKAGE_PATH names folders of packages"]),
        ('<mesh filename="empty.stl"/>', True, ["pictures are without the mesh of the file: empty.stl is empty"]),
        ('<mesh filename="no.stl"/></geometry></visual><visual><geometry><mesh filename="e.dae"/></geometry></visual><visual><geometry><sphere radius="1"/>', False,
         ["pictures are without 2 of 2 meshes of the file, the first: no.stl is not found"]),
    ],
)  # fmt: skip
def test_what_is_drawn_is_not_called_unused_and_missing_meshes_are_named(tmp_path, geometry, unused, missing):
    import ksl

    (tmp_path / "r.urdf").write_text(MESHES.replace("VISUALS", f"<visual><geometry>{geometry}</geometry></visual>"))
    (tmp_path / "empty.stl").write_bytes(b"")
    time = np.linspace(0, 1, 20)
    notes = ksl.compute_loads(tmp_path / "r.urdf", (time, 0.1 * np.sin(time)[:, None])).notes
    assert any(note.startswith("in the file and not used: visual") for note in notes) == unused
    assert [note for note in notes if note.startswith("pictures")] == missing


TINY = """<robot name="tiny"><link name="w"/><link name="a"><inertial><origin xyz="3e-5 0 0"/><mass value="1e-9"/>
<inertia ixx="1e-19" iyy="1e-19" izz="1e-19" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="revolute"><parent link="w"/><child link="a"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="2e-13" velocity="9"/></joint></robot>"""


def test_loads_of_a_tiny_machine_are_no_round_off(tmp_path):
    """A microgram at 30 µm needs 2.9e-13 N m, which pages and terminals showed as 0 beside a share of 147 %; 1e-17 N m of it is round-off still."""
    (tmp_path / "tiny.urdf").write_text(TINY)
    (tmp_path / "m.csv").write_text("time,j\n" + "".join(f"{k / 50},{0.3 * np.sin(k / 20):.9f}\n" for k in range(50)))
    held = run_ksl("hold", tmp_path / "tiny.urdf").stdout
    assert held.count("-2.943e-13 N m") == 1 and held.count("-2.943e-13") == 3 and "9.81e-09" in held
    printed = run_ksl("loads", tmp_path / "tiny.urdf", tmp_path / "m.csv", "-o", tmp_path / "out").stdout
    (drive,) = re.findall(r"Drive\n(?:.*\n){4} j +(\S+)", printed)
    assert float(drive) == pytest.approx(1e-9 * 9.81 * 3e-5, rel=1e-3) and not re.search(r"e-(1[6-9]|[2-9]\d)\b", printed.partition("note:")[0])
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert re.search(r"<td[^>]*>294\.3e-15", page) and not re.search(r"<td[^>]*>-?\d+\.\d+e-(1[89]|[2-9]\d)", page)
    row = {"joint": "j", "effort_peak": 2.9e-13, "effort_limit": 2e-13, "speed_peak": 0.0}
    assert exceeds(row, "effort_peak") and not exceeds(row | {"effort_limit": 2.9e-13 * (1 - 1e-12)}, "effort_peak")
