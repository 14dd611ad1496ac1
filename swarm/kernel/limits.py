"""Round-off of float64 numbers, of one operation and of many.

The second is a fraction of the numbers that a quantity consists of, such as a coordinate, a size, or the
terms of a sum.
"""

# The difference of 1 and the next larger number.
EPSILON = 2.220446049250313e-16
# The least number above 0 with all of its digits: a quantity that may be 0 is divided by no smaller one.
TINY = 2.2250738585072014e-308

# Round-off of the length of a vector that was scaled to length 1.
UNIT_LENGTH = 4.0 * EPSILON
# Round-off of a place that a flight has reached, relative to its coordinates.
PLACE = 4.0 * EPSILON
# Round-off of a place on a wall that a step has solved for, relative to the size of the scene.
SOLVED_PLACE = 8.0 * EPSILON
# Round-off of the identity of a discrete gradient, relative to the terms of its inner function.
IDENTITY = 8.0 * EPSILON
# Round-off of a sum that a run keeps, for each step or impact that adds to it.
SUMMED = 8.0 * EPSILON
# Round-off of a point that Newton's method has put onto a surface, relative to the extent of the scene.
PUT_ON_SURFACE = 16.0 * EPSILON
# Round-off of a start on a wall, relative to the size of the scene: it may come from a file or another program.
START_ON_WALL = 64.0 * EPSILON
# Round-off of a coefficient of a spline, relative to the largest of its cell: a smaller one has no sign.
COEFFICIENT = 64.0 * EPSILON
# Round-off of the energy of a body over one impact, the impulses of which are solved for.
ENERGY_OF_IMPACT = 64.0 * EPSILON
# Round-off of a place on a side of an outline, and on a ball of a foam, relative to its coordinates.
ON_OUTLINE, ON_FOAM = 256.0 * EPSILON, 512.0 * EPSILON
