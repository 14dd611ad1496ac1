"""Processes of their own for tests, each a copy of one that has imported the libraries.

Of the two seconds that a command of `swarm` takes most are imports, and tests begin it a hundred times. A copy is a
process like any other, with signals, limits and an exit code of its own. Where its environment is not that of the
tests, it imports `swarm` itself. A test of how Python begins, or of what is imported for what, starts Python.
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


def python(*arguments, cwd=None, env=None, timeout=600, file_size=None, bare=False):
    """As `subprocess.run` of Python with its output as text: of "-c" and code, "-m" and a module, or a file.

    No file grows beyond `file_size`, as on a full disk. A process that is `bare` imports `swarm` itself.
    """
    with tempfile.NamedTemporaryFile("r") as out, tempfile.NamedTemporaryFile("r") as err:
        request = {
            "arguments": list(map(str, arguments)), "cwd": os.path.abspath(cwd or "."), "env": env or dict(os.environ),
            "out": out.name, "err": err.name, "file_size": file_size,
        }  # fmt: skip
        asked = _starter(bare or _environment(request["env"]) != _AT_START)
        asked.stdin.write(json.dumps(request) + "\n")
        asked.stdin.flush()
        pid = int(asked.stdout.readline())
        if not select.select([asked.stdout], [], [], timeout)[0]:
            os.kill(pid, signal.SIGKILL)
            raise subprocess.TimeoutExpired(arguments, timeout)
        return subprocess.CompletedProcess(arguments, int(asked.stdout.readline()), out.read(), err.read())


def _environment(env):
    """What an import looks at: settings of Python and of Numba, the folder of kernels among them."""
    return {name: value for name, value in env.items() if name.startswith(("PYTHON", "NUMBA_"))}


_AT_START = _environment(os.environ)


@functools.cache
def _starter(is_bare):
    words = [sys.executable, __file__, *([] if is_bare else ["swarm"])]
    starter = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def end():
        starter.stdin.close()
        starter.wait()
        starter.stdout.close()

    atexit.register(end)
    return starter


def _import_swarm():
    """What commands import to run a scene, and to read and write its files."""
    import filelock  # noqa: F401
    import psutil  # noqa: F401

    import swarm.commands.summary
    import swarm.exports.exported
    import swarm.files.trajectory
    import swarm.files.writer
    import swarm.run.machine
    import swarm.run.session
    import swarm.scene_file
    from swarm.commands import cli  # noqa: F401

    for name in swarm.__all__:
        getattr(swarm, name)


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
    import click  # noqa: F401
    import h5py  # noqa: F401
    import numba
    import sympy  # noqa: F401

    numba.njit(lambda x: x + 1.0)(1.0)  # the compiler begins
    if "swarm" in sys.argv:
        _import_swarm()
    request = _serve()
    _become(request)
    how = None
    try:
        _run(*request["arguments"])
    except BaseException as error:
        how = error
    _end(how)
