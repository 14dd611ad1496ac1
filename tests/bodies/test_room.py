"""How large a body may be, and that what a body costs to make is its matrices alone."""

import itertools

import numpy as np
import pytest

import swarm
from swarm.bodies import room, tied
from swarm.bodies.elastic import block

LINE = np.arange(90_000.0).reshape(-1, 3)
PAIRS = list(itertools.combinations(range(150), 2))


def fan(points):
    """Two points, and others that are tied to both of them."""
    places = np.random.default_rng(1).standard_normal((points, 3))
    return swarm.Body(places, 1.0, links=[(i, k) for k in range(2, points) for i in (0, 1)])


@pytest.mark.parametrize(
    "build",
    [
        lambda: swarm.chain(20_000, 1.0, 1.0),
        lambda: swarm.chain(10**9, 1.0, 1.0),
        lambda: swarm.chain(10**400, 1.0, 1.0),
        lambda: swarm.Body(LINE, 1.0),
        lambda: swarm.Body(LINE, 1.0, contacts=[]),
        lambda: swarm.Body(LINE[:6000], 1.0, contacts=np.arange(6000)),
        lambda: swarm.Body(LINE[:4000], 1.0, springs=[(*pair, 1.0, 0.0) for pair in PAIRS]),
        lambda: swarm.rigid(np.random.default_rng(0).standard_normal((30_000, 3)), 1.0),
        lambda: block((1.0, 1.0, 1.0), (10**6, 10**6, 10**6)),
        lambda: swarm.elastic(block((1.0, 1.0, 1.0), (10, 10, 10)), 1e5, 0.3, 1.0),
        lambda: swarm.elastic((LINE, [(0, 1, 2, 3)]), 1e5, 0.3, 1.0),
    ],
)  # fmt: skip
def test_a_body_that_is_too_large_is_refused_before_its_matrices_are_made(build, monkeypatch):
    largest = []
    for name in ("zeros", "eye", "diag"):
        real = getattr(np, name)

        def watched(size, *args, real=real, **options):
            made = real(size, *args, **options)
            largest.append(made.nbytes)
            return made

        monkeypatch.setattr(np, name, watched)
    with pytest.raises(swarm.SceneError, match=r"a body must fit in .*B, got .* full and take .*; use fewer points"):
        build()
    assert max(largest, default=0) <= 3e8


def test_what_is_allowed_depends_on_the_memory(monkeypatch):
    swarm.chain(300, 1.0, 1.0)
    monkeypatch.setattr(room.checks, "memory", lambda: 10_000_000)
    with pytest.raises(swarm.SceneError, match=r"must fit in 2\.5 MB, got 300 points, 299 ties, 300 contact points"):
        swarm.chain(300, 1.0, 1.0)


@pytest.mark.parametrize(
    "build",
    [
        lambda: swarm.chain(2000, 1.0, 1.0),
        lambda: swarm.Body(LINE[:1000] ** 1.1, 1.0, links=[(k, k // 2) for k in range(1, 1000)]),
        lambda: fan(400),
    ],
)
def test_the_rank_of_what_is_seen_point_by_point_takes_no_large_matrix(build, monkeypatch):
    """Eigenvalues of n constraints take n^3: what can be seen at a point has at most three."""
    sizes = []
    for name in ("eigh", "eigvalsh", "cholesky", "svd", "inv"):
        real = getattr(np.linalg, name)
        monkeypatch.setattr(np.linalg, name, lambda matrix, real=real: (sizes.append(len(matrix)), real(matrix))[1])
    build()
    assert max(sizes) <= 3


@pytest.mark.parametrize("seed", range(60))
def test_points_alone_say_the_same_as_all_together(seed):
    """Random frames on a grid, whose directions often depend: the same dependences as of the whole matrix."""
    random = np.random.default_rng(seed)
    count = int(random.integers(4, 10))
    grid = np.array(list(itertools.product(range(3), repeat=3)), float)
    points = random.permutation(grid)[:count] + (0.3 * random.standard_normal((count, 3)) if seed % 3 == 0 else 0.0)
    pairs = np.array(list(itertools.combinations(range(count), 2)))
    links = random.permutation(pairs)[: int(random.integers(count - 1, min(len(pairs), 3 * count - 3)))]
    anchors = dict.fromkeys(random.permutation(count)[: int(random.integers(0, 3))].tolist())
    links = np.array([pair for pair in links.tolist() if not set(pair) <= set(anchors)]).reshape(-1, 2)
    guides = [(int(p), swarm.Plane(random.standard_normal(3), 0.0)) for p in range(count) if p not in anchors][:2]
    given = list(tied.ties(links, guides, points.T[:, :, None]))
    whole = tied._dependences(given, anchors)
    left = tied._left(given, anchors, count)
    null = tied._dependences([given[k] for k in left], anchors)
    assert null.shape[1] == whole.shape[1]
    # The same space: what is left out has no share, and projections agree.
    spread = np.zeros((len(whole), null.shape[1]))
    spread[left] = null
    assert spread @ spread.T == pytest.approx(whole @ whole.T, abs=1e-10)


def test_many_anchors_are_looked_at_from_those_that_move():
    """A net that hangs on a hundred fixed points: no path from each to each."""
    n = 100
    above = np.array([(k, 0.0, 0.0) for k in range(n)], float)
    below = above - [(0.0, 0.0, 1.0)]
    links = [(k, n + k) for k in range(n)] + [(n + k, n + k + 1) for k in range(n - 1)]
    body = swarm.Body(np.concatenate([above, below]), 1.0, links=links, anchors=dict.fromkeys(range(n)))
    assert len(body.anchors) == n
