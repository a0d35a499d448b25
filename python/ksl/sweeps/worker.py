"""A worker of the local engine: a process that computes partitions.  `python -m ksl.sweeps.worker`; the sweep starts it.

Messages are pickles on standard input and output: first the plan, then numbers of partitions.  The answer is a Result or an error."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import warnings

from ksl.base.errors import DescriptionWarning
from ksl.sweeps.evaluate import Evaluator, refused


def main() -> None:
    """Answers until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a Ctrl-C in the terminal reaches all processes; the sweep ends its workers
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what libraries print must not mix with the answers
    requests = sys.stdin.buffer
    evaluator = None
    while True:
        try:
            request = pickle.load(requests)
        except EOFError:
            return
        try:
            if evaluator is None:
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", DescriptionWarning)  # the sweep has warned of this robot already
                    evaluator = Evaluator(request)
                continue
            answer: object = evaluator.partition(request)
        except MemoryError:  # ends the worker; another one tries again
            raise
        except Exception as error:
            answer = refused(error)
        pickle.dump(answer, answers, pickle.HIGHEST_PROTOCOL)
        answers.flush()


if __name__ == "__main__":
    main()
