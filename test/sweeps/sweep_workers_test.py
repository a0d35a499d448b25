"""ksl.sweep on processes and on Ray: nothing that is complete is lost, whatever stops, and files that change meanwhile are noticed."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pyarrow.parquet as parquet
import pytest

import ksl
from described_sweeps import HERE, PANDA, PICK, SPEED, contents, described, many
from ksl.sweeps import local, on_ray
from ksl.sweeps.description import sweep_from
from ksl.sweeps.evaluate import Evaluator, Plan


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("undisturbed")
    ksl.sweep(PANDA, many(), folder, workers=2)
    return contents(folder)


def workers(words: str) -> list[int]:
    """Processes whose command line has these words, and this test's own mark in their environment: nobody else's."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if words in (entry / "cmdline").read_text().replace("\0", " ") and mark() in (entry / "environ").read_bytes().decode(errors="replace"):
                found.append(int(entry.name))
        except (OSError, ValueError):  # it has ended, or is no process
            continue
    return found


def mark() -> str:
    """Of this process: copies of it may run the same tests."""
    return f"KSL_TEST_OF={os.getpid()}."


@pytest.fixture(autouse=True)
def marked(monkeypatch):
    monkeypatch.setenv(*mark().split("="))


def killing(words: str):
    """A progress that kills one worker at work, after the first partition.  It waits for one; the deadline ends a wait in vain."""
    killed = []

    def progress(done: int, cases: int) -> None:
        until = time.monotonic() + 60
        while done and not killed:
            assert time.monotonic() < until, f"no process of {words}"
            if found := workers(words):
                os.kill(found[0], signal.SIGKILL)
                killed.append(found[0])

    return progress, killed


def test_one_worker_more_or_less_changes_no_bit(tmp_path, undisturbed, monkeypatch):
    """Nor does a robot that is given as a model; and no pipe of a worker is left to the garbage collector, which would warn of it."""
    started, popen = [], subprocess.Popen
    monkeypatch.setattr(local.subprocess, "Popen", lambda *a, **how: started.append(popen(*a, **how)) or started[-1])
    results = ksl.sweep(ksl.load(PANDA), many(), tmp_path, workers=1)
    assert results.computed == 40 and len(undisturbed) == 10
    for name, content in undisturbed.items():  # their metadata say from what they were computed: here a model, there a file
        assert parquet.read_table(tmp_path / "cases" / name).equals(parquet.read_table(io.BytesIO(content)))
    assert len(started) == 1 and started[0].stdin.closed and started[0].stdout.closed and started[0].returncode is not None


def test_a_worker_that_dies_costs_its_partition_only(tmp_path, undisturbed):
    progress, killed = killing("ksl.sweeps.worker")
    results = ksl.sweep(PANDA, many(), tmp_path, workers=2, progress=progress)
    assert killed and results.computed == 40 and contents(tmp_path) == undisturbed
    assert not workers("ksl.sweeps.worker")


@pytest.mark.long  # Ray takes most of a minute to start; test_a_cluster… have the same calls without it
def test_on_ray_the_bits_are_the_same_and_a_lost_worker_costs_its_partition_only(tmp_path):
    pytest.importorskip("ray")
    tables = many(steps=16, partition=10)
    ksl.sweep(PANDA, tables, tmp_path / "local", workers=2)
    kill, killed = killing("ray::evaluate")
    handlers = [signal.getsignal(signal.SIGTERM)]

    def progress(done: int, cases: int) -> None:
        handlers.append(signal.getsignal(signal.SIGTERM))
        kill(done, cases)

    results = ksl.sweep(PANDA, tables, tmp_path / "ray", workers=2, engine="ray", progress=progress)
    assert len(handlers) > 1 and len(set(handlers)) == 1  # so that `ksl sweep` ends by its own
    assert killed and results.computed == 80 and contents(tmp_path / "ray") == contents(tmp_path / "local")


@dataclass(eq=False)
class Task:
    function: Callable
    plan: Plan
    partition: int


