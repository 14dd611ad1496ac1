"""Runs on clusters: this machine, SLURM, a gateway of Dask in a cloud."""
