"""Passes and runs in plain Python: what lanes.py does for a lane, in the one place that tests share."""

from typing import NamedTuple
from unittest import mock

import numpy as np
from conftest import call

import swarm
from swarm.contact import energy as energies
from swarm.contact import uzawa
from swarm.contact.energy import contact_energy
from swarm.kernel.gravity import potential
from swarm.methods import base
from swarm.status import Status
from swarm.surfaces import flights


class Pass(NamedTuple):
    """The state after a pass. `surface` is the wall of the contact or -1, `hard` whether `hard_pass` did it."""

    position: np.ndarray
    velocity: np.ndarray
    left: float
    surface: float
    hard: bool
    impulse: np.ndarray  # per mass, one entry a surface
    hits: float


def energy_of(method, scene, position, velocity, mass=1.0):
    """Kinetic, potential and stored energy of one particle."""
    fall = mass * call(potential, scene.pull(), position)
    return 0.5 * mass * velocity @ velocity + fall + call(contact_energy, method.law(), scene.chain(), 1.0, position)


def one_pass(method, scene, position, velocity, left, mass=1.0, energy=None):
    """Flight and contact of one particle with `left` of its frame to go, in the method's unit.

    `energy` is its energy at the start of the run, to which a contact restores it from round-off.
    """
    position, velocity = np.asarray(position, float), np.asarray(velocity, float)
    energy = energy_of(method, scene, position, velocity, mass) if energy is None else energy
    numbers, chain, gravity = method.numbers(scene), scene.chain(), scene.pull()
    constants = call(base.lane_constants, numbers, mass, energy / mass, velocity)
    # What blocks.py seeks.
    time, wall = call(flights.first_hit, chain, gravity, position, velocity)
    *state, left, surface = call(
        base.flight, numbers, chain, gravity, position, velocity, left, *constants, float(time), float(wall), 1.0
    )
    kappa, unsolved = 0.0, False
    if base.most_sweeps(numbers, chain) > 0:
        kappa, unsolved = call(base.guess, numbers, chain, gravity, *state, left, constants[0], surface)
    for _ in range(base.most_sweeps(numbers, chain)):
        kappa, unsolved, *_loop = call(
            base.improve, numbers, chain, gravity, *state, left, constants[0], surface, kappa, unsolved, 0.0
        )
    turned = (0.0, 0.0, 0.0, 0.0)
    if base.turns(numbers):
        turned = call(base.turn, numbers, chain, gravity, *state, left, *constants[:2], surface, kappa)
    *state, left, surface, given, hits, _energy = call(
        base.contact, numbers, chain, gravity, *state, left, *constants, surface, kappa, unsolved, *turned
    )
    impulse = np.zeros((len(scene.surfaces), 1))
    hard = surface <= base.HARD
    if hard:
        surface = base.HARD - surface
        with np.errstate(all="ignore"):
            *state, left, hits, _energy, status = base.hard_pass(
                numbers,
                chain,
                gravity,
                *state,
                left,
                *map(float, constants),
                surface,
                impulse,
                np.zeros((uzawa.RECORDS, 1)),
                0,
            )
        assert status == Status.DONE, Status(status).name
    elif surface >= 0.0:
        impulse[int(surface), 0] += given
    return Pass(np.array(state[:3]), np.array(state[3:]), left, surface, hard, impulse[:, 0], hits)


def run(method, scene, position, velocity, left, mass=1.0, restores=True):
    """Passes until nothing of the frame is left."""
    position, velocity = np.asarray(position, float), np.asarray(velocity, float)
    if not restores:
        with mock.patch.object(energies, "restored", return_value=(1.0, True)):
            return run(method, scene, position, velocity, left, mass)
    energy = energy_of(method, scene, position, velocity, mass)
    passes = [Pass(position, velocity, left, -1.0, False, np.zeros(len(scene.surfaces)), 0.0)]
    while passes[-1].left > 0.0:
        passes.append(one_pass(method, scene, passes[-1].position, passes[-1].velocity, passes[-1].left, mass, energy))
        assert len(passes) < 5000
    return passes


def simulate(scene, particles, method, until, every=None):
    """`swarm.simulate` without the compiler."""
    return swarm.simulate(scene, particles, method, until=until, every=every, compile="never")
