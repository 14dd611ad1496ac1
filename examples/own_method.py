"""A complete user-defined method: `Mirror` flies to the next wall and reflects the velocity there, and nothing more.

    python examples/own_method.py

Unlike `swarm.Impact` it does not restore the energy from round-off, walls are elastic, and a particle that grazes its
wall takes all of its impacts. `from swarm.methods import contract; help(contract)` says what a method may have.
The numbers of a method are annotated fields of its record, as those of a `WallLaw`. Losses are for laws of walls: no
observable counts what a method itself takes.
"""

from dataclasses import dataclass

import swarm
from swarm.kernel.gravity import accelerated, displacement
from swarm.kernel.jit import select
from swarm.kernel.vector import dot
from swarm.methods import contract
from swarm.methods.base import Method
from swarm.surfaces.time_of_impact import flights


@dataclass(frozen=True)
class Mirror(Method):
    """Exact flights and reflections."""

    def needs(self, scene):
        return *flights.of_flights(scene.gravity is not None), "unit_normal"

    def numbers(self, scene):
        return MirrorNumbers()


class MirrorNumbers(contract.MethodNumbers):
    """The record that kernels take; this method has no numbers."""

    def constants(self, mass, energy, scale2):
        return 0.0, 0.0, 0.0

    def own(self, first, second, third):
        return self

    def land(self, walls, gravity, lane, hit):
        t = select(hit.time < lane.remaining, hit.time, lane.remaining)
        r, v = lane.r + displacement(gravity, lane.v, t), accelerated(gravity, lane.v, t)
        return contract.FlightEnd(r, v, lane.remaining - t, select(hit.time <= lane.remaining, hit.wall, -1.0))

    def contact(self, walls, gravity, lane, wall, solution):
        n = walls.unit_normal(wall, lane.r)
        b = dot(lane.v, n)
        # v1 = v0 - 2 (v0.n) n where v0.n > 0
        impulse = select((wall >= 0.0) & (b > 0.0), 2.0 * b, 0.0)
        hits = select(wall >= 0.0, 1.0, 0.0)
        return contract.Contact(lane.r, lane.v - impulse * n, lane.remaining, wall, impulse, hits, 0.0, False)


if __name__ == "__main__":
    scene = swarm.Scene([swarm.Sphere(0.5)])
    result = swarm.simulate(scene, swarm.fill(scene, 1000, speed=1.0), Mirror(), until=10.0)
    seen = result.observables
    print(f"{seen['impacts'][-1]} impacts, energy error {seen['energy_error'].max():.1e}")
