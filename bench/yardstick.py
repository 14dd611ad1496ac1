"""The machine's own pace, measured in the same run as the results it is compared with."""

import shutil
import subprocess
import tempfile
from pathlib import Path

import numba
import numpy as np

_FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")


def bare_impact(quick: bool = False) -> list[float]:
    """Nanoseconds per impact of the bare loop in C (yardstick.c), one entry a repeat; empty without a compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return []
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "yardstick"
        source = Path(__file__).with_name("yardstick.c")
        subprocess.run([compiler, *_FLAGS, str(source), "-o", str(program), "-lm"], check=True)
        printed = subprocess.run([program, "1000" if quick else "20000"], check=True, capture_output=True, text=True)
    return [float(line) for line in printed.stdout.split()]


@numba.njit(error_model="numpy")
def plain_verlet(position, velocity, radius, alpha, dt, steps):
    """What a user would write in an afternoon: velocity Verlet with a penalty wall, particle by particle."""
    for i in range(position.shape[1]):
        x, y, z = position[0, i], position[1, i], position[2, i]
        vx, vy, vz = velocity[0, i], velocity[1, i], velocity[2, i]
        ax, ay, az = 0.0, 0.0, 0.0
        for _ in range(steps):
            vx, vy, vz = vx + 0.5 * dt * ax, vy + 0.5 * dt * ay, vz + 0.5 * dt * az
            x, y, z = x + dt * vx, y + dt * vy, z + dt * vz
            distance = np.sqrt(x * x + y * y + z * z)
            gap = distance - radius
            if gap > 0.0:
                f = -alpha * gap / distance
                ax, ay, az = f * x, f * y, f * z
            else:
                ax, ay, az = 0.0, 0.0, 0.0
            vx, vy, vz = vx + 0.5 * dt * ax, vy + 0.5 * dt * ay, vz + 0.5 * dt * az
        position[0, i], position[1, i], position[2, i] = x, y, z
        velocity[0, i], velocity[1, i], velocity[2, i] = vx, vy, vz
