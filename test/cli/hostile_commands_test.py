"""Commands given what is meant to do harm: nothing but printable text reaches the terminal, no formula reaches a table, and all ends in a sentence."""

import csv
import io
import os
import re
import subprocess
import sys
from unittest.mock import Mock

import numpy as np
import pytest

import ksl
from growth import assert_linear
from ksl.base import limits
from ksl.base import csv_cells
from ksl.base.csv_cells import csv_comment, csv_table, csv_text, text_of_cell
from ksl.base.printable import one_line, printable, sentence
from ksl.output import OutputError
from ksl.robot_files import loading
from ksl_command import run_ksl, warm
from regex_steps import count_patterns

INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
BAD = [
    "\u009b31m",
    "\u202egnp",
    "[red]x[/red]",
    "[/]",
    "=HYPERLINK(1)",
    "@SUM",
    "-2+3",
    "<b>&amp;</b></script>",
    "'=1",
    "x;=cmd|'/c calc'!A0;y",
    "t\t=1",
    'q; "=1"',
]
CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def robot_of(names: list[str]) -> str:
    """Links in a chain with these names, and joints of the same names."""
    from xml.sax.saxutils import quoteattr as q

    links = "".join(f"<link name={q(n)}>{INERTIAL}</link>" for n in ["base", *names])
    ends = zip(["base", *names], names)
    limit = '<limit lower="-3" upper="3" effort="90" velocity="9"/>'
    joints = "".join(f'<joint name={q(b)} type="revolute"><parent link={q(a)}/><child link={q(b)}/>{limit}</joint>' for a, b in ends)
    return f'<robot name="\u202erobot\u009b">{links}{joints}</robot>'


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A robot and a motion whose names do all the harm that XML allows."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "robot.urdf").write_text(robot_of(BAD), encoding="utf-8")
    with open(folder / "motion.csv", "w", newline="", encoding="utf-8") as f:
        table = csv.writer(f)
        table.writerow(["time", *map(csv_text, BAD)])
        table.writerows([k / 10, *[0.1 * k] * len(BAD)] for k in range(8))
    motor = '[[component]]\njoint = "=HYPERLINK(1)"\nkind = "motor"\nname = "=\\u202e\\u001b"\npeak_torque = 9\n'
    (folder / "components.toml").write_text(motor)
    (folder / "asked.toml").write_text('[[choose]]\njoint = "=HYPERLINK(1)"\nkind = "limits"\nlink = "[red]x[/red]"\n')
    (folder / "catalogue.csv").write_text("kind,name,size,mass,torque\nlimits,'=\u202e,\u009b31m,1,1e9\n", encoding="utf-8")
    (folder / "sweep.toml").write_text('[base]\nmotion = "motion.csv"\n[[vary]]\nkind = "payload"\nlink = "=HYPERLINK(1)"\nvalues = [0, 1]\n')
    (folder / "stiffness.toml").write_text('"=HYPERLINK(1)" = 1e4\n["[red]x[/red]"]\nmotion = 1e4\n')
    assert run("loads", "robot.urdf", "motion.csv", "-o", "results", inside=folder).returncode == 0
    return folder


def run(*arguments, inside=None) -> subprocess.CompletedProcess:
    return run_ksl(*arguments, cwd=inside, text=False)


def is_sentence(p: subprocess.CompletedProcess) -> str:
    said = p.stderr.decode()
    assert p.returncode == 2 and said.startswith("ksl: ") and said.count("\n") == 1 and "Traceback" not in said, said
    assert not CONTROL.search(said), said
    return said


def test_printable_text():
    assert printable("a\x1b[31m\u202eb\nc\td\x9b") == "a\\x1b[31m\\u202eb\nc\td\\u009b"
    assert one_line("a\nb\r\u2028") == "a\\x0ab\\x0d\\u2028"
    assert printable("Gelenk 关节 مفصل ü\u00a0é 👩\u200d🚀") == "Gelenk 关节 مفصل ü\u00a0é 👩\u200d🚀", "names in any script stay"
    for unit in ("x", "\x1b", "\u202e"):  # which are six characters each when they are made visible
        assert len(sentence(unit * 1_000_000)) <= limits.MESSAGE_LENGTH and sentence(f"{unit}{'y' * 5000}z").endswith("yyz")
    assert printable("\udcff") == "\\udcff", "a byte of a path that is not UTF-8"


