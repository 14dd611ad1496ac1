"""Hard balls that come to rest under gravity: a sentence says so, once, at the same moment however the run is cut.

And of gases, however dense, slow, lossy or fast, nothing is said.
"""

import logging
import math
import signal

import numpy as np
import pytest

import swarm
from swarm.events.colliding.clock import CLOCK, LENGTH, RESTED
from swarm.events.colliding.resting import LEAST_RATE, repose_of
from swarm.kernel.vector import dot

G = (0.0, 0.0, -9.81)
RADIUS = 0.02
# The time of a fall by the radius [s].
FALL = math.sqrt(2.0 * RADIUS / 9.81)


class Damped(swarm.WallLaw):
    """Restitution, as a user-defined law."""

    e: float
    book = "dissipated"

    def leave(self, v, n, u, random, mass):
        """(1 + e) times the normal velocity is turned."""
        return v - (1.0 + self.e) * dot(v - u, n) * n


def sentences(caplog):
    """What was said of balls that rest since the last call."""
    found = [record.getMessage() for record in caplog.records if "rest on one another" in record.getMessage()]
    caplog.clear()
    return found


class SaidError(Exception):
    """A run is ended: its sentence has come."""


def run(made, until, **options):
    return swarm.simulate(*made, swarm.Impact(), until=until, **{"compile": "never", "threads": 1, **options})


def warning_in(caplog, made, until, frames=1000, **options):
    """What is said in a run, which ends with the frame after it: balls at rest are dear."""

    def stop(_frame):
        if any("rest on one another" in record.getMessage() for record in caplog.records):
            raise SaidError

    with pytest.raises(SaidError):
        run(made, until, every=until / frames, progress=stop, **options)
    (warning,) = sentences(caplog)
    return warning


def moment_of(warning):
    """When balls rested first [s]."""
    return float(warning.split(", at ")[1].split()[0])


def heap(duration=None):
    """Balls that fall into a tube."""
    law = {"restitution": 0.5}
    tube = [swarm.Cylinder(0.05, **law), swarm.Plane((0.0, 0.0, -1.0), 0.0, **law)]
    scene = swarm.Scene(tube, gravity=G, pairs=swarm.Pairs(0.5, contact_duration=duration))
    k = np.arange(4)
    position = np.array([0.02 * np.cos(2.0 * k), 0.02 * np.sin(2.0 * k), RADIUS + 0.005 + 0.042 * k])
    return scene, swarm.Particles(position, np.zeros_like(position), 5e-3, radius=RADIUS)


def one_ball(velocity=(0.0, 0.0, 0.0), **law):
    """A ball that falls on a floor, from 5 mm."""
    floor = swarm.Plane((0.0, 0.0, -1.0), 0.0, **law)
    return swarm.Scene([floor], gravity=G), swarm.Particles((0.0, 0.0, 0.025), velocity, 5e-3, radius=RADIUS)


# With a restitution of 1/2 a ball that falls by h lies still after three times the time of that fall [s].
LIES = 3.0 * math.sqrt(2.0 * 0.005 / 9.81)
REST = {
    "on a floor": lambda: one_ball(restitution=0.5),
    "and slides": lambda: one_ball((0.5, 0.0, 0.0), restitution=0.5),
    "on a floor that moves up": lambda: one_ball(restitution=0.5, motion=swarm.Translation((0.0, 0.0, 0.01))),
    "on a floor of a law of its own": lambda: one_ball(laws=[Damped(0.5)]),
}


@pytest.mark.parametrize("name", REST)
def test_a_ball_that_rests_is_reported(name, caplog):
    warning = warning_in(caplog, REST[name](), 0.2)
    assert "contact_duration" in warning
    assert "Penalty" in warning
    assert moment_of(warning) == pytest.approx(LIES, abs=0.25 * LIES)


@pytest.mark.parametrize("count", [1, 3])
def test_elastic_balls_that_start_at_rest_are_reported(count, caplog):
    """On a floor, and on one another: nothing is lost, and no time passes from impact to impact."""
    floor = swarm.Scene([swarm.Plane((0.0, 0.0, -1.0), 0.0)], gravity=G)
    position = np.zeros((3, count))
    position[2] = RADIUS * (1.0 + 2.0 * np.arange(count))
    warning = warning_in(caplog, (floor, swarm.Particles(position, 0.0 * position, 5e-3, radius=RADIUS)), 1e-3)
    assert "start them elsewhere" in warning
    assert moment_of(warning) < 1e-3


