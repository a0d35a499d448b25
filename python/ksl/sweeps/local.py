"""The local engine: processes on this machine."""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence

from ksl.base.errors import SweepError
from ksl.sweeps.evaluate import Plan, Result

ATTEMPTS = 3
"""How often a partition is tried whose worker dies."""


def compute(plan: Plan, partitions: Sequence[int], workers: int) -> Iterator[Result]:
    """Computes partitions, in whatever order they are finished.

    A worker that dies is replaced, and its partition computed again; nothing else is lost.  Raises SweepError for what a worker refuses,
    and for a partition whose workers die again and again.  Ends all workers, also when the caller stops before the end.
    """
    waiting: queue.SimpleQueue[tuple[int, int]] = queue.SimpleQueue()
    for partition in partitions:
        waiting.put((partition, 1))
    done: queue.SimpleQueue[Result | Exception] = queue.SimpleQueue()
    crew = [_Worker(plan, waiting, done) for _ in range(min(workers, len(partitions)))]
    try:
        for _ in partitions:
            answer = done.get()
            if isinstance(answer, Exception):
                raise answer
            yield answer
    finally:
        for worker in crew:
            worker.end()


def died(cases: range) -> str:
    """The sentence about a partition whose workers die."""
    return f"the worker of cases {cases.start} to {cases.stop - 1} has died {ATTEMPTS} times; memory may be too small: use fewer workers"


class _Worker:
    """A process, and the thread that talks to it."""

    def __init__(self, plan: Plan, waiting: queue.SimpleQueue[tuple[int, int]], done: queue.SimpleQueue[Result | Exception]) -> None:
        self._plan, self._waiting, self._done = plan, waiting, done
        self._process: subprocess.Popen[bytes] | None = None
        self._lock, self._ended = threading.Lock(), False
        threading.Thread(target=self._work, daemon=True).start()

    def end(self) -> None:
        """Ends the process.  Its partition isn't computed."""
        with self._lock:
            self._ended = True
            self._kill()

    def _work(self) -> None:
        try:
            while True:
                try:
                    partition, attempt = self._waiting.get_nowait()
                except queue.Empty:
                    return
                answer = self._ask(partition)
                if answer is not None:
                    self._done.put(answer)
                elif self._ended:
                    return
                elif attempt < ATTEMPTS:
                    self._waiting.put((partition, attempt + 1))
                else:
                    self._done.put(SweepError(died(self._plan.cases(partition))))
                    return
        except Exception as error:  # a fault of this thread must not leave the sweep waiting
            self._done.put(error)

    def _ask(self, partition: int) -> Result | Exception | None:
        """The answer of the process, started if there is none; None if it has died."""
        try:
            process = self._started()
            if process is None or process.stdin is None or process.stdout is None:
                return None
            pickle.dump(partition, process.stdin, pickle.HIGHEST_PROTOCOL)
            process.stdin.flush()
            answer: Result | Exception = pickle.load(process.stdout)
            return answer
        except (EOFError, OSError, pickle.UnpicklingError):
            with self._lock:
                self._kill()
            return None

    def _kill(self) -> None:
        """Ends the process, and closes its pipes: a pipe that the garbage collector closes is a ResourceWarning."""
        process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with contextlib.suppress(OSError):  # what was still to be written has no reader
                if pipe is not None:
                    pipe.close()

    def _started(self) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._ended:
                return None
            if self._process is None:
                path = os.pathsep.join(p for p in sys.path if p)  # the worker finds what this process finds
                command = [sys.executable, "-m", "ksl.sweeps.worker"]
                self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path})
                assert self._process.stdin is not None
                pickle.dump(self._plan, self._process.stdin, pickle.HIGHEST_PROTOCOL)
            return self._process
