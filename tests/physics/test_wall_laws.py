"""User-defined laws of walls, against the laws that swarm has, closed forms and distributions."""

import inspect
import math
from pathlib import Path

import numpy as np
import pytest
from conftest import rarely
from energy_books import unbooked
from same_bits import require_same
from test_examples import lines_of
from test_sessions import require_resumed_is_whole

import swarm
from examples import own_law
from examples.own_law import Viscoelastic
from swarm.contact.laws import Owned, Some
from swarm.kernel.jit import select
from swarm.kernel.random import Stream
from swarm.kernel.vector import dot, norm, vec

pytestmark = pytest.mark.physics
G = (0.0, 0.0, -9.81)
# Kolmogorov's limit: sqrt(n) D is below it with the probability of three standard errors.
KOLMOGOROV = 1.82


class Restitution(swarm.WallLaw):
    e: float

    def leave(self, v, n, u, random, mass):
        return v - (1.0 + self.e) * dot(v - u, n) * n


class Lambert(swarm.WallLaw):
    """With a probability diffuse, |v| kept: the direction of n + a point of the unit sphere."""

    probability: float

    def leave(self, v, n, u, random, mass):
        w = v - u
        along = vec((random.normal(0), random.normal(2), random.normal(4)))
        way = n + along * (1.0 / norm(along))
        diffuse = way * (norm(w) / norm(way))
        return u + select(random.uniform(6) < self.probability, diffuse, w - 2.0 * dot(w, n) * n)


class Rough(swarm.WallLaw):
    """It branches, and draws in one branch alone."""

    share: float

    def leave(self, v, n, u, random, mass):
        b = dot(v - u, n)
        if random.uniform(0) < self.share:
            return v - (1.0 + 0.5 * random.uniform(1)) * b * n
        if mass > 1.0:
            return v - 1.5 * b * n
        return v - 2.0 * b * n


def run(walls, gravity=None, until=3.0, n=40, **options):
    scene = swarm.Scene(walls, gravity)
    start = swarm.fill(scene, n, speed=1.0, mass=np.linspace(0.5, 2.0, n), seed=2)
    return swarm.simulate(scene, start, swarm.Impact(), until=until, **options)


WALLS = {
    "sphere": lambda **law: [swarm.Sphere(0.5, **law)],
    "box": lambda **law: [swarm.Box((0.5, 0.4, 0.6), rotation=(1, 2, 3, 4), **law)],
    "capped cylinder": lambda **law: [swarm.Cylinder(0.4, (0, 1, 1), 1.0, **law)],
    "torus": lambda **law: [swarm.Torus(0.6, 0.3, **law)],
    "balls": lambda **law: [
        swarm.Sphere(1.0, **law),
        swarm.Spheres([(x, y, 0.0) for x in (-0.4, 0.0, 0.4) for y in (-0.4, 0.0, 0.4)], 0.1, **law),
    ],
    "floor that moves": lambda **law: [
        swarm.Box((0.5, 0.4, 0.6), **law),
        swarm.Plane((0, 0, -1), 0.2, motion=swarm.Oscillation((0, 0, 0.05), 2.0), **law),
    ],
}


@pytest.mark.parametrize("gravity", [None, G], ids=["straight", "falling"])
@pytest.mark.parametrize("name", WALLS)
def test_a_restitution_of_ones_own_is_that_of_the_package(name, gravity):
    """Impact for impact, as long as round-off is not multiplied; what one calls heat the other calls dissipated."""
    until = 0.5 if gravity else 1.2
    own = run(WALLS[name](laws=[Restitution(0.9)]), gravity, until, compile="never")
    known = run(WALLS[name](restitution=0.9), gravity, until, compile="never")
    assert own.observables["impacts"][-1] == known.observables["impacts"][-1] > 20
    assert own.particles.position == pytest.approx(known.particles.position, abs=1e-10)
    lost = known.observables["dissipated_energy"][-1]
    assert -own.observables["wall_heat"][-1].sum() == pytest.approx(lost, rel=1e-9)
    assert own.observables["impulse"][-1] == pytest.approx(known.observables["impulse"][-1], rel=1e-9, abs=1e-12)


