"""NVIDIA Warp: the loop over steps in a kernel for the CPU, in double precision."""

import functools
import time
from typing import Any

import numpy as np

from . import Floats, Job

INSTALL = "pip install warp-lang"


def version() -> str:
    """Name and version."""
    import warp

    return f"Warp {warp.__version__}"


def settings() -> str:
    """What is not the default."""
    return "device cpu, float64, all steps of a particle in one launch"


@functools.cache
def _kernel() -> Any:
    import warp

    def verlet(
        position: warp.array(dtype=warp.vec3d),
        velocity: warp.array(dtype=warp.vec3d),
        radius: warp.float64,
        alpha: warp.float64,
        dt: warp.float64,
        steps: int,
    ):
        i = warp.tid()
        # Copies: an element of an array is a reference.
        x = warp.vec3d(position[i])
        v = warp.vec3d(velocity[i])
        for _ in range(steps):
            r = warp.length(x)
            if r > radius:
                v = v - dt * alpha * (r - radius) / r * x
            x = x + dt * v
        position[i] = x
        velocity[i] = v

    return warp.kernel(verlet)


def run(job: Job) -> tuple[Floats, float]:
    """Positions at the end, and seconds."""
    import warp

    warp.config.log_level = warp.LOG_WARNING
    with warp.ScopedDevice("cpu"):
        arrays = [warp.array(values, dtype=warp.vec3d) for values in (job.position, job.velocity)]
        numbers = [job.radius, job.alpha, job.dt]
        warp.launch(_kernel(), dim=1, inputs=[*(warp.clone(one) for one in arrays), *numbers, 1])  # compiles
        start = time.process_time()
        warp.launch(_kernel(), dim=len(job.position), inputs=[*arrays, *numbers, job.steps])
        warp.synchronize()
        seconds = time.process_time() - start
        return np.array(arrays[0].numpy()), seconds
