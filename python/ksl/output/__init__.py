"""Output files: written completely or not at all, several of them in one step, whatever stops the program (docs/loads.md).

Files: all files that KSL writes: `stage.py`: a hidden folder; `swap.py`: several files replaced in one step; `whole_file.py`: one file; `part_files.py`: files of
sweeps (docs/decisions/0013-output-files.md).
"""

from ksl.output.output_error import OutputError, cannot_write
from ksl.output.replaced import refuse_inputs, refuse_unknown
from ksl.output.stage import flush_early, staged
from ksl.output.whole_file import place_of, whole_file

__all__ = ["OutputError", "cannot_write", "flush_early", "place_of", "refuse_inputs", "refuse_unknown", "staged", "whole_file"]