class Cluster:
    """What `ray` is for ksl.sweeps.on_ray, in this process: a task is computed when it is waited for, the last one first."""

    exceptions = SimpleNamespace(**{name: type(name, (Exception,), {}) for name in ("WorkerCrashedError", "OutOfMemoryError", "RayError")})

    def __init__(self, cpus, fault=None):
        self.cpus, self.fault, self.most, self.ended, self.options = cpus, fault, 0, 0, None

    def is_initialized(self):
        return False

    def init(self, **options):
        self.options = options

    def shutdown(self):
        self.ended += 1

    def remote(self, **options):
        self.options |= options
        return lambda function: SimpleNamespace(remote=lambda plan, partition: Task(function, plan, partition))

    def put(self, x):
        return x

    def cluster_resources(self):
        return {"CPU": self.cpus}

    def wait(self, running, num_returns):
        self.most = max(self.most, len(running))
        return running[-num_returns:], running[:-num_returns]

    def get(self, task):
        if self.fault is not None and task.partition == 3:
            raise self.fault
        return task.function(task.plan, task.partition)


@pytest.mark.parametrize(("cpus", "workers", "at_once"), [(1, 1, 2), (1, 2, 4), (3, 2, 6), (16, 1, 10)])
def test_a_cluster_computes_all_partitions(monkeypatch, cpus, workers, at_once):
    """Twice as many at once as there are processors, or workers; each partition once, and the cluster that was begun is ended."""
    cluster = Cluster(cpus)
    monkeypatch.setitem(sys.modules, "ray", cluster)
    plan = Plan(PANDA, sweep_from(many()), 4)
    results = list(on_ray.compute(plan, range(10), workers, None))
    assert sorted(r.partition for r in results) == list(range(10)) and cluster.most == at_once and cluster.ended == 1
    assert cluster.options["num_cpus"] == 1 and cluster.options["max_retries"] == 2 and cluster.options["address"] == "local"
    here = Evaluator(plan)
    assert all(r.files == here.partition(r.partition).files for r in results[:2])


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ("WorkerCrashedError", "the worker of cases 12 to 15 has died 3 times"),
        ("OutOfMemoryError", "the worker of cases 12 to 15 has died"),
        ("RayError", "cases 12 to 15: the Ray cluster answers: of the cluster; check that KSL"),
    ],
)
def test_faults_of_a_cluster_are_said(monkeypatch, fault, words):
    cluster = Cluster(1, getattr(Cluster.exceptions, fault)("first line\nof the cluster"))
    monkeypatch.setitem(sys.modules, "ray", cluster)
    with pytest.raises(ksl.SweepError, match=words):
        list(on_ray.compute(Plan(PANDA, sweep_from(many()), 4), range(10), 1, None))
    assert cluster.ended == 1


def test_what_was_interrupted_goes_on(tmp_path, undisturbed):
    def interrupt(done: int, cases: int) -> None:
        if done >= 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ksl.sweep(PANDA, many(), tmp_path, workers=2, progress=interrupt)
    complete = contents(tmp_path)
    assert len(complete) == 2 and not (tmp_path / "worst.csv").exists() and not workers("ksl.sweeps.worker")
    (tmp_path / "cases" / ".part-000009.parquet.part").write_bytes(b"of a run that was killed")
    results = ksl.sweep(PANDA, many(), tmp_path, workers=1)
    assert results.computed == 32 and contents(tmp_path) == undisturbed


def test_a_fault_of_a_worker_is_said_at_once(monkeypatch):
    def fault(self, index):
        raise TypeError("of KSL")

    monkeypatch.setattr(Evaluator, "partition", fault)
    answer = on_ray.evaluate(Plan(PANDA, sweep_from(described(SPEED)), 1), 0)
    assert isinstance(answer, ksl.SweepError) and "fault in KSL: TypeError: of KSL (" in str(answer)


@pytest.mark.parametrize("workers", [0, -1, "2", 1.5])
def test_a_number_of_processes_that_is_none(tmp_path, workers):
    with pytest.raises(ksl.SweepError, match="expected a number of processes, at least 1"):
        ksl.sweep(PANDA, described(SPEED), tmp_path / "out", workers=workers)


