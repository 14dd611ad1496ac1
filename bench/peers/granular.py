"""LAMMPS: grains that fall into a box, linear springs with friction that remembers its slip (gran/hooke/history)."""

import math
import time

from . import Floats
from .lammps import INSTALL, program, version

__all__ = ["INSTALL", "Pile", "version"]


class Pile:
    """Grains in a box with a floor and four walls, which is high."""

    def __init__(
        self, places: Floats, half: float, grain: tuple[float, float], laws: dict[str, float], dt: float
    ) -> None:
        """Grains at (N, 3) [m], half the width of the box, (diameter [m], mass [kg]), and the step [s].

        The laws are the stiffness [N/m] of the springs along the normal, restitution and friction.
        """
        diameter, mass = grain
        stiffness, restitution, friction = laws["stiffness"], laws["restitution"], laws["friction"]
        # Half the period of a contact of two grains, in which the speed falls by the restitution.
        duration = math.pi * math.sqrt(0.5 * mass / stiffness)
        damping = -2.0 * math.log(restitution) / duration
        springs = f"{stiffness} NULL {damping} NULL {friction} 1"
        density, high = mass / (math.pi / 6.0 * diameter**3), float(places[:, 2].max()) + 10.0 * diameter
        self.program = program()
        self.program.commands_string(f"""
            units si
            atom_style sphere
            atom_modify map array
            boundary f f f
            newton off
            comm_modify vel yes
            region box block {-half} {half} {-half} {half} 0 {high}
            create_box 1 box
            """)
        n = len(places)
        self.program.create_atoms(n, None, [1] * n, places.ravel().tolist())
        self.program.commands_string(f"""
            set group all diameter {diameter} density {density}
            neighbor {0.2 * diameter} bin
            neigh_modify delay 0
            pair_style gran/hooke/history {springs}
            pair_coeff * *
            timestep {dt}
            fix moves all nve/sphere
            fix falls all gravity 9.81 vector 0 0 -1
            fix floor all wall/gran hooke/history {springs} zplane 0 NULL
            fix ends all wall/gran hooke/history {springs} xplane {-half} {half}
            fix sides all wall/gran hooke/history {springs} yplane {-half} {half}
            thermo 1000000000
            run 0
            """)

    def run(self, steps: int) -> float:
        """Processor time of so many steps [s]."""
        began = time.process_time()
        self.program.command(f"run {steps} pre no post no")
        return time.process_time() - began
