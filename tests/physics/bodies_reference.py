"""Motions of bodies that the engine has no part in: SciPy's DOP853 and eigenvalues."""

import math

import numpy as np
import scipy.linalg
from scipy.integrate import solve_ivp

RELATIVE, ABSOLUTE = 1e-13, 1e-15


def integrated(rate, start, time):
    """The state after `time`."""
    path = solve_ivp(rate, (0.0, time), start, "DOP853", rtol=RELATIVE, atol=ABSOLUTE)
    assert path.success
    return path.y[:, -1]


# --- A double pendulum ------------------------------------------------------------------------------------


def double_pendulum(lengths, masses, angles, rates, gravity, time):
    """(angles, their rates) of two bobs, from the vertical, after `time`."""
    (l1, l2), (m1, m2) = lengths, masses

    def rate(_t, y):
        a, b, p, q = y
        c, s = math.cos(a - b), math.sin(a - b)
        matrix = [[(m1 + m2) * l1, m2 * l2 * c], [l1 * c, l2]]
        right = [-m2 * l2 * q * q * s - (m1 + m2) * gravity * math.sin(a), l1 * p * p * s - gravity * math.sin(b)]
        return [p, q, *np.linalg.solve(matrix, right)]

    y = integrated(rate, [*angles, *rates], time)
    return y[:2], y[2:]


def bobs(lengths, angles, rates):
    """(points, velocities) (3, 3) of the anchor at the origin and the two bobs, which swing in y = 0."""
    out = np.array([1.0, 0.0, 0.0])
    up = np.array([0.0, 0.0, 1.0])
    points, velocity = np.zeros((3, 3)), np.zeros((3, 3))
    for k, (length, angle, rate) in enumerate(zip(lengths, angles, rates, strict=True)):
        points[:, k + 1] = points[:, k] + length * (math.sin(angle) * out - math.cos(angle) * up)
        velocity[:, k + 1] = velocity[:, k] + length * rate * (math.cos(angle) * out + math.sin(angle) * up)
    return points, velocity


# --- Small vibrations of an elastic body ------------------------------------------------------------------


def stiffness_matrix(points, strain):
    """(3P, 3P) second derivatives of (s - s0).K (s - s0)/2 without stress, in the order x of all points, y, z."""
    count = len(points)
    rates = np.zeros((len(strain.edges), 3, count))
    for k, (i, j) in enumerate(strain.edges):
        rates[k, :, i] = 2.0 * (points[i] - points[j])
        rates[k, :, j] = -rates[k, :, i]
    rates = rates.reshape(len(strain.edges), -1)
    return rates.T @ strain.stiffness @ rates


def vibrations(body):
    """(angular frequencies [rad/s], modes (3, P, 3P) with modes.M modes = 1), from the slowest."""
    matrix = np.kron(np.eye(3), body.mass_matrix)
    squares, modes = scipy.linalg.eigh(stiffness_matrix(body.points, body.strain), matrix)
    return np.sqrt(np.maximum(squares, 0.0)), modes.reshape(3, len(body.points), -1)


def longitudinal(body):
    """(frequency [rad/s], mode (3, P)) of the mode most alike cos(pi x/L) along x."""
    frequencies, modes = vibrations(body)
    x = body.points[:, 0]
    alike = np.cos(math.pi * (x - x.min()) / np.ptp(x))
    weights = np.abs(np.einsum("p,pq,qk->k", alike, body.mass_matrix, modes[0]))
    best = int(np.argmax(weights))
    return frequencies[best], modes[:, :, best]
