"""Other ways to name a missing effect, on the same logs and with the same candidates.

    select("lasso", path, mapping) -> ["air_drag"]      MissingLibrary where it is not installed

    pysindy          sequentially thresholded least squares (PySINDy's STLSQ) on the base model's
                     residual, threshold by held-out runs
    lasso            LASSO on the residual (scikit-learn), penalty by held-out runs
    lasso_projected  the same after projecting out what refitting the base model absorbs
    bic              each effect added and everything refitted, forward up to three, by the Bayesian
                     criterion with the effective number of samples

Each gets what joulepath's diagnosis gets: the fitted base model, its residual, and the columns of
the catalogue (planner.telemetry.terms.candidate_terms), scaled to their usual sizes. Of the
settings within one standard error of the best held-out error the sparsest is taken, which favours
them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.telemetry.estimation import Fit, fit
from planner.telemetry.logs import Telemetry
from planner.telemetry.prediction import Nodes
from planner.telemetry.starting_model import starting_model
from planner.telemetry.terms import CandidateLibrary, candidate_library
from tests.hidden_effects.logs import VEHICLE

Array = NDArray[np.float64]

FOLDS = 5
THRESHOLDS = np.geomspace(0.003, 1.0, 18)
LARGEST = 3  # effects that bic adds


class MissingLibrary(Exception):
    """A library that the comparison needs is not installed."""


@dataclass(frozen=True)
class Task:
    """What every method gets.

    Attributes:
        log: the rows.
        base: the fitted base model.
        library: the catalogue around it.
        residual: (n,) W.
        tangent: (n, p) W per unit of the base model's parameters.
        columns: (n, m) W of every candidate, each scaled to rms 1.
        effects: (m,) slug of each column.
        folds: (n,) number of the fold that a row is held out in, by run.
    """

    log: Telemetry
    base: Fit
    library: CandidateLibrary
    residual: Array
    tangent: Array
    columns: Array
    effects: list[str]
    folds: NDArray[np.int64]


def prepare(path: Path, mapping: Path | None = None, vehicle: str = VEHICLE) -> Task:
    """Read a log, fit the base model, and evaluate the candidates."""
    log = Telemetry.read(path, mapping)
    base = fit(log, starting_model(vehicle))
    library = candidate_library(base.model, log)
    nodes = Nodes.of(log, library.model)
    _, tangent, columns = library.columns(nodes)
    size = np.sqrt(np.mean(columns**2, axis=0))
    return Task(
        log,
        base,
        library,
        base.residual,
        tangent,
        columns / np.where(size > 0.0, size, 1.0),
        [column.effect for column in library.candidates],
        log.run % FOLDS,
    )


def select(method: str, path: Path, mapping: Path | None = None) -> list[str]:
    """Effects that a method names."""
    return METHODS[method](prepare(path, mapping))


def pysindy(task: Task) -> list[str]:
    """STLSQ on the raw residual."""
    try:
        from pysindy import STLSQ
    except ImportError as error:
        raise MissingLibrary("pysindy is not installed: pip install 'joulepath[bench]'") from error

    def solve(columns: Array, target: Array, threshold: float) -> Array:
        optimiser = STLSQ(threshold=threshold, alpha=1e-3, max_iter=50)
        optimiser.fit(columns, target[:, None])
        found: Array = np.asarray(optimiser.coef_, dtype=np.float64).ravel()
        return found

    # Thresholds are shares of the residual's scatter.
    levels = THRESHOLDS * float(np.std(task.residual))
    return _named(task, _chosen(task, task.columns, task.residual, levels, solve))


def lasso(task: Task) -> list[str]:
    """LASSO on the raw residual."""
    return _named(task, _lasso(task, task.columns, task.residual))


def lasso_projected(task: Task) -> list[str]:
    """LASSO on what refitting the base model cannot absorb."""
    u, s, _ = np.linalg.svd(task.tangent / np.linalg.norm(task.tangent, axis=0), full_matrices=0)
    u = u[:, s > 1e-9 * s[0]]
    columns = task.columns - u @ (u.T @ task.columns)
    size = np.sqrt(np.mean(columns**2, axis=0))
    seen = size > 0.002**0.5  # less than 0.2 % of the variance is left: not testable
    columns = np.where(seen, columns / np.where(seen, size, 1.0), 0.0)
    return _named(task, _lasso(task, columns, task.residual - u @ (u.T @ task.residual)))


def bic(task: Task) -> list[str]:
    """Forward choice by the Bayesian criterion; everything is refitted for every candidate."""
    lag = np.corrcoef(task.residual[:-1], task.residual[1:])[0, 1]
    count = len(task.log) * (1.0 - max(lag, 0.0)) / (1.0 + max(lag, 0.0))
    library = task.library
    chosen: list[str] = []
    now = library.model
    best = _bic(task.base.residual, count, len(library.places))
    places = list(library.places)
    while len(chosen) < LARGEST:
        found: list[tuple[float, str, Any, list[int]]] = []
        for slug in sorted(set(task.effects) - set(chosen)):
            start, own = _best_shape(task, slug, now)
            refit = fit(task.log, start, free=[*places, *own], noise=task.base.noise)
            value = _bic(refit.residual, count, len(places) + len(own))
            found.append((value, slug, refit.model, own))
        value, slug, model, own = min(found, key=lambda entry: entry[0])
        if value >= best:
            break
        best, now = value, model
        chosen.append(slug)
        places += own
    return chosen


def _bic(residual: Array, count: float, parameters: int) -> float:
    return float(count * np.log(np.mean(residual**2)) + parameters * np.log(count))


def _best_shape(task: Task, slug: str, model: Any) -> tuple[Any, list[int]]:
    """The model with the effect's best scanned shape, and the places of its parameters."""
    mine = [k for k, effect in enumerate(task.effects) if effect == slug]
    shapes = {task.library.candidates[k].shape for k in mine}
    if shapes == {None}:
        return model, sorted({task.library.candidates[k].place for k in mine})

    def left(shape: tuple[int, float] | None) -> float:
        of_shape = [k for k in mine if task.library.candidates[k].shape == shape]
        table = np.column_stack([task.tangent, task.columns[:, of_shape]])
        table = table / np.maximum(np.linalg.norm(table, axis=0), 1e-300)
        found = np.linalg.lstsq(table, task.residual, rcond=1e-9)[0]
        return float(np.sum((task.residual - table @ found) ** 2))

    shape = min(shapes, key=left)
    assert shape is not None
    places = {c.place for c in task.library.candidates if c.effect == slug and c.shape == shape}
    return model.with_parameter(*shape), sorted(places)


