"""The same motion in other units: what the tests of magnitudes share."""

import swarm

# Powers of 2 of length, time and mass: 2^40 is 1e12.
UNITS = [(40, 0, 0), (-40, 0, 0), (0, 40, 0), (0, -40, 0), (0, 0, 40), (0, 0, -40), (13, -27, 39)]


def sphere(length, time):
    return swarm.Scene([swarm.Sphere(0.4 * length)])


METHODS = {
    "impact": lambda length, time, mass: swarm.Impact(),
    "impact, chord": lambda length, time, mass: swarm.Impact(contact_step=2.0**-8 * time),
    "penalty": lambda length, time, mass: swarm.Penalty(2.0**-8 * time, 3e4 * mass / time**2),
    "verlet": lambda length, time, mass: swarm.Verlet(2.0**-8 * time, 3e4 * mass / time**2),
    "midpoint": lambda length, time, mass: swarm.Midpoint(2.0**-8 * time, 3e4 * mass / time**2),
    "trapezoidal": lambda length, time, mass: swarm.Trapezoidal(2.0**-8 * time, 3e4 * mass / time**2),
    "augmented Lagrangian": lambda length, time, mass: swarm.AugmentedLagrangian(
        2.0**-8 * time,
        3e4 * mass / time**2,
        tolerance=1e-12 * mass * (length / time) ** 2,
        adaptive=True,
        acceleration="reflection",
        on_unconverged="impact",
    ),
}


def ends(name, scene_of, length=1.0, time=1.0, mass=1.0, until=8.0):
    """Positions over lengths, velocities over speeds, and what is seen of the run, all without unit.

    `scene_of(length, time)` is the scene in these units.
    """
    start = swarm.fill(scene_of(1.0, 1.0), 100, speed=0.5, seed=1)
    particles = swarm.Particles(start.position * length, start.velocity * length / time, start.mass * mass)
    method = METHODS[name](length, time, mass)
    result = swarm.simulate(scene_of(length, time), particles, method, until=until * time, every=0.25 * until * time)
    seen = result.observables
    return (
        result.particles.position / length,
        result.particles.velocity / length * time,
        seen["impulse"] / mass / length * time,
        seen["energy_error"],
        seen["max_penetration"] / length,
        seen["impacts"],
    )
