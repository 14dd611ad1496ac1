"""What long runs rest on: checkpoints, memory over many frames, a frame and a path out of a large file."""

import tempfile
import time
from pathlib import Path

import numpy as np

import swarm
from swarm.output import checkpoint
from swarm.run.engine import Run

from .bars import SPEED, SPHERE
from .report import Row, repeated, show, write


def checkpoints(n: int, repeats: int, folder: Path) -> list[Row]:
    """Milliseconds that a checkpoint holds the run up, file and folder synced; beside the bare write of its bytes."""
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)
    job = checkpoint.Job("", "", "", "", n, "")
    path = folder / "run.h5.checkpoint"
    with Run(SPHERE, particles.copy(), swarm.Impact(), 1, None) as run:
        run.observe()

        def milliseconds() -> float:
            start = time.perf_counter()
            checkpoint.save(path, job, run.arrays())
            return 1e3 * (time.perf_counter() - start)

        best, median = repeated(milliseconds, repeats)
        restored = Run(SPHERE, particles.copy(), swarm.Impact(), 1, None)

        def back() -> float:
            start = time.perf_counter()
            restored.restore(checkpoint.read(path)[1], False)
            return 1e3 * (time.perf_counter() - start)

        reading = repeated(back, repeats)
        restored.__exit__()
    return [
        Row(f"checkpoint of {n} particles", best, median, "ms", "50"),
        Row("  its file", path.stat().st_size / 1e6, path.stat().st_size / 1e6, "MB"),
        Row("  reading it", *reading, "ms"),
    ]


def resident() -> int:
    """Memory of this process [kB]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4


def growth(frames: int, folder: Path) -> list[Row]:
    """Memory over a run of many frames with trajectory and checkpoints, after its first quarter."""
    sizes = []

    def look(frame: swarm.Frame) -> None:
        if 4 * frame.number >= frames and frame.number % (frames // 100) == 0:
            sizes.append(resident())

    swarm.simulate(
        SPHERE, swarm.fill(SPHERE, 100, speed=SPEED, seed=1), swarm.Impact(), until=0.1 * frames, every=0.1,
        trajectory=folder / "growth.h5", checkpoint=0.5, progress=look,
    )  # fmt: skip
    grown = (max(sizes[len(sizes) // 2 :]) - max(sizes[: len(sizes) // 2])) / 1024
    return [Row(f"memory grown over {frames} frames, after a fourth", grown, grown, "MB", "0")]


def reading(n: int, frames: int, folder: Path, repeats: int) -> list[Row]:
    """Milliseconds for a frame, and for a particle's path, of a file in the page cache; opened anew each time."""
    path = folder / "large.h5"
    swarm.simulate(
        SPHERE, swarm.fill(SPHERE, n, speed=SPEED, seed=1), swarm.Impact(), until=1e-2 * frames, every=1e-2,
        trajectory=path,
    )  # fmt: skip
    random = np.random.default_rng(1)

    def frame() -> float:
        start = time.perf_counter()
        with swarm.load(path) as trajectory:
            trajectory.frame(int(random.integers(frames)))
        return 1e3 * (time.perf_counter() - start)

    def particle() -> float:
        start = time.perf_counter()
        with swarm.load(path) as trajectory:
            trajectory.particle(int(random.integers(n)))
        return 1e3 * (time.perf_counter() - start)

    size = path.stat().st_size / 1e9
    return [
        Row(f"a frame of {size:.2g} GB ({n} particles, {frames} frames)", *repeated(frame, repeats), "ms"),
        Row("  a particle's path in it", *repeated(particle, repeats), "ms"),
    ]


def main(quick: bool) -> None:
    """Measure, print and, unless quick, write endurance-MACHINE.csv."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows = checkpoints(1_000 if quick else 100_000, 3 if quick else 21, folder)
        rows += growth(200 if quick else 40_000, folder)
        rows += reading(100 if quick else 10_000, 20 if quick else 20_000, folder, 3 if quick else 21)
    show(rows)
    if not quick:
        write(rows, "endurance")
