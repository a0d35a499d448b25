"""KSL: every wrench in a mechanism.

    import ksl
    m = ksl.load("robot.urdf")
    tau = m.inverse_dynamics(q, v, a)                        # (…, nv)
    held = m.reactions(q, v, a, part="constraint")           # (…, joints, 6): what the structure carries

SI units, radians; six-vectors are linear first unless `order="ang_lin"`; arrays have the state on the leading axes.

What there is for users; help(ksl.load) and the like say more:

    robots        load(path), load_string(text), Builder: a Model, with its Joint and Link; every algorithm is a method, help(ksl.Model)
    jobs          compute_loads, hold: a Run, with verdict, wrenches, summary, report; size, spectra, sweep; frequencies; free_bodies: load cases of parts;
                  check: Findings of one Finding each;
                  compare: a Comparison with other libraries; generate: plain C of one robot; casadi_function: a function of CasADi; fmu: one for co-simulation
    legs          actuation(m, joints): an Actuation, what motors do to joints through rods, and back; compute_actuation: an ActuationRun, its report
    motions       read_motion, read_efforts; motions.generate makes some
    algebra       Pose, Twist, Acceleration, Wrench, Momentum, Inertia: typed, with checked frames; ufuncs: the same over plain arrays
    modules       simulation: controllers, brakes and results of m.simulate; identification, base_parameters, consistency; mjcf, states in MuJoCo's layout; torch, jax
    errors        DescriptionError, MotionError, CaseError, ResultError, SizingError, SweepError, ViewerError, PartError, CompilerError, FrameError: all are ValueErrors
    warnings      DescriptionWarning, QuaternionWarning

The other modules are inner ones, which may change with every version.
"""

from ksl.base import higher_rooms as _higher_rooms

TYPE_CHECKING = False  # a type checker takes it for true, and `import typing` would take longer than all the rest
if TYPE_CHECKING:  # what the table below says, for type checkers and editors
    from ksl import base_parameters as base_parameters
    from ksl import consistency as consistency
    from ksl import identification as identification
    from ksl import jax as jax
    from ksl import mjcf as mjcf
    from ksl import motions as motions
    from ksl import simulation as simulation
    from ksl import torch as torch
    from ksl import ufuncs as ufuncs
    from ksl._core import __version__ as __version__
    from ksl.base.errors import CaseError as CaseError
    from ksl.base.errors import CompilerError as CompilerError
    from ksl.base.errors import DescriptionError as DescriptionError
    from ksl.base.errors import DescriptionWarning as DescriptionWarning
    from ksl.base.errors import FrameError as FrameError
    from ksl.base.errors import MotionError as MotionError
    from ksl.base.errors import PartError as PartError
    from ksl.base.errors import QuaternionWarning as QuaternionWarning
    from ksl.base.errors import ResultError as ResultError
    from ksl.base.errors import SizingError as SizingError
    from ksl.base.errors import SweepError as SweepError
    from ksl.base.errors import ViewerError as ViewerError
    from ksl.checks.description.findings import Finding as Finding
    from ksl.checks.description.findings import Findings as Findings
    from ksl.checks.run import check as check
    from ksl.comparison.compare_robot import compare as compare
    from ksl.comparison.results import Comparison as Comparison
    from ksl.model.builder import Builder as Builder
    from ksl.robot_files.loading import load as load
    from ksl.robot_files.loading import load_string as load_string
    from ksl.generation.casadi_function import casadi_function as casadi_function
    from ksl.generation.fmus.fmu import fmu as fmu
    from ksl.generation.generate import generate as generate
    from ksl.drivetrain.actuation import Actuation as Actuation
    from ksl.drivetrain.actuation import actuation as actuation
    from ksl.mechanism.mechanism import Joint as Joint
    from ksl.mechanism.mechanism import Link as Link
    from ksl.model.model import Model as Model
    from ksl.motions.efforts import read_efforts as read_efforts
    from ksl.motions.reading import read_motion as read_motion
    from ksl.parts.compute_free_bodies import free_bodies as free_bodies
    from ksl.report.compute_actuation import ActuationRun as ActuationRun
    from ksl.report.compute_actuation import compute_actuation as compute_actuation
    from ksl.report.compute_loads import compute_loads as compute_loads
    from ksl.report.hold_pose import hold as hold
    from ksl.report.loads_run import Run as Run
    from ksl.sizing.joints.compute_sizing import size as size
    from ksl.sizing.spectra.compute_spectra import spectra as spectra
    from ksl.small_motions.frequencies import frequencies as frequencies
    from ksl.spatial import Acceleration as Acceleration
    from ksl.spatial import Inertia as Inertia
    from ksl.spatial import Momentum as Momentum
    from ksl.spatial import Pose as Pose
    from ksl.spatial import Twist as Twist
    from ksl.spatial import Wrench as Wrench
    from ksl.sweeps.compute_sweep import sweep as sweep

