"""Public names of ksl are imported when they are used, and the help of the command line imports nothing that is slow."""

import ast
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import ksl
import pytest
from ksl.base.extras import LEAST
from ksl.base.other_names import OF_MODEL, OF_PACKAGE

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SLOW = (
    "numpy",
    "ksl._core",
    "scipy",
    "pyarrow",
    "plotly",
    "pandas",
    "lxml",
    "viser",
    "trimesh",
    "ray",
    "mujoco",
    "mcap",
    "rerun",
    "rosbags",
    "openpyxl",
    "pinocchio",
    "pydrake",
    "pxr",
    "xacro",
)


def python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_type_checkers_see_what_the_table_says():
    """`from MODULE import NAME as NAME` under TYPE_CHECKING, for every line of the table and for no other name."""
    tree = ast.parse(Path(ksl.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")
    seen = {alias.asname: line.module for line in block.body for alias in line.names if alias.name == alias.asname}
    assert seen == ksl._MODULE_OF | dict.fromkeys(ksl._MODULES, "ksl")
    assert sorted(ksl._MODULE_OF) == list(ksl._MODULE_OF), "in alphabetical order, so that lines are found and merged"


def test_every_name_is_there():
    for name in ksl.__all__:
        assert getattr(ksl, name) is not None
    assert dir(ksl) == sorted([*ksl.__all__, *ksl._MODULES])
    assert python("from ksl import *\nprint(load.__name__, Model.__name__, Wrench.__name__)") == "load Model Wrench\n"
    assert python("from ksl import load, Pose\nimport ksl\nprint(ksl.load is load, ksl.Pose is Pose)") == "True True\n"


def test_help_where_no_library_is_installed_beside():
    """help(ksl) ended with "ksl.jax needs JAX"."""
    without = "import sys\nfor name in ('jax', 'torch'):\n    sys.modules[name] = None\nimport ksl\n"
    assert python(f"{without}import pydoc\nprint('every wrench' in pydoc.render_doc(ksl))") == "True\n"
    for name in ("jax", "torch"):
        said = f"ksl.{name} needs {name if name == 'torch' else 'JAX'}; install it with: pip install 'ksl[{name}]'"
        assert python(f"{without}print(hasattr(ksl, {name!r}))\ntry:\n    ksl.{name}\nexcept AttributeError as e:\n    print(e)") == f"False\n{said}\n"
        assert python(f"{without}try:\n    from ksl import {name}\nexcept ModuleNotFoundError as e:\n    print(e)") == f"{said}\n"


@pytest.mark.parametrize("name", ["jax", "torch"])
def test_help_where_a_library_is_older_than_its_extra(name, tmp_path):
    """And where it breaks off while it is imported.  torch 2.0 ended help(ksl) in a traceback."""
    shown, least = LEAST[name]
    assert f'\n{name} = ["{name}>={least}"]\n' in (EXAMPLES.parent / "pyproject.toml").read_text()
    (tmp_path / name).mkdir()
    (tmp_path / name / "__init__.py").write_text("raise RuntimeError('no symbol table')\n")
    for version, said in (
        ("0.4.37", f"ksl.{name} needs {shown} {least} or newer, and 0.4.37 is installed; install it with: pip install --upgrade 'ksl[{name}]'"),
        ("99.1.dev2+cpu", f"ksl.{name} can't be imported: RuntimeError: no symbol table"),
    ):
        (tmp_path / f"{name}-1.dist-info").mkdir(exist_ok=True)
        (tmp_path / f"{name}-1.dist-info" / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
        begin = f"import sys\nsys.path.insert(0, {str(tmp_path)!r})\nimport ksl, pydoc\n"
        assert (
            python(
                f"{begin}print('every wrench' in pydoc.render_doc(ksl), hasattr(ksl, {name!r}))\ntry:\n    ksl.{name}\nexcept AttributeError as e:\n    print(e)"
            )
            == f"True False\n{said}\n"
        )


def test_help_begins_with_all_that_users_may_use():
    for name in (*ksl.__all__, *ksl._MODULES):
        assert name == "__version__" or re.search(rf"\b{name}\b", ksl.__doc__), f"{name} is missing in the docstring of ksl"
    assert (
        python("import ksl\nprint(ksl.motions.generate.chirp.__name__, ksl.ufuncs.product_dd.__name__, ksl.mjcf.from_mujoco.__name__)")
        == "chirp product_dd from_mujoco\n"
    )


@pytest.mark.parametrize(("names", "owner"), [(OF_PACKAGE, ksl), (OF_MODEL, ksl.Model)], ids=["ksl", "a model"])
def test_names_of_other_libraries_lead_to_what_there_is(names, owner):
    """Each is absent, and what is named in its place is there."""
    m = ksl.load(EXAMPLES / "robots/ur5.urdf")
    assert owner is not ksl or not {path.stem for path in Path(ksl.__file__).parent.iterdir()} & names.keys(), "an import would give it"
    for name, mend in names.items():
        with pytest.raises(AttributeError) as error:
            getattr(ksl if owner is ksl else m, name)
        assert mend in str(error.value)
        of_package = re.findall(r"ksl\.(\w+)", mend)
        assert all(word in dir(ksl) for word in of_package), mend
        first = re.match(r"\w+", mend).group() if owner is ksl.Model else (re.findall(r"\)\.(\w+)", mend) or ["joints"])[0]
        assert hasattr(m, first) or (first == "ksl" and of_package) or first in of_package, mend


def test_a_name_that_is_nearly_right():
    m = ksl.load(EXAMPLES / "robots/ur5.urdf")
    with pytest.raises(AttributeError, match="a ksl.Model has no 'invers_dynamics'; did you mean 'inverse_dynamics'"):
        m.invers_dynamics  # noqa: B018
    assert not hasattr(m, "__array__") and not hasattr(m, "_repr_png_")
    with pytest.raises(TypeError, match=r"ksl.load\('robot.urdf'\) reads a robot file, ksl.load_string\(text\) its contents, and ksl.Builder"):
        ksl.Model("robot.urdf")
    with pytest.raises(TypeError, match=r"not called with int: ksl.load\(path\)"):
        ksl.Model(3)


def test_no_public_function_is_hidden_by_a_module():
    """`import ksl.check` would put the module in the place of the function."""
    modules = {path.stem for path in Path(ksl.__file__).parent.iterdir()}
    assert modules.isdisjoint(ksl.__all__)


def test_methods_of_models_that_higher_rooms_compute():
    """The model's room imports nothing of theirs; `ksl/__init__.py` names the functions, which take the model first."""
    from ksl.base import higher_rooms

    methods = {"_repr_html_", "actuation", "compile", "compliance", "deflection", "equilibrium", "free_bodies", "linearise", "modes", "show", "wrench_table"}
    assert set(higher_rooms.FUNCTIONS) == methods | {"stiffnesses", "component_stiffnesses"}, "the others read files"
    for method in methods:
        own = list(inspect.signature(getattr(ksl.Model, method)).parameters.values())
        function = list(inspect.signature(higher_rooms.function_of(method)).parameters.values())
        assert [(p.name, p.kind, p.default) for p in own[1:]] == [(p.name, p.kind, p.default) for p in function[1:]], method


def test_what_show_returns_is_what_type_checkers_are_told():
    from ksl.model.model import ShownModel
    from ksl.viewer.live import Viewer

    for name in ("update", "play", "open", "export", "wait", "close"):
        assert inspect.signature(getattr(ShownModel, name)) == inspect.signature(getattr(Viewer, name)), name
    assert isinstance(Viewer.url, property)


def test_the_class_of_models_is_found_in_its_room():
    assert python("from ksl.model import Model\nimport ksl\nprint(Model is ksl.Model)") == "True\n"
    with pytest.raises(ImportError, match="Modle"):
        exec("from ksl.model import Modle")


def test_unknown_name():
    with pytest.raises(AttributeError, match="no attribute 'Modle'; did you mean 'Model'"):
        _ = ksl.Modle
    assert not hasattr(ksl, "__wrapped__")
    with pytest.raises(ImportError, match="laod"):
        exec("from ksl import laod")


@pytest.mark.parametrize("arguments", [["--help"], ["loads", "--help"], ["info", "--help"]], ids=" ".join)
def test_help_imports_nothing_slow(arguments):
    code = f"import sys\nfrom ksl.commands import app\ntry:\n    app({arguments}, prog_name='ksl')\nexcept SystemExit:\n    print('MODULES', *sys.modules)"
    shown, modules = python(code).split("MODULES")
    assert "Usage: ksl" in shown
    assert set(SLOW).isdisjoint(modules.split())


def test_completion_of_shells():
    """What `ksl --install-completion` installs, and what it then asks for."""

    def completion(**environment: str) -> str:
        done = subprocess.run([sys.executable, "-m", "ksl"], capture_output=True, text=True, env=os.environ | environment)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "_KSL_COMPLETE" in completion(_KSL_COMPLETE="source_bash")
    assert completion(_KSL_COMPLETE="complete_bash", COMP_WORDS="ksl lo", COMP_CWORD="1").split() == ["loads"]
