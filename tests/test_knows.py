"""What each engine supports is declared once: engines are distinct, and each sentence is complete."""

import re
import string
from pathlib import Path

import pytest

import swarm
from swarm.run.options import RunOptions
from swarm.run.preflight import knows

CAVITY = swarm.Scene([swarm.Sphere(0.5)])
PISTON = swarm.Scene([swarm.Sphere(0.5), swarm.Sphere(0.1, side="outside", mass=1.0)])
POINT = swarm.Particles([0.3, 0.0, 0.0], [1.0, 0.0, 0.0])
BALL = swarm.Particles([0.3, 0.0, 0.0], [1.0, 0.0, 0.0], radius=0.01)
IMPACT, PENALTY, PAPER = swarm.Impact(), swarm.Penalty(1e-3, 1e4), swarm.AugmentedLagrangian(1e-3, 1e4)


def asked(scene, particles, method, **options):
    return knows.Asked(scene, particles, method, RunOptions(until=1.0, **options))


@pytest.mark.parametrize(
    ("scene", "particles", "method", "engine"),
    [
        (CAVITY, POINT, IMPACT, knows.POINTS),
        (CAVITY, POINT, swarm.Impact(contact_step=1e-3), knows.CHORDS),
        (PISTON, POINT, IMPACT, knows.MASSIVE),
        (CAVITY, POINT, PENALTY, knows.SOFT),
        (CAVITY, POINT, PAPER, knows.PAPER),
        (CAVITY, POINT, swarm.Verlet(1e-3, 1e4), knows.BASELINE),
        (CAVITY, BALL, IMPACT, knows.BALLS),
        (PISTON, BALL, IMPACT, knows.HEAVY),
        (CAVITY, BALL, PENALTY, knows.GRAINS),
        (CAVITY, BALL, PAPER, knows.OTHER_BALLS),
        (CAVITY, None, IMPACT, knows.POINTS),
    ],
)
def test_a_run_has_one_engine(scene, particles, method, engine):
    assert knows.engine_of(asked(scene, particles, method)) == engine


REFUSALS = [
    (capability.name, engines, one) for capability in knows.CAPABILITIES for engines, one in capability.refused.items()
]


def test_each_sentence_names_only_fields_that_runs_have():
    fields = {"i", "k", "got", "count", "name", "value", "cut", "kind", "method", "whole", "step"}
    for _capability, engines, one in REFUSALS:
        named = {name for _text, name, _spec, _how in string.Formatter().parse(one.sentence()) if name}
        assert named <= fields, one
        assert set(engines) <= {*knows.ENGINES, knows.OTHER_POINTS, knows.OTHER_BALLS, knows.OTHER_BODIES}


def test_each_sentence_says_what_is_not_supported_what_came_and_what_to_use_instead():
    """What came stands before the reason; the remedy is an instruction, and the sentence is one line."""
    verbs = ("use", "give", "leave", "make", "move", "run", "heat")
    for _capability, _engines, one in REFUSALS:
        assert re.fullmatch(r"[^;]+ (must|need) [^;]+, got [^;]+", one.problem), one.problem
        assert one.remedy.split()[0] in verbs, one.remedy
        assert not re.search(r"[;.\n]$|\bgot\b", one.remedy), one.remedy
        assert one.sentence() == f"{one.problem}; {one.remedy}"


METHODS = {
    "Impact": (knows.POINTS, knows.BALLS, knows.BODIES),
    "Penalty": (knows.SOFT, knows.GRAINS, knows.SOFT_BODIES),
}


def offered(engine, remedy):
    """The engines that a remedy names."""
    kind = ("points", "balls", "bodies").index(engine.split()[0])
    if re.search("use particles(?! with a)|without a radius|radius out", remedy):
        kind = 0
    elif re.search("give the particles a radius|particles with a radius", remedy):
        kind = 1
    named = [METHODS[name][kind] for name in METHODS if re.search(rf"\b{name}\b", remedy)]
    if not named and re.search("instead of a mass|contact_step out|use particles", remedy):
        named = [METHODS["Impact"][kind]]
    return [one for one in named if one != engine]


def test_what_a_remedy_names_supports_the_capability():
    for capability, engines, one in REFUSALS:
        for engine in engines:
            others = offered(engine, one.remedy)
            assert not others or None in [knows.sentence(other, capability) for other in others], (engine, one)


def test_an_engine_has_one_sentence_for_a_capability():
    for capability in knows.CAPABILITIES:
        engines = [engine for group in capability.refused for engine in group]
        assert len(engines) == len(set(engines)), capability.name


def test_names_of_capabilities_differ():
    names = [capability.name for capability in knows.CAPABILITIES]
    assert len(names) == len(set(names))


def test_the_first_sentence_is_raised_and_what_is_supported_is_not():
    warm = swarm.Scene([swarm.Sphere(0.5, temperature=300.0)])
    knows.require_supported(asked(warm, POINT, IMPACT))
    with pytest.raises(
        swarm.SceneError, match=r"^surfaces\[0\].temperature must be None with Verlet, got 300; use Impact$"
    ):
        knows.require_supported(asked(warm, POINT, swarm.Verlet(1e-3, 1e3)))
    knows.require_supported(asked(warm, BALL, PENALTY))
    heavy = swarm.Scene([swarm.Sphere(0.5, mass=2.0)])
    knows.require_supported(asked(heavy, BALL, PENALTY))
    with pytest.raises(swarm.SceneError, match=r"^surfaces\[0\].mass must be None with Penalty, got 2; use Impact$"):
        knows.require_supported(asked(heavy, POINT, PENALTY))
    turning = swarm.Scene([swarm.Sphere(0.5, inertia=2.0, motion=swarm.Rotation((0.0, 0.0, 1.0), 0.0))])
    with pytest.raises(swarm.SceneError, match=r"^surfaces\[0\].inertia .* that have a radius and Penalty"):
        knows.require_supported(asked(turning, BALL, PENALTY))


def test_the_guide_shows_the_table():
    guide = Path(__file__).parents[1] / "examples" / "guide" / "limits.md"
    assert "\n".join(knows.markdown()) in guide.read_text(), "run: python tests/reference/tables.py"


def test_what_is_a_kind_of_another_capability_is_refused_with_it():
    assert knows.sentence(knows.BODIES, "rotation") == knows.sentence(knows.BODIES, "motion")
    assert knows.sentence(knows.POINTS, "contact duration") == knows.sentence(knows.POINTS, "law of pairs")
    names = {one.name for one in knows.CAPABILITIES}
    assert {one.within for one in knows.CAPABILITIES} <= {*names, ""}
