"""Every check returns its value in the final type, or names the argument, what came and what is expected."""

import math

import numpy as np
import pytest

from swarm import SceneError, SwarmError
from swarm.common import checks

MASKED = "points must be an array without a mask, got a masked one; remove or fill the masked entries"


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2.0), np.int64(2), np.array(2.0)])
def test_numbers_become_floats(value):
    for checked in (checks.number("n", value), checks.positive("n", value), checks.at_least("n", value, 2.0)):
        assert type(checked) is float
        assert checked == 2.0


@pytest.mark.parametrize(
    "value",
    [
        "2",
        b"2",
        None,
        True,
        [2.0],
        {},
        1j,
        np.complex128(1.0),
        np.ma.masked,
        10**400,
        object(),
        math.nan,
        math.inf,
        -math.inf,
    ],
)
@pytest.mark.parametrize(
    "check", [checks.number, checks.positive, lambda name, value: checks.at_least(name, value, 0.0)]
)
def test_what_is_not_a_finite_number(check, value):
    with pytest.raises(SceneError, match=r"^mass must be a finite number.*, got "):
        check("mass", value)


@pytest.mark.parametrize(
    ("check", "sentence"),
    [
        (lambda: checks.positive("radius", 0), "radius must be above 0, got 0"),
        (lambda: checks.positive("radius", -1e-9), "radius must be above 0, got -1e-09"),
        (lambda: checks.at_least("exponent", 0.5, 1.0), "exponent must be 1 or more, got 0.5"),
        (lambda: checks.length("radius", 1e101), "radius must be between 1e-100 and 1e+100 m, got 1e+101"),
        (lambda: checks.array("points", "abc"), "points must be an array of numbers, got str"),
        (lambda: checks.array("points", [1.0, 2j]), "points must be an array of numbers, got list"),
        (lambda: checks.array("points", np.array([True])), "points must be an array of numbers, got bool"),
        (lambda: checks.array("points", [[1.0], [np.ma.masked]][1]), MASKED),
        (lambda: checks.array("points", [np.ma.array([1.0, 2.0], mask=[0, 1])]), MASKED),
        (lambda: checks.array("points", [10**400]), "points must be an array of numbers, got list"),
        (lambda: checks.magnitude("speed", 1e300), "speed must be at most 1e+100, got 1e+300"),
        (lambda: checks.count("n", 0), "n must be 1 or more, got 0"),
        (lambda: checks.count("n", 2.5), "n must be a whole number, 1 or more, got 2.5"),
        (lambda: checks.count("n", True), "n must be a whole number, 1 or more, got True"),
        (lambda: checks.count("seed", -1, least=0), "seed must be 0 or more, got -1"),
        (lambda: checks.seed("seed", -1), "seed must be 0 or more, got -1"),
        (lambda: checks.seed("seed", 1.0), "seed must be a whole number, 0 or more, got 1.0"),
        (lambda: checks.seed("seed", 2**64), "seed must be below 2**64, got 1.84467e+19"),
        (lambda: checks.seed("seed", 10**5000), "seed must be below 2**64, got 1e+300"),
        (lambda: checks.vector("center", (1, 2)), "center must be three numbers, got 2: (1, 2)"),
        (lambda: checks.vector("center", "xyz"), "center must be three numbers, got 'xyz'"),
        (lambda: checks.vector("center", 5.0), "center must be three numbers, got 5.0"),
        (lambda: checks.vector("center", (1, math.nan, 3)), "center[1] must be a finite number, got nan"),
        (
            lambda: checks.one_of("side", "inner", ["inside", "outside"]),
            "side must be one of 'inside' and 'outside', got 'inner'; did you mean 'inside'?",
        ),
        (lambda: checks.one_of("side", 3, ["inside", "outside"]), "side must be one of 'inside' and 'outside', got 3"),
    ],
)
def test_sentences(check, sentence):
    with pytest.raises(SceneError) as caught:
        check()
    assert str(caught.value) == sentence


def test_a_bad_argument_is_a_swarm_error_and_a_value_error():
    with pytest.raises(SwarmError):
        checks.positive("radius", 0)
    with pytest.raises(ValueError, match="radius"):
        checks.positive("radius", 0)


def test_values_pass():
    assert checks.vector("v", np.array([1, 2, 3])) == (1.0, 2.0, 3.0)
    assert checks.one_of("side", "inside", {"inside": 1.0}) == "inside"
    assert checks.count("n", np.int32(3)) == 3
    assert checks.count("seed", 0, least=0) == 0
    assert checks.seed("seed", np.uint64(2**64 - 1)) == 2**64 - 1


@pytest.mark.parametrize(
    ("names", "text"), [([], ""), (["a"], "'a'"), (["a", "b"], "'a' and 'b'"), ("abc", "'a', 'b' and 'c'")]
)
def test_listed(names, text):
    assert checks.listed(names) == text


def test_closest():
    assert checks.closest("raduis", ["radius", "center"]) == "; did you mean 'radius'?"
    assert checks.closest("zzz", ["radius", "center"]) == ""
    # A word of other programs is more than a similar one, and words that share a few letters are not similar.
    assert checks.closest("COR", ["center", "restitution"]) == "; did you mean 'restitution'?"
    assert checks.closest("t_end", ["threads", "until"]) == "; did you mean 'until'?"
    assert checks.closest("t_end", ["threads"]) == checks.closest("material", ["inertia"]) == ""
    assert checks.closest("coefficient_of_restitution", ["rotation", "restitution"]) == "; did you mean 'restitution'?"


@pytest.mark.parametrize(
    ("text", "seconds"), [("90", 90.0), ("2h", 7200.0), ("1h30m", 5400.0), ("1.5 min", 90.0), ("1d 2s", 86402.0)]
)
def test_durations(text, seconds):
    assert checks.duration("t", text) == seconds


@pytest.mark.parametrize("text", ["", "h", "2 weeks", "-1h", "1h-", "0s", "nan"])
def test_bad_durations_are_named(text):
    with pytest.raises(SceneError, match="t must be"):
        checks.duration("t", text)
