"""Laws that the compiler refuses: a sentence with the law and its line, in place of an error of the compiler."""

import numpy as np
import pytest

import swarm
from swarm.kernel.vector import dot


class TwoKinds(swarm.WallLaw):
    """It returns a velocity or a Leave."""

    def leave(self, v, n, u, random, mass):
        b = dot(v - u, n)
        if b < -0.5:
            return swarm.Leave(v - 2.0 * b * n)
        return v - 2.0 * b * n


class OfArrays(swarm.WallLaw):
    """It uses a function of arrays."""

    def leave(self, v, n, u, random, mass):
        return v - 2.0 * np.dot(v - u, n) * n


LAST_LINE = OfArrays.leave.__code__.co_firstlineno + 1


@pytest.mark.parametrize(
    ("law", "why"),
    [(TwoKinds, "values of several kinds"), (OfArrays, rf"by line {LAST_LINE} of .*test_user_code\.py")],
)
def test_a_law_that_cannot_be_compiled_is_named(law, why):
    scene = swarm.Scene([swarm.Sphere(1.0, laws=[law()])])
    sentence = rf"surfaces\[0\]\.laws\[0\] \({law.__name__}\) cannot be compiled.*{why}; compiled code may use numbers"
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.simulate(scene, swarm.fill(scene, 3, speed=1.0, seed=1), until=1.0, compile="always")


def test_the_same_law_runs_in_plain_python():
    scene = swarm.Scene([swarm.Sphere(1.0, laws=[TwoKinds()])])
    result = swarm.simulate(scene, swarm.fill(scene, 3, speed=1.0, seed=1), until=1.0, compile="never")
    assert result.observables["energy_error"].max() < 1e-14


class Subtracts(swarm.WallLaw):
    """It takes the velocity of the wall for a number."""

    def leave(self, v, n, u, random, mass):
        return random.diffuse(n, u, 1)


def test_a_law_that_raises_is_a_sentence_with_its_line():
    line = Subtracts.leave.__code__.co_firstlineno + 1
    sentence = rf"Subtracts\.leave raised TypeError: .*, line {line} of .*test_user_code\.py; vectors have"
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.Sphere(1.0, laws=[Subtracts()])
