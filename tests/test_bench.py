"""The benchmark runs, so that it does not rot; nothing here is timed."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.physics


def report(name):
    """What `python -m bench NAME --quick` prints."""
    root = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-m", "bench", name, "--quick"], cwd=root, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_throughput_quick():
    told = report("throughput")
    for row in (
        "Impact, sphere ",
        "two threads over one",
        "Penalty, sphere, dt=0.025",
        "Uzawa, State I",
        "memory",
        "first frame",
    ):
        assert row in told


def test_scenes_quick():
    told = report("scenes")
    assert "capped cylinder" in told
    assert "formula of the ellipsoid" in told
