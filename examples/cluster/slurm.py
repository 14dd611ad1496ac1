"""A scene file on the nodes of a SLURM cluster, by dask-jobqueue: `pip install ".[cluster]" dask-jobqueue`.

    python -m examples.cluster.slurm SCENE.toml -o /scratch/me/run.h5 --jobs 10 --cores 32 --walltime 04:00:00
    python -m examples.cluster.slurm SCENE.toml --script            prints the job script and submits nothing

Run it on a login node, or as a small job of its own. The folder of the trajectory must be one that all nodes have
mounted. What is left at the end of `--walltime`, or at Ctrl-C, goes on with `--resume`.
"""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

# Of each worker, which pauses at 80 % of it and is ended at 95 %.
GIBIBYTES = 2


def cluster_of(arguments: argparse.Namespace) -> Any:
    """The cluster, without a job yet; a worker of one thread for each core."""
    try:
        from dask_jobqueue import SLURMCluster
    except ModuleNotFoundError:
        sys.exit("this example needs dask-jobqueue: pip install dask-jobqueue")

    return SLURMCluster(
        queue=arguments.partition,
        account=arguments.account,
        cores=arguments.cores,
        processes=arguments.cores,
        memory=arguments.memory or f"{GIBIBYTES * arguments.cores}GiB",
        walltime=arguments.walltime,
        interface=arguments.interface,
        scheduler_options={"dashboard_address": ":0"},
    )


def main() -> None:
    """Submit the jobs, and run the scene on them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("run.h5"), help="the trajectory, on shared storage")
    parser.add_argument("--jobs", type=int, default=2, help="jobs, of one node each")
    parser.add_argument("--cores", type=int, default=16, help="cores of a job")
    parser.add_argument("--memory", help=f"memory of a job, such as 64GiB; by default {GIBIBYTES} GiB for each core")
    parser.add_argument("--walltime", default="01:00:00", help="of a job")
    parser.add_argument("--partition")
    parser.add_argument("--account")
    parser.add_argument("--interface", help="network interface, such as ib0")
    parser.add_argument("--resume", action="store_true", help="go on with a run that was stopped")
    parser.add_argument("--script", action="store_true", help="print the job script alone")
    arguments = parser.parse_args()
    with cluster_of(arguments) as cluster:
        if arguments.script:
            print(cluster.job_script())
            return
        cluster.scale(jobs=arguments.jobs)
        command = [sys.executable, "-m", "swarm", "run", str(arguments.scene), "-o", str(arguments.output)]
        # One shard for each core that is asked for, also of jobs that have not begun when the run does.
        command += ["--cluster", cluster.scheduler_address, "--shards", str(arguments.jobs * arguments.cores)]
        sys.exit(subprocess.run([*command, *["--resume"] * arguments.resume], check=False).returncode)


if __name__ == "__main__":
    main()
