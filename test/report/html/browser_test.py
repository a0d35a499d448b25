"""The report in a real browser: light, dark and on paper; pictures; no network; numbers as in the summary."""

import itertools
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import ksl
from ksl.load_cases.curves import Curves
from ksl.load_cases.load_case import LoadCase
from ksl.load_cases.quantities import SummaryRow, summarise
from ksl.load_cases.verdict import Verdict, uses_of
from ksl.motions.motion import complete
from ksl.report.html.input import CaseCurves, ReportInput
from ksl.report.json_file import write_json
from ksl.report.html.numbers import Clock, format_number
from ksl.report.html.page import write_report
from ksl.report.pdf import BROWSERS, find_browser, write_pdf
from ksl.report.html.stills import stills_of

pytestmark = pytest.mark.skipif(not any(map(shutil.which, BROWSERS)), reason="needs Chromium or Chrome")

ARM = """
<robot name="arm">
  <link name="ground"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0"/><mass value="3"/><inertia ixx="0.01" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.06 0.06"/></geometry></visual></link>
  <link name="fore"><inertial><origin xyz="0.15 0 0"/><mass value="2"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><origin xyz="0.15 0 0"/><geometry><box size="0.3 0.05 0.05"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="ground"/><child link="upper"/><axis xyz="0 -1 0"/>
    <limit lower="-1" upper="1" effort="40" velocity="2"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="2" velocity="5"/></joint>
</robot>
"""


def loads_of(robot: Path, name: str, payload: float, pictures: bool) -> tuple[CaseCurves, list[SummaryRow], list]:
    model = ksl.load(robot, payloads={"fore": (payload, [0.3, 0, 0])})
    time = np.linspace(0, 2, 201)
    q = np.stack([0.8 * np.sin(time), 1.5 * np.cos(1.3 * time)], axis=1)
    case = LoadCase(model, complete(model, time, q, [[None, None], [None, None]]), name=name)
    curves = Curves(case)
    for block in case.blocks():
        curves.add(block)
    rows = [{"case": name, **summarise(time, loads)} for loads in curves.loads]
    uses = [use for joint, row in zip(model.joints, rows, strict=True) for use in uses_of(joint, row, time, q)]
    shown = CaseCurves(name, time, curves.loads, curves.power_balance(), stills=stills_of(case, curves.loads) if pictures else {})
    return shown, rows, uses


@pytest.fixture(scope="module")
def report(tmp_path_factory) -> ReportInput:
    """Two load cases; the elbow's limit is exceeded in both.  One has pictures, which take a browser without a graphics card seconds."""
    robot = tmp_path_factory.mktemp("robot") / "arm.urdf"
    robot.write_text(ARM)
    cases = [loads_of(robot, name, mass, name == "heavy") for name, mass in (("heavy", 4.0), ("light", 1.0))]
    rows, uses = [row for case in cases for row in case[1]], [use for case in cases for use in case[2]]
    return ReportInput("Joint loads of arm", [("robot", "arm")], ["a note"], rows, [case[0] for case in cases], None, Verdict(tuple(uses)))


@pytest.fixture(scope="module")
def page_file(report, tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("page") / "report.html"
    write_report(file, report)
    return file


@pytest.fixture(scope="module")
def page(browser, page_file):
    """The page, opened once.  At the end there must be no errors in its console, and no requests that leave the machine."""
    said = []
    context = browser(1280, 1000, color_scheme="light")
    page = context.new_page()
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: None if request.url.startswith(("file:", "data:", "blob:")) else said.append(request.url))
    page.goto(page_file.as_uri() + "#case-0-joint-0")
    page.wait_for_selector(":root[data-ready]", state="attached")
    yield page
    context.close()
    assert said == []


@pytest.fixture
def on_paper(page):
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    yield page
    page.evaluate("dispatchEvent(new Event('afterprint'))")


PAPER, PAPER_COLOUR = "#case-0-joint-0 .chart .main-svg", "e => getComputedStyle(e).backgroundColor"


def paper_becomes(page, colour):
    """A change of the colour scheme reaches the page after a moment."""
    page.wait_for_function(f"colour => ({PAPER_COLOUR})(document.querySelector('{PAPER}')) === colour", arg=colour, timeout=60_000)


def paper_colour(page):
    return page.eval_on_selector(PAPER, PAPER_COLOUR)


def test_light_and_dark(page):
    light, dark = "rgb(255, 255, 255)", "rgb(20, 23, 27)"
    page.wait_for_selector("#case-0-joint-0 .chart .main-svg")
    paper_becomes(page, light)
    page.emulate_media(color_scheme="dark")
    paper_becomes(page, dark)
    assert page.eval_on_selector("body", "e => getComputedStyle(e).backgroundColor") == dark
    plate = page.eval_on_selector(".still", "e => getComputedStyle(e).backgroundColor")
    assert min(map(int, plate.removeprefix("rgb(").removesuffix(")").split(","))) > 200, "arrows are dark blue"
    page.evaluate("dispatchEvent(new Event('beforeprint'))")  # paper is light
    assert paper_colour(page) == light
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert paper_colour(page) == dark
    page.emulate_media(color_scheme="light")
    paper_becomes(page, light)


def test_pictures_are_rendered_and_not_empty(page, report):
    images = page.locator(".still img")
    assert images.count() == sum(len(case.stills) for case in report.cases) == 3  # two joints and the base
    colours = page.eval_on_selector_all(
        ".still img",
        """images => images.map((image) => {
          const canvas = Object.assign(document.createElement("canvas"), { width: image.naturalWidth, height: image.naturalHeight });
          const context = canvas.getContext("2d", { willReadFrequently: true });
          context.drawImage(image, 0, 0);
          const pixels = new Uint32Array(context.getImageData(0, 0, canvas.width, canvas.height).data.buffer);
          return new Set(pixels).size;
        })""",
    )
    assert min(colours) > 20  # shaded surfaces, and not one colour