@pytest.mark.parametrize(
    "name", [*BAD, "a", "", "'", "''=x", "\t1", "\r1", "\uff1d1", "a=1", "1", "'a", "a;", "a;b", "a;'=b;=;'", ";;-1", "\t=1", "\t'=1", "';\r'=", "a\n=1"]
)
def test_cells_read_back(name):
    cell = csv_text(name)
    assert text_of_cell(cell) == name and not re.match("[=+\\-@\t\r\uff1d\uff0b\uff0d\uff20]", cell)


@pytest.mark.parametrize("name", ["x;=cmd|'/c calc'!A0;y", 'x;"=1"', 'x; ""=1', "x;'=1", "x\t@SUM", ";+1+1", "x\n=1", "x\r\n-1", '";=1', "x;\uff1d1", "=1;=1"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_no_formula_for_programs_that_split_elsewhere(name, separator):
    """The cell between others in a file with commas, as programs with other separators take it apart."""
    file = io.StringIO()
    csv.writer(file).writerow(["a", csv_text(name), "b"])
    lines = re.split("\r\n|\n|\r", file.getvalue()) if separator != "," else [file.getvalue()]
    for cell in [cell for line in lines for cell in next(csv.reader([line], delimiter=separator), [])]:
        assert not re.match(" *[=+\\-@\uff1d]", cell), (file.getvalue(), cell)
    for comment in (csv_comment(f"robot {name}"), csv_comment(f"robot, {name}")):
        for cell in next(csv.reader([f"# {comment}"], delimiter=separator)):
            assert not re.match(" *[=+\\-@\uff1d]", cell), (comment, cell)


def test_a_comment_with_a_number_of_many_digits(monkeypatch):
    """10,000 digits with a letter behind them took 3 s."""
    assert [csv_comment(f"a;{x}") for x in ("-1", "-1.5", "-.5e3", "-1.", "-1x", "-")] == ["a;-1", "a;-1.5", "a;-.5e3", "a;'-1.", "a;'-1x", "a;'-"]
    steps = count_patterns(monkeypatch, csv_cells)

    def quote(digits: int) -> int:
        before = steps()
        for number in ("1" * digits, "1." + "1" * digits, "1e" + "1" * digits):
            assert csv_comment(f"a;-{number}x") == f"a;'-{number}x"
        return steps() - before

    assert_linear(quote, 100)


def test_cells_of_tables():
    import pyarrow as pa

    words = pa.array(BAD)
    table = csv_table(pa.table({"a": words, "=b": words.dictionary_encode(), "x": pa.array([-1.0] * len(BAD))}))
    assert table.column_names == ["a", "'=b", "x"] and table["a"].to_pylist() == [csv_text(n) for n in BAD] == table["'=b"].to_pylist()
    assert table["x"].to_pylist() == [-1.0] * len(BAD), "numbers stay"


PRINTED = {
    "info": (("info", "robot.urdf"), 0),
    "check": (("check", "robot.urdf", "--all"), 1),
    "check --json": (("check", "robot.urdf", "--json"), 1),
    "compare": (("compare", "robot.urdf", "--with", "mujoco", "--states", "1"), 0),
    "loads": (("loads", "robot.urdf", "motion.csv", "-o", "OUT", "--csv", "--mcap", "--mat"), 0),
    "free-bodies": (("free-bodies", "results", "-o", "OUT", "--deck", "calculix"), 0),
    "generate": (("generate", "robot.urdf", "--algorithms", "bias", "-o", "OUT"), 0),
    "generate --cuda": (("generate", "robot.urdf", "--algorithms", "bias", "--cuda", "-o", "OUT"), 0),
    "generate --pivots": (("generate", "robot.urdf", "--algorithms", "bias", "--pivots", "-o", "OUT"), 2),
    "generate --fmu": (("generate", "robot.urdf", "--fmu", "inverse", "-o", "OUT.fmu"), 0),
    "actuation": (("actuation", "robot.urdf", "--joints", "=HYPERLINK(1),-2+3", "--start", "-2+3=0.1", "-o", "OUT"), 0),
    "hold": (("hold", "robot.urdf"), 0),
    "modes": (("modes", "robot.urdf", "--stiffness", "stiffness.toml", "--motion", "motion.csv", "-o", "OUT.csv"), 0),
    "motion": (("motion", "robot.urdf", "--kind", "minjerk", "-o", "OUT.csv"), 0),
    "simulate": (("simulate", "robot.urdf", "--until", "0.02", "--pose", "=HYPERLINK(1)=0.1", "--dry-friction", "-2+3=1", "-o", "OUT"), 0),
    "size": (("size", "results", "components.toml", "-o", "OUT"), 0),
    "size --example": (("size", "results", "--example"), 0),
    "size --spectra": (("size", "results", "--spectra", "-o", "OUT"), 0),
    "size --choose": (("size", "results", "asked.toml", "--choose", "catalogue.csv", "-o", "OUT"), 0),
    "sweep": (("sweep", "robot.urdf", "sweep.toml", "-o", "OUT"), 0),
    "view": (("view", "robot.urdf", "--export", "OUT.html"), 0),
    "names of files": (("loads", "\x1b[31m.urdf", "\u202e.csv"), 2),
    "a command": (("\x1b[31m",), 2),
    "an argument": (("info", "robot.urdf", "\x1b[31m"), 2),
    "an option": (("loads", "robot.urdf", "motion.csv", "--on", "\u202e"), 2),
}
"""What each command is given, and its status.  A new command must enter."""


def test_every_command_is_in_the_table():
    import ksl.commands  # noqa: F401  the commands
    from ksl.commands.app import app

    assert {command.name or command.callback.__name__ for command in app.registered_commands} <= {arguments[0] for arguments, _ in PRINTED.values()}


@pytest.mark.parametrize(("arguments", "status"), PRINTED.values(), ids=PRINTED)
def test_nothing_but_printable_text_is_printed(hostile, tmp_path, arguments, status):
    for needed in {"view": ["viser"], "compare": ["mujoco"]}.get(arguments[0], []):
        pytest.importorskip(needed)
    p = run(*(a.replace("OUT", str(tmp_path / "out")) for a in arguments), inside=hostile)
    assert p.returncode == status and p.stdout + p.stderr, p.stderr.decode()
    for text in (p.stdout.decode(), p.stderr.decode()):
        assert not CONTROL.search(text), text
        assert "Traceback" not in text
    if arguments[0] == "info" and len(arguments) == 2:
        assert "[red]x[/red]" in p.stdout.decode(), "names are no markup"


def test_colours_stay_on_a_terminal():
    """What is replaced is the text, and not what rich writes for colours."""
    from rich.text import Text

    from ksl.commands.app import SafeConsole

    out = io.StringIO()
    SafeConsole(file=out, force_terminal=True, color_system="standard", width=80).print(Text("a\x1b[2Jb", style="red"))
    assert out.getvalue() == "\x1b[31ma\\x1b[2Jb\x1b[0m\n"


def test_files_hold_no_formulas_and_read_back(hostile, tmp_path):
    p = run("loads", hostile / "robot.urdf", hostile / "motion.csv", "-o", tmp_path / "o", "--csv")
    assert p.returncode == 0, p.stderr.decode()
    for file in (tmp_path / "o").glob("*.csv"):
        with open(file, newline="", encoding="utf-8") as f:
            cells = [cell for row in csv.reader(line for line in f if not line.startswith("#")) for cell in row]
        assert len(cells) > 50
        for cell in cells:
            assert not re.match("[=+@\t\r]|-(?!(\\d|inf|nan))|-.*[^-+.\\dein]", cell), (file, cell)
        assert "'-2+3" in cells and "''=1" in cells
    html = (tmp_path / "o" / "report.html").read_text(encoding="utf-8")
    assert "</b></script>" not in html and "<b>&amp;</b>" not in html
    made = run("motion", hostile / "robot.urdf", "--kind", "minjerk", "-o", tmp_path / "m.csv")
    assert made.returncode == 0, made.stderr.decode()
    for file in [*(tmp_path / "o").glob("*.csv"), tmp_path / "m.csv"]:
        for separator in ";\t":
            with open(file, newline="", encoding="utf-8") as f:
                inner = [cell for row in csv.reader(f, delimiter=separator) for cell in row[1:]]
            assert not any(re.match(" *[=+@]", cell) for cell in inner), (file, separator)
    m = ksl.read_motion(ksl.load(hostile / "robot.urdf"), tmp_path / "m.csv")
    assert np.isfinite(m.q).all() and m.q.shape[1] == len(BAD)


# the last resort


FAULTS = [
    (MemoryError("x\x1b"), "not enough memory"), (RecursionError("x\x1b"), "KSL_TRACEBACK=1"), (KeyError("x\x1b"), "KSL_TRACEBACK=1"), (AssertionError("x\x1b"), "KSL_TRACEBACK=1"),
    (UnicodeEncodeError("utf-8", "a", 0, 1, "b"), "codec"), (PermissionError(13, "no", "file"), "file: can't be read"), (OutputError("folder: is full"), "ksl: folder: is full"),
]  # fmt: skip


@pytest.mark.parametrize(("fault", "sentence"), FAULTS)
def test_every_command_ends_in_a_sentence(hostile, monkeypatch, fault, sentence):
    """A fault is planted into what all commands call."""
    monkeypatch.setattr(loading, "load", Mock(side_effect=fault))
    assert sentence in is_sentence(run("info", hostile / "robot.urdf"))


def test_the_traceback_can_be_had(hostile, monkeypatch):
    monkeypatch.setattr(loading, "load", Mock(side_effect=KeyError("x")))
    p = run_ksl("info", hostile / "robot.urdf", KSL_TRACEBACK="1")
    assert "Traceback" in p.stderr and "KeyError" in p.stderr


def test_an_interrupt_is_no_traceback(hostile):
    code = (
        "import ksl.robot_files.loading\ndef load(*a, **o): raise KeyboardInterrupt\nksl.robot_files.loading.load = load\nfrom ksl.__main__ import main\nmain()"
    )
    p = subprocess.run([sys.executable, "-c", code, "info", hostile / "robot.urdf"], capture_output=True, timeout=60)
    assert p.returncode == 130 and b"Traceback" not in p.stderr and p.stderr.count(b"\n") <= 1, p.stderr


@pytest.mark.parametrize("at", ["import", "callback", "end"])
def test_an_interrupt_where_python_loses_it(hostile, at):
    """A module that makes another exception of it while it is imported; a callback of a weak reference, whose exceptions Python drops; the end."""
    code = {
        "import": "def load(*a, **o):\n try:\n  os.kill(os.getpid(), signal.SIGINT); time.sleep(5)\n except BaseException: pass\n raise ImportError('cannot import name')",
        "callback": "class C: pass\ndef cb(r): os.kill(os.getpid(), signal.SIGINT); time.sleep(0.2)\ndef load(*a, **o):\n c = C(); r = weakref.ref(c, cb); del c; time.sleep(5)",
        "end": "def load(*a, **o): raise SystemExit(0)\nfrom ksl.commands.app import Commands\ndef end(*a, **o): os.kill(os.getpid(), signal.SIGINT); time.sleep(5)\nCommands.main = end",
    }[at]
    start = "import os, signal, time, weakref\nimport ksl.robot_files.loading\nsignal.signal(signal.SIGINT, signal.default_int_handler)\n"  # jobs in the background ignore it
    p = subprocess.run([sys.executable, "-c", f"{start}{code}\nksl.robot_files.loading.load = load\nfrom ksl.__main__ import main\nmain()", "info", hostile / "robot.urdf"],
                       capture_output=True, timeout=60)  # fmt: skip
    assert p.returncode == 130 and b"Traceback" not in p.stderr and b"fault" not in p.stderr, p.stderr


FILES = {
    "loads": ("loads", "ROBOT", "X"),
    "map": ("loads", "ROBOT", "MOTION", "--map", "X"),
    "external": ("loads", "ROBOT", "MOTION", "--external", "X"),
    "cases": ("loads", "ROBOT", "--cases", "X"),
    "components": ("loads", "ROBOT", "MOTION", "--components", "X"),
    "size": ("size", "X", "X"),
    "choose": ("size", "RESULTS", "COMPONENTS", "--choose", "X"),
    "free-bodies": ("free-bodies", "X", "-o", "OUT"),
    "stresses": ("free-bodies", "X", "--stress", "X", "-o", "OUT"),
    "sweep": ("sweep", "ROBOT", "X"),
    "hold": ("hold", "ROBOT", "--pose", "X"),
    "motion of actuation": ("actuation", "ROBOT", "--joints", "-2+3", "--motion", "X", "-o", "OUT"),
    "check of actuation": ("actuation", "ROBOT", "--joints", "-2+3", "--check", "X", "-o", "OUT"),
    "waypoints": ("motion", "ROBOT", "--kind", "minjerk", "--waypoints", "X", "-o", "OUT.csv"),
    "loops": ("hold", "ROBOT", "--loops", "X"),
    "stiffness": ("hold", "LOOPED", "--stiffness", "X"),
    "stiffness of modes": ("modes", "ROBOT", "--stiffness", "X"),
    "simulate": ("simulate", "ROBOT", "X", "-o", "OUT"),
    "cases of simulate": ("simulate", "ROBOT", "--cases", "X", "-o", "OUT"),
    "compare": ("compare", "X"),
    "info": ("info", "X"),
    "check": ("check", "X"),
    "view": ("view", "X", "--export", "OUT.html"),
}


@pytest.fixture(scope="module")
def nasty(tmp_path_factory):
    """Files that no reader wants, by name."""
    folder = tmp_path_factory.mktemp("nasty")
    os.mkfifo(folder / "pipe")
    (folder / "null").write_bytes(bytes(1000))
    (folder / "cr").write_bytes(b"time,a\r0,0\r")
    (folder / "field").write_bytes(b'time,"' + b"x" * 140_000 + b'"\n0,0\n')
    (folder / "latin").write_bytes(b"a = '\xff'\n[\xff]\n")
    (folder / "deep").write_bytes(b"a = " + b"[" * 50_000)
    (folder / "number").write_bytes(b"a = " + b"1" * 50_000)
    (folder / "empty").write_bytes(b"")
    with open(folder / "sparse", "wb") as f:
        f.truncate(8 << 30)
    os.symlink(folder / "loop", folder / "loop")
    return folder


NASTY = ["pipe", "null", "cr", "field", "latin", "deep", "number", "empty", "sparse", "loop", "absent", ".", "bytes\udcff"]


@pytest.mark.parametrize("what", FILES)
def test_files_that_no_reader_wants(hostile, nasty, examples, tmp_path, what, monkeypatch, capfd):
    """Every file argument of every command, in this process: starting 150 of them would take minutes."""
    from ksl.commands import app

    warm()
    if what == "view":
        pytest.importorskip("viser")
    places = {
        "ROBOT": hostile / "robot.urdf",
        "MOTION": hostile / "motion.csv",
        "LOOPED": examples / "robots/excavator.urdf",
        "RESULTS": hostile / "results",
        "COMPONENTS": hostile / "components.toml",
    }
    endless = ["pipe", "sparse", "/dev/zero", "bytes\udcff"]  # of robot files the tests of the loader have these
    for name in [n for n in [*NASTY, "/dev/zero"] if not (what in ("info", "view", "compare") and n in endless)]:
        file = nasty / name
        arguments = [str(file) if a == "X" else str(places[a]) if a in places else a.replace("OUT", str(tmp_path / "out")) for a in FILES[what]]
        monkeypatch.chdir(tmp_path)
        with pytest.raises(SystemExit) as ended:
            app(arguments, prog_name="ksl")
        _, said = capfd.readouterr()
        assert ended.value.code == 2, (name, said)
        assert said.startswith("ksl: ") and said.count("\n") == 1 and not CONTROL.search(said), (name, said)
        assert "KSL_TRACEBACK" not in said, (name, said)
