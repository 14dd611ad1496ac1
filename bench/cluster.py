"""A run on a cluster of two workers of one thread against one process of two threads, and 200 shards on two workers."""

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import swarm
from swarm.files import paths
from swarm.fleet import local

from .report import Row, in_turn, show, tier, write

# Impacts of each particle, and the time between two of them in these cavities at this speed [s].
_IMPACTS, _SPEED = 200, 1.0
_SHARDS = 200


def scenes() -> dict[str, tuple[swarm.Scene, float]]:
    """Name -> scene, and the time in which a particle has some 200 impacts [s]."""
    sphere, egg = swarm.Sphere(0.5), swarm.Ellipsoid((0.5, 0.4, 0.6))
    return {
        "sphere": (swarm.Scene([sphere]), 133.0),
        "falling in an ellipsoid": (swarm.Scene([egg], gravity=(0.0, 0.0, -1.0)), 120.0),
    }


def main(quick: bool) -> None:
    """Print the report."""
    from distributed import Client

    n = 256 if quick else 1_000_000
    rows: list[Row] = []
    began = time.perf_counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        local.started(2) as address,
        Client(address, set_as_default=False) as client,
    ):
        client.wait_for_workers(2)
        started = time.perf_counter() - began
        rows.append(Row("start of a local cluster of two workers", started, started, "s"))
        for name, (scene, until) in scenes().items():
            start = swarm.fill(scene, n, speed=_SPEED, seed=1)
            until = until / 1000.0 if quick else until

            def timed(path: str, scene: swarm.Scene = scene, start: swarm.Particles = start, until: float = until,
                      **where: object) -> Callable[[], float]:  # fmt: skip
                def measure() -> float:
                    began = time.perf_counter()
                    swarm.simulate(
                        scene, start, swarm.Impact(), until=until, every=until / 2, trajectory=Path(folder) / path,
                        overwrite=True, compile=tier(), **where,  # type: ignore[arg-type]
                    )  # fmt: skip
                    return time.perf_counter() - began

                return measure

            found = in_turn(
                {"one": timed("one.h5", threads=2), "two": timed("two.h5", cluster=client)}, 1 if quick else 3
            )
            for what, key in (("one process, two threads", "one"), ("two workers of one thread", "two")):
                rows.append(Row(f"{name}, {what}", *found[key], "s"))
            speed = found["one"][0] / found["two"][0]
            rows.append(Row("  speed over that of one process", speed, speed, "", "0.9", speed / 0.9))
            if name == "sphere":
                rows += of_many(timed("many.h5", cluster=client, shards=_SHARDS), client, Path(folder) / "many.h5", n)
    show(rows)
    if not quick:
        write(rows, "cluster")


def of_many(run: Callable[[], float], client: object, path: Path, n: int) -> list[Row]:
    """What 200 shards on two workers take of the scheduler and of the disk."""
    scheduler = client.run_on_scheduler  # type: ignore[attr-defined]
    before = scheduler(time.process_time)
    seconds = run()
    busy = scheduler(time.process_time) - before
    files = list(paths.shards_of(path).glob("*.h5"))
    size = sum(file.stat().st_size for file in files) / 3 / n
    return [
        Row(f"{len(files)} shards on two workers", seconds, seconds, "s"),
        Row("  the scheduler's processor time, a shard", *[1e3 * busy / len(files)] * 2, "ms"),
        Row("  bytes of a particle in a frame", size, size, "B"),
    ]
