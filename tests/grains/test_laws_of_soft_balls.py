"""Laws of walls with soft balls: they act at the end of a contact, as those of `Impact` do at an impact."""

import numpy as np
import pytest
from cut_short import in_sessions
from energy_books import unbooked
from grains_runs import ran
from same_bits import require_same

import swarm
from swarm.grains.grains_run import GrainsRun
from swarm.kernel.jit import select
from swarm.kernel.vector import dot

SOFT = swarm.Penalty(1e-3, 4e4)
LAWS = {
    "hot": {"temperature": 0.5, "accommodation": 0.6},
    "hottest": {"temperature": 2.0},
    "Lambert": {"laws": [swarm.Lambert(0.7)]},
    "CercignaniLampis": {"laws": [swarm.CercignaniLampis(0.5, 0.4, 0.6)]},
    "Absorb": {"laws": [swarm.Absorb(0.5)]},
}
LOSSY = {"restitution": 0.9, "friction": 0.2}


def ball(velocity=(0.6, 0.0, -1.0), spin=None):
    return swarm.Particles((0.0, 0.0, 0.2), velocity, radius=0.1, spin=spin)


def went(scene, start, method=SOFT, until=0.5, **options):
    return ran(scene, start, method, until, **{"seed": 4, "every": 0.125, **options})


def balanced(seen):
    return unbooked(seen) / (seen["kinetic_energy"].max() + np.ptp(seen["potential_energy"]))


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", range(3))
def test_a_contact_ends_as_a_rigid_impact(law, seed):
    scene = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0, **LAWS[law])], gravity=None)
    rigid, soft = (went(scene, ball(), method, seed=seed) for method in (swarm.Impact(), SOFT))
    assert soft.particles.velocity == pytest.approx(rigid.particles.velocity, abs=1e-9)
    for name in ("dissipated_energy", "wall_heat", "impacts", "impulse"):
        assert soft.observables[name][-1] == pytest.approx(rigid.observables[name][-1], abs=1e-9)
    assert balanced(soft.observables) < 1e-13


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("moves", [False, True])
def test_what_walls_give_is_booked_beside_losses(law, moves):
    motion = swarm.Oscillation((0.05, 0.03, 0.04), 1.0) if moves else None
    box = swarm.Box((0.5, 0.5, 0.5), motion=motion, **LOSSY, **LAWS[law])
    round_one = swarm.Sphere(0.7, **LAWS[law])
    scene = swarm.Scene([box, round_one], gravity=(0.3, -0.2, -1.0), pairs=swarm.Pairs(**LOSSY))
    start = swarm.fill(scene, 6, speed=1.0, mass=2.0, radius=0.1, seed=3)
    seen = went(scene, start, swarm.Penalty(2.5e-3, 8e3), until=1.0).observables
    assert seen["impacts"][-1] > 5
    assert balanced(seen) < 1e-12
    assert seen["energy_error"].max() < 1e-12


class Slower(swarm.WallLaw):
    """Sends a ball off along the normal, with 0.4 m/s and half of the speed with which it came."""

    def leave(self, v, n, u, random, mass):
        return u + (0.4 - 0.5 * dot(v - u, n)) * n


def loop(steps, h=1e-3, alpha=4e4):
    """A ball of 1 kg between two plates, in plain floats: its place, velocity, and the heat of the lower plate."""
    z, v, heat = 0.3, -1.0, 0.0
    for _k in range(steps):
        side = 1.0 if z < 0.3 else -1.0
        before, end, push = 0.1 - z if z < 0.3 else z - 0.5, z + h * v, 0.0
        for _sweep in range(60):
            after = 0.1 - end if z < 0.3 else end - 0.5
            stored = [0.5 * alpha * max(gap, 0.0) ** 2 for gap in (before, after)]
            push = side * (stored[1] - stored[0]) / (after - before) if after != before else side * alpha * after
            end = z + h * (v + 0.5 * h * push)
        z, v = end, v + h * push
        if side > 0.0 and before > 0.0 and after <= 0.0:
            heat += 0.5 * ((0.4 + 0.5 * v) ** 2 - v**2)
            v = 0.4 + 0.5 * v
    return z, v, heat


def test_many_contacts_are_those_of_a_loop_in_floats():
    plates = [swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[Slower()]), swarm.Plane((0.0, 0.0, 1.0), 0.6)]
    scene = swarm.Scene(plates, gravity=None)
    result = went(scene, swarm.Particles((0.0, 0.0, 0.3), (0.0, 0.0, -1.0), radius=0.1), until=4.0)
    z, v, heat = loop(4000)
    assert result.observables["impacts"][-1] > 6
    assert result.particles.position[2, 0] == pytest.approx(z, abs=1e-9)
    assert result.particles.velocity[2, 0] == pytest.approx(v, abs=1e-9)
    assert result.observables["wall_heat"][-1].sum() == pytest.approx(heat, abs=1e-10)


