"""What all Python tests share: one fixed profile for random examples, so that a run today is the run of tomorrow.

`pytest --long` runs the tests marked `many_cases`, with fifty times as many random cases, those of hypothesis with twenty times as many, and those marked `long`, which no other run
takes; `make test-long` does."""

import gc
import os
import shutil
import signal
import sys
from pathlib import Path

# One test a core: with threads of its own, the linear algebra of small matrices takes ten times the processor time where cores are busy.
# Before numpy is imported, and for all processes that tests start.
for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import pytest
from hypothesis import HealthCheck, settings

import random_cases
from sweeps_here import sweeps_here  # noqa: F401, a fixture

settings.register_profile("fixed", derandomize=True, deadline=None, max_examples=30, database=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("many", settings.get_profile("fixed"), max_examples=600)
settings.load_profile("fixed")

LONGEST = ("tutorials_test.py", "readme_test.py", "browser_test.py", "sweep_workers_test.py", "hostile_names_test.py", "viewer_page_test.py", "jax_test.py")
"""Files of half a minute, which begin first: the last one to begin bounds the time of several workers."""

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(autouse=True, scope="session")
def cache_of_this_run(tmp_path_factory):
    """What is compiled for one robot stays out of the cache of whoever runs the tests: `make test` leaves nothing there, and finds nothing."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KSL_CACHE", str(tmp_path_factory.mktemp("ksl_cache")))
        yield


def pytest_addoption(parser):
    parser.addoption("--long", action="store_true", help="run the tests marked long, and those marked many_cases with 100,000 random cases instead of 2,000")


def pytest_configure(config):
    """Before any test module is imported: modules take the numbers into constants of their own."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as of what a shell runs in the background: calls that tests interrupt would never end
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.getoption("--long"):
        random_cases.take_more()
        settings.load_profile("many")


@pytest.hookimpl(wrapper=True)
def pytest_collection(session):
    """All that is made here stays: looking through it for garbage would take a third of the time, and again at each later look."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_runtest_teardown(item):
    """What a command that runs in this process wants ends with its test: each MJCF file of all later tests would be compiled by a new Python."""
    if "ksl.base.own_process" in sys.modules:
        sys.modules["ksl.base.own_process"]._is_wanted = False


def pytest_collection_modifyitems(config, items):
    items.sort(key=lambda item: item.path.name not in LONGEST)
    marked = lambda item, *names: any(item.get_closest_marker(name) for name in names)
    random = lambda item: marked(item, "many_cases") or getattr(getattr(item, "obj", None), "is_hypothesis_test", False)
    wanted = (lambda item: marked(item, "long") or random(item)) if config.getoption("--long") else (lambda item: not marked(item, "long"))
    left_out = [item for item in items if not wanted(item)]
    if left_out:
        items[:] = [item for item in items if wanted(item)]
        config.hook.pytest_deselected(items=left_out)


@pytest.fixture(scope="session")
def examples() -> Path:
    """The folder of robots and motions that ship with KSL."""
    return ROOT / "examples"


@pytest.fixture
def robot(tmp_path):
    """Writes URDF text to a file and loads it: robot(text, **options of ksl.load)."""
    import ksl

    def load(text: str, **options):
        path = tmp_path / "robot.urdf"
        path.write_text(text)
        return ksl.load(path, **options)

    return load


@pytest.fixture(scope="module")
def browser():
    """Windows of a headless Chromium: browser(width, height, **options of playwright's contexts).  Small ones, since without a graphics card drawing is work.

    Skips where there is none.  It ends with the module: two can't be open in one process, nor does asyncio run beside one."""
    api = pytest.importorskip("playwright.sync_api", reason="the package playwright is not installed")
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        pytest.skip("no Chromium is installed: apt-get install chromium")
    with api.sync_playwright() as p:
        options = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
        chromium = p.chromium.launch(executable_path=program, args=options)

        def window(width: int = 480, height: int = 300, **options):
            return chromium.new_context(viewport={"width": width, "height": height}, **options)

        yield window
        chromium.close()


@pytest.fixture(params=["fixed", "floating"])
def arm(request, examples):
    import ksl

    return ksl.load(examples / "robots/panda.urdf", floating_base=request.param == "floating")
