"""One set of names through every page: nothing of them runs, nothing leaves the machine, and no page stays blank."""

import ast
import re
from pathlib import Path
from types import SimpleNamespace

import ksl
import numpy as np
import pytest
from names import HOSTILE, OURS, chain

pytest.importorskip("viser", reason="the package viser is not installed")
PYTHON = Path(ksl.__file__).parent

SURFACES = {
    "report/html/page.py": "report.html",
    "report/loads_run.py": "run in a notebook",
    "sizing/joints/sizing.py": "sizing in a notebook",
    "viewer/notebook.py": "model in a notebook",
    "viewer/live.py": "live page, and viewer in a notebook",
    "viewer/controls.py": "live page, and viewer in a notebook",
    "viewer/export.py": "exported file",
    "viewer/still.py": "figure of plotly",
    "report/html/stills.py": "report.html",
    "model/model.py": "model in a notebook",
}
"""Modules that make pages, and what the tests below call their pages.  A new one must enter."""


def test_every_page_is_in_the_table():
    makes_pages = re.compile(
        r"_repr_(html|markdown|svg|mimebundle)_\(self|add_(html|markdown)\(|</body>|<iframe|\"annotations\"|</script|report\.html\"\)\)\.substitute"
    )
    found = {str(p.relative_to(PYTHON)) for p in PYTHON.rglob("*.py") if makes_pages.search(p.read_text(encoding="utf-8"))} - {
        "base/markup.py",
        "viewer/gate.py",
    }
    assert found <= set(SURFACES), found - set(SURFACES)


def test_text_is_escaped_in_one_place():
    """No module but `ksl.base.markup` escapes for pages, so that no surface has rules of its own."""
    texts = {path: path.read_text(encoding="utf-8") for path in PYTHON.rglob("*.py")}
    for path, text in texts.items():
        for node in ast.walk(ast.parse(text)) if "escape" in text else ():
            if isinstance(node, ast.ImportFrom) and node.module in ("html", "xml.sax.saxutils", "markupsafe"):
                names = {name.name for name in node.names} - {"unescape"}
                assert not names or path.name == "markup.py", path


def test_what_the_viewer_shows_as_markdown_is_our_own(hostile):
    from ksl.viewer.live import Viewer
    from ksl.viewer.scene import make_scene

    with Viewer(make_scene(hostile.model)) as viewer:
        shown = [viewer.controls._readout.content, viewer.controls._legend.content]
        assert shown[0] and not any(name in text for name in HOSTILE for text in shown)


