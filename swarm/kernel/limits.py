"""Round-off of float64 numbers: that of one operation, and that of what many of them make.

The latter are parts of the numbers that a quantity is made of, such as a coordinate, a size, or the terms of a sum.
"""

# From 1 to the next number.
EPSILON = 2.220446049250313e-16
# The least number above 0 with all of its digits: what may be 0 is divided by no less.
TINY = 2.2250738585072014e-308

# Of the length of a vector that was scaled to length 1.
UNIT_LENGTH = 4.0 * EPSILON
# Of a place that a flight has reached, of its coordinates.
PLACE = 4.0 * EPSILON
# Of a place on a wall that a step has solved for, of the size of the scene.
SOLVED_PLACE = 8.0 * EPSILON
# Of the identity of a discrete gradient, of the terms of its inner function.
IDENTITY = 8.0 * EPSILON
# Of a sum that a run keeps, for each step or impact that adds to it.
SUMMED = 8.0 * EPSILON
# Of a point that Newton's method has put onto a surface, of the extent of the scene.
PUT_ON_SURFACE = 16.0 * EPSILON
# Of a start on a wall, of the size of the scene: it may come from a file or another program.
START_ON_WALL = 64.0 * EPSILON
# Of a coefficient of a spline, of the largest one of its cell: a smaller one has no sign.
COEFFICIENT = 64.0 * EPSILON
# Of the energy of a body over one impact: its impulses are solved for.
ENERGY_OF_IMPACT = 64.0 * EPSILON
# Of a place on a side of an outline, and on a ball of a foam, of its coordinates.
ON_OUTLINE, ON_FOAM = 256.0 * EPSILON, 512.0 * EPSILON
