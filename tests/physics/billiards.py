"""What the physics tests share: closed forms, invariants, scenes."""

import math

import mpmath
import numpy as np

import swarm

EPSILON = float(np.finfo(np.float64).eps)
AXES = (0.3, 0.4, 0.6)
FACES = [(s * (i == 0), s * (i == 1), s * (i == 2)) for i in range(3) for s in (1.0, -1.0)]
DIGITS = 50

SCENES = {
    "sphere": [swarm.Sphere(0.5)],
    "ellipsoid": [swarm.Ellipsoid(AXES)],
    "hemisphere": [swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.0)],
    "cut sphere": [swarm.Sphere(0.5), swarm.Plane((0.0, 0.0, -1.0), 0.2)],
    "box": [swarm.Plane(face, 0.5) for face in FACES],
    "nested spheres": [swarm.Sphere(0.5), swarm.Sphere(0.2, (0.1, 0.0, 0.0), side="outside")],
    "ball in ellipsoid": [swarm.Ellipsoid(AXES), swarm.Sphere(0.2, (0.05, 0.0, 0.1), side="outside")],
}


def scene_of(name, gravity=None):
    """A scene of the table."""
    return swarm.Scene(SCENES[name], gravity=gravity)


def run(scene, particles, method, until, every=None, compile="auto"):
    """`simulate` in the thread of the test."""
    return swarm.simulate(scene, particles, method, until=until, every=every, threads=1, compile=compile)


def equally_busy(scene, particles, impacts, time):
    """The same particles, each as fast as makes it hit the walls about `impacts` times until `time`."""
    fast = swarm.Particles(particles.position, particles.velocity * (impacts / (20.0 * time)), particles.mass)
    columns = [swarm.Particles(r, v) for r, v in zip(fast.position.T, fast.velocity.T, strict=True)]
    hits = np.array(
        [run(scene, one, swarm.Impact(), 20.0 * time, compile="always").observables["impacts"][-1] for one in columns]
    )
    fast.velocity = fast.velocity * (impacts / hits * 20.0)
    return fast


def reversed_motion(particles):
    """The same particles with opposite velocities."""
    return swarm.Particles(particles.position, -particles.velocity, particles.mass)


def speed2(particles):
    return (particles.velocity**2).sum(axis=0)


def worst_energy(start, end):
    """Largest relative change of |v|^2, from the particles themselves."""
    return float(np.abs(speed2(end) / speed2(start) - 1.0).max())


def ulps_outside(scene, result):
    """The largest penetration of all frames in units of the last place of the smallest surface."""
    return float(result.observables["max_penetration"].max() / np.spacing(scene.size()))


def places_outside(scene, result):
    """The same in last places of the farthest coordinate: a wall at 0.6 cannot be met to the last place of 0.2."""
    return float(result.observables["max_penetration"].max() / np.spacing(scene.extent()))


def chord_numbers(particles, radius):
    """(time to the first impact, time between impacts) in a sphere about the origin."""
    r, v = particles.position, particles.velocity
    rv, vv = (r * v).sum(axis=0), (v**2).sum(axis=0)
    half = np.sqrt(rv**2 + vv * (radius**2 - (r**2).sum(axis=0)))
    return (half - rv) / vv, 2.0 * half / vv


def sphere_billiard(position, velocity, radius, time):
    """Position and velocity at `time` of the exact billiard in a sphere about the origin, and its impacts.

    The motion stays in a plane, and every impact turns it by the same angle, so n impacts are one n-th power.
    """
    with mpmath.workdps(DIGITS):
        r, v, radius = mpmath.matrix(position.tolist()), mpmath.matrix(velocity.tolist()), mpmath.mpf(radius)
        rv, vv = (r.T * v)[0], (v.T * v)[0]
        first = (mpmath.sqrt(rv**2 + vv * (radius**2 - (r.T * r)[0])) - rv) / vv
        left = mpmath.mpf(time) - first
        if left < 0:
            end, speed, impacts = r + v * time, v, 0
        else:
            across = (r + v * first) / radius
            outward = (v.T * across)[0]
            along = v - across * outward
            sideways = mpmath.norm(along)
            along = along / sideways
            # In the plane (across, along): at R, with velocity (-outward, sideways) after the first impact.
            w, flight = mpmath.mpc(-outward, sideways), 2 * radius * outward / vv
            further = int(mpmath.floor(left / flight))
            turn = ((radius + flight * w) / radius) ** further
            z, w = turn * (radius + (left - further * flight) * w), turn * w
            end, speed, impacts = across * z.real + along * z.imag, across * w.real + along * w.imag, 1 + further
        return np.array([float(c) for c in end]), np.array([float(c) for c in speed]), impacts