def test_the_spin_is_kept_and_what_is_absorbed_stays_where_it_was():
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Absorb(1.0)])
    result = went(swarm.Scene([floor], gravity=(0.0, 0.0, -1.0)), ball(spin=(1.0, 2.0, 3.0)), until=1.0)
    # It is in contact for pi/sqrt(alpha/m) = 0.016 s, from 0.1 m up.
    assert result.absorbed_time[0] == pytest.approx(0.0954 + 0.0157, abs=2e-3)
    assert result.particles.position[2, 0] == pytest.approx(0.1, abs=2e-3)
    assert result.particles.spin[:, 0].tolist() == [1.0, 2.0, 3.0]
    assert result.observables["absorbed"][-1].tolist() == [1]
    assert result.observables["energy_error"].max() < 1e-13


def test_what_an_absorbed_ball_has_stored_with_others_is_lost():
    # The lower one leaves the floor while the upper one presses on it.
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, laws=[swarm.Absorb(1.0)])
    start = swarm.Particles(
        np.array([(0.0, 0.0), (0.0, 0.0), (0.12, 0.325)]), np.array([(0.0, 0.0), (0.0, 0.0), (-1.0, -1.0)]), radius=0.1
    )
    seen = went(swarm.Scene([floor], gravity=None), start, until=0.5).observables
    assert seen["absorbed"][-1, 0] >= 1
    assert seen["energy_error"].max() < 1e-13


def test_a_group_of_a_mesh_has_a_law_of_its_own():
    corners = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
    quads = [(0, 2, 6, 4), (1, 5, 7, 3), (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)]
    triangles = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    group, law = [0, 0, 1, 1] + [2] * 8, {"temperature": 0.5}

    def shot(velocity, **given):
        mesh = swarm.Mesh(corners, triangles, "inside", **given)
        start = swarm.Particles((0.0, 0.1, 0.5), velocity, radius=0.1)
        return went(swarm.Scene([mesh], gravity=None), start, until=0.5, every=0.5, seed=7)

    grouped = {"group": group, "names": ("floor", "lid", "sides"), "groups": {"floor": law}}
    down = shot((0.0, 0.0, -1.0), **grouped)
    assert np.array_equal(down.particles.velocity, shot((0.0, 0.0, -1.0), **law).particles.velocity)
    assert down.observables["wall_heat"][-1, 0] != 0.0
    grouped["groups"]["sides"] = {"laws": [swarm.Absorb(1.0)]}
    assert shot((1.0, 0.0, 0.0), **grouped).observables["absorbed"][-1].tolist() == [1]
    assert shot((0.0, 0.0, 1.0), **grouped).particles.velocity[:, 0] == pytest.approx((0.0, 0.0, -1.0), abs=1e-9)


def test_a_velocity_into_the_wall_ends_the_run_with_a_sentence():
    class Through(swarm.WallLaw):
        limit: float

        def leave(self, v, n, u, random, mass):
            return select(dot(v, v) > self.limit, v, v - 2.0 * dot(v - u, n) * n)

    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Through(1e4)])], gravity=None)
    start = swarm.Particles((0.0, 0.0, 0.0), (0.0, 0.0, 200.0), radius=0.1)
    with pytest.raises(swarm.RunError, match=r"failed at particle 0: one of the laws .* left surfaces\[0\] \(Sphere\)"):
        went(scene, start, swarm.Penalty(1e-5, 4e8), until=0.5)


def test_a_run_in_many_sessions_has_the_same_bits(tmp_path, monkeypatch):
    box = swarm.Box((0.5, 0.4, 0.6), temperature=0.5, accommodation=0.5, laws=[swarm.Absorb(0.3)], **LOSSY)
    scene = swarm.Scene([box], gravity=None, pairs=swarm.Pairs(**LOSSY))
    start = swarm.fill(scene, 6, speed=1.0, mass=2.0, radius=0.08, seed=3)
    method = swarm.Penalty(2e-3, 1e4)
    whole = went(scene, start, method, until=1.0, every=0.25)

    def go():
        path = tmp_path / "run.h5"
        return went(scene, start, method, until=1.0, every=0.25, trajectory=path, resume=True, checkpoint=1e3)

    parts, ended = in_sessions(monkeypatch, GrainsRun, 90, go)
    assert ended > 3
    assert 0 < whole.observables["absorbed"][-1, 0] < 6
    require_same(parts, whole)
