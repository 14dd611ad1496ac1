"""The machine's own pace, measured in the same run as the results it is compared with."""

import atexit
import functools
import shutil
import subprocess
import tempfile
from pathlib import Path

import numba
import numpy as np

_FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")


# What yardstick.c measures -> passes of one repeat, some 15 ms.
PASSES = {"impact": 20_000, "lane": 20_000, "verlet": 40_000, "divide": 60_000, "root": 40_000, "copy": 1}


@functools.cache
def _program() -> Path | None:
    """The compiled yardstick.c; None without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return None
    folder = Path(tempfile.mkdtemp(prefix="swarm-bench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    program = folder / "yardstick"
    source = Path(__file__).with_name("yardstick.c")
    subprocess.run([compiler, *_FLAGS, str(source), "-o", str(program), "-lm"], check=True)
    return program


def bare(what: str, processes: int = 1) -> list[float]:
    """Nanoseconds an item of yardstick.c, one entry a repeat and process; empty without a compiler."""
    program = _program()
    if program is None:
        return []
    running = [
        subprocess.Popen([program, what, str(PASSES[what])], stdout=subprocess.PIPE, text=True)
        for _ in range(processes)
    ]
    return [float(line) for one in running for line in one.communicate()[0].split()]


@numba.njit(error_model="numpy")
def _spring(x, y, z, radius, alpha):
    distance = np.sqrt(x * x + y * y + z * z)
    gap = distance - radius
    if gap > 0.0:
        f = -alpha * gap / distance
        return f * x, f * y, f * z
    return 0.0, 0.0, 0.0


@numba.njit(error_model="numpy")
def plain_verlet(position, velocity, radius, alpha, dt, steps):
    """What a user would write in an afternoon: velocity Verlet with a penalty wall, particle by particle."""
    for i in range(position.shape[1]):
        x, y, z = position[0, i], position[1, i], position[2, i]
        vx, vy, vz = velocity[0, i], velocity[1, i], velocity[2, i]
        ax, ay, az = _spring(x, y, z, radius, alpha)
        for _ in range(steps):
            vx, vy, vz = vx + 0.5 * dt * ax, vy + 0.5 * dt * ay, vz + 0.5 * dt * az
            x, y, z = x + dt * vx, y + dt * vy, z + dt * vz
            ax, ay, az = _spring(x, y, z, radius, alpha)
            vx, vy, vz = vx + 0.5 * dt * ax, vy + 0.5 * dt * ay, vz + 0.5 * dt * az
        position[0, i], position[1, i], position[2, i] = x, y, z
        velocity[0, i], velocity[1, i], velocity[2, i] = vx, vy, vz
