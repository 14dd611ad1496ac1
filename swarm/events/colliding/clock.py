"""The time of a run of balls, counted from the start of an epoch."""

import math

# Entries of a clock: the number of epochs that have ended, their length [s], the events and the collisions so far, the
# last events at one time, and the typical way of a ball in an epoch [m]. Then, of resting.py: the impacts since a time,
# how many of them were slow, that time [s since the start], and the first time at which balls rested, 0 for never.
EPOCHS, LENGTH, EVENTS, COLLISIONS, SAME, REACH = 0, 1, 2, 3, 4, 5
IMPACTS, SLOW, SINCE, RESTED, CLOCK = 6, 7, 8, 9, 10


def moment_of(clock, now):
    """Return a time of the epoch as the time since the start of the run [s]."""
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