HOLE = swarm.Sphere(0.15, (0.0, 0.0, 0.5))
SCENES = {
    "cell": lambda **law: swarm.Scene([swarm.Sphere(0.3, (0.1, 0, 0), "outside", **law)], None, (1.0, 1.0, 1.0)),
    "cell over a floor": lambda **law: swarm.Scene(
        [swarm.Slab((0, 0, 1), 0.5, **law), swarm.Sphere(0.3, (0.1, 0, 0), "outside", **law)], G, (1.0, 1.0, None)
    ),
    "opening": lambda **law: swarm.Scene([swarm.Sphere(0.5, openings=[HOLE], **law)], (0.5, 0.0, -1.0)),
    "opening, straight": lambda **law: swarm.Scene([swarm.Sphere(0.5, openings=[HOLE], **law)]),
}


@pytest.mark.parametrize("name", SCENES)
def test_in_cells_through_openings_and_in_the_log_too(name, tmp_path):
    results, logs = [], []
    for k, law in enumerate(({"laws": [Restitution(0.9)]}, {"restitution": 0.9})):
        scene = SCENES[name](**law)
        start = swarm.fill(scene, 40, speed=1.0, seed=2)
        log = tmp_path / f"{k}.h5"
        results.append(swarm.simulate(scene, start, swarm.Impact(), until=1.0, impacts=log, compile="never"))
        logs.append(swarm.load_impacts(log))
    own, known = results
    assert own.particles.position == pytest.approx(known.particles.position, abs=1e-12)
    impacts, escaped = (own.observables[name][-1] for name in ("impacts", "escaped"))
    assert impacts == known.observables["impacts"][-1] > 10
    assert escaped == known.observables["escaped"][-1]
    # An escape has a row of its own.
    assert len(logs[0]) == len(logs[1]) == impacts + escaped
    lost = known.observables["dissipated_energy"][-1]
    assert -own.observables["wall_heat"][-1].sum() == pytest.approx(lost, rel=1e-9)


def test_a_run_is_not_resumed_by_another_law(tmp_path):
    start = swarm.fill(swarm.Scene([swarm.Sphere(0.5)]), 5, speed=1.0, seed=1)

    def simulate(e, **options):
        scene = swarm.Scene([swarm.Sphere(0.5, laws=[Restitution(e)])])
        options = {"trajectory": tmp_path / "run.h5", "every": 0.5, "compile": "never", **options}
        return swarm.simulate(scene, start, swarm.Impact(), **options)

    simulate(0.9, until=1.0)
    with pytest.raises(swarm.SwarmError, match=r"Restitution|scene"):
        simulate(0.8, until=2.0, resume=True)


def cup(laws):
    """A capped cylinder in which balls come to rest."""
    return [swarm.Cylinder(0.2, (0, 0, 1), 0.4, laws=laws, restitution=0.8, friction=0.3)]


@pytest.mark.parametrize(
    ("name", "laws", "gravity"),
    [
        ("sphere", [Rough(0.3)], None), ("cup", [Viscoelastic(2.0)], G),
        rarely("balls", [Lambert(0.5), Restitution(0.9)], None), rarely("floor that moves", [Rough(0.3)], G),
    ],
)  # fmt: skip
def test_the_same_bits_compiled_in_plain_python_and_in_any_threads(name, laws, gravity):
    walls = cup(laws) if name == "cup" else WALLS[name](laws=laws)
    one, two = (run(walls, gravity, 2.0, compile="always", threads=threads) for threads in (1, 2))
    assert one.observables["impacts"][-1] > 50
    require_same(one, two)
    few, plain = (run(walls, gravity, 2.0, n=3, compile=tier) for tier in ("always", "never"))
    assert few.observables["impacts"][-1] > 3
    require_same(few, plain)


def test_a_resumed_run_is_a_whole_one(tmp_path):
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Lambert(0.5)])])
    assert require_resumed_is_whole(tmp_path, scene, swarm.Impact(), every=10.0) > 0


def test_two_laws_in_turn():
    one = run(WALLS["sphere"](laws=[Restitution(0.9), Restitution(0.8)]), until=1.0, compile="never")
    product = run(WALLS["sphere"](laws=[Restitution(0.72)]), until=1.0, compile="never")
    assert one.particles.position == pytest.approx(product.particles.position, abs=1e-11)


def kolmogorov(sample):
    """sqrt(n) D of a sample that should be uniform in (0, 1)."""
    n, below = sample.size, np.sort(sample)
    return math.sqrt(n) * max((np.arange(1, n + 1) / n - below).max(), (below - np.arange(n) / n).max())


