"""The numbers of a bolted flange that follow from the name of its bolt."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ksl.sizing.bolt_names import Bolt
from ksl.sizing.bolt_strength import EMBEDDING, MODULI, TIGHTENING, allowed_loads, bolt_resilience, plate_resilience

OF_BOLT = ("preload", "tightening_factor", "embedding_loss", "bolt_resilience", "plate_resilience", "yield_force", "amplitude_limit")
"""Keys whose numbers follow from the bolt's name, unless they are given."""

FOR_BOLTS = ("clamp_length", "shank_length", "plates", "thread_in", "tightening", "thread_friction", "yield_share")
"""Keys that say something together with `bolt` alone."""


def numbers_of_bolt(bolt: Bolt, given: Mapping[str, Any]) -> tuple[dict[str, float], dict[str, str]]:
    """{key: number} that the name gives, and {key: sentence} of those for which something is missing.

    given: the flange's keys, defaults included, without those that were refused; `tightening_factor` only if it is in the file.  The smallest
    assembly preload is the largest one that the bolt bears, divided by the tightening factor.
    """
    found: dict[str, float] = {}
    absent: dict[str, str] = {}
    friction, share = given.get("thread_friction"), given.get("yield_share")
    if friction is not None and share is not None:
        loads = allowed_loads(bolt, friction, share)
        alpha = given.get("tightening_factor") or TIGHTENING[given["tightening"]]
        found |= {"tightening_factor": alpha, "preload": loads.preload / alpha, "yield_force": loads.yield_force, "amplitude_limit": loads.amplitude}
    _add_resiliences(bolt, given, found, absent)
    own = [given.get(key) or found.get(key) for key in ("bolt_resilience", "plate_resilience")]
    if own[0] and own[1] and given.get("thread_in"):
        found["embedding_loss"] = EMBEDDING[given["thread_in"]] / (own[0] + own[1])
    return found, absent


def _add_resiliences(bolt: Bolt, given: Mapping[str, Any], found: dict[str, float], absent: dict[str, str]) -> None:
    length, shank, plates, held = (given.get(key) for key in ("clamp_length", "shank_length", "plates", "thread_in"))
    missing = [key for key, x in (("clamp_length", length), ("shank_length", shank), ("plates", plates)) if x is None]
    if missing or length is None or shank is None or plates is None or held is None:
        absent |= dict.fromkeys(("bolt_resilience", "plate_resilience"), f"the resilience of {bolt.name} needs {' and '.join(missing)}")
        return
    found["bolt_resilience"] = bolt_resilience(bolt, length, shank, held, MODULI[plates])
    try:
        found["plate_resilience"] = plate_resilience(bolt, length, MODULI[plates], held)
    except ValueError as e:
        absent["plate_resilience"] = f"{e}; give plate_resilience"
