"""Golden runs: the last bits of short runs of every method in every kind of surface, as they were before."""

import importlib.util
import json
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


def test_every_run_is_known():
    assert set(KNOWN) == set(golden.runs())


@pytest.mark.parametrize("name", [name if name in SOON else rarely(name) for name in KNOWN])
def test_the_bits_are_as_they_were(name):
    assert golden.digest(name) == KNOWN[name]
