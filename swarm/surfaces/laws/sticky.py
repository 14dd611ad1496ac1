"""A wall on which particles stay for a while."""

from ..wall_law import Leave, WallLaw, mirrored
from .law_numbers import require_magnitude


class Sticky(WallLaw):
    """Residence on the wall: a particle leaves as from a mirror, after a random time with an exponential distribution.

    Args:
        time: the mean residence time [s], 0 or more.

    With another law it leaves by that law: `laws=[Lambert(), Sticky(1e-3)]`. In files and observables a particle that
    waits is at its place on the wall, with the velocity with which it will leave: its energy and momentum are those
    after the impact. The log of impacts has the time of the impact. A waiting particle costs nothing in frames in which
    it waits. With `Penalty` it leaves at the start of a step. A ball or a grain that waits is a fixed sphere for
    others. The scene must have no motion, and the wall no mass; where particles have a radius no wall may have a mass.

    Raises:
        SceneError: by the surface: a time below 0; by the run: a wall moves.

    Source: Frenkel, Z. Phys. 26 (1924) 117; de Boer, The Dynamical Character of Adsorption (1953), section 3.

    Example:
        >>> import swarm
        >>> swarm.Sphere(0.5, laws=[swarm.Lambert(), swarm.Sticky(0.01)]).laws[1]
        Sticky(time=0.01)
    """

    time: float

    def check(self, name):
        """Raise unless the time is 0 or more."""
        require_magnitude(f"{name}.time", self.time, "s")

    def leave(self, v, n, u, random, mass):
        """Reflect the particle as a mirror, after a random time."""
        return Leave(mirrored(v, n, u), wait=self.time * random.exponential(0))
