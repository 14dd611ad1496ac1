"""Golden runs: the last bits of short runs of every method in every kind of surface, as they were before."""

import ast
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import rarely

_SPEC = importlib.util.spec_from_file_location("golden", Path(__file__).parent / "reference" / "golden.py")
golden = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(golden)

KNOWN = json.loads(golden.FILE.read_text())
# Seconds each in plain Python, of which the long ring has the rest.
SOON = [
    name for name in KNOWN if "falling" not in name and (name.startswith("impact e=1") or name.endswith(", sphere"))
]


ROTATED = ("impact e=1, rotated ellipsoid", "impact e=1, box", "impact e=1, bowl")
DIGESTS = "import golden; print([golden.digest(name) for name in {names}])"


@pytest.mark.physics
@pytest.mark.parametrize("processor", ["Haswell", "Sandybridge"])
def test_another_processors_blas_changes_no_bit(processor):
    """NumPy's matrix product rounds as the processor likes; OpenBLAS can be told of which one it runs on."""
    folder = Path(golden.__file__).parent
    done = subprocess.run(
        [sys.executable, "-c", DIGESTS.format(names=ROTATED)],
        env={**os.environ, "OPENBLAS_CORETYPE": processor}, cwd=folder, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ast.literal_eval(done.stdout) == [KNOWN[name] for name in ROTATED]


def test_every_run_is_known():
    assert set(KNOWN) == set(golden.runs())


@pytest.mark.parametrize("name", [name if name in SOON else rarely(name) for name in KNOWN])
def test_the_bits_are_as_they_were(name):
    assert golden.digest(name) == KNOWN[name]
