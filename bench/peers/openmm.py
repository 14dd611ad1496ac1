"""OpenMM: particles in an external force, on the CPU platform with one thread."""

import time

import numpy as np

from . import Floats, Job

INSTALL = "pip install openmm"


def version() -> str:
    """Name and version."""
    import openmm

    return f"OpenMM {openmm.version.version}"


def settings() -> str:
    """What is not the default."""
    return "CustomExternalForce, VerletIntegrator (leapfrog), platform CPU with Threads=1 (single precision)"


def run(job: Job) -> tuple[Floats, float]:
    """Positions at the end, and seconds."""
    import openmm

    system = openmm.System()
    wall = openmm.CustomExternalForce("0.5*alpha*max(0, r - radius)^2; r = sqrt(x*x + y*y + z*z)")
    wall.addGlobalParameter("alpha", job.alpha)
    wall.addGlobalParameter("radius", job.radius)
    for i in range(len(job.position)):
        system.addParticle(1.0)
        wall.addParticle(i)
    system.addForce(wall)
    platform = openmm.Platform.getPlatformByName("CPU")
    context = openmm.Context(system, openmm.VerletIntegrator(job.dt), platform, {"Threads": "1"})
    context.setPositions(job.position)
    context.setVelocities(job.velocity)
    context.getIntegrator().step(1)  # compiles the force
    start = time.process_time()
    context.getIntegrator().step(job.steps - 1)
    state = context.getState(getPositions=True)
    seconds = (time.process_time() - start) * job.steps / max(job.steps - 1, 1)
    return np.array(state.getPositions(asNumpy=True)._value), seconds
