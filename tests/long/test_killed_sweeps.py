"""A sweep that is killed at random moments, many times, has the table of one that is not."""

import signal

import numpy as np
import pytest
from sweep_sessions import assert_the_same_table

pytestmark = pytest.mark.long


@pytest.mark.parametrize("seed", range(8))
def test_killed_at_any_moment(tmp_path, seed):
    draw = np.random.default_rng(seed)
    kinds = draw.choice([signal.SIGKILL, signal.SIGKILL, signal.SIGINT, signal.SIGTERM], 6)
    assert_the_same_table(tmp_path, [signal.Signals(kind) for kind in kinds], draw, longest=0.6)