def test_a_lambert_law_keeps_the_speed_and_gives_the_cosine_law():
    n, normal = 20_000, np.array([0.6, -0.48, 0.64])
    before = -0.8 * normal + np.array([0.8, 0.36, -0.48])
    start = swarm.Particles(np.outer(normal, np.full(n, 1e-6)), np.outer(before, np.ones(n)))
    wall = swarm.Plane(tuple(-normal), 0.0, laws=[Lambert(1.0)])
    result = swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=1e-3, compile="always", seed=5)
    assert (result.impacts_per_particle == 1).all()
    v = result.particles.velocity
    speed = np.linalg.norm(v, axis=0)
    assert speed == pytest.approx(np.linalg.norm(before), rel=4 * np.finfo(float).eps)
    cosine = normal @ v / speed
    assert kolmogorov(cosine**2) < KOLMOGOROV
    across = np.cross(before, normal)
    angle = np.arctan2(across @ v / np.linalg.norm(across), v.T @ np.cross(normal, across) / np.linalg.norm(across))
    assert kolmogorov(angle / (2.0 * math.pi) + 0.5) < KOLMOGOROV


def test_a_share_of_the_particles_by_the_other_law():
    """A thermal wall asks the law of those that it does not accommodate."""
    n = 20_000
    start = swarm.Particles(np.tile([[0.0], [0.0], [1e-6]], n), np.tile([[0.0], [0.0], [-1.0]], n))
    wall = swarm.Plane((0, 0, -1), 0.0, temperature=0.1, accommodation=0.25, laws=[Restitution(0.5)])
    result = swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(), until=1e-3, compile="always", seed=5)
    by_law = result.particles.velocity[2] == 0.5
    assert by_law.mean() == pytest.approx(0.75, abs=3.0 * math.sqrt(0.25 * 0.75 / n))


def test_what_a_law_gives_and_takes_is_booked():
    result = run(WALLS["sphere"](laws=[Rough(0.3)]), until=30.0, every=10.0, compile="always")
    assert unbooked(result.observables) <= 1e-13 * abs(result.observables["total_energy"][0])
    assert result.observables["wall_heat"][-1].sum() < -0.5 * result.observables["kinetic_energy"][0]


def test_balls_come_to_rest_under_a_law_of_their_own():
    """The last hops are those of the surface: a bounce is not divided without end."""
    result = run(cup([Viscoelastic(2.0)]), G, until=6.0, n=30, compile="always")
    assert result.observables["kinetic_energy"][-1] < 1e-12 * result.observables["kinetic_energy"][0]
    assert result.particles.position[2] == pytest.approx(-0.2, abs=1e-15)
    assert (result.impacts_per_particle < 2000).all()
    assert unbooked(result.observables) <= 1e-12 * abs(result.observables["total_energy"][0])


def test_the_numbers_of_an_impact_are_independent():
    """Of each other, of those of other impacts and particles, and of those of thermal walls."""
    streams = [Stream(7, particle, number) for particle in range(50) for number in range(50)]
    rows = np.array([[stream.uniform(k) for k in range(4)] for stream in streams])
    for k in range(4):
        assert kolmogorov(rows[:, k]) < KOLMOGOROV
    assert abs(np.corrcoef(rows.T) - np.eye(4)).max() < 4.0 / math.sqrt(len(streams))
    normal = np.array([stream.normal(0) for stream in streams])
    assert kolmogorov(0.5 * (1.0 + np.array([math.erf(x / math.sqrt(2.0)) for x in normal]))) < KOLMOGOROV
    assert kolmogorov(np.exp([-stream.exponential(1) for stream in streams])) < KOLMOGOROV


def test_the_example_is_short():
    laws = [one for one in vars(own_law).values() if isinstance(one, type) and issubclass(one, swarm.WallLaw)]
    assert len(laws) == 2
    assert all(len(inspect.getsource(law).splitlines()) <= 20 for law in laws)
    assert len(lines_of(Path(own_law.__file__))) <= 30


def test_the_laws_of_the_example_book_what_they_take():
    """Some balls stick to the floor, the others come to rest, and every joule is booked."""
    laws = [own_law.Glue(0.5, 0.05), own_law.Viscoelastic(2.0)]
    found = run(cup(laws), G, 3.0, n=12, compile="never")
    seen, stuck = found.observables, np.isfinite(found.absorbed_time)
    assert 0 < seen["absorbed"][-1, 0] == np.count_nonzero(stuck) < 12
    assert seen["dissipated_energy"][-1] > 0.0
    # A mirror gives round-off.
    assert np.abs(seen["wall_heat"]).max() < 1e-13 * seen["dissipated_energy"][-1]
    assert unbooked(found.observables) < 1e-13 * abs(found.observables["total_energy"][0])


