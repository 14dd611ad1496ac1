"""Embree: a billiard of rays in a mesh, by embreex; single precision, so that a ray may pass between two triangles."""

import time

import numpy as np

from . import Floats

INSTALL = "pip install embreex"


def version() -> str:
    """Name and version."""
    import embreex

    return f"Embree by embreex {embreex.__version__}"


def run(corners: Floats, triangles: Floats, start: tuple[Floats, Floats], impacts: int) -> tuple[float, int]:
    """Processor time of the rays alone for an impact [s], and how many points no triangle stopped.

    Args:
        corners: (C, 3) [m].
        triangles: (T, 3) numbers of corners, their normals outwards.
        start: (N, 3) places [m] and directions.
        impacts: of each point.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene(robust=True)
    TriangleMesh(scene, corners[triangles].astype(np.float32))
    places, ways = (np.ascontiguousarray(one, np.float32) for one in start)
    spent, met, lost = 0.0, 0, 0
    for _k in range(impacts):
        began = time.process_time()
        seen = scene.run(places, ways, output=1)
        spent += time.process_time() - began
        hits = seen["primID"] >= 0
        met += int(hits.sum())
        lost += int((~hits).sum())
        places, ways = places[hits], ways[hits]
        normals = seen["Ng"][hits] / np.linalg.norm(seen["Ng"][hits], axis=1)[:, None]
        # Outwards, whatever the order of the corners.
        across = (ways * normals).sum(axis=1)
        normals *= np.sign(across)[:, None]
        # Off the triangle, by round-off of single precision: else the next ray meets it again.
        places = places + seen["tfar"][hits][:, None] * ways - 1e-6 * normals
        ways = ways - 2.0 * abs(across)[:, None] * normals
    return spent / met, lost
