"""Times of what hostile or large inputs cost in Python: `growth.py BENCH_DIR`, run with the Python that has KSL.

The tests count this work (test/growth.py), since a time says as much about the machine.  Here are the times, of an input and of one four times
as large, beside what they may be at most; and those of robot files, for each megabyte, by the program `growth`.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from rich.console import Console
from scipy.interpolate import make_interp_spline

import ksl
from ksl.checks.run import findings_of_bytes, fix
from ksl.checks.description.tags import balanced
from ksl.checks.description.vocabulary import ELEMENTS
from ksl.base.csv_cells import csv_comment
from ksl.commands.print_info import print_info
from ksl.mechanism.joint_columns import by_name
from ksl.motions.signal.corners import find_jumps
from ksl.motions.files.joint_states import JointStates, JointStateTable
from ksl.motions.signal.noise import step_of, white_noise
from ksl.motions.reading import read_motion
from ksl.motions.files.recognise import open_table
from ksl.base.toml_files import toml_of

ROOT = Path(__file__).resolve().parent.parent
Work = Callable[[], object]


def seconds(run: Work) -> float:
    """Processor time, the least of three."""
    least = float("inf")
    for _ in range(3):
        start = time.process_time()
        with suppress(ValueError):  # refused with a sentence
            run()
        least = min(least, time.process_time() - start)
    return least


def chain(n: int) -> ksl.Model:
    b = ksl.Builder("chain").add_link("l0")
    for i in range(1, n):
        b.add_link(f"l{i}", 1.0, (0, 0, 0.05)).add_joint(f"j{i}", "revolute", f"l{i - 1}", f"l{i}", axis=(0, 1, 0), limits=(-1, 1), effort=10)
    return b.build()


def growing(folder: Path) -> dict[str, tuple[Callable[[int], Work], int, float]]:
    """{what: (the work for a size, the larger size, seconds that it may take on two cores of the usual kind)}."""
    robot = ksl.load(ROOT / "examples/robots/ur5.urdf")
    text = lambda inside: f'<robot name="r">{inside}</robot>'.encode()
    check = lambda given: lambda: findings_of_bytes(given)

    def written(name: str, content: str) -> Path:
        (folder / name).write_text(content)
        return folder / name

    def names(n: int) -> Work:
        path = written("wide.csv", "time," + ",".join(f"hip_{k}" for k in range(n)) + "\n" + "0," * n + "0\n")
        return lambda: read_motion(robot, path)

    def parquet(n: int) -> Work:
        pq.write_table(pa.table([pa.array([0.0])] * (n + 1), names=[f"c{k}" for k in [*range(n), n - 1]]), folder / "t.parquet")
        return lambda: open_table(folder / "t.parquet")

    def messages(n: int) -> Work:
        header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=0))
        message = SimpleNamespace(name=[f"j{k}" for k in range(n)], position=[0.0] * n, velocity=[], effort=[], header=header)
        return lambda: JointStateTable(JointStates("file", "/joint_states", [(0, message)]), "MCAP", False)

    def followers(n: int) -> Work:
        links = "".join(f'<link name="l{k}"/>' for k in range(n + 1))
        mimic = lambda k: f'<mimic joint="j{k - 1}"/>' if k else ""
        joints = (f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/>{mimic(k)}</joint>' for k in range(n))
        return check(text(links + "".join(joints)))

    def comments(n: int) -> Work:
        path = written("robot.urdf", "<!-- a -->" * n + '<!DOCTYPE robot><robot name="r"><link name="a"/></robot>')
        return lambda: fix(path, folder / "out.urdf", force=True)

    def columns(n: int) -> Work:
        given = [f"j{k}" for k in range(n)]
        return lambda: by_name(dict.fromkeys(given, 1.0), given, "q", [(name, "revolute") for name in given])

    def info(n: int) -> Work:
        model, console = chain(n), Console(width=200, highlight=False, file=(folder / "info.txt").open("w"))
        return lambda: print_info(model, console)

    return {
        "names of columns in a CSV file": (names, 100_000, 5),
        "names of a Parquet file, one of them twice": (parquet, 20_000, 5),
        "joints of a message": (messages, 16_000, 0.24),
        "columns that are taken by name": (columns, 10_000, 1),
        "blanks in a TOML file": (lambda n: lambda: toml_of(" " * n + "?\n", "map.toml", ksl.MotionError), 16_000, 1),
        "digits of a number in a robot file": (lambda n: check(text(f'<link name="a"><inertial><mass value="{"1" * n}x"/></inertial></link>')), 20_000, 1),
        "digits of a number in a comment": (lambda n: lambda: csv_comment(f"a;-{'1' * n}x"), 10_000, 0.5),
        "followers of followers": (followers, 1600, 0.8),
        "unknown attributes": (lambda n: check(text("<link " + " ".join(f'b{k}="1"' for k in range(n)) + "/>")), 12_000, 1),
        "unknown elements": (lambda n: check(text("".join(f"<e{k}/>" for k in range(n)))), 12_000, 1),
        "a namespace of 80 kB, and elements": (lambda n: check(text(f'<a xmlns="{"u" * 80_000}">{"<b/>" * n}</a>')), 16_000, 0.5),
        "tags that are not closed": (lambda n: lambda: balanced("<a></b>" * n, ELEMENTS), 15_000, 1),
        "comments before a document type": (comments, 24, 2),
        "bytes of the root element's tag": (lambda n: lambda: ksl.load_string(b"<robot name='" + b"x" * n + b"'/>"), 50_000_000, 10),
        "links that `ksl info` prints": (info, 2400, 0.5),
    }


def beside(folder: Path) -> list[tuple[str, Work, str, Work, float]]:
    """(what, its work, what it is compared with, the work of that, how many times as long it may take)."""
    path = folder / "plain.csv"
    path.write_text("time,a,b,c\n" + "".join(f"{k},0.123456789,-0.5,{k}.25\n" for k in range(200_000)))
    t = np.arange(100_000) * 1e-3
    x = np.sin(t[:, None] * np.arange(1, 8) * 0.3)
    look = lambda: (find_jumps(t, x), white_noise(t, x, np.array([step_of(c) for c in x.T])))
    return [
        ("a CSV file of 200,000 lines", lambda: open_table(path).read(["time", "a", "b", "c"], "time"), "pyarrow", lambda: pyarrow.csv.read_csv(path), 5),
        ("jumps and noise of 7 joints, 100,000 samples", look, "a spline", lambda: make_interp_spline(t, x, k=5, check_finite=False)(t, nu=2), 3),
    ]


def main(programs: Path) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        print(f"{'input':46} {'size':>12} {'s':>8} {'s, a quarter':>13} {'at most, s':>11}")
        for what, (make, size, most) in growing(folder).items():
            few, many = (seconds(make(n)) for n in (size // 4, size))
            print(f"{what:46} {size:12,} {many:8.3f} {few:13.3f} {most:11.2f}")
        print()
        for what, ours, other, theirs, most in beside(folder):
            print(f"{what:46} {seconds(ours) / seconds(theirs):6.2f} times as long as {other}; at most {most:g} times")
        m = ksl.load(ROOT / "examples/robots/panda.urdf")
        x = read_motion(m, ROOT / "examples/motions/panda_pick.csv")
        table = m.wrench_table(x.time, x.q, x.v, x.a)
        try:
            print(
                f"{'sizing of the Panda by its pick motion':46} {seconds(lambda: ksl.size(table, ROOT / 'examples/components/panda.toml')):6.3f} s; at most 2 s\n"
            )
        except ModuleNotFoundError as error:
            print(f"no sizing: {error}\n")
    sys.stdout.flush()
    subprocess.run([programs / "growth"], check=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
