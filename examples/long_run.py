"""A long run that is stopped and resumed twice on its way: what it conserves, and what it takes.

`python -m examples.long_run` gives 5 000 particles in an ellipsoid 10^6 impacts each, 5 10^9 in all, in three
processes: the first two get SIGTERM at frames 50 and 300, and the next goes on from the checkpoint.
`--particles` and `--impacts` make it shorter.
"""

import argparse
import json
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import psutil

import swarm

SEMI_AXES = (0.3, 0.3, 0.6)
SPEED = 0.5
# Impacts a second of a particle in this cavity at this speed: a fourth of its surface over its volume, times the speed.
RATE = 1.0682
FRAMES, STOPS = 500, (50, 300)
TRAJECTORY = "long.h5"


def joachimsthal(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """(r.Av)^2 - (v.Av)(r.Ar - 1), which impacts in an ellipsoid r.Ar = 1 and flights between them conserve."""
    a = 1.0 / np.array(SEMI_AXES)[:, None] ** 2
    across = (a * position * velocity).sum(axis=0)
    return across**2 - (a * velocity**2).sum(axis=0) * ((a * position**2).sum(axis=0) - 1.0)


def session(folder: Path, particles: int, impacts: float, stop: int | None) -> dict:
    """The run from where it is to frame `stop`, or to its end: how it ended, and this process's memory on the way."""
    scene = swarm.Scene([swarm.Ellipsoid(SEMI_AXES)])
    start, until = swarm.fill(scene, particles, speed=SPEED, seed=1), impacts / RATE
    memory = {}

    def watch(frame: swarm.Frame) -> None:
        memory[frame.number] = psutil.Process().memory_info().rss / 2**20
        if frame.number == stop:
            signal.raise_signal(signal.SIGTERM)

    told = {"status": "stopped", "wall time [s]": None}
    try:
        result = swarm.simulate(
            scene, start, swarm.Impact(), until=until, every=until / FRAMES, trajectory=folder / TRAJECTORY,
            frames=max(1, particles // 100), checkpoint=5.0, resume=True, progress=watch,
        )  # fmt: skip
        told = {"status": "complete", "wall time [s]": result.wall_time}
    except KeyboardInterrupt:
        pass
    numbers = sorted(memory)
    quarter = numbers[len(numbers) // 4]
    return {**told, "frames": numbers[-1] + 1, "memory [MB]": [memory[quarter], memory[numbers[-1]]]}


def main(particles: int = 5_000, impacts: float = 1e6, folder: Path | None = None) -> dict:
    """Run, stop and resume it twice, each time in another process; the report's figures."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = folder or Path(temporary)
        size = ["--particles", str(particles), "--impacts", str(impacts)]
        sessions = []
        for stop in (*STOPS, None):
            command = [sys.executable, __file__, *size, "--session", str(folder), *(["--stop", str(stop)] * bool(stop))]
            sessions.append(json.loads(subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout))
        with swarm.load(folder / TRAJECTORY) as trajectory:
            seen, first, last = trajectory.observables, trajectory.frame(0), trajectory.frame(-1)
            frames = len(trajectory)
        before, after = (joachimsthal(one.position, one.velocity) for one in (first, last))
        quarter, end = sessions[-1]["memory [MB]"]
        return {
            "particles": particles,
            "impacts": int(seen["impacts"][-1]),
            "frames": frames,
            "sessions": [told["status"] for told in sessions],
            "frames at the stops": [told["frames"] for told in sessions],
            "wall time [s]": sessions[-1]["wall time [s]"],
            "energy error, worst particle": float(seen["energy_error"].max()),
            "Joachimsthal's integral, worst relative change": float(np.abs(after / before - 1.0).max()),
            "largest penetration [m]": float(seen["max_penetration"].max()),
            "file [MB]": (folder / TRAJECTORY).stat().st_size / 1e6,
            "memory of the last session after a fourth of it [MB]": quarter,
            "and at its end [MB]": end,
        }


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--particles", type=int, default=5_000)
    arguments.add_argument("--impacts", type=float, default=1e6, help="of each particle")
    arguments.add_argument("--session", type=Path, metavar="FOLDER", help="one of the processes: go on there")
    arguments.add_argument("--stop", type=int, metavar="FRAME", help="the frame at which it stops")
    options = arguments.parse_args()
    if options.session:
        print(json.dumps(session(options.session, options.particles, options.impacts, options.stop)))
    else:
        for what, value in main(options.particles, options.impacts).items():
            print(f"{what:<56}{value:.3g}" if isinstance(value, float) else f"{what:<56}{value}")
