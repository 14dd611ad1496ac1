"""The same points in the same sphere by every program: steps a second, and the time to a given accuracy.

What others do best is compared in ground.py.

The error is the median distance from where the points of a rigid cavity are at the end. A soft wall is met late, a
stiff one changes the energy in explicit steps: for each step dt, stiffnesses dt sqrt(alpha / m) of 0.3, 0.1 and 0.03
are tried, of ten to a hundred steps a contact, and dt is halved until one of them comes near enough.

Seconds are of processor time, of one thread: what else runs on a machine makes wall times longer.
"""

import time
from collections.abc import Callable

import numpy as np

import swarm
from swarm.methods.base import Method

from .. import yardstick
from ..report import Row, machine, show, write
from . import Floats, Job, ground, loaded

PEERS = ("lammps", "openmm", "warp")
RADIUS, SPEED, UNTIL = 0.5, 0.5, 10.0
_STIFFNESSES = (0.3, 0.1, 0.03)
# The error to reach [m], and the longest a program may take for one try [s].
_ERROR, _PATIENCE = 0.01, 30.0

Solver = Callable[[Job], tuple[Floats, float]]


def numba_verlet(job: Job) -> tuple[Floats, float]:
    """What a user would write in an afternoon."""
    position, velocity = job.position.T.copy(), job.velocity.T.copy()
    yardstick.plain_verlet(position[:, :1].copy(), velocity[:, :1].copy(), job.radius, job.alpha, job.dt, 1)
    start = time.process_time()
    yardstick.plain_verlet(position, velocity, job.radius, job.alpha, job.dt, job.steps)
    return position.T, time.process_time() - start


def ours(job: Job, method: Method) -> tuple[Floats, float]:
    """Seconds from the first frame."""
    scene, clock = swarm.Scene([swarm.Sphere(job.radius)]), []
    particles = swarm.Particles(job.position.T.copy(), job.velocity.T.copy())
    for until in (2.0 * job.dt, job.steps * job.dt):
        clock.clear()
        result = swarm.simulate(
            scene, particles, method, until=until, threads=1, progress=lambda frame: clock.append(time.process_time())
        )
        seconds = time.process_time() - clock[0]
    return result.particles.position.T, seconds


def penalty(job: Job) -> tuple[Floats, float]:
    """Our conserving penalty of fixed step."""
    return ours(job, swarm.Penalty(dt=job.dt, penalty=job.alpha))


def job_of(start: swarm.Particles, dt: float, alpha: float) -> Job:
    """The job with this step."""
    rows = (np.ascontiguousarray(values.T) for values in (start.position, start.velocity))
    return Job(*rows, RADIUS, alpha, dt, round(UNTIL / dt))


def off(position: Floats, exact: Floats) -> float:
    """The error [m]."""
    return float(np.median(np.linalg.norm(position - exact, axis=1)))


def solution(
    solver: Solver, start: swarm.Particles, exact: Floats, each: float, patience: float
) -> tuple[str, float, bool]:
    """What comes how near, its seconds, and whether that is near enough; `each` [s] is a step of one particle."""
    dt, best, spent = 1e-3, np.inf, 0.0
    while best == np.inf or each * len(start) * UNTIL / dt < patience:
        for stiffness in _STIFFNESSES:
            alpha = (stiffness / dt) ** 2
            position, spent = solver(job_of(start, dt, alpha))
            error = off(position, exact)
            if error <= _ERROR:
                return f"  to {error:.2g} m: dt={dt:.3g}, alpha={alpha:.2g}", spent, True
            best = min(best, error)
        dt *= 0.5
    return f"  to {_ERROR:g} m: not in {patience:g} s, {best:.2g} m at dt={2.0 * dt:.3g}", spent, False


def solvers() -> tuple[dict[str, Solver], list[str]]:
    """Name -> run, and a sentence for each program that cannot be loaded."""
    found: dict[str, Solver] = {"swarm, Penalty": penalty, "plain Verlet in Numba": numba_verlet}
    peers, missing = loaded(PEERS)
    for peer, version in peers.values():
        found[version] = peer.run
        print(f"{version}: {peer.settings()}")
    return found, missing


def main(quick: bool) -> None:
    """Measure, print, and write the CSV of this machine."""
    n = 2 if quick else 10_000
    scene = swarm.Scene([swarm.Sphere(RADIUS)])
    start = swarm.fill(scene, n, speed=SPEED, seed=1)
    print(f"{n} points, sphere of radius {RADIUS:g} m, {SPEED:g} m/s, {UNTIL:g} s, one thread; {machine()}")
    exact, seconds = ours(job_of(start, 1e-3, 1e4), swarm.Impact())
    rows = [Row("swarm, Impact: the rigid cavity to round-off", seconds, seconds, "s")]
    found, missing = solvers()
    for name, solver in found.items():
        position, seconds = solver(job_of(start, 1e-3, 1e4))
        each = seconds / (n * round(UNTIL / 1e-3))
        error = off(position, exact)
        rows.append(Row(f"{name}: alpha=1e4, dt=1e-3", 1e9 * each, 1e9 * each, "ns/particle-step"))
        rows.append(Row("  its error", error, error, "m"))
        told, seconds, reached = solution(solver, start, exact, each, 0.1 if quick else _PATIENCE)
        rows.append(Row(told, seconds, seconds, "s", "", seconds / rows[0].best if reached else None))
    beside, without = ground.rows(quick)
    rows, missing = rows + beside, missing + without
    show(rows)
    for sentence in missing:
        print(sentence)
    if not quick:
        write(rows, "peers")
