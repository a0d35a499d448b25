"""The package on Windows and macOS, as far as it can be seen from here: what these systems lack is not called, and modules are imported without it.
docs/decisions/0024-packages.md lists what stands in for it."""

import ast
import contextlib
import os
import re
import subprocess
import sys

import pytest
from syntax import FILES, PYTHON, nodes

from ksl.output import OutputError, locks, patience, stage

fcntl = pytest.importorskip("fcntl", reason="plays other systems on this one")

MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
"""Modules of the standard library that Windows lacks."""

WINDOWS_LACKS = {
    "os": {
        "O_CLOEXEC",
        "O_DIRECTORY",
        "O_NOFOLLOW",
        "O_NONBLOCK",
        "chown",
        "fchmod",
        "fchown",
        "fork",
        "getegid",
        "geteuid",
        "getgid",
        "getgroups",
        "getloadavg",
        "getpgid",
        "getsid",
        "getuid",
        "killpg",
        "lchown",
        "mkfifo",
        "mknod",
        "nice",
        "openpty",
        "pipe2",
        "posix_fallocate",
        "pread",
        "preadv",
        "pwrite",
        "pwritev",
        "register_at_fork",
        "sched_getaffinity",
        "sched_setaffinity",
        "sendfile",
        "set_blocking",
        "setsid",
        "statvfs",
        "sync",
        "sysconf",
        "ttyname",
        "uname",
        "wait",
        "waitstatus_to_exitcode",
    },
    "signal": {
        "SIGALRM",
        "SIGCHLD",
        "SIGCONT",
        "SIGHUP",
        "SIGKILL",
        "SIGPIPE",
        "SIGQUIT",
        "SIGSTOP",
        "SIGTSTP",
        "SIGUSR1",
        "SIGUSR2",
        "SIGWINCH",
        "alarm",
        "pause",
        "pthread_kill",
        "pthread_sigmask",
        "setitimer",
        "siginterrupt",
        "sigwait",
    },
    "socket": {"AF_UNIX", "socketpair"},
}
MACOS_LACKS = {
    "os": {"O_DIRECT", "memfd_create", "pipe2", "posix_fallocate", "sched_getaffinity", "sched_setaffinity"},
    "signal": {"sigtimedwait", "sigwaitinfo"},
}

IMPORTS = """
import importlib, pkgutil, sys, types
system, blocked, lacking = {system!r}, {blocked!r}, {lacking!r}
import ksl
names = [m.name for m in pkgutil.walk_packages(ksl.__path__, "ksl.") if not m.name.rpartition(".")[2].startswith("_")]
for name in list(names):  # with all that other packages import, which have their own ways on other systems
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as e:  # of a package that is not installed
        if e.name.startswith("ksl"):
            raise
        names.remove(name)
compiled = {{name: sys.modules[name] for name in ("ksl._core", "ksl._ufuncs") if name in sys.modules}}
for name in [name for name in sys.modules if name == "ksl" or name.startswith("ksl.")]:
    del sys.modules[name]
sys.modules.update(compiled)
for name in blocked:
    sys.modules[name] = None  # ModuleNotFoundError
for name, missing in lacking.items():
    real, other = importlib.import_module(name), types.ModuleType(name)
    other.__dict__.update({{k: v for k, v in vars(real).items() if k not in missing}})
    if name == "os":
        other.name, other.sep, other.pathsep = ("nt", "\\\\", ";") if system == "win32" else ("posix", "/", ":")
    sys.modules[name] = other
sys.platform = system
for name in names:
    importlib.import_module(name)
print(len(names))
"""


