"""Elastic bodies: the energy of homogeneous stretches in closed form, masses, and what they refuse."""

import math

import numpy as np
import pytest
from scipy.spatial import Delaunay

import swarm
from swarm.bodies.elastic import block

YOUNG, POISSON, DENSITY = 3.0e4, 0.3, 1.2e3
LENGTHS = (1.0, 0.5, 2.0)
BLOCK = block(LENGTHS, (2, 1, 3))


def scattered():
    """A mesh of random points, whose elements have all shapes."""
    points = np.random.default_rng(8).random((30, 3))
    elements = Delaunay(points).simplices.astype(np.int64)
    corners = points[elements]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    elements[volumes < 0.0] = elements[volumes < 0.0][:, [1, 0, 2, 3]]
    return points, elements[np.abs(volumes) > 1e-4]


def volumes_of(nodes, elements):
    corners = nodes[elements]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0


def density_of_energy(gradient, young=YOUNG, poisson=POISSON):
    """lambda/2 tr(E)^2 + mu E:E of E = (F^T F - 1)/2."""
    strain = 0.5 * (gradient.T @ gradient - np.eye(3))
    mu = young / (2.0 * (1.0 + poisson))
    lam = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    return 0.5 * lam * np.trace(strain) ** 2 + mu * (strain**2).sum()


@pytest.mark.parametrize("poisson", [0.3, 0.0, 0.49, -0.9])
@pytest.mark.parametrize("mesh", [BLOCK, scattered()], ids=["block", "scattered"])
def test_a_homogeneous_stretch_has_the_energy_of_its_strain(mesh, poisson):
    """The patch test, of a stretch, a shear and any gradient, and after a rotation."""
    nodes, _elements = mesh
    body = swarm.elastic(mesh, YOUNG, poisson, DENSITY)
    volume = volumes_of(*mesh).sum()
    any_gradient = np.random.default_rng(8).standard_normal((3, 3))
    for gradient in (np.diag([1.1, 1.0, 0.95]), np.eye(3) + 0.2 * np.eye(3, k=1), any_gradient):
        expected = volume * density_of_energy(gradient, YOUNG, poisson)
        assert body.strain.energy(gradient @ nodes.T) == pytest.approx(expected, rel=1e-10)


def test_rigid_motions_cost_nothing():
    nodes, _elements = BLOCK
    body = swarm.elastic(BLOCK, YOUNG, POISSON, DENSITY)
    turn = np.linalg.qr(np.random.default_rng(8).standard_normal((3, 3)))[0]
    moved = (turn @ nodes.T) + np.array([[3.0], [-2.0], [1.0]])
    stretched = body.strain.energy(1.01 * moved)
    assert stretched > 1.0
    # Squares of round-off, relative to those of a stretch of a percent.
    assert body.strain.energy(moved) < 1e-24 * stretched
    copies = np.stack([moved, 1.01 * moved], axis=2)
    assert body.strain.energy(copies) == pytest.approx([0.0, float(stretched)], abs=1e-12 * stretched)


def test_small_strains_are_hooke_s():
    """A bar pulled along x that may become thinner as it likes: half Young's modulus times the strain squared."""
    body = swarm.elastic(BLOCK, YOUNG, POISSON, DENSITY)
    small = 1e-5
    pulled = np.diag([1.0 + small, 1.0 - POISSON * small, 1.0 - POISSON * small])
    energy = body.strain.energy(pulled @ BLOCK[0].T) / np.prod(LENGTHS)
    assert energy == pytest.approx(0.5 * YOUNG * small**2, rel=1e-4)


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_mass_and_first_moments(mass):
    body = swarm.elastic(BLOCK, YOUNG, POISSON, DENSITY, mass)
    assert body.mass_matrix.sum() == pytest.approx(DENSITY * np.prod(LENGTHS), rel=1e-13)
    assert body.mass_matrix.sum(axis=1) @ body.points == pytest.approx(np.zeros(3), abs=1e-10)


def test_consistent_masses_have_the_inertia_of_the_solid():
    """Linear displacements are represented exactly: x.M x is the integral of rho x^2, m a^2/12."""
    body = swarm.elastic(BLOCK, YOUNG, POISSON, DENSITY, "consistent")
    mass = DENSITY * np.prod(LENGTHS)
    second = body.points.T @ body.mass_matrix @ body.points
    assert second == pytest.approx(np.diag(mass * np.square(LENGTHS) / 12.0), abs=1e-10)


