"""What kernels of bodies take and keep: the body, the rule of a step, the state of all copies, and the lanes."""

from typing import Any, NamedTuple


class Ties(NamedTuple):
    """What ties the points of a body: rows of links, then of springs, then of edges of the elastic strain.

    The vector of a row is y = r_a - r_b.
    """

    ends: Any  # (L, 2) the points a, b
    links: int  # how many of the rows are rigid
    springs: int  # how many are springs
    rest: Any  # (L,) |y|^2 of a link and of an edge without stress, the rest length of a spring
    stiffness: Any  # (L,) of springs
    compliance: Any  # (E, E) 2/K of the edges
    start: Any  # (L,) the first column of each row of the system that is not 0
    inverse_mass: Any  # (P, P) W = 1/M, without rows and columns of points that are fixed
    mass: Any  # (P, P) M
    is_diagonal: bool
    is_free: Any  # (P,) whether a point can move
    couplings: Any  # (L, L) beta W beta, where beta is +1 at a and -1 at b


class Touching(NamedTuple):
    """The points that may touch walls, and what walls do to them."""

    coefficients: Any  # (K, P) b of c = sum b_p r_p
    plain: Any  # (K,) the base point that it is, -1 for a combination of several
    reach: Any  # (K, P) W b
    to_ties: Any  # (K, L) beta W b
    to_others: Any  # (K, K) b W b
    restitution: Any  # (walls,)
    friction: Any  # (walls,)


class Rule(NamedTuple):
    """How a step is taken."""

    dt: float
    stages: Any  # (S,) lengths of the stages of a composed step, in units of the step
    gravity: Any  # (3,)
    room: float  # round-off of a position on a wall [m]
    noise: float  # round-off of |y|^2 of the shortest tie, relative
    lanes: int  # how many bodies at once


class BodyState(NamedTuple):
    """All copies."""

    position: Any  # (3, P, n)
    velocity: Any  # (3, P, n)
    left: Any  # (n,) of the frame [s]
    guess: Any  # (2, L, n) multipliers of the last two steps
    short: Any  # (n,) short steps between impacts, one after the other
    lasting: Any  # (n,) int8, whether a contact lasts
    impacts: Any  # (n,)
    impulse: Any  # (walls, n) [N s]
    dissipated: Any  # (n,) [J]
    sliding: Any  # (n,) [s]
    steps: Any  # (n,)


class Lanes(NamedTuple):
    """The bodies that a thread advances at once."""

    r: Any  # (P, 3, B) at the start of the step
    v: Any
    ra: Any  # at the start of the stage
    va: Any
    p: Any  # where the stage would end without ties
    r1: Any  # at its end
    v1: Any
    force: Any  # (P, 3, B) deceleration by the ties
    y0: Any  # (L, 3, B) of every tie at the start of the stage
    y1: Any
    d: Any  # discrete gradient of |y|^2: y0 + y1
    a: Any  # (L, L, B) system of the multipliers, factored
    f: Any  # (L, B) its right side
    soft: Any  # (L, B) of springs: its diagonal
    multiplier: Any  # (L, B)
    recent: Any  # (L, B) multipliers of the last step
    before: Any  # (L, B) and of the one before


class Pace(NamedTuple):
    """Numbers of each lane, (B,)."""

    left: Any  # of the frame [s]
    step: Any  # the step that is tried [s]
    h: Any  # of the stage [s]
    error: Any
    previous: Any  # error
    rate: Any
    trial: Any  # length to try [s]; 0: a whole step
    low: Any  # bracket of the time of impact [s]
    high: Any
    done: Any  # bool: the ties of this stage are solved
    last: Any  # bool: after this correction
    solved: Any  # bool: of all stages
    out: Any  # bool: a point is outside
    body: Any  # int: number of the body, -1 for none
    point: Any  # int: whose impact it is, -1 for none
    wall: Any
    stuck: Any  # int: trials since the last step
    action: Any  # int