@pytest.mark.parametrize(("system", "blocked", "lacking"), [("win32", MODULES, WINDOWS_LACKS), ("darwin", set(), MACOS_LACKS)], ids=["Windows", "macOS"])
def test_every_module_is_imported(system, blocked, lacking):
    """With `os`, `signal` and the like as that system has them, for the modules of this package alone."""
    done = subprocess.run(
        [sys.executable, "-c", IMPORTS.format(system=system, blocked=blocked, lacking=lacking)], capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


def unguarded(nodes: list[ast.AST], lacking: dict[str, set[str]]) -> list[str]:
    """Names that the system lacks, used where no condition around them asks for the system, or for the name or what comes with it."""
    used = [n for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name) and n.attr in lacking.get(n.value.id, ())]
    parents = {child: node for node in nodes for child in ast.iter_child_nodes(node)} if used else {}
    found = []
    for node in used:
        around, at = [], node
        while at in parents and not isinstance(at, (ast.FunctionDef, ast.Module)):
            at = parents[at]
            around += [ast.unparse(getattr(at, "test", at))] if isinstance(at, (ast.If, ast.IfExp, ast.BoolOp)) else []
        around += (
            [ast.unparse(s) for s in at.body if isinstance(s, ast.If) and isinstance(s.body[-1], (ast.Return, ast.Raise))]
            if isinstance(at, ast.FunctionDef)
            else []
        )
        if not any(word in condition for condition in around for word in ("hasattr(", "sys.platform", "os.name", "fcntl is None")):
            found.append(f"{node.lineno}: {node.value.id}.{node.attr}")
    return found


def of_posix(text: str) -> list[str]:
    """Headers and functions of C that Windows lacks, outside of conditions."""
    used = re.compile(r"#include <(?:unistd\.h|pthread\.h|sys/(?!types\.h)[^>]*)>|\b(?:aligned_alloc|posix_memalign|pause)\s*\(")
    depth, found = 0, []
    for line in text.splitlines():
        depth += line.startswith(("#if ", "#ifdef ", "#ifndef ")) - line.startswith("#endif")
        found += [] if depth else used.findall(line)
    return found


def test_the_extension_calls_nothing_of_posix():
    """`make test-windows` compiles the library for Windows; the extension is compiled for it by `make dist`, before a release."""
    assert not {path.name: found for path in PYTHON.rglob("*.[ch]pp") if (found := of_posix(path.read_text(encoding="utf-8")))}
    assert of_posix("#include <unistd.h>\nvoid f() { pause(); }\n") == ["#include <unistd.h>", "pause("]


@pytest.mark.parametrize("lacking", [WINDOWS_LACKS, MACOS_LACKS], ids=["Windows", "macOS"])
def test_nothing_is_called_that_a_system_lacks(lacking):
    found = []
    for path in FILES:
        name = path.relative_to(PYTHON).as_posix()
        found += [f"{name}:{use}" for use in unguarded(nodes(path), lacking)]
    assert not found


def test_what_is_lacking_is_found():
    def found(text):
        return unguarded(list(ast.walk(ast.parse(text))), WINDOWS_LACKS)

    assert found("import os\ndef f():\n    return os.getuid()\n") == ["3: os.getuid"]
    assert not found("import os\ndef f():\n    return os.getuid() if hasattr(os, 'getuid') else 0\n")


def test_a_file_is_read_where_no_descriptor_can_be_without_waiting(tmp_path, monkeypatch):
    """Windows has os.set_blocking from Python 3.12 on, for pipes alone: it refuses files."""
    from ksl.base import input_files

    def refuse(*_):
        raise OSError("not a pipe")

    monkeypatch.delattr(os, "O_NONBLOCK")
    monkeypatch.setattr(os, "set_blocking", refuse)
    (tmp_path / "a.txt").write_bytes(b"1\r\n")
    assert input_files.contents(str(tmp_path / "a.txt"), 100) == b"1\r\n"


def test_results_are_replaced_without_links(tmp_path, monkeypatch):
    """As on Windows, where few may make them."""
    from ksl.output import swap

    monkeypatch.setattr(swap.os, "name", "nt")
    for name in ("a", "b"):
        (tmp_path / name).write_text("earlier")
    stage = tmp_path / ".stage"
    (stage / "new").mkdir(parents=True)
    for name in ("a", "c"):
        (stage / "new" / name).write_text("new")
    monkeypatch.setattr(swap.os, "symlink", lambda *_, **__: pytest.fail("a link was made"))
    swap.swap(stage, {"a", "b", "c"})
    monkeypatch.setattr(swap.os, "name", "posix")
    assert {path.name: path.read_text() for path in tmp_path.iterdir() if path.is_file()} == {"a": "new", "c": "new"}


