"""Passes and runs in plain Python: what swarm/lanes does for a lane, in the one place that tests share."""

from typing import NamedTuple
from unittest import mock

import numpy as np
from conftest import call

import swarm
from swarm.common.status import Status
from swarm.contact import energy as energies
from swarm.contact import uzawa
from swarm.contact.energy import contact_energy
from swarm.kernel.gravity import potential
from swarm.kernel.vector import vec
from swarm.methods import contract
from swarm.surfaces.time_of_impact import flights


class Pass(NamedTuple):
    """The state after a pass. `surface` is the wall of the contact or -1; `hard`: for `hard_pass`, or may last."""

    position: np.ndarray
    velocity: np.ndarray
    remaining: float
    surface: float
    hard: bool
    impulse: np.ndarray  # per mass, one entry a surface
    hits: float


def energy_of(method, scene, position, velocity, mass=1.0):
    """Kinetic, potential and stored energy of one particle."""
    fall = mass * call(potential, scene.pull(), position)
    stored = call(contact_energy, method.law(), scene.compiled().walls(), 1.0, position)
    return 0.5 * mass * velocity @ velocity + fall + stored


def one_pass(method, scene, position, velocity, remaining, mass=1.0, energy=None):
    """Flight and contact of one particle with `remaining` of its frame to go, in the method's unit.

    `energy` is its energy at the start of the run, to which a contact restores it from round-off.
    """
    position, velocity = np.asarray(position, float), np.asarray(velocity, float)
    energy = energy_of(method, scene, position, velocity, mass) if energy is None else energy
    numbers, walls, gravity = method.numbers(scene), scene.compiled().walls(), scene.pull()
    # Twice the energy scale per mass, as `observables.energy_scale` has it
    scale2 = velocity @ velocity + 2.0 * np.abs(scene.gravity or 0.0).sum() * scene.finite_size()
    constants = call(numbers.constants, mass, energy / mass, scale2)
    own = call(numbers.own, *map(float, constants))
    lane = contract.Lane(vec(position), vec(velocity), np.float64(remaining), 1.0, own)
    if numbers.lands:
        end = call(numbers.land, walls, gravity, lane, call(flights.first_hit, walls, gravity, *lane[:2]))
    else:
        end = call(numbers.flight, walls, gravity, lane)
    flown = lane.remaining - end.remaining
    lane = contract.Lane(end.r, end.v, end.remaining, 1.0, own, flown)
    kappa, unsolved = 0.0, False
    if numbers.most_sweeps(walls) > 0:
        kappa, unsolved = call(numbers.guess, walls, gravity, lane, end.wall)
    for _ in range(numbers.most_sweeps(walls)):
        solution = contract.Solution(kappa, unsolved, contract.NOT_TURNED)
        kappa, unsolved, _record = call(numbers.improve, walls, gravity, lane, end.wall, solution, 0.0)
    turned = contract.NOT_TURNED
    if numbers.turns:
        turned = call(numbers.turn, walls, gravity, lane, end.wall, kappa)
    solution = contract.Solution(kappa, unsolved, turned)
    contact = call(numbers.contact, walls, gravity, lane, end.wall, solution)
    impulse, wall = np.zeros((len(scene.surfaces), 1)), contact.wall
    hard = wall <= contract.HARD or contact.lasts
    if contact.lasts:
        # Another kernel decides whether the contact lasts; it is an impact so far.
        impulse[int(wall), 0] += contact.impulse
    elif hard:
        wall, lanes = contract.HARD - wall, _Lanes(impulse, np.zeros((uzawa.RECORDS, 1)))
        lane = contract.Lane(contact.r, contact.v, contact.remaining, 1.0, own, flown)
        with np.errstate(all="ignore"):
            contact, status = numbers.hard_pass(walls, gravity, lane, wall, lanes, 0)
        assert status == Status.DONE, Status(status).name
    elif wall >= 0.0:
        impulse[int(wall), 0] += contact.impulse
    ends = np.array(contact.r), np.array(contact.v)
    return Pass(*ends, contact.remaining, wall, hard, impulse[:, 0], contact.hits)


class _Lanes(NamedTuple):
    """What `hard_pass` writes into."""

    impulse: np.ndarray
    record: np.ndarray


def run(method, scene, position, velocity, remaining, mass=1.0, restores=True):
    """Passes until nothing of the frame is left."""
    position, velocity = np.asarray(position, float), np.asarray(velocity, float)
    if not restores:
        with mock.patch.object(energies, "restoring_factor", return_value=(1.0, True)):
            return run(method, scene, position, velocity, remaining, mass)
    energy = energy_of(method, scene, position, velocity, mass)
    passes = [Pass(position, velocity, remaining, -1.0, False, np.zeros(len(scene.surfaces)), 0.0)]
    while passes[-1].remaining > 0.0:
        passes.append(
            one_pass(method, scene, passes[-1].position, passes[-1].velocity, passes[-1].remaining, mass, energy)
        )
        assert len(passes) < 5000
    return passes


def simulate(scene, particles, method, until, every=None):
    """`swarm.simulate` without the compiler."""
    return swarm.simulate(scene, particles, method, until=until, every=every, compile="never")
