"""Steps into soft walls in a cell that repeats: particles come back into it at the end of the step that leaves it."""

import math

import numpy as np
import pytest

import swarm

CELL = (1.0, 1.0, 1.0)
# The second reaches over three faces, at a corner of the cell.
CENTERS, RADII, H, ALPHA = [(0.5, 0.5, 0.5), (0.02, -0.01, 0.97)], (0.3, 0.2), 0.004, 1e4
BALLS = [swarm.Sphere(a, c, "outside") for a, c in zip(RADII, CENTERS, strict=True)]
METHODS = [
    swarm.Penalty(dt=H, penalty=ALPHA),
    swarm.Penalty(dt=H, penalty=3e5, exponent=1.5),
    swarm.AugmentedLagrangian(dt=0.5 * H, penalty=1e8, adaptive=True, tolerance=1e-24, max_sweeps=500),
]


def start(count=5, speed=1.0, mass=1.3):
    rng = np.random.default_rng(4)
    balls = list(zip(RADII, CENTERS, strict=True))
    p = rng.random((200, 3))
    found = [r for r in p if all(np.linalg.norm((r - c + 0.5) % 1.0 - 0.5) > a + 0.01 for a, c in balls)]
    v = rng.normal(size=(3, count))
    return swarm.Particles(np.array(found[:count]).T, speed * v / np.linalg.norm(v, axis=0), mass=mass)


def run(method, surfaces, particles, until=2.0, gravity=None, period=CELL, **given):
    """The frames, and what is observed."""
    scene, frames = swarm.Scene(surfaces, gravity=gravity, period=period), []

    def keep(frame):
        frames.append((frame.position.copy(), frame.image.copy(), frame.velocity.copy()))

    seen = swarm.simulate(scene, particles, method, until=until, every=0.2, progress=keep, **given)
    return frames, seen.observables


def unfolded(frames):
    return frames[-1][0] + frames[-1][1] * np.array(CELL)[:, None]


# --- Against a loop without a cell -----------------------------------------------------------------------


def plain_step(r, v, mass):
    """One step of eq. (5) with the scalar form (9) at the nearest balls of an endless lattice, which are apart."""
    for c, a in zip(CENTERS, RADII, strict=True):
        end = r + H * v
        for near in {tuple(np.round(r - c)), tuple(np.round(end - c))}:
            x0, p = r - c - near, H * v
            y0 = max(a - np.linalg.norm(x0), 0.0)
            if y0 == 0.0 and np.linalg.norm(x0 + p) >= a:
                continue

            def end_of(k, x0=x0, p=p):
                # x1 = x0 + p + k (x0 + x1)
                return (x0 + p + k * x0) / (1.0 - k)

            def missed(k, x0=x0, y0=y0, a=a, end_of=end_of):
                x1 = end_of(k)
                y1 = max(a - np.linalg.norm(x1), 0.0)
                slope = (y1 - y0) / (x1 @ x1 - x0 @ x0)
                return k + H * H / (2.0 * mass) * ALPHA * (y0 + y1) / 2.0 * slope

            low, high = 0.0, 0.5
            for _i in range(200):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if missed(middle) < 0.0 else (low, middle)
            x1 = end_of(high)
            return x1 + c + near, 2.0 / H * (x1 - x0) - v
    return r + H * v, v


def test_a_plain_loop_on_an_endless_lattice_goes_the_same_way():
    particles = start(4)
    frames, _seen = run(METHODS[0], BALLS, particles, 1.2)
    steps = round(1.2 / H)
    for i in range(4):
        r, v = particles.position[:, i].copy(), particles.velocity[:, i].copy()
        for _k in range(steps):
            r, v = plain_step(r, v, 1.3)
        assert np.allclose(unfolded(frames)[:, i], r, atol=1e-8)
    assert np.abs(frames[-1][1]).sum() > 0


# --- Facts -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS, ids=["linear", "hertz", "multipliers"])
def test_energy_is_kept_over_faces(method):
    particles = start()
    frames, seen = run(method, BALLS, particles)
    energy = seen["total_energy"]
    assert np.abs(energy - energy[0]).max() <= 1e-12 * energy[0]
    deepest = math.sqrt(1.3 / ALPHA) if isinstance(method, swarm.Penalty) else 1e-9
    for position, _image, _velocity in frames:
        assert ((position >= 0.0) & (position < 1.0)).all()
        for c, a in zip(CENTERS, RADII, strict=True):
            away = (position - np.array(c)[:, None] + 0.5) % 1.0 - 0.5
            assert (np.linalg.norm(away, axis=0) > a - deepest).all()
    assert frames[-1][1].any()
    assert seen["impacts"][-1].sum() > 5


def test_what_falls_through_cells_gains_what_gravity_gives():
    frames, seen = run(METHODS[0], BALLS, start(3, 0.4), gravity=(0.0, 0.5, -2.0), until=1.0)
    energy = seen["total_energy"]
    assert np.abs(energy - energy[0]).max() <= 1e-12 * np.abs(seen["kinetic_energy"]).max()
    assert frames[-1][1].any()


def test_the_limit_is_that_of_rigid_walls():
    particles = start(3)
    exact, _seen = run(swarm.Impact(), BALLS, particles, 0.6)
    misses = []
    for alpha in (1e4, 1e6):
        frames, _seen = run(swarm.Penalty(dt=0.2 / math.sqrt(alpha), penalty=alpha), BALLS, particles, 0.6)
        misses.append(np.abs(unfolded(frames) - unfolded(exact)).max())
    # A contact takes a time of pi sqrt(m/alpha).
    assert misses[1] < 0.2 * misses[0] < 0.05


def test_a_contact_over_a_face_is_one_contact():
    # It meets the ball where half of it is in the next cell, and its contact takes many steps on both sides.
    ball, v = swarm.Sphere(0.2, (0.0, 0.5, 0.5), "outside", restitution=0.5, friction=0.1), (0.8, -1.0, 0.0)
    shifted = swarm.Sphere(0.2, (0.5, 0.5, 0.5), "outside", restitution=0.5, friction=0.1)
    soft = swarm.Penalty(dt=0.001, penalty=1024.0)
    ends = []
    for one, x in ((ball, 0.79), (shifted, 0.29)):
        particle = swarm.Particles(np.array([[x], [0.9], [0.5]]), np.array(v)[:, None], mass=1.0)
        frames, seen = run(soft, [one], particle, 0.6)
        ends.append(frames[-1])
        assert seen["impacts"][-1].sum() == 1
    assert np.allclose(ends[0][2], ends[1][2], atol=1e-9)
    assert np.linalg.norm(ends[0][2]) < 1.2
    assert [end[1][0, 0] for end in ends] == [1, 0]


def test_counters_count_what_steps_over_faces_cross():
    counter = swarm.Plane((1.0, 0.0, 0.0), 0.003)
    particle = swarm.Particles(np.array([[0.5], [0.9], [0.5]]), np.array([[1.0], [0.0], [0.0]]), mass=1.0)
    _frames, seen = run(METHODS[0], BALLS, particle, 4.0, counters=[counter])
    assert seen["crossings"][-1].sum() == 4


def test_a_step_that_goes_too_far_over_a_face_is_refused():
    with pytest.raises(swarm.SceneError, match=r"no particle flies farther than 0\.05 m in a step"):
        run(swarm.Penalty(dt=0.1, penalty=1e4), BALLS, start())
