"""What `ksl.free_bodies` returns: load cases of parts, which can be written."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from ksl.parts.cases import Cases
from ksl.parts.part_loads import DeckOptions
from ksl.parts.write import write


class FreeBodyCases(Cases):
    """Load cases of parts, in the order of load cases and times."""

    deck_notes: Sequence[str] = ()
    """What the decks that were written last have to be read with."""

    def write(
        self, directory: str | os.PathLike[str], decks: str | Sequence[str] = (), meshes: Mapping[str, str | os.PathLike[str]] | None = None,
        options: DeckOptions = DeckOptions(), xlsx: bool = False, force: bool = False,
    ) -> list[str]:  # fmt: skip
        """Writes free_bodies.csv, a row for everything that acts; motions.csv, a row for each body; free_bodies.json; and decks.  Returns their names.

        decks: "calculix", which meshes alone ask for, too, "abaqus", "nastran": LINK_calculix.inp … with a step or subcase for each case.  meshes: {link: .inp file} of parts, in the
        part's frame and the deck's units; a deck then runs as it is.  Without one it has the loads and their reference nodes alone.
        options: :class:`ksl.parts.part_loads.DeckOptions`: units, material, node sets, coupling, inertia relief.
        xlsx: free_bodies.xlsx too; needs the extra `ksl[xlsx]`.  force: as in :meth:`ksl.Run.write`.
        All are written, or none.  Raises PartError and OutputError, and says how to mend it.

            cases.write("parts", decks="calculix", meshes={"panda_link3": "link3.inp"})
        """
        written, self.deck_notes = write(self, directory, [decks] if isinstance(decks, str) else decks, meshes, options, xlsx, force)
        return written
