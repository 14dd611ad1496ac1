"""Sweeps: the wall time of many short runs beside its parts, and the memory of a thousand."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

from .report import ROOT, Row, as_usual, child, show, tier, write

# The bar: a sweep of short runs takes at most so much more than the compilation and the runs on all cores.
BAR = 1.3
# With all kernels compiled it takes at most this part of the same runs in a loop in one process.
LOOP_BAR = 0.6
_SCENE = """
gravity = [0.0, 0.0, -9.81]
[particles]
count = {count}
speed = 1.0
mass = 1e-3
[[surface]]
kind = "sphere"
radius = 0.1
[method]
kind = "impact"
[run]
until = {until}
every = 0.1
frames = "none"
[sweep]
"surface.0.restitution" = [0.9, 0.95, 0.97, 0.98, 0.99]
"particles.seed" = {{range = {seeds}}}
"""
# In one process: every run cold and compiled first, and then as it is by itself, with one thread.
_ALONE = """
import sys, time, pathlib, swarm
from swarm import scene_file
from swarm.fleet.plan import read
plan = read(pathlib.Path(sys.argv[1]))
texts = map(plan.text, plan.variants)
jobs = [scene_file.job_of(scene_file.document_of(text, plan.path), text, plan.path) for text in texts]

def seconds(job, number):
    began = time.perf_counter()
    swarm.simulate(
        job.scene, job.start(), job.method, until=job.run.until, every=job.run.every, frames="none", threads=1,
        compile=sys.argv[3], trajectory=sys.argv[2] + f"/{number}.h5", overwrite=True,
    )
    return time.perf_counter() - began

cold = seconds(jobs[0], 0)
own = [seconds(job, number) for number, job in enumerate(jobs)]
print(cold - own[0], sum(own))
"""


def _environment(folder: Path) -> dict[str, str]:
    """That of a process with its kernels in a folder."""
    found = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    return {**as_usual(), "NUMBA_CACHE_DIR": str(folder), "PYTHONPATH": found}


def _sweep(path: Path, folder: Path, cache: Path) -> tuple[float, list[tuple[float, float, float]]]:
    """Seconds of `swarm sweep`; and, twice a second, the time, MB of the parent and MB of the largest worker."""
    began, seen = time.perf_counter(), []
    command = [sys.executable, "-m", "swarm", "sweep", str(path), "-o", str(folder), "--quiet"]
    process = subprocess.Popen(command, env=_environment(cache))
    watched = psutil.Process(process.pid)
    while True:
        try:
            process.wait(0.5)
            break
        except subprocess.TimeoutExpired:
            workers = [one.memory_info().rss / 1e6 for one in watched.children()]
            seen.append((time.perf_counter() - began, watched.memory_info().rss / 1e6, max(workers, default=0.0)))
    if process.returncode:
        raise RuntimeError(f"the sweep ended with the exit code {process.returncode}")
    return time.perf_counter() - began, seen


def _short_runs(place: Path, seeds: int, count: int, until: float, quick: bool) -> list[Row]:
    """The wall time of short runs of one scene, nothing compiled before, beside its parts."""
    folder = place / f"{5 * seeds}-runs"
    (folder / "alone").mkdir(parents=True)
    path = folder / "short.toml"
    path.write_text(_SCENE.format(count=count, until=until, seeds=seeds))
    said = child(_ALONE, str(path), str(folder / "alone"), tier(), NUMBA_CACHE_DIR=str(folder / "cold"))
    compiling, own = map(float, said.split())
    cores = len(os.sched_getaffinity(0))
    wall, _memory = _sweep(path, folder / "short", folder / "colder")
    least = compiling + own / cores
    runs = f"{5 * seeds} runs"
    rows = [
        Row(f"{runs}: compile once", compiling, compiling, "s"),
        Row(f"{runs}: their own time, one after the other", own, own, "s"),
        Row(f"{runs}: the two, of the second a share for each core", least, least, "s"),
        Row(f"{runs}: swarm sweep, nothing compiled before", wall, wall, "s", f"<={BAR}", wall / least),
    ]
    if quick:
        return rows
    warm, _memory = _sweep(path, folder / "again", folder / "colder")
    return [*rows, Row(f"{runs}: swarm sweep, once more", warm, warm, "s", f"<={LOOP_BAR}", warm / own)]


def _many_runs(folder: Path, seeds: int) -> list[Row]:
    """The memory of tiny runs, when a tenth of the time is over and at the end."""
    path = folder / "many.toml"
    path.write_text(_SCENE.format(count=5, until=0.2, seeds=seeds))
    wall, seen = _sweep(path, folder / "many", folder / "colder")
    began = seen[0][0] + 0.1 * (wall - seen[0][0])
    _, parent, worker = next((one for one in seen if one[0] >= began and one[2] > 0.0), seen[-1])
    _, parent_at_end, worker_at_end = [one for one in seen if one[2] > 0.0][-1]
    runs = f"{5 * seeds} tiny runs"
    return [
        Row(f"{runs}: wall time of each", wall / (5 * seeds) * 1e3, wall / (5 * seeds) * 1e3, "ms"),
        Row(f"{runs}: memory of the parent, at a tenth", parent, parent, "MB"),
        Row(
            f"{runs}: memory of the parent, at the end", parent_at_end, parent_at_end, "MB", "", parent_at_end / parent
        ),
        Row(f"{runs}: memory of a worker, at a tenth", worker, worker, "MB"),
        Row(f"{runs}: memory of a worker, at the end", worker_at_end, worker_at_end, "MB", "", worker_at_end / worker),
    ]


def main(quick: bool = False) -> None:
    """Print the report."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        rows = _short_runs(folder, *((1, 20, 0.1) if quick else (10, 2000, 4.0)), quick)
        rows += [] if quick else _short_runs(folder, 20, 1000, 0.2, quick)
        rows += _many_runs(folder, 1 if quick else 200)
    show(rows)
    if not quick:
        write(rows, "sweep")
