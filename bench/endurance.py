"""What long runs rest on: checkpoints, memory over many frames, a frame and a path out of a large file."""

import tempfile
import time
from pathlib import Path

import numpy as np

import swarm
from swarm.files import checkpoint, checksums
from swarm.files.storage import Storage
from swarm.files.writer import TrajectoryWriter
from swarm.run.engine import Run
from swarm.state import State

from .bars import SPEED, SPHERE
from .report import Row, repeated, show, tier, write


def checkpoints(n: int, repeats: int, folder: Path) -> list[Row]:
    """Milliseconds that a checkpoint holds the run up, file and folder synced; beside the bare write of its bytes."""
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)
    job = checkpoint.SavedRun("", "", "", "", n, "")
    path = folder / "run.h5.checkpoint"
    with Run(SPHERE.compiled(), particles.copy(), swarm.Impact(), 1, None, tier()) as run:
        run.observe()

        def milliseconds() -> float:
            start = time.perf_counter()
            checkpoint.save(path, job, run.arrays())
            return 1e3 * (time.perf_counter() - start)

        best, median = repeated(milliseconds, repeats)
        restored = Run(SPHERE.compiled(), particles.copy(), swarm.Impact(), 1, None, tier())

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


def writing(n: int, frames: int, folder: Path, repeats: int) -> list[Row]:
    """Processor time of a frame in batches of ten, of that its checksums, and of holding all values against them."""
    particles = swarm.fill(SPHERE, n, speed=SPEED, seed=1)
    nothing, counts = np.zeros(n), np.zeros(n, np.int64)
    state = State(particles.position, particles.velocity, nothing, nothing, nothing, counts, nothing, nothing, None)
    path = folder / "written.h5"

    def written() -> float:
        path.unlink(missing_ok=True)
        start = time.process_time()
        with TrajectoryWriter(path, Storage(), SPHERE, swarm.Impact(), particles, None, {}) as write:
            for first in range(0, frames, 10):
                write([(k, float(k), state, {"time": float(k), "impacts": k}) for k in range(first, first + 10)])
        return 1e3 * (time.process_time() - start) / frames

    rows = np.ascontiguousarray(particles.position.T)[None]

    def sums() -> float:
        start = time.process_time()
        for _ in range(frames):
            for one in (rows, rows, counts[None]):
                checksums.row_sums(one, checksums.BLOCK)
        return 1e3 * (time.process_time() - start) / frames

    def read() -> float:
        start = time.process_time()
        with swarm.load(path) as trajectory:
            trajectory.require_intact()
        return 1e3 * (time.process_time() - start) / frames

    figures = [("a frame written", repeated(written, repeats)), ("  of that checksums", repeated(sums, repeats))]
    figures.append(("  read and held against its checksums", repeated(read, repeats)))
    size = path.stat().st_size / frames / 1e6
    found = [Row(f"{what}, {n} particles, {size:.2g} MB", *of, "ms") for what, of in figures]
    return [*found, Row("  a frame written, that is", *(size / ms * 1e3 for ms in figures[0][1]), "MB/s")]


def main(quick: bool) -> None:
    """Measure, print and, unless quick, write endurance-MACHINE.csv."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rows = checkpoints(1_000 if quick else 100_000, 3 if quick else 21, folder)
        rows += growth(200 if quick else 40_000, folder)
        rows += writing(1_000 if quick else 10_000, 20 if quick else 500, folder, 3 if quick else 21)
        rows += reading(100 if quick else 10_000, 20 if quick else 20_000, folder, 3 if quick else 21)
    show(rows)
    if not quick:
        write(rows, "endurance")