def test_a_ray_cluster_out_of_reach(tmp_path):
    pytest.importorskip("ray")
    with pytest.raises(ksl.SweepError, match="out of reach"):
        ksl.sweep(PANDA, described(SPEED), tmp_path, workers=1, engine="ray", address="127.0.0.1:1")


def with_copies(tmp_path):
    """Robot and motion of their own, and a sweep of them in four partitions."""
    robot, motion = tmp_path / "panda.urdf", tmp_path / "pick.csv"
    robot.write_bytes(Path(PANDA).read_bytes())
    motion.write_bytes(Path(PICK).read_bytes())
    tables = {"sweep": {"partition": 1}, "base": {"motion": str(motion)}, "vary": [{"kind": "speed", "values": [0.4, 0.6, 0.8, 1.0]}]}
    return robot, motion, tables


def faster(motion):
    """Another motion at the same path."""
    lines = motion.read_text().splitlines()
    other = motion.with_name("other.csv")
    other.write_text("\n".join([lines[0], *(f"{0.5 * float(line.split(',', 1)[0])},{line.split(',', 1)[1]}" for line in lines[1:])]) + "\n")
    os.replace(other, motion)


@pytest.mark.parametrize("which", ["motion", "robot"])
def test_a_file_that_is_replaced_during_a_sweep_is_refused(tmp_path, monkeypatch, which):
    """A worker that starts after it reads other contents: no partition is computed from them."""
    from ksl.sweeps import local

    robot, motion, tables = with_copies(tmp_path)

    def compute(plan, partitions, workers):
        for k, partition in enumerate(partitions):
            if k == 2:
                faster(motion) if which == "motion" else robot.write_text(robot.read_text().replace('mass value="', 'mass value="1'))
            yield Evaluator(plan).partition(partition)

    monkeypatch.setattr(local, "compute", compute)
    with pytest.raises(ksl.SweepError, match=f"{(motion if which == 'motion' else robot).name}: has changed since the sweep began"):
        ksl.sweep(robot, tables, tmp_path / "out")
    assert len(contents(tmp_path / "out")) == 2
    with pytest.raises(ksl.SweepError, match=f"holds another sweep .of other files: {(motion if which == 'motion' else robot).name} had other contents"):
        ksl.sweep(robot, tables, tmp_path / "out")


@HERE
def test_partitions_carry_the_hashes_they_were_computed_from(tmp_path, capsys):
    """Those of other contents are computed again, and that is said."""
    robot, motion, tables = with_copies(tmp_path)
    ksl.sweep(robot, tables, tmp_path / "old")
    right = contents(tmp_path / "old")
    for file in sorted((tmp_path / "old" / "cases").iterdir()):
        said = json.loads(parquet.read_schema(file).metadata[b"ksl"])["inputs"]
        assert [(f["role"], f["file"]) for f in said] == [("robot", "panda.urdf"), ("motion", "pick.csv")] and all(len(f["sha256"]) == 64 for f in said)
    faster(motion)
    ksl.sweep(robot, tables, tmp_path / "new")
    name = sorted(right)[1]
    (tmp_path / "new" / "cases" / name).write_bytes(right[name])  # a mixture, as an earlier version left it
    again = ksl.sweep(robot, tables, tmp_path / "new")
    assert again.computed == 1 and again.replaced == 1 and "1 partition again, since files had other contents" in repr(again)
    assert (tmp_path / "new" / "cases" / name).read_bytes() != right[name]
    whole = ksl.sweep(robot, tables, tmp_path / "new")
    assert whole.computed == 0 and whole.replaced == 0


@HERE
def test_results_of_other_files_are_not_sized_together(tmp_path):
    from ksl.sizing.results import read_results

    robot, motion, tables = with_copies(tmp_path)
    ksl.sweep(robot, tables, tmp_path / "old", wrenches=True)
    faster(motion)
    ksl.sweep(robot, tables, tmp_path / "new", wrenches=True)
    (tmp_path / "new/wrenches/part-000001.parquet").write_bytes((tmp_path / "old/wrenches/part-000001.parquet").read_bytes())
    with pytest.raises(ksl.SizingError, match=r"part-000001.parquet: was computed from other files than part-000000.parquet"):
        read_results(tmp_path / "new")
