"""Threads of large kernels: their stack holds the scratch arrays, where one of the usual size would end the process."""

import threading

import numpy as np
from children import python

from swarm.bodies.body_run import threads_with

# In a process of its own: what is tested ends in a segmentation fault.
LARGE = """
import numba
import numpy as np
from swarm.kernel import arrays, machine_code
from swarm.bodies.body_run import threads_with

@numba.njit(nogil=True)
def sum_of(size):
    values = arrays.scratch(size, np.float64)
    total = 0.0
    for k in range(size):
        values[k] = k
    for k in range(size):
        total += values[k]
    return total

size = 16_000_000
with threads_with(2, 8 * size) as pool:
    print([pool.submit(sum_of, size).result() for _ in range(4)] == [0.5 * size * (size - 1)] * 4)
"""


def test_scratch_arrays_of_128_megabytes_fit():
    done = python("-c", LARGE, timeout=300)
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr


def test_all_threads_are_there_and_others_have_the_usual_stack():
    before = threading.stack_size()
    with threads_with(3, 1 << 26) as pool:
        assert threading.stack_size() == before
        together = threading.Barrier(3, timeout=60)
        places = [pool.submit(together.wait) for _ in range(3)]
        assert np.sort([place.result() for place in places]).tolist() == [0, 1, 2]
