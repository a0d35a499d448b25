"""Every command and function of KSL that writes files, with an earlier result and a later one that differ."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import killing
from ksl_command import ksl_main

ARM = """<robot name="arm"><link name="rail"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="rail"/><child link="cart"/><axis xyz="1 0 0"/>
<limit lower="-9" upper="9" effort="900" velocity="9"/></joint></robot>"""


@dataclass(frozen=True)
class Writer:
    """A command that writes into a folder, or one file into it."""

    name: str
    earlier: Callable[[Path], Callable[[], object]]
    """Makes what runs the command with this folder."""
    later: Callable[[Path], Callable[[], object]]
    user_file: str = "notes.txt"
    """Something of the user's in the folder."""


@contextmanager
def stand_ins_end() -> Iterator[None]:
    """After the block, what the functions below have replaced is put back: other tests run in the same process."""
    from ksl.load_cases import provenance
    from ksl.sizing.catalogue import provenance as run
    from ksl.sweeps import local
    from ksl.viewer import export

    replaced = [(module, name, getattr(module, name)) for module, name in ((provenance, "datetime"), (run, "datetime"), (local, "compute"), (export, "_html"))]
    try:
        yield
    finally:
        for module, name, original in replaced:
            setattr(module, name, original)


def same_date() -> None:
    """Gives all results the same date, so that two runs write the same bytes."""
    from ksl.load_cases import provenance
    from ksl.sizing.catalogue import provenance as run

    class Then(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime(2020, 1, 1, tzinfo=tz)

    provenance.datetime = run.datetime = Then


def export_a_small_page() -> None:
    """Replaces the page of the viewer, which takes a second to make, by a small one: writing the file does not depend on what the page shows."""
    from ksl.viewer import export

    export._html = lambda scene, shown: f"<html><body>{shown.selected} {len(scene.time)}</body></html>" * 2000


def prepare(work: Path) -> list[Writer]:
    """Inputs in `work`, and all that writes."""
    work.mkdir(parents=True, exist_ok=True)
    (work / "arm.urdf").write_text(ARM)
    (work / "wrong.urdf").write_text(ARM.replace('lower="-9" upper="9"', 'lower="9" upper="-9"'))
    (work / "wrong2.urdf").write_text(ARM.replace('lower="-9" upper="9"', 'lower="7" upper="-7"'))
    for name, speed in (("a", 1.0), ("b", 2.0)):
        rows = "".join(f"{k / 100},{speed * (k / 100) ** 2}\n" for k in range(150))
        (work / f"{name}.csv").write_text("time,slide\n" + rows)
        (work / f"sweep_{name}.toml").write_text(f'[base]\nmotion = "{name}.csv"\n[[vary]]\nkind = "payload"\nlink = "cart"\nvalues = [0, 1, 2, 3]\n')
    run = ksl_main
    arm = work / "arm.urdf"

    def loads(motion: str, *more: str) -> Callable[[Path], Callable[[], object]]:
        return lambda out: run("loads", arm, work / f"{motion}.csv", "-o", out, *more)

    results = work / "results"
    for name in ("a", "b"):
        killing.in_this_process(run("loads", arm, work / f"{name}.csv", "-o", results / name))
    writers = [
        Writer("loads", loads("a", "--csv", "--json"), loads("b")),
        Writer("loads into an empty folder", lambda out: lambda: out.mkdir(exist_ok=True), loads("b", "--csv")),
        Writer("size", lambda out: run("size", results / "a", "-o", out, "--brief"), lambda out: run("size", results / "b", "-o", out)),
        Writer(
            "motion",
            lambda out: run("motion", arm, "--kind", "template", "-o", out / "m.csv"),
            lambda out: run("motion", arm, "--kind", "chirp", "--duration", 3, "-o", out / "m.csv"),
        ),
        Writer(
            "motion as Parquet",
            lambda out: run("motion", arm, "--kind", "template", "-o", out / "m.parquet"),
            lambda out: run("motion", arm, "--kind", "chirp", "--duration", 3, "-o", out / "m.parquet"),
        ),
        Writer(
            "check --fix",
            lambda out: run("check", work / "wrong.urdf", "--fix", out / "fixed.urdf"),
            lambda out: run("check", work / "wrong2.urdf", "--fix", out / "fixed.urdf", "--force"),
        ),
        Writer(
            "view --export",
            lambda out: run("view", arm, "--export", out / "page.html"),
            lambda out: run("view", arm, work / "a.csv", "--export", out / "page.html"),
        ),
        Writer("to_urdf", lambda out: lambda: _to_urdf(arm, out, 1.0), lambda out: lambda: _to_urdf(arm, out, 2.0)),
        Writer("Run.report", lambda out: lambda: _report(arm, work / "a.csv", out), lambda out: lambda: _report(arm, work / "b.csv", out)),
    ]
    return writers


def sweep_of(work: Path, name: str, *more: object) -> Callable[[Path], Callable[[], object]]:
    return lambda out: ksl_main("sweep", work / "arm.urdf", work / f"sweep_{name}.toml", "-o", out, "--workers", 1, *more)


def _to_urdf(arm: Path, out: Path, mass: float) -> None:
    import ksl

    ksl.load(arm).with_payload("cart", mass).to_urdf(out / "made.urdf")


def _report(arm: Path, motion: Path, out: Path) -> None:
    import ksl

    ksl.compute_loads(arm, motion).report(out / "report.html")


def earlier_results(writer: Writer, folder: Path) -> killing.Seen:
    """A folder with the earlier results and a file of the user's."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    (folder / writer.user_file).write_text("the user's")
    status, _ = killing.in_a_copy(writer.earlier(folder), output=Path(os.devnull))
    assert status in (0, 1, 2) if writer.name == "check --fix" else status == 0, (writer.name, status)
    return killing.visible(folder)


def killed_at_changes(writer: Writer, out: Path, places: int | None = None) -> list[str]:
    """Kills a command before its changes: all of them, or so many, evenly spread.  Returns what a reader finds amiss."""
    earlier = earlier_results(writer, out)
    saved = out.with_name(out.name + "-saved")
    shutil.rmtree(saved, ignore_errors=True)
    shutil.copytree(out, saved)
    status, changes = killing.in_a_copy(writer.later(out))
    later = killing.visible(out)
    faults = [] if later != earlier else ["the results don't differ, and the check would see nothing"]
    for number in chosen(changes, places):
        shutil.rmtree(out)
        shutil.copytree(saved, out)
        if killing.in_a_copy(writer.later(out), kill_at=number)[0] != -9:
            faults.append(f"change {number} never came")
        faults += amiss(out, earlier, later, f"killed before change {number} of {changes}")
    if killing.in_a_copy(writer.later(out))[0] != status or killing.visible(out) != later:
        faults.append("the run after them all has other results")
    return faults


def amiss(out: Path, earlier: killing.Seen, later: killing.Seen, when: str) -> list[str]:
    """What is wrong with a folder: at once, and after the next run, which here writes nothing."""
    from ksl.output import staged

    found = killing.visible(out)
    faults = [] if found in (earlier, later) else [f"{when}: torn, {sorted(found)}"]
    with staged(out):
        pass
    if killing.visible(out) != found:
        faults.append(f"{when}: the next run has changed the results")
    left = killing.everything(out) - set(found)
    return faults + ([f"{when}: left behind: {sorted(left)}"] if left else [])


def chosen(changes: int, places: int | None) -> list[int]:
    """All numbers from 1 to `changes`, or so many, evenly spread."""
    return list(range(1, changes + 1)) if places is None else sorted({1 + k * (changes - 1) // (places - 1) for k in range(places)})
