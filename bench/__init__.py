"""Benchmarks: `python -m bench throughput`. Warm-up is excluded; minimum and median of repeats are reported."""