class LocksOfWindows:
    """msvcrt as far as locks use it: no other process reads a byte that is locked, so that it must not be one of the text."""

    LK_NBLCK = 2

    def locking(self, handle, mode, count):
        assert (mode, count) == (self.LK_NBLCK, 1) and os.lseek(handle, 0, os.SEEK_CUR) > os.fstat(handle).st_size
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(13, "Permission denied") from None


@pytest.fixture
def windows_files(monkeypatch):
    """Locks by LockFile, and no file is removed that somebody has open."""
    unlink = os.unlink

    def of_closed_files(path, *, dir_fd=None):
        place = os.stat(path, dir_fd=dir_fd)
        for handle in os.listdir("/proc/self/fd"):
            with contextlib.suppress(OSError):
                if os.path.samestat(os.fstat(int(handle)), place):
                    raise AssertionError(f"{path} is open") if dir_fd is None else PermissionError(13, "Permission denied")
        unlink(path, dir_fd=dir_fd)

    monkeypatch.setattr(locks, "fcntl", None)
    monkeypatch.setattr(locks, "msvcrt", LocksOfWindows())
    monkeypatch.setattr(locks.os, "unlink", of_closed_files)
    monkeypatch.delattr(os, "pread")
    monkeypatch.delattr(os, "pwrite")


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="asks Linux which files are open")
def test_runs_take_turns_by_the_locks_of_windows(tmp_path, windows_files, monkeypatch):
    opened, refused = os.open, [PermissionError, PermissionError, FileNotFoundError]  # while its last holder removes it

    def busy(*given):
        if refused:
            raise refused.pop()
        return opened(*given)

    with monkeypatch.context() as m:
        m.setattr(locks.os, "open", busy)
        m.setattr(locks.os, "name", "nt")
        held = locks.lock(tmp_path / "lock")
    with pytest.raises(locks.LockedError, match=f"process {os.getpid()} on "):
        locks.lock(tmp_path / "lock")
    held.release()
    assert not (tmp_path / "lock").exists()
    dead = tmp_path / f"{stage.PREFIX}00000000"
    (dead / "new").mkdir(parents=True)
    (dead / "lock").touch()
    with stage.staged(tmp_path) as files:
        (files / "table").write_text("new")
        assert [path.name for path in tmp_path.iterdir()] == [files.parent.name], "that of a killed run is gone, that of this one stays"
    assert [path.name for path in tmp_path.iterdir()] == ["table"]


def test_a_file_that_another_program_has_open_is_named_before_any_is_replaced(tmp_path, monkeypatch):
    def rename(place, to):
        if place.name == "b":
            e = PermissionError(13, "in use", str(place))
            e.winerror = 32  # as Windows' own errors have it
            raise e
        assert place == to

    for name in ("a", "b"):
        (tmp_path / name).write_text("earlier")
    swapped = stage.swap.swap

    def as_on_windows(*given):
        with monkeypatch.context() as m:  # Path asks for the name, too
            m.setattr(stage.swap.os, "name", "nt")
            m.setattr(stage.swap.os, "rename", rename)
            m.setattr(patience, "MOMENT", 0.01)
            swapped(*given)

    monkeypatch.setattr(stage.swap, "swap", as_on_windows)
    with pytest.raises(OutputError, match=r"\(Permission denied\); close b in the program that has it open, and run it again"), stage.staged(tmp_path) as files:
        for name in ("a", "b"):
            (files / name).write_text("new")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a": "earlier", "b": "earlier"}


def test_a_bag_is_read_where_links_are_refused(tmp_path, monkeypatch):
    from ksl.motions.files import bags

    def refuse(*_):
        raise OSError(22, "a required privilege is not held by the client")

    monkeypatch.setattr(bags.os, "symlink", refuse)
    (tmp_path / "recording").write_bytes(b"bag")
    with bags._with_suffix(str(tmp_path / "recording"), ".db3") as path:
        assert path.suffix == ".db3" and path.read_bytes() == b"bag"
