"""Load cases of a robot with their results: summary, wrenches, verdict, and what is to be said of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from ksl.base.notes import not_used
from ksl.base.words import of_cases
from ksl.load_cases.case_result import CaseResult, compute_case
from ksl.load_cases.load_case import Block, LoadCase
from ksl.load_cases.provenance import Provenance
from ksl.load_cases.ranking import Ranking, severity
from ksl.load_cases.summary_table import summary_table
from ksl.load_cases.undetermined import stiffness_note
from ksl.load_cases.verdict import Verdict, not_given
from ksl.load_cases.wrench_table import TableWriter
from ksl.model.model import Model

if TYPE_CHECKING:
    from ksl.base.arrow_table import ArrowTable

KEPT_CASES, KEPT_CURVES = 5, 24
"""The report has the curves of the load cases that govern most: of so many at most, and of so many joints in all of them together, but of one at least."""


class ComputedCases:
    """Load cases of a robot and their results, which are computed when they are first asked for.

    All load cases have the same joints and the same placement of wrenches.
    """

    def __init__(self, cases: Sequence[LoadCase], provenance: Provenance) -> None:
        self.cases = tuple(cases)
        self.provenance = provenance
        """Inputs with their hashes, options, versions, date, command line."""
        self._results: list[CaseResult] | None = None
        self._ranking = Ranking()

    @property
    def model(self) -> Model:
        """The model of the first load case."""
        return cast(Model, self.cases[0].model)

    @property
    def results(self) -> list[CaseResult]:
        """The result of each load case."""
        if self._results is None:
            self.compute()
        assert self._results is not None
        return self._results

    @property
    def summary(self) -> ArrowTable:
        """A row per load case and joint: peaks with their times, rms, work; if there are several cases, the worst over all below them.

        Columns as in summary.csv; the metadata (key `ksl`, JSON) says units and what made the numbers.
        """
        return cast("ArrowTable", summary_table(self.rows, self.provenance))

    @property
    def wrenches(self) -> ArrowTable:
        """Every wrench: a row for each load case, sample and joint, as in wrenches.parquet.  Computed anew each time."""
        writer = self.writer()
        import pyarrow as pa

        return cast("ArrowTable", pa.concat_tables([writer.table(block, i) for i, case in enumerate(self.cases) for block in case.blocks()]))

    @property
    def rows(self) -> list[dict[str, float | str | None]]:
        """The rows of the summary for the chosen joints, without the worst over all cases."""
        wanted = self.cases[0].placement.wanted
        return [row for result in self.results for row in result.rows if wanted(str(row["joint"]))]

    @property
    def verdict(self) -> Verdict:
        """Red, amber or green over all load cases and joints."""
        lines = of_cases([(r.case.name, doubt) for r in self.results for doubt in dict.fromkeys(r.doubts)], len(self.cases))
        return Verdict(
            tuple(use for r in self.results for use in r.uses), (*lines, *not_given(self.model.joints, self.model.drives if self.model.loops else None))
        )

    @property
    def notes(self) -> list[str]:
        """Lines by weight: limits exceeded, doubts, other warnings, what was differentiated, and last what is not used."""
        verdict, several = self.verdict, len(self.cases) > 1
        exceeded = [f"{use.case}: {use.exceeded}" if several else use.exceeded for use in verdict.exceeded]
        read = of_cases([(c.name, line) for c in self.cases if c.motion.source for line in c.motion.source.notes], len(self.cases))
        differentiated = of_cases([(c.name, line) for c in self.cases for line in c.motion.differentiated], len(self.cases))
        stiff = of_cases([(c.name, line) for c in self.cases for line in stiffness_note(c.model)], len(self.cases))
        unused = [not_used(content) for content in self.model.unused]
        return list(dict.fromkeys([*exceeded, *verdict.reasons, *stiff, *read, *self.model.warnings, *differentiated, *unused]))

    @property
    def governing(self) -> CaseResult:
        """The result of the load case with the worst use of a limit; where there are no limits, with the largest effort."""
        return max(self.results, key=severity)

    def compute(self, sink: Callable[[Block, int], None] | None = None, advance: Callable[[int], None] | None = None) -> None:
        """Computes all load cases, one after the other, now and not when their results are first asked for.

        Of many, only the curves of those that govern most are kept.  sink: is given each block, and the number of its case, when it is done.
        advance: is told the number of samples of each block.  Raises MotionError where results are not finite.
        """
        results: list[CaseResult] = []
        ranking = Ranking()
        kept: list[int] = []
        wanted = [j.name for j in self.cases[0].joints if self.cases[0].placement.wanted(j.name)]
        for i, case in enumerate(self.cases):
            of_case = _numbered(sink, i) if sink else None
            results.append(compute_case(case, of_case, advance))
            ranking.add(results[i], wanted)
            kept.append(i)
            if len(kept) > self._most:
                kept, dropped = (best := ranking.first(self._most, kept)), next(k for k in kept if k not in best)
                results[dropped] = replace(results[dropped], loads=None)
        self._results, self._ranking = results, ranking

    @property
    def _most(self) -> int:
        """How many load cases have curves in the report."""
        wanted = sum(self.cases[0].placement.wanted(j.name) for j in self.cases[0].joints)
        return max(1, min(KEPT_CASES, KEPT_CURVES // max(1, wanted)))

    def writer(self) -> TableWriter:
        """What makes tables of the wrenches of these load cases."""
        return TableWriter(self.model, self.cases[0].placement, self.provenance)


def _numbered(sink: Callable[[Block, int], None], case: int) -> Callable[[Block], None]:
    return lambda block: sink(block, case)
