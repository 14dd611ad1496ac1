"""The catalog of observables: the guide shows it, and each entry says what files and tables need."""

from pathlib import Path

import swarm
from swarm.common import catalog

GUIDE = Path(__file__).parents[1] / "examples" / "guide" / "results.md"


def test_the_guide_shows_the_catalog():
    assert "\n".join(catalog.markdown()) in GUIDE.read_text(), "run: python tests/reference/tables.py"


def test_the_help_of_a_result_names_every_observable():
    text = swarm.Result.__doc__
    assert [name for name in catalog.OBSERVABLES if f'"{name}"' not in text] == []


def test_units_are_si():
    """Products of powers of units, as xarray and pint read them."""
    units = {"1", "kg", "m", "s", "rad", "N", "J", "Pa"}
    for name, one in catalog.OBSERVABLES.items():
        parts = one.unit.split(" ")
        assert {part.rstrip("-0123456789") or "1" for part in parts} <= units, name


def test_nan_is_a_value_of_few():
    names = (*catalog.OBSERVABLES, "of_a_user")
    assert [name for name in names if catalog.may_be_nan(name)] == ["pressure", "collision_rate"]
