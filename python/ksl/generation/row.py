"""The row of an algorithm, as far as generated code needs it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    inputs: tuple[str, ...]
    """Names of the inputs, in the order of calls."""
    request: str
    """What a call names: "", "link", "links", "frame", "frames", "relative", "joints" or "reactions" (api/algorithms/row.py)."""
    links_keyword: str
    """What the argument of the call is called that names several links."""
    external: str
    """Wrenches on links: "", "optional" or "required"."""
    needs_mass: bool
    """Are large results looked at, since a joint may move no mass?"""
    text: str
    """What it computes, of what."""
