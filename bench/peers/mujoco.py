"""MuJoCo: one rigid polyhedron in a box of six planes, without friction and losses."""

import time

from . import Floats

INSTALL = "pip install mujoco"
# A process that runs twenty balls in a box for 10 s.
FIRST = """
import mujoco
walls = "".join(
    f'<geom type="plane" size="9 9 1" pos="{0.5 * side * (k == 0)} {0.5 * side * (k == 1)} {0.5 * side * (k == 2)}" '
    f'euler="{turn}"/>'
    for k, side, turn in ((0, -1, "0 90 0"), (0, 1, "0 -90 0"), (1, -1, "-90 0 0"), (1, 1, "90 0 0"), (2, -1, "0 0 0"),
                          (2, 1, "180 0 0"))
)
balls = "".join(
    f'<body pos="{0.2 * (k % 3 - 1)} {0.2 * (k // 3 % 3 - 1)} {0.2 * (k // 9 - 1)}"><freejoint/>'
    '<geom type="sphere" size="0.01" mass="1"/></body>'
    for k in range(20)
)
model = mujoco.MjModel.from_xml_string(
    f'<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>{walls}{balls}</worldbody></mujoco>'
)
data = mujoco.MjData(model)
data.qvel[:] = 0.5
mujoco.mj_step(model, data, nstep=5000)
"""
# Stiffness of a wall, over the mass that it meets [1/s^2]; without damping it is a spring that loses nothing.
_STIFFNESS = 1e5
# How the plane z = 0 is turned to each wall: axis, side, Euler's angles.
_WALLS = (
    (0, -1, "0 90 0"),
    (0, 1, "0 -90 0"),
    (1, -1, "-90 0 0"),
    (1, 1, "90 0 0"),
    (2, -1, "0 0 0"),
    (2, 1, "180 0 0"),
)


def version() -> str:
    """Name and version."""
    import mujoco

    return f"MuJoCo {mujoco.__version__}"


def run(
    corners: Floats, box: tuple[float, float, float], mass: float, motion: tuple[float, float],
    step: tuple[float, float],
) -> tuple[float, float]:  # fmt: skip
    """Relative energy error at the end and seconds, of a body with a speed and a spin, for (dt, until)."""
    import mujoco

    (speed, spin), (dt, until) = motion, step
    planes = []
    for axis, side, turn in _WALLS:
        place = " ".join(str(side * box[axis]) if k == axis else "0" for k in range(3))
        planes.append(f'<geom type="plane" size="9 9 1" pos="{place}" euler="{turn}"/>')
    vertices = " ".join(f"{x:.17g}" for x in corners.ravel())
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{dt}" gravity="0 0 0" integrator="RK4" cone="elliptic"/>'
        f'<asset><mesh name="body" vertex="{vertices}"/></asset>'
        f'<default><geom condim="1" solref="-{_STIFFNESS} 0" solimp="0.99 0.99 0.001 0.5 2"/></default><worldbody>'
        f'{"".join(planes)}<body><freejoint/><geom type="mesh" mesh="body" mass="{mass}"/></body></worldbody></mujoco>'
    )
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    data = mujoco.MjData(model)
    data.qvel[:3] = [part * speed for part in (0.6, -0.48, 0.64)]
    data.qvel[3:] = [part * spin for part in (0.36, -0.48, 0.8)]
    mujoco.mj_forward(model, data)
    first = data.energy[1]
    begin = time.perf_counter()
    mujoco.mj_step(model, data, nstep=round(until / dt))
    seconds = time.perf_counter() - begin
    # Between impacts all energy is kinetic.
    while data.ncon > 0:
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return float(abs(data.energy[1] / first - 1.0)), seconds
