"""A long run that is stopped and resumed twice on its way: what it conserves, and what it takes.

`python -m examples.long_run` gives 5 000 particles in an ellipsoid 10^6 impacts each, 5 10^9 in all, in three
processes: the first two stop at their limit of wall time, whatever they are at, and the next goes on from the
checkpoint.
`--particles` and `--impacts` make it shorter.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import swarm

SEMI_AXES = (0.3, 0.3, 0.6)
SPEED = 0.5
# Impacts a second of a particle in this cavity at this speed: a fourth of its surface over its volume, times the speed.
RATE = 1.0682
FRAMES = 500


def scene_file(particles: int, impacts: float) -> str:
    """The scene, with frames of every fiftieth particle."""
    until = impacts / RATE
    return f"""
[particles]
count = {particles}
speed = {SPEED}
seed = 1

[[surface]]
kind = "ellipsoid"
semi_axes = {list(SEMI_AXES)}

[method]
kind = "impact"

[run]
until = {until!r}
every = {until / FRAMES!r}
frames = {max(1, particles // 100)}
checkpoint = 5.0
"""


def joachimsthal(position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """(r.Av)^2 - (v.Av)(r.Ar - 1), which impacts in an ellipsoid r.Ar = 1 and flights between them conserve."""
    a = 1.0 / np.array(SEMI_AXES)[:, None] ** 2
    across = (a * position * velocity).sum(axis=0)
    return across**2 - (a * velocity**2).sum(axis=0) * ((a * position**2).sum(axis=0) - 1.0)


def session(folder: Path, *limit: str) -> tuple[dict, list[int]]:
    """One process of the run: its summary, and its memory [kB] twice a second."""
    command = [sys.executable, "-m", "swarm", "run", "long.toml", "--resume", "--json", *limit]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
        memory = []
        while process.poll() is None:
            time.sleep(0.5)
            try:
                status = Path(f"/proc/{process.pid}/status").read_text()
            except OSError:
                break
            memory += [int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")]
        told = json.load(process.stdout)
    if process.returncode != 0:
        raise SystemExit(f"the run failed with exit code {process.returncode}")
    return told, memory


def main(particles: int = 5_000, impacts: float = 1e6, limit: float = 15.0, folder: Path | None = None) -> dict:
    """Run, stop and resume it twice; the report's figures."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = folder or Path(temporary)
        (folder / "long.toml").write_text(scene_file(particles, impacts))
        sessions = [session(folder, "--walltime", f"{limit}s") for _ in range(2)]
        sessions.append(session(folder))
        with swarm.load(folder / "long.h5") as trajectory:
            seen, first, last = trajectory.observables, trajectory.frame(0), trajectory.frame(-1)
            frames = len(trajectory)
        before, after = (joachimsthal(one.position, one.velocity) for one in (first, last))
        return {
            "particles": particles,
            "impacts": int(seen["impacts"][-1]),
            "frames": frames,
            "sessions": [told["status"] for told, _memory in sessions],
            "frames at the stops": [told["frames"] for told, _memory in sessions],
            "wall time [s]": sessions[-1][0]["wall_time"],
            "energy error, worst particle": float(seen["energy_error"].max()),
            "Joachimsthal's integral, worst relative change": float(np.abs(after / before - 1.0).max()),
            "largest penetration [m]": float(seen["max_penetration"].max()),
            "file [MB]": (folder / "long.h5").stat().st_size / 1e6,
            "memory of the last session after a fourth of it [MB]": sessions[-1][1][len(sessions[-1][1]) // 4] / 1024,
            "and at its end [MB]": sessions[-1][1][-1] / 1024,
        }


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--particles", type=int, default=5_000)
    arguments.add_argument("--impacts", type=float, default=1e6, help="of each particle")
    arguments.add_argument("--limit", type=float, default=15.0, help="wall time of the first two sessions [s]")
    options = arguments.parse_args()
    for what, value in main(options.particles, options.impacts, options.limit).items():
        print(f"{what:<56}{value:.3g}" if isinstance(value, float) else f"{what:<56}{value}")
