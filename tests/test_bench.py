"""The benchmark runs, so that it does not rot; nothing here is timed."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.physics


def test_throughput_quick():
    root = Path(__file__).parents[1]
    done = subprocess.run(
        [sys.executable, "-m", "bench", "throughput", "--quick"], cwd=root, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    for row in (
        "Impact, sphere ",
        "two threads over one",
        "Penalty, sphere, dt=0.025",
        "Uzawa, State I",
        "memory",
        "first frame",
    ):
        assert row in done.stdout
