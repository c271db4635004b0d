"""Derivatives of the residuals of recorded runs against differences."""

from __future__ import annotations

import numpy as np


def check_derivatives(problem, z, share=2e-3, among=lambda _: True):
    """Compare the derivatives by every unknown `among` all, of every column, at the values `z`; each may deviate from
    the difference by a `share` of the largest."""
    comparisons = list(problem.comparisons(z))
    seen = set()
    for unknown in (each for each in problem.unknowns if among(each.name)):
        place = problem.place[unknown.name]
        step = 1e-5 if unknown.name.endswith(".angle") else 1e-4 * unknown.prior_deviation
        near = []
        for sign in (1.0, -1.0):
            other = z.copy()
            other[place] += sign * step
            near.append([each.residuals for each in problem.comparisons(other)])
        for each, ahead, behind in zip(comparisons, *near, strict=True):
            difference = -(ahead - behind) / (2.0 * step)
            size = np.max(np.abs(difference))
            if place not in each.places:
                assert size * unknown.prior_deviation < 1e-3, (unknown.name, each.column)
                continue
            seen.add(unknown.name)
            own = each.slopes[:, list(each.places).index(place)]
            assert np.max(np.abs(own - difference)) < share * size + 1e-6 / unknown.prior_deviation, (
                unknown.name,
                each.column,
                np.max(np.abs(own - difference)) / size,
            )
    assert seen == set(filter(among, problem.place))
