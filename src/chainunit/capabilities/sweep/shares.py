"""Shares of the variance of a result by its parameters, from any points (Sobol's indices), with their intervals.

The result is a polynomial and a rest. Polynomials that are orthonormal for the distributions of the parameters have
their shares in their coefficients (B. Sudret, Global sensitivity analysis using polynomial chaos expansions, 2008).
The size of the rest is that at points which a polynomial does not know: each fold of the points has one from the
other folds. A share may lack all of the rest, or have as much too much, as terms may look alike at the points. So a
poor polynomial widens the intervals, and makes no share wrong. Classes of a parameter narrow the interval of the
share that it explains alone; a result with more waves along a parameter than there are classes of it is not seen. The
errors of the coefficients by chance come on top.

The result over a whole grid is split without an estimate.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...reading.results import Estimate
from .plan import SweptParameter

MOST_POINTS = 8192
"""Largest number of points behind shares."""
LEAST_POINTS = 32
"""Least number of points behind shares."""
_FOLDS = 8
_TERMS, _CHOSEN, _DEGREE, _TOGETHER = 600, 150, 20, 3
"""Largest number of terms to choose from and of chosen terms, their largest degree in a parameter, and the
largest number of parameters of a term."""
_NO_GAIN = 1e-22
"""A part of the variance that is an error of rounding."""
_SIGMAS = 3.0
"""Reach of the intervals in standard deviations: all shares of a sweep stand together."""
_ROUNDING = 1e-7
_IN_CLASS = 8
"""Number of points of a class."""


class Shares(NamedTuple):
    """The shares of a parameter: the one that it explains `alone` (of first order), and the one `in_all`, with what
    it does together with others (total order)."""

    alone: Estimate
    in_all: Estimate


def shares_on_grid(y: Any) -> list[Shares]:
    """The shares of each axis of a grid with these values, all equally frequent. They are exact."""
    whole, axes = float(np.var(y)), range(y.ndim)
    exact = []
    for i in axes:
        by_itself = float(np.var(np.mean(y, axis=tuple(k for k in axes if k != i)))) / whole
        in_all = float(np.mean(np.var(y, axis=i))) / whole
        exact.append(Shares(_share(by_itself, by_itself, by_itself), _share(in_all, in_all, in_all)))
    return exact


def _share(value: float, low: float, high: float) -> Estimate:
    return Estimate(value, low, high, "1", "percent")


def shares_of_points(parameters: Sequence[SweptParameter], x: Any, y: Any) -> list[Shares]:
    """The shares of each of the `parameters` in the variance of a result.

    Parameters
    ----------
    x : values of the parameters, shape (points, parameters)
    y : values of the result, which vary, shape (points,)
    """
    x, y = x[:MOST_POINTS], y[:MOST_POINTS]
    terms = _terms(parameters)
    phi = _polynomials(parameters, x, terms)
    fit = _fitted(phi, (y - np.mean(y)) / np.std(y))
    single = np.count_nonzero(terms, axis=1) == 1
    rows = []
    for i in range(len(parameters)):
        has = terms[:, i] > 0
        most = _most_between(x[:, i], fit.errors)
        rows.append(Shares(_estimate(phi, fit, has & single, most), _estimate(phi, fit, has, 1.0)))
    return rows


def _estimate(phi: Any, fit: _Polynomial, some: Any, most: float) -> Estimate:
    """The share of the terms `some` in the variance, with its interval. The variance that the polynomials leave
    unexplained may be due to these terms up to its share `most`, and all of it to the others; and the share scatters
    with the points."""
    c, e = fit.coefficients, fit.errors
    part, whole, unexplained = float(np.sum(c[some] ** 2)), float(np.sum(c[1:] ** 2)), float(np.mean(e**2))
    if not whole > 0.0:
        return _share(0.0, 0.0, 1.0)
    share = part / whole
    contribution = phi[:, some] @ c[some]
    others = phi[:, 1:] @ c[1:] - contribution
    scatter = float(np.std(((1.0 - share) * contribution - share * others) * e))
    error = 2.0 * scatter / math.sqrt(len(e)) / whole
    least, highest = max(0.0, part - most * unexplained), part + most * unexplained
    beside = whole - part
    low = least / (least + beside + unexplained) - _SIGMAS * error - _ROUNDING
    high = highest / (highest + max(0.0, beside - unexplained)) + _SIGMAS * error + _ROUNDING
    return _share(share, max(0.0, low), min(1.0, high))


def _most_between(x: Any, e: Any) -> float:
    """The largest share of the variance of the rest `e` that may be of `x` alone, by classes of `x`."""
    values, bins = np.unique(x), max(1, len(x) // _IN_CLASS)
    edges = values if len(values) <= bins else np.quantile(x, np.arange(bins) / bins)
    place = np.searchsorted(edges, x, "right") - 1
    count = np.bincount(place, minlength=len(edges))
    means = np.bincount(place, e, len(edges)) / np.maximum(count, 1)
    size = float(np.sum(e * e))
    share = float(np.sum(count * means**2)) / size if size > 0.0 else 0.0
    return min(1.0, share + _SIGMAS * math.sqrt(2.0 * len(edges) + 4.0 * len(x) * share) / len(x))


def _terms(parameters: Sequence[SweptParameter]) -> Any:
    """The degrees of the terms in each parameter, shape (terms, parameters): the constant, then the terms with the
    least product of the degrees plus one (a hyperbolic cross)."""
    d = len(parameters)
    most = [
        min(_DEGREE, len(parameter.values) - 1) if parameter.values else _DEGREE for parameter in parameters
    ]
    rows: list[tuple[int, ...]] = []

    def add(row: list[int], begin: int, left: int) -> None:
        """Terms with `left` as product of the degrees plus one in the parameters from `begin` on."""
        if left == 1:
            rows.append(tuple(row))
        elif sum(map(bool, row)) < _TOGETHER:
            for i in range(begin, d):
                for degree in range(1, min(most[i], left - 1) + 1):
                    if left % (degree + 1) == 0:
                        row[i] = degree
                        add(row, i + 1, left // (degree + 1))
                        row[i] = 0

    for product in range(1, (_DEGREE + 1) * 3):
        add([0] * d, 0, product)
        if len(rows) >= _TERMS:
            break
    return np.array(rows[: max(_TERMS, 1 + d)])


def _polynomials(parameters: Sequence[SweptParameter], x: Any, terms: Any) -> Any:
    """The terms at the points, shape (points, terms)."""
    phi = np.ones((len(x), len(terms)))
    for i, parameter in enumerate(parameters):
        polynomials = _of_one(parameter, x[:, i], int(np.max(terms[:, i])))
        phi *= polynomials[:, terms[:, i]]
    return phi


def _of_one(parameter: SweptParameter, x: Any, degree: int) -> Any:
    """Polynomials up to the degree that are orthonormal for the distribution of a parameter, at its values `x`, shape
    (points, degree + 1): of Hermite for a normal one, of Legendre for an even one, and by QR for single values."""
    from numpy.polynomial import hermite_e, legendre

    if parameter.is_normal:
        t = (x - parameter.centre) / parameter.deviation
        return hermite_e.hermevander(t, degree) / np.sqrt([math.factorial(k) for k in range(degree + 1)])
    low, high = parameter.ends
    if not parameter.values:
        sizes = np.sqrt(2.0 * np.arange(degree + 1) + 1.0)
        return legendre.legvander((2.0 * x - low - high) / (high - low), degree) * sizes
    values = np.array(parameter.values)
    matrix = legendre.legvander((2.0 * values - low - high) / (high - low), degree)
    q, _ = np.linalg.qr(matrix)
    q *= math.sqrt(len(values)) * np.sign(q[0, 0])
    order = np.argsort(values)
    return q[order][np.searchsorted(values[order], x)]


class _Polynomial(NamedTuple):
    """The polynomial that fits the points: its `coefficients`, shape (terms,), and the `errors` at each point of the
    one that fits the points of the other folds, shape (points,)."""

    coefficients: Any
    errors: Any


def _fitted(phi: Any, y: Any) -> _Polynomial:
    """The least-squares fit with the number of terms that has the least error at points which it does not know."""
    fold = np.random.default_rng(0).permutation(len(y)) % _FOLDS
    parts = [(phi[fold == k], y[fold == k]) for k in range(_FOLDS)]
    grams, moments = [p.T @ p for p, _ in parts], [p.T @ v for p, v in parts]
    gram, moment = sum(grams), sum(moments)
    most = min(phi.shape[1], len(y) // 3, _CHOSEN)
    # each part is judged by the fits, of 1, 2, .. terms, to all other parts
    paths = []
    for k, (p, v) in enumerate(parts):
        paths.append(_path(gram - grams[k], moment - moments[k], p, v, most))
    best = int(np.argmin(np.sum([np.sum(path.errors**2, axis=0) for path in paths], axis=0)))
    errors = np.empty(len(y))
    for k, path in enumerate(paths):
        errors[fold == k] = path.errors[:, best]
    whole = _path(gram, moment, phi[:0], y[:0], best + 1)
    coefficients = np.zeros(len(gram))
    coefficients[whole.chosen] = np.linalg.solve(whole.basis[whole.chosen].T, whole.along)
    return _Polynomial(coefficients, errors)


class _Path(NamedTuple):
    """Least-squares fits with one term, two and so on: the `chosen` terms in their order, the products of all terms
    with the chosen ones made orthonormal (`basis`), the coefficients of these (`along`), and the `errors` at the
    points of the fold with each number of terms, shape (points, numbers)."""

    chosen: list[int]
    basis: Any
    along: Any
    errors: Any


def _path(gram: Any, moment: Any, phi: Any, y: Any, most: int) -> _Path:
    """The fits of the points with these products, each with the term more that lessens the error most (orthogonal
    least squares), and their errors at the points of the fold, whose terms and values are `phi` and `y`."""
    squares = np.diag(gram)
    # of each term, what the chosen terms leave: its square, and its product with the result
    free, product = squares.copy(), moment.copy()
    basis, along, errors = np.zeros((len(gram), most)), np.zeros(most), np.empty((len(y), most))
    columns, error = np.zeros((len(y), most)), y.copy()
    chosen: list[int] = []
    term = 0
    while True:
        j, row, root = len(chosen), basis[term].copy(), math.sqrt(free[term])
        basis[:, j] = (gram[:, term] - basis @ row) / root
        columns[:, j] = (phi[:, term] - columns @ row) / root
        along[j] = product[term] / root
        product -= along[j] * basis[:, j]
        free -= basis[:, j] ** 2
        error = error - along[j] * columns[:, j]
        errors[:, j:] = error[:, None]
        chosen.append(term)
        # a term that the chosen ones nearly make gains nothing
        gain = np.where(free > 1e-6 * squares, product**2 / np.maximum(free, 1e-300), 0.0)
        gain[chosen] = 0.0
        term = int(np.argmax(gain))
        if len(chosen) == most or gain[term] <= _NO_GAIN * squares[0]:
            return _Path(chosen, basis[:, : j + 1], along[: j + 1], errors)