def _lasso(task: Task, columns: Array, target: Array) -> Array:
    try:
        from sklearn.linear_model import Lasso
    except ImportError as error:
        raise MissingLibrary(
            "scikit-learn is not installed: pip install 'joulepath[bench]'"
        ) from error

    def solve(columns: Array, target: Array, penalty: float) -> Array:
        model = Lasso(alpha=penalty, fit_intercept=False, precompute=True, max_iter=5000, tol=1e-3)
        found: Array = model.fit(np.asfortranarray(columns), target).coef_
        return found

    largest = float(np.abs(columns.T @ target).max()) / len(target)
    levels = largest * np.geomspace(1e-3, 1.0, 24)
    return _chosen(task, columns, target, levels, solve)


def _chosen(
    task: Task,
    columns: Array,
    target: Array,
    levels: Array,
    solve: Callable[[Array, Array, float], Array],
) -> Array:
    """Coefficients at the sparsest level within one standard error of the best held-out error."""
    errors = np.empty((len(levels), FOLDS))
    for fold in range(FOLDS):
        kept = task.folds != fold
        for number, level in enumerate(levels):
            found = solve(columns[kept], target[kept], float(level))
            errors[number, fold] = np.mean((target[~kept] - columns[~kept] @ found) ** 2)
    mean, spread = errors.mean(axis=1), errors.std(axis=1, ddof=1) / np.sqrt(FOLDS)
    best = int(np.argmin(mean))
    sparsest = int(np.flatnonzero(mean <= mean[best] + spread[best]).max())
    return solve(columns, target, float(levels[sparsest]))


def _named(task: Task, coefficients: Array) -> list[str]:
    return sorted({task.effects[k] for k in np.flatnonzero(np.abs(coefficients) > 1e-10)})


METHODS: dict[str, Callable[[Task], list[str]]] = {
    "pysindy": pysindy,
    "lasso": lasso,
    "lasso_projected": lasso_projected,
    "bic": bic,
}


def as_diagnosis(selected: list[str]) -> dict[str, Any]:
    """What a method names, in the form that the scoring reads."""
    return {
        "verdict": "missing_effect" if selected else "complete",
        "selected": selected,
        "candidates": [{"effect": slug, "indistinguishable_from": []} for slug in selected],
    }
