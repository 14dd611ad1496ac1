"""Processes of their own for tests, each a copy of one that has imported the libraries.

Two thirds of the second that `swarm` takes to begin are NumPy's, Numba's and HDF5's, and tests begin it a hundred
times. A copy is a process like any other, with signals, limits and an exit code of its own. It imports `swarm` itself,
by its own environment. A test of how Python begins, or of what is imported for what, starts Python.
"""

import atexit
import ctypes
import functools
import json
import os
import resource
import runpy
import select
import signal
import subprocess
import sys
import tempfile
import threading
import types
from pathlib import Path


def python(*arguments, cwd=None, env=None, timeout=600, file_size=None):
    """As `subprocess.run` of Python with its output as text: of "-c" and code, "-m" and a module, or a file.

    No file grows beyond `file_size`, as on a full disk.
    """
    with tempfile.NamedTemporaryFile("r") as out, tempfile.NamedTemporaryFile("r") as err:
        request = {
            "arguments": list(map(str, arguments)), "cwd": os.path.abspath(cwd or "."), "env": env or dict(os.environ),
            "out": out.name, "err": err.name, "file_size": file_size,
        }  # fmt: skip
        asked = _starter()
        asked.stdin.write(json.dumps(request) + "\n")
        asked.stdin.flush()
        pid = int(asked.stdout.readline())
        if not select.select([asked.stdout], [], [], timeout)[0]:
            os.kill(pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired(arguments, timeout)
        return subprocess.CompletedProcess(arguments, int(asked.stdout.readline()), out.read(), err.read())


@functools.cache
def _starter():
    starter = subprocess.Popen([sys.executable, __file__], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def end():
        starter.stdin.close()
        starter.wait()
        starter.stdout.close()

    atexit.register(end)
    return starter


def _serve():
    """The request of a copy, in that copy."""
    for line in iter(sys.stdin.readline, ""):
        pid = os.fork()
        if pid == 0:
            return json.loads(line)
        print(pid, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), flush=True)
    sys.exit()


def _become(request):
    """What Python does before the first line of a program."""
    from numba.core import config

    for number, name in enumerate((os.devnull, request["out"], request["err"])):
        os.dup2(os.open(name, os.O_RDWR), number)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if request["file_size"] is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (request["file_size"],) * 2)
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    config.reload_config()
    # The limit of a file would cut bytecode short too, which other tests read.
    written = request["file_size"] is None and not os.environ.get("PYTHONDONTWRITEBYTECODE")
    sys.dont_write_bytecode = not written
    paths = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    sys.path[:1] = ["", *(path for path in paths if path not in sys.path)]


def _run(kind, *arguments):
    if kind == "-c":
        code, *more = arguments
        sys.argv, main = ["-c", *more], types.ModuleType("__main__")
        sys.modules["__main__"] = main
        exec(compile(code, "<string>", "exec"), main.__dict__)
    elif kind == "-m":
        sys.argv = list(arguments)
        runpy.run_module(arguments[0], run_name="__main__", alter_sys=True)
    else:
        sys.argv, sys.path[0] = [kind, *arguments], str(Path(kind).parent)
        runpy.run_path(kind, run_name="__main__")


def _end(how):
    """What Python does after the last line, without taking all modules apart: half a second."""
    code = how.code if isinstance(how, SystemExit) else 0 if how is None else 1
    if how is not None and not isinstance(how, SystemExit):
        sys.excepthook(type(how), how, how.__traceback__)
    if code is not None and not isinstance(code, int):
        print(code, file=sys.stderr)
        code = 1
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    if isinstance(how, KeyboardInterrupt):
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    ctypes.PyDLL(None).exit(code or 0)  # that of C: libraries close their files


if __name__ == "__main__":
    import h5py  # noqa: F401
    import numba
    import sympy  # noqa: F401
    import typer  # noqa: F401

    numba.njit(lambda x: x + 1.0)(1.0)  # the compiler begins
    request = _serve()
    _become(request)
    how = None
    try:
        _run(*request["arguments"])
    except BaseException as error:
        how = error
    _end(how)