class Made:
    """A robot, a run and a sizing whose names and files are hostile."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        file = folder / "a'\" onmouseover='alert(2)'.urdf"
        self.models = []
        for names in (HOSTILE, [*HOSTILE, *(n for n in OURS if n.strip())]):
            file.write_text(chain(names, robot='<img src=x onerror=alert(3)> "r"'), encoding="utf-8")
            self.models.append(ksl.load(file))
        self.model = self.models[0]
        time = np.linspace(0, 1, 20)
        motion = folder / "<img src=x onerror=alert(4)>.npz"
        np.savez(motion, time=time, q=np.sin(3 * time)[:, None] * np.full(self.model.nq, 0.3))
        self.run = ksl.compute_loads(self.model, motion, payloads={HOSTILE[0]: (1.0, [0, 0, 0.1])}, external={HOSTILE[9]: np.array([1.0, 2, 3, 0, 0, 0])})


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    return Made(tmp_path_factory.mktemp("hostile"))


@pytest.fixture
def watched(browser):
    """Opens pages, and says what ran or left the machine."""
    context = browser(700)
    page, seen = context.new_page(), []
    page.on("dialog", lambda dialog: (seen.append(f"ran: {dialog.message}"), dialog.dismiss()))

    def request(route):
        url = route.request.url
        if url.startswith(("file:", "data:", "blob:", "http://127.0.0.1:")) and not url.endswith("/x"):
            route.continue_()
        else:
            seen.append(f"left: {url}")
            route.abort()

    page.route("**/*", request)
    page.on("pageerror", lambda error: seen.append(str(error)))
    yield page, seen
    context.close()
    assert seen == []


def test_report_and_notebook(hostile, watched):
    page, _ = watched
    file = hostile.folder / "report.html"
    hostile.run.report(file)
    page.goto(file.as_uri() + "#joint-0")
    page.wait_for_selector(".chart .main-svg", timeout=60_000)
    text = page.inner_text("body")
    assert all(" ".join(name.split()) in " ".join(text.split()) for name in HOSTILE if "\u202e" not in name) and "\\u202egnp" in text, (
        "they are read as they are"
    )
    from ksl.sizing.figures import Figure
    from ksl.sizing.joints.sizing import Sizing

    figure = Figure(
        **dict.fromkeys(Figure.__dataclass_fields__, "")
        | {
            "joint": HOSTILE[0],
            "component": HOSTILE[1],
            "formula": HOSTILE[2],
            "source": HOSTILE[3],
            "value": 1.0,
            "limit": 2.0,
            "utilisation": 0.5,
            "time": None,
        }
    )
    sizing = SimpleNamespace(figures=(figure,), verdict=HOSTILE[4])
    notebook = hostile.folder / "notebook.html"
    parts = [hostile.model._repr_html_(), hostile.run._repr_html_(), Sizing._repr_html_(sizing)]
    notebook.write_text("<!DOCTYPE html><meta charset=utf-8>" + "".join(parts), encoding="utf-8")
    page.goto(notebook.as_uri())
    assert page.locator("svg").count() == 1 and page.locator("script, img, a").count() == 0
    page.hover("svg circle >> nth=0", force=True)


def test_figure_of_plotly(hostile, watched):
    import json

    from ksl.report.html.page import _plotly
    from ksl.viewer.scene import make_scene
    from ksl.viewer.still import still

    page, _ = watched
    wrenches = {name: np.array([1.0, 0, 0, 0, 0, 0]) for name in HOSTILE}
    figure = still(make_scene(hostile.model, external=wrenches), 0, HOSTILE[0])
    file = hostile.folder / "figure.html"
    file.write_text(f"<meta charset=utf-8><div id=a></div><script>{_plotly().replace('</script', '')}</script>".replace("<!--", ""), encoding="utf-8")
    page.goto(file.as_uri())
    page.evaluate("([data, layout]) => Plotly.newPlot('a', data, layout)", json.loads(json.dumps([figure["data"], figure["layout"]])))
    page.wait_for_selector(".annotation-text", timeout=60_000)
    assert page.locator(".annotation-text a").count() == 0
    assert "onerror=alert(1)>" in (page.locator(".annotation-text").text_content() or "").replace("\u00a0", " ")


def test_the_live_page_and_the_exported_file(hostile, watched, capsys):
    """The page of a robot with a link `world` was blank: two entries of a list were equal."""
    from ksl.viewer.export import export
    from ksl.viewer.live import Viewer
    from ksl.viewer.scene import make_scene

    page, seen = watched
    scene = make_scene(hostile.models[1])
    with Viewer(scene, joint="world") as viewer:
        page.goto(viewer.url)
        page.wait_for_function("() => window.__viserMutable && window.__viserMutable.nodeRefFromName['/drive/heads']", timeout=90_000)
        page.get_by_text("force, N").first.wait_for(timeout=60_000)
        assert page.get_by_text("is not found").count() >= 1, "notes name the meshes"
        for control in (viewer.controls._selected, viewer.controls._axes, viewer.controls._at):
            assert len(set(control.options)) == len(control.options) and all(option.strip() and len(option) < 80 for option in control.options)
        assert "link world" in viewer.controls._axes.options and "link joint" in viewer.controls._at.options
        page.evaluate("() => { setTimeout(() => { throw new Error('planted <fault>') }, 0) }")
        end = 200
        while not viewer.page_errors and end:
            page.wait_for_timeout(50)
            end -= 1
        assert len(viewer.page_errors) == 1 and "planted <fault>" in viewer.page_errors[0]
        assert "ksl: the page in the browser reports an error: " in capsys.readouterr().err
        assert [x for x in seen if "planted" not in x] == []
        seen.clear()
        assert "<iframe" in viewer._repr_html_() and "<img" not in viewer._repr_html_()
    file = export(scene, hostile.folder / "robot.html", subtitle=HOSTILE[1])
    page.goto(file.as_uri())
    page.wait_for_selector("#ksl-legend", timeout=60_000)
    assert HOSTILE[1] in page.inner_text("#ksl-legend") and page.locator("#ksl-legend img").count() == 0


def test_nodes_of_the_scene_are_apart():
    """Names that differ only in what the tree of nodes separates had one node, and the first link moved with the second."""
    from ksl.viewer.labels import labels

    names = [*OURS, *HOSTILE, "joint", ""]
    found = labels([n.replace("/", "_") for n in names], "link", ("joint", "world"))
    assert len(set(found)) == len(names) and not any("/" in n for n in found if "http" not in n and n.count("/") > 3)
    assert labels(["a", "b", "a"], "link") == ["a", "b", "a (2)"] and labels(["world", "link world"], "link", ("world",)) == ["link world", "link world (2)"]


@pytest.mark.parametrize("frame", ["joint", "world"])
def test_a_link_called_world_can_be_chosen(tmp_path, frame):
    """The readout gives the wrench at that link and in its axes, and not at the world's origin."""
    from ksl.viewer.readout import Choice, OfLink, wrench_at
    from ksl.viewer.scene import make_scene

    (tmp_path / "r.urdf").write_text(chain(["up", frame, "tip"]), encoding="utf-8")
    (tmp_path / "s.urdf").write_text(chain(["up", "other", "tip"]), encoding="utf-8")
    q = [0.3, -0.5, 0.4]
    scene, plain = make_scene(ksl.load(tmp_path / "r.urdf"), q), ksl.load(tmp_path / "s.urdf")
    link = scene.model.link_names.index(frame)
    expected = plain.reactions(q, np.zeros(3), np.zeros(3), at="other", axes="other", joints=["up"])[0]
    np.testing.assert_allclose(wrench_at(scene, 0, "up", Choice(at=OfLink(link), axes=OfLink(link))), expected, atol=1e-12)
    expected = plain.reactions(q, np.zeros(3), np.zeros(3), at="world", axes="world", joints=["up"])[0]
    np.testing.assert_allclose(wrench_at(scene, 0, "up", Choice(at="world", axes="world")), expected, atol=1e-12)
