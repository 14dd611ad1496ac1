"""A gas in a sphere by worker processes of this machine, the smallest cluster; then the same with one process.

    python -m examples.cluster.local [--workers 2] [-o cavity.h5]

Their bits are the same.
"""

import argparse
import tempfile
from pathlib import Path

import swarm


def run(workers: int, path: Path, count: int = 5000) -> tuple[swarm.Result, swarm.Result]:
    """The result of the workers, with their trajectory at `path`, and that of this process."""
    scene = swarm.Scene([swarm.Sphere(radius=0.5, restitution=0.99)])
    start = swarm.fill(scene, count, speed=1.0, seed=1)
    far = swarm.simulate(
        scene, start, swarm.Impact(), until=2.0, every=0.5, trajectory=path, cluster=f"local:{workers}", overwrite=True
    )
    return far, swarm.simulate(scene, start, swarm.Impact(), until=2.0, every=0.5)


def main() -> None:
    """Print what both say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("-o", "--output", type=Path, help="the trajectory; its particles are in a folder beside it")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        far, here = run(arguments.workers, arguments.output or Path(folder) / "cavity.h5")
    for name in ("impacts", "total_energy", "dissipated_energy"):
        same = "the same bits" if (far.observables[name] == here.observables[name]).all() else "another number"
        print(f"{name}: {far.observables[name][-1]!r}, {same} as from one process")


if __name__ == "__main__":
    main()