def unfolded(r, v, angle, time):
    """(position, velocity, impacts) in the wedge between y = 0 and the ray at `angle`, by mirror images.

    The flight is straight through the images, each seen past one more wall, and is folded back into the wedge.
    """
    with mpmath.workdps(40):
        side, x, y = mpmath.mpf(angle), mpmath.mpf(r[0]), mpmath.mpf(r[1])
        z = mpmath.mpc(x, y) + mpmath.mpc(*v[:2].tolist()) * time
        seen = mpmath.arg(z)
        # Anticlockwise past the edge the angle goes beyond pi.
        if x * v[1] - y * v[0] > 0.0 and seen < 0:
            seen += 2 * mpmath.pi
        turns = mpmath.floor(seen / side)
        w, way = mpmath.mpc(*v[:2].tolist()), mpmath.expj(-2 * side * mpmath.ceil(turns / 2))
        z, w = z * way, w * way
        if int(turns) % 2:
            z, w = mpmath.conj(z), mpmath.conj(w)
        return np.array([float(z.real), float(z.imag)]), np.array([float(w.real), float(w.imag)]), abs(int(turns))


def joachimsthal(particles, axes=AXES):
    """(r.Av)^2 - (v.Av)(r.Ar - 1): constant along every billiard in the ellipsoid r.Ar = 1."""
    a = 1.0 / np.array(axes)[:, None] ** 2
    r, v = particles.position, particles.velocity
    return (a * r * v).sum(axis=0) ** 2 - (a * v * v).sum(axis=0) * ((a * r * r).sum(axis=0) - 1.0)


def ellipsoid_area(axes=AXES, n=60):
    """Surface by the trapezoidal rule in the angle and Gauss's rule in the height, both spectral."""
    a, b, c = axes
    u, weights = np.polynomial.legendre.leggauss(n)
    angle = np.arange(n) * (2.0 * math.pi / n)
    s2 = 1.0 - u[:, None] ** 2
    density = np.sqrt(s2 * ((b * c * np.cos(angle)) ** 2 + (a * c * np.sin(angle)) ** 2) + (a * b * u[:, None]) ** 2)
    return float((weights[:, None] * density).sum() * 2.0 * math.pi / n)


def wall_bounce(distance, speed, time, stiffness, exponent):
    """(position, velocity) after one bounce off the soft wall x = 0, m x'' = -stiffness x^exponent for x > 0.

    The contact lasts 2 (depth/speed) sqrt(pi) G(1 + p)/G(1/2 + p), p = 1/(exponent + 1); mass 1.
    """
    p = 1.0 / (exponent + 1.0)
    depth = (speed**2 / (2.0 * p * stiffness)) ** p
    contact = 2.0 * depth / speed * math.sqrt(math.pi) * math.gamma(1.0 + p) / math.gamma(0.5 + p)
    return -speed * (time - distance / speed - contact), -speed


def launched(wall, tangent, inward, angle):
    """Particles on the wall with unit speed, `angle` [rad] from the wall's tangent towards the inside."""
    return swarm.Particles(wall, math.cos(angle) * tangent + math.sin(angle) * inward)


def wall_frames(axes, n, seed):
    """n random points of an ellipsoid about the origin with a random unit tangent and the inward unit normal."""
    random, axes = np.random.default_rng(seed), np.array(axes)[:, None]
    unit = random.standard_normal((3, n))
    wall = axes * unit / np.sqrt((unit**2).sum(axis=0))
    inward = -wall / axes**2
    inward /= np.sqrt((inward**2).sum(axis=0))
    tangent = random.standard_normal((3, n))
    tangent -= (tangent * inward).sum(axis=0) * inward
    return wall, tangent / np.sqrt((tangent**2).sum(axis=0)), inward
