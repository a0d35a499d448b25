"""Output files: written completely or not at all, several of them in one step, whatever stops the program (docs/loads.md)."""

from ksl.output.output_error import OutputError, cannot_write
from ksl.output.replaced import refuse_inputs, refuse_unknown
from ksl.output.stage import flush_early, staged
from ksl.output.whole_file import place_of, whole_file

__all__ = ["OutputError", "cannot_write", "flush_early", "place_of", "refuse_inputs", "refuse_unknown", "staged", "whole_file"]
