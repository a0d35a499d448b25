"""The array functions, loaded from the file of ksl._core, so that both use the same threads."""

import sys
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location

from ksl import _core

_spec = spec_from_file_location(__name__, _core.__file__, loader=ExtensionFileLoader(__name__, _core.__file__))
assert _spec
sys.modules[__name__] = module_from_spec(_spec)  # an import of this module gives the compiled one
