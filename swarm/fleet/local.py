"""A cluster on this machine: `python -m swarm.fleet.local N` runs a scheduler and N workers of one thread each.

It prints its address and ends, with all its processes, when its standard input does: also when the process that started
it is killed. Ctrl-C in a terminal does not reach it, so that shards can save their checkpoints first. Unlike the
`LocalCluster` of a script or a notebook it does not import the user's main module again.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import RunError

_ROOT = Path(__file__).parents[2]
# Seconds for its processes to end by themselves.
_ENDS = 10.0
# A scheduler runs any code that is sent to it, so it listens on this machine only, independent of Dask's default.
_HERE = "127.0.0.1"


@contextmanager
def started(workers: int) -> Iterator[str]:
    """Start a cluster of this number of workers on this machine, which ends with the context; return its address.

    Raises:
        RunError: it does not start.
    """
    # Functions of the user's modules are looked up where this process finds them.
    folders = [str(_ROOT), *(os.path.abspath(folder) for folder in sys.path)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(folders)}
    command = [sys.executable, "-P", "-m", "swarm.fleet.local", str(workers)]
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=output, env=environment,
            start_new_session=True, text=True,
        )  # fmt: skip
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            address = process.stdout.readline().strip()
            if not address:
                process.wait()
                output.seek(0)
                lines = output.read().decode(errors="replace").strip().splitlines() or ["it said nothing"]
                raise RunError(f"the local cluster did not start: {lines[-1]}")
            yield address
        finally:
            process.stdin.close()
            process.stdout.close()
            try:
                process.wait(_ENDS)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def main() -> None:
    """Run a cluster until the standard input ends."""
    import logging

    from distributed import LocalCluster

    with LocalCluster(
        n_workers=int(sys.argv[1]), threads_per_worker=1, processes=True, memory_limit=0, host=_HERE,
        dashboard_address=f"{_HERE}:0", worker_dashboard_address=None, silence_logs=logging.CRITICAL,
    ) as cluster:  # fmt: skip
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
