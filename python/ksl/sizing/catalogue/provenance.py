"""What made a sizing: versions, files with their hashes, cases with how often they occur, and what made the loads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime, timezone
from typing import Any

from ksl._core import __version__
from ksl.base.files_read import InputFile
from ksl.load_cases.provenance import versions
from ksl.sizing.catalogue.parts import Components
from ksl.sizing.results import Results


def made_of(table: Results, files: Sequence[InputFile], parts: Components | None) -> dict[str, Any]:
    """As JSON can hold it."""
    inputs = [asdict(file) for file in files if file.sha256 is not None]
    spectrum = (
        {case: parts.spectrum.shares.get(case, 0.0) if parts.spectrum.shares else parts.spectrum.repetitions.get(case, 1.0) for case in table.cases}
        if parts
        else {}
    )
    unit = "share of time" if parts and parts.spectrum.shares else "repetitions"
    date = datetime.now(timezone.utc).isoformat(timespec="seconds").replace("+00:00", "Z")
    made = {key: table.metadata[key] for key in ("command", "date", "inputs", "versions") if table.metadata.get(key)}
    return {"version": __version__, "versions": versions(), "date": date, "inputs": inputs, "cases": spectrum, "cases are": unit, "loads": made}
