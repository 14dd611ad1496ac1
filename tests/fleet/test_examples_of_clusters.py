"""examples/cluster: what can be run without SLURM and without a cloud."""

import importlib.util
from pathlib import Path

import pytest
from children import python

ROOT = Path(__file__).parents[2]


def printed(name, *words):
    done = python("-m", f"examples.cluster.{name}", *words, cwd=ROOT, timeout=100)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", ["local", "slurm", "gateway"])
def test_help_needs_no_package_of_a_cluster(name):
    assert "usage:" in printed(name, "--help")


@pytest.mark.skipif(importlib.util.find_spec("dask_jobqueue") is None, reason="dask-jobqueue is not installed")
def test_the_job_of_slurm_starts_one_worker_for_each_core():
    script = printed(
        "slurm", "scene.toml", "--script", "--cores", "12", "--partition", "short", "--walltime", "00:20:00"
    )
    for line in ("#SBATCH -p short", "#SBATCH --cpus-per-task=12", "#SBATCH -t 00:20:00"):
        assert line in script.splitlines()
    assert "--nthreads 1 " in script
    assert "--nworkers 12 " in script


@pytest.mark.skipif(importlib.util.find_spec("dask_jobqueue") is None, reason="dask-jobqueue is not installed")
@pytest.mark.parametrize(("words", "job", "worker"), [([], 32, "2.00GiB"), (["--memory", "64GiB"], 64, "4.00GiB")])
def test_the_memory_of_a_job_is_enough_for_its_workers(words, job, worker):
    """16 cores by default, each with a worker: 2 GiB for each, and what is asked for where it is."""
    script = printed("slurm", "scene.toml", "--script", *words)
    assert f"#SBATCH --mem={job}G" in script.splitlines()
    assert f"--memory-limit {worker} " in script


@pytest.mark.physics
def test_workers_of_this_machine_have_the_same_bits():
    assert printed("local").count("the same bits") == 3
