"""Steps as statements of C99.

A short function is straight lines.  A long one is cut into functions of at most `PART` statements, since compilers take more than linear time for one;
what one part computes and another reads lies in an array that they share, each place of which is used again when its number is no longer read.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ksl.generation.recording import CONDITIONS, Operation, Recording

NOT_FUSED = """\
/* Products and sums are not fused, so that results are the same everywhere.  gcc doesn't know this line: it wants -ffp-contract=off or -std=c99. */
#if !defined(__GNUC__) || defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif

"""
"""At the head of a file whose results are those of the engine to the bit."""
STRAIGHT = 6000
"""So many statements are one function."""
PART = 2000
"""So many statements a part has at most."""
STATEMENT_BYTES, RESULT_BYTES = 11, 4
"""How much code is made of them, at -O2 for x86-64: of 15 algorithms of the UR5 and the Panda, double and float, gcc 12 makes 0.77 to 1.16 of this, clang 14 0.69 to 1.27."""
BINARY = {
    Operation.ADD: "+", Operation.SUBTRACT: "-", Operation.MULTIPLY: "*", Operation.DIVIDE: "/", Operation.LESS: "<", Operation.AT_MOST: "<=", Operation.EQUAL: "==",
}  # fmt: skip
FUNCTIONS = {Operation.ROOT: "sqrt", Operation.ABSOLUTE: "fabs", Operation.ARCTANGENT: "atan2"}


def about_bytes(of: Recording) -> int:
    """How long the code of a function is, about, to two digits: that of its statements and of the stores of its results."""
    statements = len(of.operations) - of.count(Operation.CONSTANT)
    return int(float(f"{STATEMENT_BYTES * statements + RESULT_BYTES * sum(of.sizes()):.1e}"))


class Printer:
    """Prints one function.  prefix: of all names.

    What the methods of the last third print differs between languages: `ksl.generation.lanes` has its own."""

    def __init__(self, of: Recording, prefix: str) -> None:
        self.of, self.prefix = of, prefix
        self.straight, self.part, self.storage, self.maybe_unread = STRAIGHT, PART, "", tuple[str, ...]()
        self.storage_of_parts = f"static {prefix.upper()}PART "
        self.real, self.condition, self.sine_cosine = "float" if of.single else "double", "int", f"{prefix}math_sine_cosine"
        self.operations: list[int] = of.operations.tolist()
        self.operands: list[list[int]] = of.operands.tolist()
        self.pointers = [name for name, numbers in of.inputs for _ in range(numbers)]
        self.places = [k for _, numbers in of.inputs for k in range(numbers)]
        self.partner = self._partners()
        self.written: dict[int, list[str]] = {}
        for target, step in zip(self._targets(), of.outputs.tolist()):
            if step >= 0:
                self.written.setdefault(step, []).append(target)

    def _targets(self) -> Iterator[str]:
        """`tau[0]`, … for each number of the results."""
        for (name, _), size in zip(self.of.results, self.of.sizes()):
            yield from (f"{name}[{k}]" for k in range(size))

    def _partners(self) -> dict[int, int]:
        """{step: the cosine of the same angle for a sine, and the other way round}, where both are used."""
        found: dict[tuple[int, int], int] = {}
        for step, what in enumerate(self.operations):
            if what in (Operation.SINE, Operation.COSINE):
                found[what, self.operands[step][0]] = step
        pairs = {}
        for (what, angle), step in found.items():
            other = found.get((Operation.COSINE if what == Operation.SINE else Operation.SINE, angle))
            if other is not None:
                pairs[step] = other
        return pairs

    def literal(self, number: float) -> str:
        if not math.isfinite(number):  # NaN, of what has no solution
            suffix = "f" if self.of.single else ""
            top = "0.0" if math.isnan(number) else "1.0" if number > 0 else "-1.0"
            return f"({top}{suffix} / 0.0{suffix})"
        text = f"{np.float32(number)!s}f" if self.of.single else repr(float(number))
        if "e" in text and "." not in text:
            text = text.replace("e", ".0e")
        return f"({text})" if text.startswith("-") else text

    def parameters(self) -> str:
        """The function's parameters, as a declaration has them."""
        return ", ".join(self.declared([name for name, _ in self.of.inputs], [name for name, _ in self.of.results]))

    def declared(self, read: list[str], written: list[str]) -> list[str]:
        """Parameters for these inputs and these results."""
        return [*(f"const {self.real} *{name}" for name in read), *(f"{self.real} *{name}" for name in written)]

    def function(self, name: str) -> str:
        steps = [i for i, what in enumerate(self.operations) if what == Operation.INPUT]
        inputs = len(steps)
        steps += [i for i, what in enumerate(self.operations) if what not in (Operation.INPUT, Operation.CONSTANT)]
        read = {self.pointers[int(self.of.numbers[i])] for i in steps if self.operations[i] == Operation.INPUT}
        unread = "".join(f"  (void){name};\n" for name in (*(name for name, _ in self.of.inputs if name not in read), *self.maybe_unread))
        head = f"{self.storage}void {name}({self.parameters()}) {{\n{unread}"
        constants = "".join(
            f"  {target} = {self.constant(step)};\n"
            for step, targets in self.written.items()
            if self.operations[step] == Operation.CONSTANT
            for target in targets
        )
        if len(steps) <= self.straight:
            body = "".join(self.statements(steps, {}, {}))
            return f"{head}{body}{constants}}}\n"
        most = -(-len(steps) // -(-len(steps) // self.part))  # parts are as long as each other
        first = max(inputs, most)  # all inputs are read before a result is written, which may lie where they are
        return self._in_parts(name, [steps[:first], *(steps[k : k + most] for k in range(first, len(steps), most))], head, constants)

    def _in_parts(self, name: str, parts: list[list[int]], head: str, constants: str) -> str:
        """Functions one after the other; the last one writes constants, too."""
        part_of = {step: k for k, part in enumerate(parts) for step in part}
        last_read: dict[int, int] = {}
        for step, part_number in part_of.items():
            for operand in self.operands[step]:
                last_read[operand] = max(last_read.get(operand, 0), part_number)
        slots, most = _slots(parts, part_of, last_read)
        texts, calls = [], []
        for k, part in enumerate(parts):
            stored = {step: slots[step] for step in part if step in slots}
            loaded = {operand: slots[operand] for step in part for operand in self.operands[step] if operand in slots and part_of[operand] != k}
            last = k == len(parts) - 1
            lines = "".join(self.statements(part, loaded, stored)) + (constants if last else "")
            pointers = self._pointers_of(part, constants if last else "")
            parameters = ", ".join([*self.declared(*pointers), f"{self.real} *w"])
            texts.append(f"{self.storage_of_parts}void {name}_part_{k + 1}({parameters}) {{\n{lines}}}\n")
            calls.append(self.call_of_part(f"{name}_part_{k + 1}", [*pointers[0], *pointers[1], "w"]))
        return "\n".join(texts) + f"\n{head}{self.workspace(most)}{''.join(calls)}}}\n"

    def _pointers_of(self, part: list[int], constants: str) -> tuple[list[str], list[str]]:
        """The inputs that a part reads, and the results that it writes, by these lines, too."""
        read = {self.pointers[int(self.of.numbers[step])] for step in part if self.operations[step] == Operation.INPUT}
        written = {target.partition("[")[0] for step in part for target in self.written.get(step, ())}
        return [name for name, _ in self.of.inputs if name in read], [name for name, _ in self.of.results if name in written or f"  {name}[" in constants]

    def statements(self, steps: list[int], loaded: dict[int, int], stored: dict[int, int]) -> Iterator[str]:
        """The lines of steps.  loaded: steps of other parts, by their places in w; stored: those of this part that others read."""
        for step, place in loaded.items():
            if self.operations[step] in CONDITIONS:
                yield f"  const {self.condition} x{step} = {self.kept_condition(f'w[{place}]')};\n"
            else:
                yield f"  const {self.real} x{step} = w[{place}];\n"
        own, done = set(steps), set[int]()
        inputs = [step for step in steps if self.operations[step] == Operation.INPUT]
        for step in inputs:  # all of them are read before a result is written, which may lie where they are
            yield self._statement(step, own)
        for step in inputs:
            yield from self._kept(step, stored)
        for step in steps[len(inputs) :]:
            if step not in done:
                group = [step, self.partner[step]] if self.partner.get(step) in own else [step]
                done.update(group)
                yield self._statement(step, own)
                for computed in group:
                    yield from self._kept(computed, stored)

    def _kept(self, step: int, stored: dict[int, int]) -> Iterator[str]:
        """The lines that put a number into results, and where other parts read it."""
        for target in self.written.get(step, ()):
            yield f"  {target} = x{step};\n"
        if step in stored:
            value = self.number_of_condition(f"x{step}") if self.operations[step] in CONDITIONS else f"x{step}"
            yield f"  w[{stored[step]}] = {value};\n"

    def _statement(self, step: int, own: set[int]) -> str:
        what = self.operations[step]
        if what in (Operation.SINE, Operation.COSINE):
            return self._sine(step, own)
        kind = self.condition if what in CONDITIONS else self.real
        return f"  const {kind} x{step} = {self._expression(step)};\n"

    def _sine(self, step: int, own: set[int]) -> str:
        partner = self.partner.get(step, -1)
        other = f"x{partner}" if partner in own else f"unused{step}"
        sine, cosine = (f"x{step}", other) if self.operations[step] == Operation.SINE else (other, f"x{step}")
        return f"  {self.real} {sine}, {cosine};\n  {self.sine_cosine}({self.angle(self.operands[step][0])}, &{sine}, &{cosine});\n"

    def _operand(self, step: int) -> str:
        return self.constant(step) if self.operations[step] == Operation.CONSTANT else f"x{step}"

    def _expression(self, step: int) -> str:
        what = self.operations[step]
        if what == Operation.INPUT:
            k = int(self.of.numbers[step])
            return f"{self.pointers[k]}[{self.places[k]}]"
        a, b, c = (self._operand(x) if x >= 0 else "" for x in self.operands[step])
        if what in BINARY:
            return f"{a} {BINARY[Operation(what)]} {b}"
        if what == Operation.SELECT:
            return self.selected(a, b, c)
        if what == Operation.NEGATE:
            return f"-{a}"
        return self.called(Operation(what), [x for x in (a, b) if x])

    def call_of_part(self, name: str, pointers: list[str]) -> str:
        return f"  {name}({', '.join(pointers)});\n"

    def angle(self, step: int) -> str:
        """The argument of the function that computes sine and cosine."""
        return self._operand(step)

    def workspace(self, numbers: int) -> str:
        """The declaration of w, what parts keep for others."""
        return f"  {self.real} w[{numbers}];\n"

    def constant(self, step: int) -> str:
        return self.literal(self.of.numbers[step])

    def selected(self, condition: str, a: str, b: str) -> str:
        return f"{condition} ? {a} : {b}"

    def kept_condition(self, number: str) -> str:
        """The condition of a number that another part has kept."""
        return f"{number} != {self.literal(0)}"

    def number_of_condition(self, condition: str) -> str:
        return f"{condition} ? {self.literal(1)} : {self.literal(0)}"

    def called(self, what: Operation, operands: list[str]) -> str:
        return f"{FUNCTIONS[what]}{'f' if self.of.single else ''}({', '.join(operands)})"


def _slots(parts: list[list[int]], part_of: dict[int, int], last_read: dict[int, int]) -> tuple[dict[int, int], int]:
    """The place of each step that another part reads, and how many places there are.  A place is free after the last part that reads it."""
    places: dict[int, int] = {}
    free: list[int] = []
    until: dict[int, list[int]] = {}
    most = 0
    for k, part in enumerate(parts):
        for step in part:
            if last_read.get(step, k) > k:
                if free:
                    places[step] = free.pop()
                else:
                    places[step], most = most, most + 1
                until.setdefault(last_read[step], []).append(places[step])
        free.extend(until.pop(k, ()))
    return places, max(most, 1)
