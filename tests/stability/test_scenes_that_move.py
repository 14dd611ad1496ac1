"""Random scenes whose walls move: contact that lasts ends, with the energy and the walls kept, wherever frames end."""

import numpy as np
import pytest
from energy_books import booked, unbooked

import swarm
from swarm.lanes import careful, contact_events, slide

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

    monkeypatch.setattr(contact_events, "_decide", counted(contact_events._decide))
    monkeypatch.setattr(careful, "_step", counted(careful._step))
    monkeypatch.setattr(slide, "_retire", counted(slide._retire))
    return rounds


def motion(random, can_turn):
    """An oscillation, a translation or a rotation, along and about axes or not."""
    some = random.normal(size=3) * random.integers(0, 2, 3)
    oscillation = swarm.Oscillation(
        tuple(0.04 * some), float(random.choice([0.5, 2.0, 5.0])), random.choice([0.0, 1.0])
    )
    axis = [(0, 0, 1), (0, 1, 0), (1, 1, 0.5)][random.integers(3)]
    rotation = swarm.Rotation(axis, float(random.choice([-2.0, 0.05, 8.0])), (0.0, 0.0, 0.0))
    kind = random.integers(4)
    if kind == 0:
        return swarm.Translation(tuple(0.1 * some))
    return rotation if kind == 1 and can_turn else oscillation


def scene_of(seed):
    """A cavity of one of four kinds, in which a ball may be, and three particles."""
    random = np.random.default_rng(seed)
    friction, restitution = random.choice([0.0, 0.3, 0.8]), random.choice([1.0, 0.9, 0.5, 0.0])
    laws = {"friction": float(friction), "restitution": float(restitution)}
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


def run(scene, particles, until=UNTIL, method=METHOD, **options):
    return swarm.simulate(scene, particles, method, until=until, compile="never", threads=1, **options)


def require_kept(result, scene):
    seen = result.observables
    scale = np.abs(seen["wall_work"]).sum() + seen["kinetic_energy"].max() + np.abs(booked(seen)).max()
    assert unbooked(seen) <= 1e-13 * scale
    assert seen["max_penetration"].max() <= 64.0 * np.spacing(scene.extent())
    assert np.isfinite(result.particles.velocity).all()


# Scenes that went round and round without time passing, in which a velocity became no number, or of each kind one.
SOON = [0, 3, 4, 10, 12, 18, 25, 29, 51]


@pytest.mark.parametrize("seed", SOON)
def test_contact_ends(seed):
    scene, particles = scene_of(seed)
    require_kept(run(scene, particles), scene)


@pytest.mark.long
@pytest.mark.parametrize("seed", [seed for seed in range(240) if seed not in SOON])
def test_contact_ends_in_many_scenes(seed):
    scene, particles = scene_of(seed)
    require_kept(run(scene, particles), scene)


def test_a_particle_as_fast_as_a_wall_far_away_does_not_meet_it():
    """Friction at the ceiling gives it the velocity of the box, with which the side walls move too."""
    box = swarm.Box((1.0, 0.8, 0.7), friction=0.3, motion=swarm.Oscillation((0.0, 0.05, 0.0), 2.0))
    start = swarm.Particles((-0.03, 0.02, 0.2), (0.06, -0.72, 1.87))
    result = run(swarm.Scene([box]), start, 1.0)
    # From z = 0.2 to the ceiling, and to and fro between it and the floor
    assert result.observables["impacts"][-1] == 1 + int((1.87 - 0.5) / 1.4)
    assert result.particles.velocity[0, 0] == 0.0


def test_what_lies_at_a_wall_that_moves_along_itself_stays_there(bounded):
    """Nothing presses it to the wall, and nothing takes it away: the wall is met once."""
    box = swarm.Box((1.0, 1.0, 1.0), restitution=0.0, motion=swarm.Oscillation((0.0, 0.05, 0.0), 2.0))
    result = run(swarm.Scene([box]), swarm.Particles((0.0, 0.0, 0.9), (0.1, 0.0, 0.5)), 5.0)
    assert result.particles.position[:, 0] == pytest.approx((0.5, 0.0, 1.0), abs=1e-13)
    assert result.observables["impacts"][-1] == 1
    assert len(bounded) < 10


# --- What is counted -------------------------------------------------------------------------------------

# Half widths, amplitude and frequency, restitution and friction, gravity, the speed of the particles and their seed
SHAKEN = {
    "up and down": ((1.0, 1.0, 0.7), ((0.0, 0.0, -0.01), 5.0, 1.0), (0.5, 0.3), PULLS[1], 2.0, 274329274),
    "askew": ((0.3, 0.3, 1.0), ((0.0, -0.01525722, -0.02262339), 0.5), (0.5, 0.0), PULLS[1], 1.0, 261881865),
    "to and fro": ((0.8, 0.3, 1.0), ((-0.06, 0.076, 0.005), 5.0), (0.5, 0.0), None, 1.0, 4),
    "elastic": ((0.3, 0.3, 0.5), ((0.02, 0.1, -0.09), 0.5), (1.0, 0.0), PULLS[1], 1.0, 4),
    "dead": ((0.3, 0.3, 0.5), ((0.0, 0.0, 0.03), 0.5), (0.0, 0.0), PULLS[1], 1.0, 4),
}


@pytest.mark.parametrize("name", SHAKEN)
def test_impacts_do_not_depend_on_where_frames_end(name):
    widths, moved, (restitution, friction), pull, speed, seed = SHAKEN[name]
    laws = {"restitution": restitution, "friction": friction, "motion": swarm.Oscillation(*moved)}
    walls = [swarm.Box(widths, **laws), swarm.Sphere(0.1, side="outside", **laws)]
    scene = swarm.Scene(walls, pull)
    some = swarm.fill(scene, 3, speed=speed, seed=seed)
    require_same_counts(scene, swarm.Particles(some.position[:, 1:], some.velocity[:, 1:]))


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.9])
def test_impacts_on_walls_at_rest_do_not_either(restitution):
    tilted = swarm.Plane((0.3, -0.2, -1.0), 0.0, restitution=restitution)
    start = swarm.Particles(np.full((3, 4), 0.3), 0.4 * np.random.default_rng(1).standard_normal((3, 4)))
    counts = require_same_counts(swarm.Scene([tilted], PULLS[1]), start)
    assert restitution > 0.0 or counts[-1] == 4


def test_when_hops_end_does_not_depend_on_the_speed_at_the_start_of_a_frame():
    box = swarm.Scene([swarm.Box((0.3, 0.3, 0.3), restitution=0.5)], PULLS[1])
    require_same_counts(box, swarm.fill(box, 8, speed=3.0, seed=1))


def require_same_counts(scene, particles):
    """The counts at the ends of frames, which are those of runs that end there."""
    ends = np.linspace(0.1, 1.0, 10)
    counts = run(scene, particles, ends[-1], swarm.Impact(), every=0.1).observables["impacts"][1:]
    alone = [run(scene, particles, end, swarm.Impact()).observables["impacts"][-1] for end in ends]
    assert [int(count) for count in alone] == counts.tolist()
    assert (np.diff(counts) >= 0).all()
    return counts