@pytest.mark.parametrize("cells", [(1, 1, 1), (2, 1, 3), (3, 4, 2)])
def test_a_block_is_filled_and_closed(cells):
    """Elements fill it without gap or overlap, and its surface is that of the block, anticlockwise."""
    nodes, elements = block(LENGTHS, cells)
    volumes = volumes_of(nodes, elements)
    assert len(nodes) == np.prod(np.add(cells, 1))
    assert volumes == pytest.approx(np.prod(LENGTHS) / (6 * np.prod(cells)), rel=1e-12)
    body = swarm.elastic((nodes, elements), YOUNG, POISSON, DENSITY)
    nx, ny, nz = cells
    assert len(body.faces) == 4 * (nx * ny + ny * nz + nz * nx)
    corners = (body.contacts @ body.points)[body.faces]
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    a, b, c = LENGTHS
    assert np.sqrt((areas**2).sum(axis=1)).sum() == pytest.approx(2.0 * (a * b + b * c + c * a), rel=1e-12)
    # Gauss: a third of the flux of r through a closed surface is the volume.
    assert (areas * corners[:, 0]).sum() / 3.0 == pytest.approx(np.prod(LENGTHS), rel=1e-12)


def test_contacts_are_the_nodes_of_the_surface():
    nodes, elements = block((1.0, 1.0, 1.0), (3, 3, 3))
    body = swarm.elastic((nodes, elements), YOUNG, POISSON, DENSITY)
    outside = np.flatnonzero(np.abs(nodes).max(axis=1) > 0.49)
    assert (body.contacts == np.eye(64)[outside]).all()


NODES, ELEMENTS = block((1.0, 1.0, 1.0), (1, 1, 1))


def changed(first):
    elements = ELEMENTS.copy()
    elements[0] = first
    return elements


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        ({"mesh": NODES}, ["mesh", "(nodes, elements)"]),
        ({"mesh": (NODES, changed(ELEMENTS[0, [1, 0, 2, 3]]))}, ["elements[0]", "inside out", "0 more"]),
        ({"mesh": (NODES, changed([0, 1, 2, 3]))}, ["elements[0]", "plane"]),
        ({"mesh": (NODES, changed([0, 1, 2, 8]))}, ["elements[0][3]", "from 0 to 7"]),
        ({"mesh": (NODES, changed(ELEMENTS[1, [1, 0, 3, 2]]))}, ["elements[1]", "elements[0]"]),
        ({"mesh": (NODES, [])}, ["elements", "at least one"]),
        ({"mesh": ([*NODES, (0.0, 0.0, 9.0)], ELEMENTS)}, ["nodes[8]", "no mass"]),
        ({"mesh": (NODES * math.nan, ELEMENTS)}, ["nodes", "finite"]),
        ({"young": 0.0}, ["young", "above 0"]),
        ({"poisson": 0.5}, ["poisson", "below 0.5", "got 0.5"]),
        ({"poisson": -1.0}, ["poisson", "above -1"]),
        ({"density": -1.0}, ["density", "above 0"]),
        ({"mass": "full"}, ["mass", "'lumped' and 'consistent'", "'full'"]),
    ],
)
def test_errors_name_the_argument(options, parts):
    given = {"mesh": (NODES, ELEMENTS), "young": 1.0, "poisson": 0.3, "density": 1.0} | options
    with pytest.raises(swarm.SceneError) as caught:
        swarm.elastic(**given)
    assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_three_elements_at_a_triangle_overlap():
    nodes = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 2.0), (0.0, 0.0, -1.0)]
    with pytest.raises(swarm.SceneError, match=r"overlap.*3 that share the triangle of nodes \[0, 1, 2\]"):
        swarm.elastic((nodes, [(0, 1, 2, 3), (0, 1, 2, 4), (0, 2, 1, 5)]), 1.0, 0.3, 1.0)


@pytest.mark.parametrize(
    ("lengths", "cells", "parts"),
    [
        ((1.0, 0.0, 1.0), (1, 1, 1), ["lengths[1]", "above 0"]),
        ((1.0, 1.0), (1, 1, 1), ["lengths", "three numbers"]),
        ((1.0, 1.0, 1.0), (1, 0, 1), ["cells[1]", "1 or more"]),
        ((1.0, 1.0, 1.0), 2, ["cells", "3 numbers", "got 2"]),
    ],
)
def test_errors_of_a_block(lengths, cells, parts):
    with pytest.raises(swarm.SceneError) as caught:
        block(lengths, cells)
    assert all(part in str(caught.value) for part in parts), str(caught.value)