class Into(swarm.WallLaw):
    """Into the wall, from a speed on that no trial has."""

    def leave(self, v, n, u, random, mass):
        return v - 2.0 * select(dot(v, v) > 1e4, 0.25, 1.0) * dot(v - u, n) * n


class Damped(swarm.WallLaw):
    """A restitution that is written relative to the wall."""

    e: float

    def leave(self, v, n, u, random, mass):
        b = -dot(v - u, n)
        return u + (v - u + b * n) + self.e * b * n


class Through(swarm.WallLaw):
    def leave(self, v, n, u, random, mass):
        return v


class Nothing(swarm.WallLaw):
    e: float


@pytest.mark.parametrize("tier", ["never", "always"])
def test_a_law_that_sends_a_particle_into_the_wall_ends_the_run(tier):
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Into()])])
    start = swarm.fill(scene, 5, speed=200.0, seed=1)
    with pytest.raises(swarm.RunError, match=r"particle \d+.*law"):
        swarm.simulate(scene, start, swarm.Impact(), until=1.0, compile=tier)


def test_a_speed_away_from_a_moving_wall_may_be_round_off_of_the_velocity_of_the_wall():
    """A law that adds the velocity of the wall to 1e-15 of it sends some particles into the wall by round-off."""
    one, random, into = Some((Damped(0.5),), 0.0, 1.0), np.random.default_rng(1), 0
    for _try in range(200):
        n, u = (vec(random.normal(size=3)) for _ in range(2))
        n = n * (1.0 / norm(n))
        ended = Owned((one,)).leave(0, u - random.uniform(0.0, 1e-15) * n, n, u, Stream(0, 0, 0, 0, None), 1.0)
        into += dot(ended.v - u, n) < 0.0
        assert ended.is_right
    assert into > 5
    far = Owned((Some((Through(),), 0.0, 1.0),)).leave(0, u - 1e-13 * n, n, u, Stream(0, 0, 0, 0, None), 1.0)
    assert not far.is_right


@pytest.mark.parametrize(
    ("laws", "sentence"),
    [
        (Restitution(0.9), "laws must be a list of WallLaw, .*, got Restitution"),
        ("lambert", r'in a scene file laws = \[\{kind = "lambert"\}\], got \'lambert\''),
        ([0.5], r"laws\[0\] must be a WallLaw, .* got 0.5"),
        ([Restitution(0.9), Nothing(1.0)], r"laws\[1\] must have a method leave\(self, v, n, u, random, mass\)"),
        ([Restitution(math.nan)], r"laws\[0\].e must be a finite number, got nan"),
        ([Through()], r"laws\[0\] must send particles away from the wall: .*Through\(\) returned"),
    ],
)
def test_bad_laws_are_refused_in_one_sentence(laws, sentence):
    with pytest.raises(swarm.SceneError, match=sentence):
        swarm.Sphere(1.0, laws=laws)


def test_what_knows_no_laws_says_so():
    wall = swarm.Sphere(1.0, laws=[Restitution(0.9)])
    start = swarm.Particles((0, 0, 0), (1, 0, 0))
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws must be .* with Verlet"):
        swarm.simulate(swarm.Scene([wall]), start, swarm.Verlet(dt=1e-3, penalty=1e6), until=1.0)
    with pytest.raises(swarm.SceneError, match="contact_step must be 0 where"):
        swarm.simulate(swarm.Scene([wall]), start, swarm.Impact(contact_step=1e-3), until=1.0)
    scene = swarm.Scene([wall])
    bodies = swarm.place(scene, swarm.dumbbell(0.1, 1.0), 2, speed=1.0, seed=1)
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws must be left out with bodies"):
        swarm.simulate(scene, bodies, swarm.Penalty(dt=1e-3, penalty=1e4), until=1.0)


def test_a_file_has_the_name_of_a_law(tmp_path):
    """Enough for pictures, and not to run it."""
    scene = swarm.Scene([swarm.Sphere(0.5, laws=[Restitution(0.9)])])
    start = swarm.fill(scene, 5, speed=1.0, seed=1)
    swarm.simulate(scene, start, swarm.Impact(), until=1.0, trajectory=tmp_path / "run.h5", compile="never")
    read = swarm.load(tmp_path / "run.h5").scene
    assert read.surfaces[0].laws == ("Restitution(e=0.9)",)
    assert swarm.fill(read, 5, speed=1.0, seed=1).position == pytest.approx(start.position)
    with pytest.raises(swarm.SceneError, match=r"surfaces\[0\].laws: 'Restitution\(e=0.9\)' is a Python object"):
        swarm.simulate(read, start, swarm.Impact(), until=1.0)