def test_without_webgl_there_is_a_sentence(browser, page_file):
    context = browser()
    page = context.new_page()
    page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    page.goto(page_file.as_uri())
    page.wait_for_selector(":root[data-ready]", state="attached")
    assert page.locator(".still").first.inner_text() == "The picture needs WebGL, which this browser does not offer."
    context.close()


def test_one_case_is_shown_and_links_choose(page):
    shown = lambda: page.eval_on_selector_all("article.case", "all => all.map((e) => e.checkVisibility())")
    assert shown() == [True, False]
    page.select_option("#choice", "1")
    assert shown() == [False, True]
    page.click("#worst a:text-is('heavy') >> nth=0")
    assert shown() == [True, False]
    assert page.input_value("#choice") == "0"


def test_on_paper_all_is_shown_and_charts_fit(on_paper):
    assert all(on_paper.eval_on_selector_all("article.case", "all => all.map((e) => e.checkVisibility())"))
    boxes = on_paper.eval_on_selector_all(".chart .main-svg", "all => all.map((e) => [e.clientWidth, e.clientHeight])")
    assert len(boxes) >= 2 * (2 + 2 * 5 + 2)  # of both cases: the balance, the joints, the base
    assert {tuple(box) for box in boxes} == {(334, 172)}


LABELS = """all => all.map((chart) => [...chart.querySelectorAll(".annotation-text")].map((label) => label.getBoundingClientRect()))"""


@pytest.mark.parametrize("shown", ["page", "on_paper"])
def test_labels_of_limits_do_not_cover_each_other(request, page, shown):
    """In the corner of an effort over a speed both labels stood in one place."""
    request.getfixturevalue(shown)
    page.locator("#case-0-joint-0 figure").last.scroll_into_view_if_needed()
    page.wait_for_function("document.querySelectorAll('#case-0-joint-0 .chart .main-svg').length >= 5")
    charts = [c for c in page.eval_on_selector_all(".chart", LABELS) if len(c) > 1 and c[0]["width"]]
    assert charts
    for labels in charts:
        for a, b in itertools.combinations(labels, 2):
            apart = a["right"] <= b["left"] or b["right"] <= a["left"] or a["bottom"] <= b["top"] or b["bottom"] <= a["top"]
            assert apart, (a, b)


def test_joints_do_not_each_begin_a_page(page):
    """Of six joints with components, 26 pages were half empty."""
    page.emulate_media(media="print")
    breaks = page.eval_on_selector_all("section.joint, section.joint figure, #provenance", "all => all.map((e) => getComputedStyle(e).breakBefore)")
    page.emulate_media(media="screen")
    assert len(breaks) > 6 and set(breaks) == {"auto"}


def test_numbers_of_the_page_are_those_of_the_summary(on_paper, report):
    for number, case in enumerate(report.cases):
        text = on_paper.inner_text(f"#case-{number}-summary").split()
        for row in (row for row in report.summary if row["case"] == case.name):
            for key, value in row.items():
                if isinstance(value, float) and not key.startswith("acceleration"):
                    value = row.get(f"{key.removesuffix('_peak')}_at_peak", value) if key.endswith("_peak") else value  # with its sign
                    assert (Clock.of(case.time).text(value) if key.endswith("_time") else format_number(value)) in text, (case.name, row["joint"], key)


def test_verdict_is_in_words(page, report):
    assert page.inner_text("#verdict").split("\n\n")[1] == "Red: limits are exceeded"
    worst = max((use for use in report.verdict.uses if use.joint == "elbow"), key=lambda use: use.share)
    assert worst.case == "heavy"
    cell = page.inner_text(".uses tbody tr:first-child td:last-child")
    assert "exceeded" in cell and format_number(worst.value) in cell and "heavy" in cell


@pytest.mark.parametrize("width", [400, 1280])
def test_nothing_is_wider_than_the_window(page, width):
    page.set_viewport_size({"width": width, "height": 1000})
    assert page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize(("paper", "size"), [("A4", (594.96, 841.92)), ("letter", (612, 792))])
def test_pdf(report, tmp_path, paper, size):
    case = report.cases[paper == "letter"]  # the first with pictures, the second without
    one = replace(report, cases=[case], summary=[row for row in report.summary if row["case"] == case.name])
    write_report(tmp_path / "report.html", one)
    write_pdf(tmp_path / "report.html", tmp_path / "report.pdf", find_browser(), paper)
    data = (tmp_path / "report.pdf").read_bytes()
    assert data.startswith(b"%PDF")
    boxes = [tuple(map(float, part.split(b"]")[0].split()[2:])) for part in data.split(b"/MediaBox [")[1:]]
    assert 3 <= len(boxes) <= 5  # the front; the summary; and the power balance, two joints and the base
    assert all(box == pytest.approx(size, abs=1) for box in boxes)


def test_json_has_the_same_numbers(report, tmp_path):
    write_json(tmp_path / "report.json", report)
    said = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    for row, expected in zip(said["summary"], report.summary, strict=True):
        assert {key: row[key] for key in expected} == expected
    assert said["verdict"]["level"] == "red"
    assert [case["name"] for case in said["cases"]] == ["heavy", "light"]
    assert said["summary"][1]["effort_limit"] == 2.0
    bad = replace(report, summary=[{**report.summary[0], "force_peak": float("nan")}, *report.summary[1:]])
    write_json(tmp_path / "bad.json", bad)
    assert json.loads((tmp_path / "bad.json").read_text(encoding="utf-8"))["summary"][0]["force_peak"] is None
