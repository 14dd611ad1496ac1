"""A scene file on a cluster that a Dask gateway of a cloud starts: `pip install ".[cluster]" dask-gateway`.

    python -m examples.cluster.gateway SCENE.toml -o /shared/run.h5 --address https://gateway.example.org --workers 20

The image of the workers must have the same Python, swarm, Numba and NumPy as this machine, and a volume that both have
mounted, in which the trajectory is.
"""

import argparse
import dataclasses
import sys
from pathlib import Path

from swarm import scene_file
from swarm.run.simulation import carry_out


def main() -> None:
    """Run a scene on workers of a gateway."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("run.h5"), help="the trajectory, on a shared volume")
    parser.add_argument("--address", help="of the gateway; by default the one of Dask's configuration")
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()
    try:
        from dask_gateway import Gateway
    except ModuleNotFoundError:
        sys.exit("this example needs dask-gateway: pip install dask-gateway")

    job = scene_file.read(arguments.scene)
    with Gateway(arguments.address).new_cluster() as cluster, cluster.get_client() as client:
        cluster.scale(arguments.workers)
        options = dataclasses.replace(
            job.run, trajectory=arguments.output, progress=True, cluster=client, shards=arguments.workers
        )
        result = carry_out(job.scene, job.start(), job.method, options)
    print(f"{len(result.particles)} particles, {result.observables['impacts'][-1]} impacts: {result.trajectory}")


if __name__ == "__main__":
    main()
