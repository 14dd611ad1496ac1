"""The time of a run of balls, which is counted from the start of an epoch on."""

# Of a clock: how many epochs have ended, their length [s], events and collisions so far, the last ones at one time.
EPOCHS, LENGTH, EVENTS, COLLISIONS, SAME, CLOCK = 0, 1, 2, 3, 4, 5


def moment_of(clock, now):
    """A time of the epoch since the start of the run [s]."""
    return clock[EPOCHS] * clock[LENGTH] + now
