"""What `bench accuracy` compares: a method of this project, or the plain loop."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

import swarm
from swarm.methods.base import Method
from swarm.run.engine import Run

from . import yardstick
from .report import tier


class Contender(Protocol):
    """What can be measured."""

    def seconds(self, particles: swarm.Particles, until: float) -> float:
        """Processor time [s] of the kernels, one thread, all particles."""

    def ends(self, particles: swarm.Particles, times: NDArray) -> Iterator[NDArray]:
        """Positions at these times."""

    def worst(self, particles: swarm.Particles, every: float, frames: int) -> tuple[float, float]:
        """Relative energy error and depth [m] of any particle in any frame."""


@dataclass(frozen=True)
class Ours:
    """A method of this project."""

    scene: swarm.Scene
    method: Method

    def seconds(self, particles: swarm.Particles, until: float) -> float:
        with Run(self.scene.compiled(), particles.copy(), self.method, 1, None, tier()) as run:
            run.advance(0.0, 0.0)
            start = time.process_time()
            run.advance(self.method.span("until", until), until)
            return time.process_time() - start

    def ends(self, particles: swarm.Particles, times: NDArray) -> Iterator[NDArray]:
        for until in times:
            yield swarm.simulate(self.scene, particles, self.method, until=float(until), threads=1).particles.position

    def worst(self, particles: swarm.Particles, every: float, frames: int) -> tuple[float, float]:
        seen = swarm.simulate(self.scene, particles, self.method, until=frames * every, every=every, threads=1)
        return float(seen.observables["energy_error"].max()), float(seen.observables["max_penetration"].max())


@dataclass(frozen=True)
class Plain:
    """What a user would write in an afternoon, in a sphere of 0.5 m, for 1 kg: every step of every particle."""

    dt: float
    penalty: float

    def _advance(self, position: NDArray, velocity: NDArray, span: float) -> None:
        yardstick.plain_verlet(position, velocity, 0.5, self.penalty, self.dt, round(span / self.dt))

    def seconds(self, particles: swarm.Particles, until: float) -> float:
        position, velocity = particles.position.copy(), particles.velocity.copy()
        self._advance(position, velocity, self.dt)
        start = time.process_time()
        self._advance(position, velocity, until)
        return time.process_time() - start

    def ends(self, particles: swarm.Particles, times: NDArray) -> Iterator[NDArray]:
        position, velocity = particles.position.copy(), particles.velocity.copy()
        for span in np.diff(times, prepend=0.0):
            self._advance(position, velocity, span)
            yield position

    def worst(self, particles: swarm.Particles, every: float, frames: int) -> tuple[float, float]:
        position, velocity = particles.position.copy(), particles.velocity.copy()
        start, energy, deepest = 0.5 * (velocity**2).sum(axis=0), 0.0, 0.0
        for _ in range(frames):
            self._advance(position, velocity, every)
            depth = np.maximum(np.linalg.norm(position, axis=0) - 0.5, 0.0)
            now = 0.5 * (velocity**2).sum(axis=0) + 0.5 * self.penalty * depth**2
            energy, deepest = max(energy, float(abs(now / start - 1.0).max())), max(deepest, float(depth.max()))
        return energy, deepest
