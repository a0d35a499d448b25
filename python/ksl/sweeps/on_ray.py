"""The engine on Ray: processes of a cluster that exists, or of one that is started on this machine."""

from __future__ import annotations

import os
import signal
import socket
import threading
import warnings
from collections.abc import Iterator, Sequence
from typing import Any

from ksl.base.errors import DescriptionWarning, SweepError
from ksl.sweeps.evaluate import Evaluator, Plan, Result, refused
from ksl.sweeps.local import ATTEMPTS, died

_evaluators: dict[str, Evaluator] = {}
"""The evaluator of this worker, kept between its partitions."""


def evaluate(plan: Plan, partition: int) -> Result | SweepError:
    """What a Ray worker runs.  An error is returned: it would be tried again if it were raised."""
    try:
        if plan.key not in _evaluators:
            _evaluators.clear()
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", DescriptionWarning)  # the sweep has warned of this robot already
                _evaluators[plan.key] = Evaluator(plan)
        return _evaluators[plan.key].partition(partition)
    except Exception as error:
        return refused(error)


def compute(plan: Plan, partitions: Sequence[int], workers: int, address: str | None) -> Iterator[Result]:
    """The results of partitions, as the local engine gives them.  address: of a cluster; None: the cluster of the environment (RAY_ADDRESS), or a new one with `workers` processes.

    Every machine of the cluster needs KSL and the files, under the same paths.  Raises SweepError.
    """
    try:
        import ray
    except ModuleNotFoundError:
        raise SweepError("the engine ray needs the package ray; install it with: pip install 'ksl[ray]'") from None
    own = not ray.is_initialized()
    if own:
        _connect(address, workers)
    try:
        task = ray.remote(num_cpus=1, max_retries=ATTEMPTS - 1)(evaluate)
        shared, waiting = ray.put(plan), list(partitions)[::-1]
        running: dict[object, int] = {}
        at_once = 2 * max(workers, int(ray.cluster_resources().get("CPU", workers)))  # the results of more would fill the memory of the cluster
        while waiting or running:
            while waiting and len(running) < at_once:
                partition = waiting.pop()
                running[task.remote(shared, partition)] = partition
            ready, _ = ray.wait(list(running), num_returns=1)
            cases = plan.cases(running.pop(ready[0]))
            try:
                answer = ray.get(ready[0])
            except (ray.exceptions.WorkerCrashedError, ray.exceptions.OutOfMemoryError):
                raise SweepError(died(cases)) from None
            except ray.exceptions.RayError as error:  # above all: a machine of the cluster that lacks KSL, or has another version of it
                said = str(error).strip().splitlines()[-1]
                raise SweepError(f"cases {cases.start} to {cases.stop - 1}: the Ray cluster answers: {said}; check that KSL is on its machines") from None
            if isinstance(answer, SweepError):
                raise answer
            yield answer
    finally:
        if own:
            ray.shutdown()


def _connect(address: str | None, workers: int) -> None:
    import ray

    given = address or os.environ.get("RAY_ADDRESS")
    handler = signal.getsignal(signal.SIGTERM)
    options: dict[str, Any] = {} if given else {"num_cpus": workers, "include_dashboard": False}
    try:
        if given:
            _reach(given)
        ray.init(address=given or "local", log_to_driver=False, configure_logging=True, logging_level="ERROR", **options)
    except (OSError, RuntimeError, ValueError, ray.exceptions.RayError) as error:
        said = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise SweepError(f"the Ray cluster at {given} is out of reach ({said}); check the address, or leave it out for a cluster on this machine") from None
    finally:
        if handler is not None and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGTERM, handler)  # Ray leaves one of its own, which ends the process with another status


def _reach(address: str) -> None:
    """Raises OSError if nothing listens there: Ray itself would try for minutes."""
    host, separator, port = address.removeprefix("ray://").rpartition(":")
    if separator and port.isdigit():
        socket.create_connection((host, int(port)), timeout=5).close()
