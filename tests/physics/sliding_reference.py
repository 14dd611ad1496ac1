"""Sliding on a wall phi(x, y, z) = 0 by SciPy's DOP853, independent of the engine; and starts on such walls.

r'' = G - N n, n = grad phi/|grad phi|, N = (v.Hv + G.grad phi)/|grad phi|, with Coulomb's friction -mu |N| v/|v|.
"""

import functools

import numpy as np
import sympy
from scipy.integrate import solve_ivp

RELATIVE, ABSOLUTE = 1e-13, 1e-15
AXES = sympy.symbols("x y z")


@functools.cache
def derivatives(phi):
    """phi, its gradient and its Hessian, as functions of x, y, z."""
    formula = sympy.sympify(phi, locals=dict(zip("xyz", AXES, strict=True)))
    gradient = [formula.diff(axis) for axis in AXES]
    hessian = [[part.diff(axis) for axis in AXES] for part in gradient]
    return tuple(sympy.lambdify(AXES, each, "math") for each in (formula, gradient, hessian))


def on_wall(phi, near):
    """The point of the wall near a point, by Newton's method along the gradient."""
    value, gradient, _ = derivatives(phi)
    point = np.array(near, dtype=float)
    for _ in range(20):
        slope = np.array(gradient(*point))
        point -= value(*point) / (slope @ slope) * slope
    return point


def along_wall(phi, point, velocity):
    """The part of a velocity along the wall at a point, as fast as the whole."""
    normal = np.array(derivatives(phi)[1](*point))
    normal /= np.linalg.norm(normal)
    along = velocity - (velocity @ normal) * normal
    return along * (np.linalg.norm(velocity) / np.linalg.norm(along))


def pull_and_push(phi, r, v, gravity):
    """The unit normal out of phi < 0, and N, the wall's push against it [m/s^2]."""
    _, gradient, hessian = derivatives(phi)
    slope = np.array(gradient(*r))
    steepness = np.linalg.norm(slope)
    return slope / steepness, (v @ np.array(hessian(*r)) @ v + gravity @ slope) / steepness


def slid(phi, r, v, time, gravity=(0.0, 0.0, 0.0), friction=0.0):
    """(position, velocity, the least N on the way) after `time`."""
    gravity = np.array(gravity)

    def rate(_t, y):
        n, push = pull_and_push(phi, y[:3], y[3:], gravity)
        force = gravity - push * n
        if friction > 0.0:
            force -= friction * abs(push) * y[3:] / np.linalg.norm(y[3:])
        return np.concatenate((y[3:], force))

    path = solve_ivp(rate, (0.0, time), np.concatenate((r, v)), "DOP853", rtol=RELATIVE, atol=ABSOLUTE)
    assert path.success
    least = min(pull_and_push(phi, y[:3], y[3:], gravity)[1] for y in path.y.T)
    return path.y[:3, -1], path.y[3:, -1], least