_MODULE_OF = {
    "Acceleration": "ksl.spatial",
    "Actuation": "ksl.drivetrain.actuation",
    "ActuationRun": "ksl.report.compute_actuation",
    "Builder": "ksl.model.builder",
    "CaseError": "ksl.base.errors",
    "Comparison": "ksl.comparison.results",
    "CompilerError": "ksl.base.errors",
    "DescriptionError": "ksl.base.errors",
    "DescriptionWarning": "ksl.base.errors",
    "Finding": "ksl.checks.description.findings",
    "Findings": "ksl.checks.description.findings",
    "FrameError": "ksl.base.errors",
    "Inertia": "ksl.spatial",
    "Joint": "ksl.mechanism.mechanism",
    "Link": "ksl.mechanism.mechanism",
    "Model": "ksl.model.model",
    "Momentum": "ksl.spatial",
    "MotionError": "ksl.base.errors",
    "PartError": "ksl.base.errors",
    "Pose": "ksl.spatial",
    "QuaternionWarning": "ksl.base.errors",
    "ResultError": "ksl.base.errors",
    "Run": "ksl.report.loads_run",
    "SizingError": "ksl.base.errors",
    "SweepError": "ksl.base.errors",
    "Twist": "ksl.spatial",
    "ViewerError": "ksl.base.errors",
    "Wrench": "ksl.spatial",
    "__version__": "ksl._core",
    "actuation": "ksl.drivetrain.actuation",
    "casadi_function": "ksl.generation.casadi_function",
    "check": "ksl.checks.run",
    "compare": "ksl.comparison.compare_robot",
    "compute_actuation": "ksl.report.compute_actuation",
    "compute_loads": "ksl.report.compute_loads",
    "fmu": "ksl.generation.fmus.fmu",
    "free_bodies": "ksl.parts.compute_free_bodies",
    "frequencies": "ksl.small_motions.frequencies",
    "generate": "ksl.generation.generate",
    "hold": "ksl.report.hold_pose",
    "load": "ksl.robot_files.loading",
    "load_string": "ksl.robot_files.loading",
    "read_efforts": "ksl.motions.efforts",
    "read_motion": "ksl.motions.reading",
    "size": "ksl.sizing.joints.compute_sizing",
    "spectra": "ksl.sizing.spectra.compute_spectra",
    "sweep": "ksl.sweeps.compute_sweep",
}
"""Public names, and the modules that are imported when they are first used.  `import ksl` alone imports not even NumPy: the help of the
command line needs none of it, and NumPy takes longer to import than the help to print.  A public name has a line here and one above."""

_MODULES = {
    "base_parameters": "ksl.base_parameters",
    "consistency": "ksl.consistency",
    "identification": "ksl.identification",
    "jax": "ksl.jax",
    "mjcf": "ksl.mjcf",
    "motions": "ksl.motions.generate",
    "simulation": "ksl.simulation",
    "torch": "ksl.torch",
    "ufuncs": "ksl.ufuncs",
}
"""Public modules, and what is imported when they are first used as `ksl.NAME`."""

__all__ = list(_MODULE_OF)

_higher_rooms.FUNCTIONS.update(
    {
        "actuation": "ksl.drivetrain.actuation:actuation",
        "_repr_html_": "ksl.viewer.notebook:html_of",
        "compile": "ksl.generation.compiled:compiled",
        "component_stiffnesses": "ksl.sizing.catalogue.component_stiffness:component_stiffnesses",
        "compliance": "ksl.small_motions.compliance:compliance",
        "deflection": "ksl.small_motions.compliance:deflection",
        "equilibrium": "ksl.small_motions.equilibrium:equilibrium",
        "linearise": "ksl.small_motions.linearise:linearise",
        "free_bodies": "ksl.parts.of_state:free_bodies",
        "modes": "ksl.small_motions.modes:modes",
        "stiffnesses": "ksl.robot_files.stiffness_file:stiffnesses",
        "show": "ksl.viewer.live:show",
        "wrench_table": "ksl.load_cases.wrench_table:wrench_table",
    }
)
"""Methods of a model that rooms above the model's compute, and files that these read."""

if not TYPE_CHECKING:  # otherwise a type checker would believe in any name

    def __getattr__(name: str) -> object:
        """Imports the module of a public name (PEP 562)."""
        import sys
        from importlib import import_module

        if name in _MODULES:
            try:
                import_module(_MODULES[name])
            except ImportError as e:  # an attribute is asked for: hasattr and help would end with any other error
                raise AttributeError(str(e), name=name) from None
            except Exception as e:  # of another library, as it is installed
                raise AttributeError(f"ksl.{name} can't be imported: {type(e).__name__}: {e}", name=name) from e
            return sys.modules[f"ksl.{name}"]
        if name not in _MODULE_OF:
            from ksl.base.errors import near_names
            from ksl.base.other_names import OF_PACKAGE

            mend = OF_PACKAGE[name] if name in OF_PACKAGE else f"{near_names(name, [*_MODULE_OF, *_MODULES])}dir(ksl) lists them"
            raise AttributeError(f"module 'ksl' has no attribute {name!r}; {mend}", name=name)
        value = getattr(import_module(_MODULE_OF[name]), name)
        globals()[name] = value  # from now on an ordinary attribute
        return value


def __dir__() -> list[str]:
    return sorted([*__all__, *_MODULES])
