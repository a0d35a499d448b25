"""The command `ksl` for blocks of pages, and blocks in Python as `ksl -c CODE`: a small program asks a waiting Python, which has all modules, to run
them in a copy of itself.  Sweeps start no processes.

Starting Python with all that a command imports takes a second, and pages have a hundred commands.  test/cli tests the console script itself."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import ksl_command
from pages import environment

PROGRAM = """#!{python} -IS
import json, os, socket, sys
server = socket.socket(socket.AF_UNIX)
server.connect({place!r})
socket.send_fds(server, [b"."], [0, 1, 2])
server.sendall(json.dumps([sys.argv[1:], os.getcwd(), dict(os.environ)]).encode())
server.shutdown(socket.SHUT_WR)
sys.exit(int(server.recv(9) or b"70"))
"""


@contextlib.contextmanager
def waiting(folder: Path) -> Iterator[Path]:
    """The folder of the program `ksl`, while the Python that it asks is there."""
    place = str(folder / "socket")
    program = folder / "ksl"
    program.write_text(PROGRAM.format(python=sys.executable, place=place))
    program.chmod(0o755)
    with subprocess.Popen([sys.executable, __file__, place], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, env=environment()) as server:
        assert server.stdout and server.stdout.readline() == b"ready\n"
        try:
            yield folder
        finally:
            server.terminate()


def serve(place: str) -> None:
    ksl_command.warm()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(place)
        listening.listen()
        print("ready", flush=True)
        while True:
            asked, _ = listening.accept()
            if os.fork() == 0:
                signal.signal(signal.SIGTERM, signal.SIG_DFL)
                answer(asked)
            asked.close()
            with contextlib.suppress(ChildProcessError):
                while os.waitpid(-1, os.WNOHANG)[0]:
                    pass


def answer(asked: socket.socket) -> None:
    """Runs the command in a copy of this process, tells its status, and ends."""
    _, streams, _, _ = socket.recv_fds(asked, 1, 3)
    with asked.makefile("rb") as words:
        arguments, folder, environment = json.loads(words.read())

    def start() -> None:
        asked.close()
        os.dup2(streams[0], 0)
        ksl_command.print_to(*streams[1:])
        sys.stdin = open(0, encoding="utf-8", closefd=False)
        for stream in streams:
            os.close(stream)
        os.chdir(folder)
        os.environ.clear()
        os.environ.update(environment)
        ksl_command.sweep_here()

    action = ksl_command.ksl_main(*arguments)
    if arguments[0] == "-c":
        action = lambda: exec(compile(arguments[1], "block", "exec"), {"__name__": "__main__"})
    copy = ksl_command.copied(lambda: ksl_command.status_of(action), start)
    status = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
    asked.sendall(str(status if status >= 0 else 128 - status).encode())
    os._exit(0)


if __name__ == "__main__":
    serve(sys.argv[1])
