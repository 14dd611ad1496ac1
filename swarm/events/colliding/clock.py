"""The time of a run of balls, which is counted from the start of an epoch on."""

import math

# Of a clock: how many epochs have ended, their length [s], events and collisions so far, the last ones at one time; how
# far balls are to fly in an epoch, about [m]; impacts that are counted since a time [s since the start], how many of
# them were slow, and when balls were found at rest first (see resting.py), 0 for never.
EPOCHS, LENGTH, EVENTS, COLLISIONS, SAME, REACH = 0, 1, 2, 3, 4, 5
IMPACTS, SLOW, SINCE, RESTED, CLOCK = 6, 7, 8, 9, 10


def moment_of(clock, now):
    """A time of the epoch since the start of the run [s]."""
    return clock[EPOCHS] * clock[LENGTH] + now


def fit(clock, speed2):
    """Halve or double the length of epochs to fit the mean square of the speed; their ends stay where they are."""
    way2 = speed2 * clock[LENGTH] * clock[LENGTH]
    reach2 = clock[REACH] * clock[REACH]
    is_even = 2.0 * math.floor(0.5 * clock[EPOCHS]) == clock[EPOCHS]
    if way2 > 4.0 * reach2:
        clock[LENGTH], clock[EPOCHS] = 0.5 * clock[LENGTH], 2.0 * clock[EPOCHS]
    elif 16.0 * way2 < reach2 and is_even:
        clock[LENGTH], clock[EPOCHS] = 2.0 * clock[LENGTH], 0.5 * clock[EPOCHS]
