"""Thermal walls: what leaves them, and argon in free molecular flow between two plates, by closed forms.

Leaving a diffuse wall of temperature T, with s^2 = kT/m: the normal speed has the distribution 1 - exp(-v^2/(2 s^2)),
the tangential components are Gaussian of width s; so the energy is 2kT in the mean, with the variance 2 (kT)^2.
Everything random is compared within three standard errors, for one seed.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from energy_books import unbooked
from test_sessions import require_resumed_is_whole

import swarm

pytestmark = pytest.mark.physics

BOLTZMANN = 1.380649e-23
ARGON = 6.6e-26
# Temperatures are kT [J].
COLD, HOT = 300.0 * BOLTZMANN, 600.0 * BOLTZMANN
ERRORS = 3.0
# Kolmogorov's limit: sqrt(n) D is below it with the probability of three standard errors.
KOLMOGOROV = 1.82
WIDTH = 1.0


def spread(temperature):
    """s = sqrt(kT/m) [m/s]."""
    return math.sqrt(temperature / ARGON)


def kolmogorov(sample, distribution):
    """sqrt(n) D of a sample."""
    n = sample.size
    below = distribution(np.sort(sample))
    return math.sqrt(n) * max((np.arange(1, n + 1) / n - below).max(), (below - np.arange(n) / n).max())


def gaussian(width):
    return lambda v: 0.5 * (1.0 + np.array([math.erf(x / (width * math.sqrt(2.0))) for x in v]))


def rayleigh(width):
    return lambda v: 1.0 - np.exp(-0.5 * (v / width) ** 2)


# --- One impact -------------------------------------------------------------------------------------------


def emitted(accommodation=1.0, n=20_000, seed=3, temperature=HOT):
    """What leaves a wall after one impact each: the velocities in the frame of the wall (out of it, along it)."""
    normal = np.array([0.6, -0.48, 0.64])
    along = np.array([0.8, 0.36, -0.48])
    frame = np.array([-normal, along, np.cross(along, normal)])
    wall = swarm.Plane(tuple(normal), 0.0, temperature=temperature, accommodation=accommodation)
    before = frame.T @ [-400.0, 30.0, 50.0]
    start = swarm.Particles(np.outer(-normal, np.full(n, 1e-6)), np.outer(before, np.ones(n)), ARGON)
    result = swarm.simulate(
        swarm.Scene([wall]), start, swarm.Impact(), until=1e-7, threads=1, seed=seed, compile="always"
    )
    assert (result.impacts_per_particle == 1).all()
    return frame @ result.particles.velocity, result


def test_what_leaves_a_diffuse_wall():
    """It has forgotten how it came, and its three components are independent."""
    (out, one, two), result = emitted()
    n, s = out.size, spread(HOT)
    assert (out > 0.0).all()
    assert kolmogorov(out, rayleigh(s)) <= KOLMOGOROV
    assert kolmogorov(one, gaussian(s)) <= KOLMOGOROV
    assert kolmogorov(two, gaussian(s)) <= KOLMOGOROV
    energy = 0.5 * ARGON * (out**2 + one**2 + two**2)
    error = math.sqrt(2.0 / n) * HOT
    assert abs(energy.mean() - 2.0 * HOT) <= ERRORS * error
    # Gamma distributed, of shape 2: the fourth central moment is 24 (kT)^4, so that of the variance is 20/n.
    assert abs(energy.var() / (HOT) ** 2 - 2.0) <= ERRORS * math.sqrt(20.0 / n)
    for a, b in ((out, one), (out, two), (one, two), (out**2, one**2), (one**2, two**2)):
        assert abs(np.corrcoef(a, b)[0, 1]) <= ERRORS / math.sqrt(n)
    # From one particle to the next.
    assert abs(np.corrcoef(out[1:], out[:-1])[0, 1]) <= ERRORS / math.sqrt(n)
    came = 0.5 * ARGON * (400.0**2 + 30.0**2 + 50.0**2)
    assert result.observables["wall_heat"][-1].sum() == pytest.approx(energy.sum() - n * came, rel=1e-11)


def test_the_other_distribution_is_refused():
    """The limit is sharp: neither a half-Gaussian nor a temperature that is 5 % off passes."""
    (out, one, _), _ = emitted()
    s = spread(HOT)
    assert kolmogorov(out, lambda v: 2.0 * gaussian(s)(v) - 1.0) > 10.0 * KOLMOGOROV
    assert kolmogorov(out, rayleigh(spread(1.05 * HOT))) > KOLMOGOROV
    assert kolmogorov(one, gaussian(spread(1.1 * HOT))) > KOLMOGOROV


def test_accommodation():
    """With its probability diffuse, otherwise mirrored, to the last bits."""
    part = 0.3
    (out, one, two), _ = emitted(part)
    mirrored = (np.abs(out - 400.0) <= 1e-10) & (np.abs(one - 30.0) <= 1e-10) & (np.abs(two - 50.0) <= 1e-10)
    n = out.size
    assert abs(mirrored.mean() - (1.0 - part)) <= ERRORS * math.sqrt(part * (1.0 - part) / n)
    assert kolmogorov(out[~mirrored], rayleigh(spread(HOT))) <= KOLMOGOROV
    assert kolmogorov(one[~mirrored], gaussian(spread(HOT))) <= KOLMOGOROV


def test_without_accommodation_a_wall_is_elastic():
    (out, one, two), result = emitted(0.0, n=100)
    assert np.array([out, one, two]) == pytest.approx(np.outer([400.0, 30.0, 50.0], np.ones(100)), rel=1e-13)
    assert result.observables["wall_heat"][-1].tolist() == [0.0]


def test_a_wall_at_0_kelvin_stops_them():
    velocity, result = emitted(n=100, temperature=0.0)
    assert (velocity == 0.0).all()
    assert result.observables["kinetic_energy"][-1] == 0.0
    assert result.observables["wall_heat"][-1].sum() == pytest.approx(-result.observables["kinetic_energy"][0])


# --- Between two plates -----------------------------------------------------------------------------------

PLATES = swarm.Scene(
    [
        swarm.Plane((1.0, 0.0, 0.0), 0.5 * WIDTH, temperature=COLD),
        swarm.Plane((-1.0, 0.0, 0.0), 0.5 * WIDTH, temperature=HOT),
    ]
)


def stationary(n, seed=0):
    """The gas as it is in the end: uniform, and what comes from a plate half a Maxwellian of its temperature.

    Its part is the mean time of its flights, as 1/s: fluxes are equal, so densities are as 1/speed.
    """
    random = np.random.default_rng(seed)
    cold = random.random(n) < spread(HOT) / (spread(HOT) + spread(COLD))
    velocity = np.where(cold, spread(COLD), spread(HOT)) * random.standard_normal((3, n))
    velocity[0] = np.where(cold, -1.0, 1.0) * np.abs(velocity[0])
    position = np.array([random.uniform(-0.5 * WIDTH, 0.5 * WIDTH, n), np.zeros(n), np.zeros(n)])
    return swarm.Particles(position, velocity, ARGON)


def flow(n, round_trips, seed=0, **keywords):
    """A run of the stationary gas, and the time of a mean round trip.

    A flight takes WIDTH/v, and the mean of 1/v over what leaves a plate is sqrt(pi/2)/s.
    """
    trip = WIDTH * math.sqrt(0.5 * math.pi) * (1.0 / spread(COLD) + 1.0 / spread(HOT))
    keywords = {"threads": 1, "compile": "always", **keywords}
    until = round_trips * trip
    return swarm.simulate(PLATES, stationary(n), swarm.Impact(), until=until, every=until / 4.0, seed=seed, **keywords)


def test_heat_flows_between_plates():
    """A round trip carries 2k(T_hot - T_cold) in the mean, and 10^6 impacts are 500 round trips of 1000 particles."""
    n, trips = 1000, 500
    result = flow(n, trips)
    impacts = result.impacts_per_particle
    assert impacts.sum() == result.observables["impacts"][-1]
    # In the stationary gas the mean number of impacts is exactly that; particles are independent.
    assert abs(impacts.mean() - 2.0 * trips) <= ERRORS * impacts.std() / math.sqrt(n)
    cold, hot = result.observables["wall_heat"][-1]
    quantum = HOT - COLD
    # What varies: how often, and with what energy each comes and goes.
    noise = math.hypot(impacts.std() * math.sqrt(n) * quantum, math.sqrt(2.0 * n * trips * (HOT**2 + COLD**2)))
    assert noise < 0.02 * 2.0 * quantum * n * trips
    assert abs(hot - 2.0 * quantum * n * trips) <= ERRORS * noise
    assert abs(cold + 2.0 * quantum * n * trips) <= ERRORS * noise
    # A trip at a time, without the noise of how many there are: half of the impacts of each are on the hot plate.
    noise = math.sqrt(2.0 * n * trips * (HOT**2 + COLD**2)) + n * quantum
    assert abs(hot - quantum * impacts.sum()) <= ERRORS * noise


def test_heat_flows_between_plates_that_accommodate_a_part():
    """Of what leaves a plate 1/(2 - a) had its last diffuse reflection there, the rest at the other one.

    So a round trip, of the same mean time, carries a/(2 - a) of the heat. The start has to be stationary: what is slow
    crosses seldom, and from another start the flux of heat is off by some part of a crossing over the time.
    """
    n, trips, a = 20_000, 20, 0.5
    gas, random = stationary(n), np.random.default_rng(1)
    mirrored = random.random(n) < (1.0 - a) / (2.0 - a)
    gas.velocity[0, mirrored] *= -1.0
    plates = swarm.Scene([replace(plate, accommodation=a) for plate in PLATES.surfaces])
    until = trips * WIDTH * math.sqrt(0.5 * math.pi) * (1.0 / spread(COLD) + 1.0 / spread(HOT))
    result = swarm.simulate(plates, gas, swarm.Impact(), until=until, every=until / 20.0, threads=1)
    cold, hot = np.diff(result.observables["wall_heat"], axis=0).T
    flux = 0.5 * (hot - cold) * 20.0 / (2.0 * (HOT - COLD) * n * trips * a / (2.0 - a))
    noise = flux.std(ddof=1) / math.sqrt(20.0)
    assert noise < 4e-3
    assert abs(flux.mean() - 1.0) <= ERRORS * noise


def test_the_gas_between_plates_is_stationary():
    """At sqrt(T_hot T_cold) in the mean, each half of it a half Maxwellian, and uniform."""
    n = 5000
    result = flow(n, 100)
    end = result.particles
    x, (u, v, w) = end.position[0], end.velocity
    rises = u > 0.0
    assert abs(rises.mean() - spread(COLD) / (spread(COLD) + spread(HOT))) <= ERRORS * 0.5 / math.sqrt(n)
    for part, s in ((rises, spread(HOT)), (~rises, spread(COLD))):
        assert kolmogorov(np.abs(u[part]), lambda a, s=s: 2.0 * gaussian(s)(a) - 1.0) <= KOLMOGOROV
        assert kolmogorov(v[part], gaussian(s)) <= KOLMOGOROV
        assert kolmogorov(w[part], gaussian(s)) <= KOLMOGOROV
    assert kolmogorov(x, lambda a: a / WIDTH + 0.5) <= KOLMOGOROV
    energy = 0.5 * ARGON * (u**2 + v**2 + w**2)
    mean = 1.5 * math.sqrt(HOT * COLD)
    assert abs(energy.mean() - mean) <= ERRORS * energy.std() / math.sqrt(n)


def test_the_account_with_heat():
    """Total energy - heat + dissipated energy stays, to the round-off of what went in and out."""
    result = flow(200, 50)
    observables = result.observables
    heat = observables["wall_heat"]
    total = observables["total_energy"] - heat.sum(axis=1) + observables["dissipated_energy"]
    assert np.abs(heat[-1]).min() > 10.0 * observables["total_energy"][0]
    assert np.abs(total - total[0]).max() <= 1e-13 * np.abs(heat).max()


def test_the_account_with_heat_losses_and_gravity():
    """What is mirrored loses energy by restitution, what is not is given heat; both are booked."""
    law = {"temperature": HOT, "accommodation": 0.5, "restitution": 0.8}
    scene = swarm.Scene([swarm.Sphere(0.5, **law), swarm.Plane((0.0, 0.0, -1.0), 0.3)], (0.0, 0.0, -1e5))
    start = swarm.fill(scene, 200, speed=spread(HOT), mass=ARGON, seed=1)
    result = swarm.simulate(scene, start, swarm.Impact(), until=0.05, every=0.01, threads=1, seed=2)
    observables = result.observables
    assert observables["dissipated_energy"][-1] > observables["total_energy"][0]
    assert observables["wall_heat"][-1][0] > observables["total_energy"][0]
    assert observables["wall_heat"][-1][1] == 0.0
    assert unbooked(observables) <= 1e-13 * np.abs(observables["wall_heat"]).max()


# --- The same bits ----------------------------------------------------------------------------------------


def bits(result):
    heat, impacts = result.observables["wall_heat"], result.impacts_per_particle
    return [array.tobytes() for array in (result.particles.position, result.particles.velocity, heat, impacts)]


def test_bits_follow_from_the_seed_alone():
    """Not from threads, blocks or the tier."""
    expected = bits(flow(3000, 2, seed=7))
    for keywords in ({"threads": 2}, {"threads": 3, "block_size": 1}, {"threads": 1, "block_size": 10**6}):
        assert bits(flow(3000, 2, seed=7, **keywords)) == expected
    others = [bits(flow(3000, 2, seed=seed)) for seed in (0, 8, 2**63)]
    assert all(one != other for one, other in zip((expected, *others), (*others, expected), strict=True))
    assert bits(flow(50, 2, seed=7, compile="never")) == bits(flow(50, 2, seed=7))


def test_a_particle_has_its_own_numbers():
    """Particles that start alike do not stay so; and the first hundred fly as they do without the others."""
    (out, one, _), _ = emitted(n=2000)
    assert np.unique(out).size == np.unique(one).size == 2000
    (few, _, _), _ = emitted(n=100)
    assert np.array_equal(few, out[:100])


def test_resumed_is_whole(tmp_path):
    """The number of its next impact is in the checkpoint."""
    scene = swarm.Scene([swarm.Box((0.5, 0.4, 0.3), temperature=1.0, accommodation=0.7)])
    assert require_resumed_is_whole(tmp_path, scene, swarm.Impact(), n=300, every=20.0) >= 6