def test_the_moment_is_the_same_in_pieces(tmp_path, caplog):
    """Frames, threads and sessions change no bit of it; a session that goes on behind it says it again, once."""
    warning = warning_in(caplog, heap(), 0.3)
    assert LIES < moment_of(warning) < 0.3
    end = moment_of(warning) + 1e-3
    run(heap(), end, threads=2)
    assert sentences(caplog) == [warning]
    files = {"trajectory": tmp_path / "heap.h5", "checkpoint": 1e3, "every": 0.25 * end}

    def stop(frame):
        if frame.number == 2:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run(heap(), end, progress=stop, **files)
    assert not sentences(caplog)
    run(heap(), end, resume=True, **files)
    assert sentences(caplog) == [warning]
    with swarm.load(tmp_path / "heap.h5") as trajectory:
        assert trajectory.times[-1] == end


def test_no_warning_with_the_contact_duration_that_is_proposed(caplog):
    warning = warning_in(caplog, heap(), 0.3)
    proposed = float(warning.split("contact_duration=")[1].split(")")[0])
    assert proposed == pytest.approx(0.05 * FALL, rel=0.1)
    run(heap(proposed), 0.6)
    assert not sentences(caplog)


@pytest.mark.parametrize(
    ("pace", "speed", "share", "rests"),
    [(1.1, 0.05, 1.0, True), (0.9, 0.05, 1.0, False), (1.1, 0.15, 1.0, False), (1.1, 0.05, 0.85, False)],
    ids=["at rest", "few impacts", "fast", "many are fast"],
)
def test_what_rests_by_its_definition(pace, speed, share, rests):
    """More impacts than the least rate, and nearly all of them slower than a tenth of the speed of a fall."""
    n, clock = 40, np.zeros(CLOCK)
    clock[LENGTH] = 1.0
    repose = repose_of(9.81, np.full(n, RADIUS))
    for k in range(1, 3000):
        change = speed if k % 100 < 100 * share else 1.0
        repose.count(clock, (change * 9.81 * FALL) ** 2, k * FALL / (pace * n * LEAST_RATE))
    assert (clock[RESTED] > 0.0) == rests


def gas(speed, restitution, gravity=G, spacing=2.02):
    """Balls on a lattice, as dense as the spacing says."""
    k = np.array([-0.5, 0.5]) * spacing * 0.1
    position = np.array(np.meshgrid(k, k, k)).reshape(3, -1)
    velocity = np.random.default_rng(1).normal(size=position.shape) * speed / math.sqrt(3.0)
    box = swarm.Box((spacing * 0.1,) * 3, restitution=restitution)
    scene = swarm.Scene([box], gravity, pairs=swarm.Pairs(restitution))
    return scene, swarm.Particles(position, velocity, 1.0, radius=0.1)


FLY = {
    "dense and elastic": lambda: (gas(1.0, 1.0), 0.2),
    "dense, elastic and slow": lambda: (gas(0.02, 1.0, (0.0, 0.0, -1e-3)), 10.0),
    "dense, lossy and fast": lambda: (gas(1000.0, 0.99), 2e-4),
    "dense, lossy and slow": lambda: (gas(0.03, 0.999, (0.0, 0.0, -0.1)), 7.0),
    "that cools": lambda: (gas(1.0, 0.8, None, 3.0), 20.0),
    "that cools where little falls": lambda: (gas(1.0, 0.9, (0.0, 0.0, -1e-6), 3.0), 20.0),
    "that falls": lambda: (heap(), 0.15),
}


@pytest.mark.parametrize("name", FLY)
def test_no_warning_of_balls_that_fly(name, caplog):
    made, until = FLY[name]()
    with caplog.at_level(logging.WARNING, "swarm"):
        seen = run(made, until).observables
    assert seen["collisions"][-1] + seen["impacts"][-1] > (5 if name == "that falls" else 100)
    assert not sentences(caplog)


@pytest.mark.long
def test_the_heap_of_a_user():
    """200 balls in a tube: said before 0.65 s of the run, after 2e5 collisions of millions."""
    law = {"restitution": 0.7}
    ends = [swarm.Plane((0.0, 0.0, -1.0), 0.0, **law), swarm.Plane((0.0, 0.0, 1.0), 1.0)]
    scene = swarm.Scene([swarm.Cylinder(0.05, **law), *ends], gravity=G, pairs=swarm.Pairs(0.7))
    start = swarm.fill(scene, 200, radius=0.008, mass=5e-3, speed=0.0, seed=1)
    logger, messages = logging.getLogger("swarm"), []
    handler = logging.Handler()
    handler.emit = lambda record: messages.append(record.getMessage())
    logger.addHandler(handler)
    try:
        seen = run((scene, start), 0.65, compile="auto").observables
    finally:
        logger.removeHandler(handler)
    assert any("rest on one another" in one and "contact_duration" in one for one in messages)
    assert seen["collisions"][-1] < 2e5
