"""Nearest points of facets: what is left out by the corners alone is never nearer."""

import numpy as np

from birdstrike.solver.kernels.contact.sheet_contact import may_be_nearer, nearest_on_facet

NODES = 6


def test_facet_that_is_left_out_by_its_corners_is_not_nearer():
    rng = np.random.default_rng(0)
    left_out = nearer = 0
    for trial in range(2000):
        rows, columns = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0], indexing="ij")
        flat = np.column_stack([rows.ravel(), columns.ravel(), np.zeros(NODES)])
        nodes = flat + rng.uniform(0.0, 0.45) * rng.uniform(-1.0, 1.0, (NODES, 3))
        quads = np.array([[0, 2, 3, 1], [2, 4, 5, 3]])
        if trial % 3 == 0:
            quads[1, 3] = quads[1, 2]  # a triangle
        point = np.array([rng.uniform(0.0, 1.3), rng.uniform(0.0, 1.0), rng.uniform(-1.5, 1.5)])
        foot, other = np.zeros(6), np.zeros(6)
        assert nearest_on_facet(point, nodes, quads[0], foot)
        assert nearest_on_facet(point, nodes, quads[1], other)
        if not may_be_nearer(point, nodes, quads[1], foot):
            left_out += 1
            assert abs(other[2]) >= (1.0 - 1e-9) * abs(foot[2]), trial
        nearer += abs(other[2]) < abs(foot[2])
    assert left_out > 500
    assert nearer > 100
