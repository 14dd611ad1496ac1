"""Meshes with what makes triangles hard: acute and obtuse edges, needles, slivers, thin walls."""

import numpy as np
import trimesh

import swarm


def thorny(seed=3, n=24):
    """A vessel whose corners are at random distances: spikes and valleys, and needles at the poles."""
    ball = trimesh.creation.uv_sphere(radius=1.0, count=[n, n])
    directions = np.array(ball.vertices) / np.linalg.norm(ball.vertices, axis=1)[:, None]
    away = np.random.default_rng(seed).uniform(0.4, 1.0, len(directions))
    return directions * away[:, None], np.array(ball.faces)


def slivered(seed=1):
    """A box with thousands of slivers: each side a fan of needles from a corner of it."""
    random, n = np.random.default_rng(seed), 150
    around = np.sort(random.uniform(0.0, 2.0 * np.pi, n))
    rim = np.stack([np.cos(around), np.sin(around), np.zeros(n)], axis=1)
    corners = np.concatenate([rim - (0, 0, 0.3), rim * 0.9 + (0, 0, 0.3)])
    k = np.arange(n)
    after = (k + 1) % n
    sides = [(k, after, n + k), (after, n + after, n + k)]
    fans = [(np.zeros(n - 2, int), k[2:], k[1:-1]), (np.full(n - 2, n), n + k[1:-1], n + k[2:])]
    return corners, np.concatenate([np.stack(part, axis=1) for part in (*sides, *fans)])


def hollow(thickness):
    """The walls of a hollow cube of 1 m."""
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    corners, faces = np.array(box.vertices), np.array(box.faces)
    return np.concatenate([corners, (1.0 - 2.0 * thickness) * corners]), np.concatenate([faces, faces + 8])


def aimed(mesh, start, gravity=None, seed=4):
    """Particles whose flights go exactly to corners and to places on edges."""
    random, n = np.random.default_rng(seed), start.position.shape[1]
    corners = mesh.corners[mesh.triangles]
    which, k = random.integers(0, len(corners), n), random.integers(0, 3, n)
    one, other = corners[which, k], corners[which, (k + 1) % 3]
    part = np.where(np.arange(n) % 2, 0.0, random.random(n))
    target, time = (one + part[:, None] * (other - one)).T, random.uniform(0.3, 1.0, n)
    velocity = (target - start.position) / time
    if gravity is not None:
        velocity = velocity - 0.5 * np.array(gravity)[:, None] * time
    return swarm.Particles(start.position, velocity)
