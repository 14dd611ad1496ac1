"""Random scenes whose walls move: contact that lasts ends, with the energy and the walls kept, wherever frames end."""

import numpy as np
import pytest

import swarm
from swarm.lanes import meet, slide

# Rounds in contact of three particles; those of scenes here take some tens each.
MANY = 1500
UNTIL = 0.4
METHOD = swarm.Impact(sliding_tolerance=1e-4)
PULLS = None, (0.0, 0.0, -9.81), (-5.0, -6.0, -9.81)


@pytest.fixture(autouse=True)
def bounded(monkeypatch):
    """A run that goes round and round between flight, walls and sliding fails, and does not hang."""
    rounds = []

    def counted(function):
        def called(*arguments):
            rounds.append(function.__name__)
            assert len(rounds) <= MANY
            return function(*arguments)

        return called

    monkeypatch.setattr(meet, "_decide", counted(meet._decide))
    monkeypatch.setattr(meet, "_step", counted(meet._step))
    monkeypatch.setattr(slide, "_retire", counted(slide._retire))
    return rounds


def motion(random, can_turn):
    """An oscillation, a translation or a rotation, along and about axes or not."""
    some = random.normal(size=3) * random.integers(0, 2, 3)
    oscillation = swarm.Oscillation(tuple(0.04 * some), float(random.choice([0.5, 2.0, 5.0])), random.choice([0.0, 1.0]))
    axis = [(0, 0, 1), (0, 1, 0), (1, 1, 0.5)][random.integers(3)]
    rotation = swarm.Rotation(axis, float(random.choice([-2.0, 0.05, 8.0])), (0.0, 0.0, 0.0))
    kind = random.integers(4)
    if kind == 0:
        return swarm.Translation(tuple(0.1 * some))
    return rotation if kind == 1 and can_turn else oscillation


def scene_of(seed):
    """A cavity of one of four kinds, in which a ball may be, and three particles."""
    random = np.random.default_rng(seed)
    laws = {"friction": float(random.choice([0.0, 0.3, 0.8])), "restitution": float(random.choice([1.0, 0.9, 0.5, 0.0]))}
    kind, widths = seed % 4, tuple(random.choice([0.3, 0.5, 0.8], 3).tolist())
    moves = motion(random, kind != 2)
    if kind == 0:
        walls = [swarm.Box(widths, motion=moves, **laws)]
    elif kind == 1:
        walls = [swarm.Cylinder(widths[0], length=2.0 * widths[1], motion=moves, **laws)]
    elif kind == 2:
        normals = np.vstack([np.eye(3), -np.eye(3)])
        walls = [
            swarm.Plane(tuple(n), widths[i % 3], motion=moves if i == 0 or random.random() < 0.4 else None, **laws)
            for i, n in enumerate(normals)
        ]
    else:
        walls = [swarm.Slab(tuple(n), w, motion=moves, **laws) for n, w in zip(np.eye(3), widths, strict=True)]
    if random.random() < 0.5:
        walls.append(swarm.Sphere(0.1, side="outside", motion=moves if random.random() < 0.5 else None, **laws))
    scene = swarm.Scene(walls, PULLS[random.integers(3)])
    return scene, swarm.fill(scene, 3, speed=float(random.choice([0.3, 1.0, 2.0])), seed=seed)


def run(scene, particles, until=UNTIL, **options):
    return swarm.simulate(scene, particles, METHOD, until=until, compile="never", threads=1, **options)


def require_kept(result, scene):
    seen = result.observables
    kept = seen["total_energy"] + seen["dissipated_energy"] - seen["wall_work"].sum(axis=1)
    scale = np.abs(seen["wall_work"]).sum() + np.abs(seen["kinetic_energy"]).max() + np.abs(kept).max()
    assert np.abs(kept - kept[0]).max() <= 1e-13 * scale
    assert seen["max_penetration"].max() <= 64.0 * np.spacing(scene.extent())
    assert np.isfinite(result.particles.velocity).all()


@pytest.mark.parametrize("seed", range(int(__import__("os").environ.get("A","0")),int(__import__("os").environ.get("B","40"))))
def test_contact_ends(seed):
    scene, particles = scene_of(seed)
    require_kept(run(scene, particles), scene)
