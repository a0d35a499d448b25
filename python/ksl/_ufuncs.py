"""The array functions, out of the file that holds the dynamics: both then work on the same threads."""

import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location

from ksl import _core

_spec = spec_from_file_location(__name__, _core.__file__, loader=ExtensionFileLoader(__name__, _core.__file__))
assert _spec
sys.modules[__name__] = module_from_spec(_spec)  # who imports this one gets that one
