"""The storage curve of examples/bottle_from_stl.py beside its law."""

import numpy as np
import pytest

from examples import bottle_from_stl

pytestmark = pytest.mark.physics


def test_a_shutter_lets_out_what_a_bottle_of_triangles_stores():
    storage = bottle_from_stl.run(2500)
    assert (np.abs(storage.part - storage.law) <= 3.0 * storage.error + 1e-12).all()
    assert storage.part[-1] < 0.2
    assert storage.mesh.names == ("bottle", "shutter")
    assert storage.mesh.contain(np.ascontiguousarray(storage.shown)).all()
