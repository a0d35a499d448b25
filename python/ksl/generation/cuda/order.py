"""The order of steps in which fewer numbers are alive at once, for functions whose numbers don't fit into registers.

Compilers keep to the order of a text by and large.  That of recording, body by body, suits arms.  In a tree with many branches it computes all branches side by side;
results one after the other, each with what it alone needs, let a branch end before the next begins.  No order changes a bit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ksl.generation.recording import Operation, Recording

REGISTERS = 255
"""A thread has so many, of 32 bits each."""


def ordered(of: Recording) -> Recording:
    """The recording, or the same in another order where its numbers are more than registers and fewer are alive then."""
    alive = most_alive(of)
    if alive * (1 if of.single else 2) <= REGISTERS:
        return of
    other = by_results(of)
    return other if most_alive(other) < alive else of


def most_alive(of: Recording) -> int:
    """The most numbers that are computed and still to be read, after any of the steps; constants are none."""
    count = len(of.operations)
    last = np.arange(count)
    for operand in of.operands.T:
        np.maximum.at(last, operand[operand >= 0], np.flatnonzero(operand >= 0))
    numbers = of.operations != Operation.CONSTANT
    change = np.bincount(np.flatnonzero(numbers), minlength=count + 1) - np.bincount(last[numbers] + 1, minlength=count + 2)[: count + 1]
    return int(np.cumsum(change).max())


def by_results(of: Recording) -> Recording:
    """Results from the last to the first, and before each what it needs and isn't there yet: of its operands the one with the most numbers of its own first."""
    operations, operands = of.operations.tolist(), [[x for x in of_step if x >= 0] for of_step in of.operands.tolist()]
    order = [step for step, what in enumerate(operations) if what in (Operation.CONSTANT, Operation.INPUT)]
    done, need = set(order), [1] * len(operations)
    for step, read in enumerate(operands):  # registers of an expression (Sethi and Ullman 1970)
        needs = sorted((need[x] for x in set(read) if operations[x] != Operation.CONSTANT), reverse=True)
        need[step] = max([1, *(n + k for k, n in enumerate(needs))])
    for result in reversed(of.outputs.tolist()):
        waiting = [result] if result >= 0 else []
        while waiting:
            missing = [x for x in operands[waiting[-1]] if x not in done]
            if waiting[-1] in done or not missing:
                step = waiting.pop()
                if step not in done:
                    done.add(step)
                    order.append(step)
            else:
                waiting.append(max(missing, key=need.__getitem__))
    place = np.full(len(operations) + 1, -1, np.int32)  # the last one is that of no step
    place[order] = np.arange(len(order))
    return replace(of, operations=of.operations[order], operands=place[of.operands[order]], numbers=of.numbers[order], outputs=place[of.outputs])
