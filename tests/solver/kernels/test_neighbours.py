"""Neighbour lists against a k-d tree, and the Verlet skin's promise."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from birdstrike.solver.bird.neighbour_list import NEAR, SKIN, VerletList
from birdstrike.solver.kernels.bird.neighbours import WIDTH


def rows(verlet: VerletList) -> list[list[int]]:
    found = [verlet.neighbour[verlet.start[a] : verlet.start[a + 1]] for a in range(verlet.n)]
    assert all(len(row) % WIDTH == 0 for row in found)
    return [sorted(int(b) for b in row if b != a) for a, row in enumerate(found)]


def test_list_equals_that_of_a_tree():
    x = np.random.default_rng(1).uniform(-1.0, 1.0, (700, 3)) * [1.0, 0.5, 0.2]
    verlet = VerletList(len(x), 0.3)
    verlet.build(x, np.ones(len(x), np.bool_))
    tree = KDTree(x)
    expected = [sorted(set(found) - {a}) for a, found in enumerate(tree.query_ball_point(x, verlet.cutoff))]
    assert rows(verlet) == expected


def test_inactive_particles_are_nobodys_neighbours():
    x = np.random.default_rng(2).uniform(0.0, 1.0, (200, 3))
    active = np.ones(len(x), np.bool_)
    active[::3] = False
    verlet = VerletList(len(x), 0.3)
    verlet.build(x, active)
    listed = rows(verlet)
    assert all(not listed[a] for a in range(0, len(x), 3))
    assert all(b % 3 for row in listed for b in row)


def test_list_stays_complete_until_it_is_rebuilt():
    rng = np.random.default_rng(3)
    x = rng.uniform(0.0, 1.0, (400, 3))
    active = np.ones(len(x), np.bool_)
    verlet = VerletList(len(x), 0.2)
    verlet.build(x, active)
    common_flight = np.array([5.0, 0.0, 0.0])
    x = x + common_flight + rng.uniform(-1.0, 1.0, x.shape) * 0.49 * (SKIN - NEAR) * 0.2 / np.sqrt(3.0)
    verlet.refresh(x, active)
    assert verlet.rebuilds == 1, "a common motion alone must not cost a rebuild"
    near = [set(verlet.neighbour[first:stop]) for first, stop in zip(verlet.start, verlet.stop, strict=False)]
    pairs = KDTree(x).query_pairs(0.2)
    assert all(b in near[a] and a in near[b] for a, b in pairs)
    assert verlet.mean_length < 0.9 * verlet.start[-1] / verlet.n
    x[0] += SKIN * 0.2
    verlet.refresh(x, active)
    assert verlet.rebuilds == 2


def test_one_stray_particle_does_not_exhaust_memory():
    x = np.random.default_rng(4).uniform(0.0, 1.0, (100, 3))
    x[0] = [1e6, 1e6, 1e6]
    verlet = VerletList(len(x), 0.3)
    verlet.build(x, np.ones(len(x), np.bool_))
    assert rows(verlet)[0] == []
