"""Fields whose checks their annotations declare."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Annotated

import pytest

import swarm
from swarm.common import validated
from swarm.common.validated import Count, Length, Magnitude, Part, Validated
from swarm.serialization import tables

DESCRIBED = [
    getattr(swarm, name)
    for name in swarm.__all__
    if isinstance(getattr(swarm, name), type) and issubclass(getattr(swarm, name), Validated)
]


def doubled(name, value):
    return f"{name}{2 * value}"


@dataclass(frozen=True)
class Base(Validated):
    size: Length
    text: Annotated[str, doubled] = "a"


@dataclass(frozen=True)
class Derived(Base):
    part: Part | None = None
    count: Count = 3
    unchecked: float = math.nan

    def __post_init__(self):
        super().__post_init__()
        if self.part == self.size:
            raise swarm.SceneError("part must differ from size")


def test_a_field_gets_the_value_that_its_check_returns():
    made = Derived(2, part=1)
    assert (made.size, made.text, made.part, made.count) == (2.0, "textaa", 1.0, 3)
    assert isinstance(made.size, float)


def test_none_stands_where_the_type_allows_it_alone():
    assert Derived(2.0).part is None
    with pytest.raises(swarm.SceneError, match=r"count must be a whole number, 1 or more, got None"):
        Derived(2.0, count=None)


def test_fields_of_a_base_are_checked_first_and_what_concerns_several_last():
    with pytest.raises(swarm.SceneError, match="size must be above 0"):
        Derived(-1.0, part=2.0)
    with pytest.raises(swarm.SceneError, match="part must be from 0 to 1"):
        Derived(2.0, part=2.0)
    with pytest.raises(swarm.SceneError, match="part must differ from size"):
        Derived(1.0, part=1.0)


def test_replaced_fields_are_checked_as_well():
    with pytest.raises(swarm.SceneError, match="size must be above 0"):
        dataclasses.replace(Derived(1.0), size=0.0)


@pytest.mark.parametrize(("kind", "expected"), [(Length, float), (Magnitude | None, float | None), (str, str)])
def test_signatures_show_types_without_checks(kind, expected):
    assert validated.bare(kind) == expected


@pytest.mark.parametrize("kind", DESCRIBED, ids=lambda kind: kind.__name__)
def test_help_shows_no_check(kind):
    import inspect

    assert "Annotated" not in str(inspect.signature(kind))


@pytest.mark.parametrize("value", ["x", True, None, math.nan, -1.0, math.inf, [1.0]])
@pytest.mark.parametrize(
    ("kind", "name", "others"),
    [
        (swarm.Sphere, "radius", {}), (swarm.Torus, "minor_radius", {"major_radius": 2.0}),
        (swarm.Capsule, "length", {"radius": 1.0}), (swarm.Sphere, "restitution", {"radius": 1.0}),
        (swarm.Penalty, "dt", {"penalty": 1.0}), (swarm.Impact, "sliding_tolerance", {}),
        (swarm.Oscillation, "frequency", {"amplitude": (0.0, 0.0, 1.0)}), (swarm.Pairs, "friction", {}),
        (swarm.Slab, "half_width", {"normal": (0.0, 0.0, 1.0)}),
    ],
    ids=lambda one: one if isinstance(one, str) else "",
)  # fmt: skip
def test_a_bad_value_is_refused_by_the_name_of_its_field(kind, name, others, value):
    with pytest.raises(swarm.SceneError, match=rf"^{name} must be .*, got "):
        kind(**others, **{name: value})


def test_a_table_says_which_type_a_missing_key_has():
    with pytest.raises(swarm.SceneError, match=r"surface\[0\].radius: expected a number, got nothing; add radius"):
        tables.surface_of({"kind": "sphere"}, "surface[0]")
