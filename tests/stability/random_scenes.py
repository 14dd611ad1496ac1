"""What holds of any scene and method: a run ends with its invariants, or with a sentence that says why not."""

import math

import numpy as np

import swarm

# Particles and time: some tens of impacts each.
NUMBER, UNTIL = 8, 4.0


def outcome(make):
    """`make()` is (scene, particles, method): the error's sentence, or "" and the invariants of the method."""
    try:
        scene, particles, method = make()
        result = swarm.simulate(scene, particles, method, until=UNTIL, every=UNTIL / 4.0)
    except swarm.SwarmError as error:
        sentence = str(error)
        assert len(sentence.split()) > 5, sentence
        return sentence
    assert np.isfinite(result.particles.position).all()
    assert np.isfinite(result.particles.velocity).all()
    assert result.observables["time"][-1] == UNTIL
    holds(scene, particles, method, result.observables)
    return ""


def holds(scene, particles, method, seen):
    """The bars of each method."""
    depth, reach = seen["max_penetration"].max(), scene.extent()
    if isinstance(method, swarm.Impact):
        assert seen["energy_error"].max() <= 1e-12
        assert depth <= 64.0 * np.spacing(reach)
    elif isinstance(method, swarm.AugmentedLagrangian):
        # Phi1 <= sqrt(2 tolerance/alpha), of a gap with any slope
        assert seen["energy_error"].max() <= 1e-9
        assert depth <= 1e-9 * reach
    elif isinstance(method, swarm.Penalty):
        assert seen["energy_error"].max() <= 1e-10
    else:
        # Baselines promise nothing, but a number.
        assert math.isfinite(seen["energy_error"].max())
