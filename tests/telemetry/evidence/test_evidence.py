"""Sums by block answer what least squares on the rows themselves answers."""

from __future__ import annotations

import numpy as np
import pytest

from planner.telemetry.evidence.evidence import Evidence
from planner.telemetry.evidence.gram_matrices import RowClusters

ROWS, TANGENT, OTHERS = 1200, 3, 5


def drawn(seed: int, coefficients=(), rows: int = ROWS):
    """(rows, columns) random columns; some of the others are in the residual."""
    random = np.random.default_rng(seed)
    mixed = np.eye(TANGENT + OTHERS) + 0.4 * random.standard_normal((TANGENT + OTHERS,) * 2)
    columns = random.standard_normal((rows, TANGENT + OTHERS)) @ mixed
    residual = random.standard_normal(rows) + columns[:, :TANGENT] @ [2.0, -1.0, 3.0]
    for number, value in enumerate(coefficients):
        residual += value * columns[:, TANGENT + number]
    return np.column_stack([columns, residual])


def evidence_of(matrix, blocks: int = 40, spread=None) -> Evidence:
    """All rows summed up."""
    number = np.arange(len(matrix)) * blocks // len(matrix)
    scaled = matrix if spread is None else matrix / spread[:, None]
    kept = RowClusters(matrix, number, number // 4)
    slow = np.zeros(matrix.shape[1])
    return Evidence(TANGENT, kept, scaled.T @ scaled, len(matrix), slow)


def left_over(matrix, columns):
    """Sum of squares after ordinary least squares, and its coefficients."""
    design = matrix[:, columns]
    found, *_ = np.linalg.lstsq(design, matrix[:, -1], rcond=None)
    return float(np.sum((matrix[:, -1] - design @ found) ** 2)), found


OWN = [0, 1, 2]
SETS = [[3], [5, 7], [3, 4, 5, 6, 7]]


@pytest.mark.parametrize("columns", SETS)
def test_gain_is_what_least_squares_gains(columns):
    matrix = drawn(1, (0.1, 0.0, -0.2))
    evidence = evidence_of(matrix)
    gain, found = evidence.gain(columns)
    before, _ = left_over(matrix, OWN)
    after, expected = left_over(matrix, OWN + columns)
    assert gain == pytest.approx(0.5 * (before - after), rel=1e-5, abs=1e-6)
    assert found == pytest.approx(expected[TANGENT:], rel=1e-5, abs=1e-7)
    assert evidence.gain([])[0] == 0.0


def test_many_sets_at_once_gain_what_each_of_them_gains():
    matrix = drawn(4, (0.1, 0.3, 0.0, -0.2))
    for number in (4, 6):
        matrix[:, number] = matrix[:, 3]  # two columns that do the same
    evidence = evidence_of(matrix)
    sets = np.array([[3, 5], [3, 4], [4, 6], [5, 7]])
    values, found = evidence.gains(sets)
    for columns, value, coefficients in zip(sets, values, found, strict=True):
        alone, expected = evidence.gain(columns)
        assert value == pytest.approx(alone, rel=1e-9)
        assert coefficients == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("columns", SETS)
def test_test_estimates_what_least_squares_estimates(columns):
    matrix = drawn(2, (0.1, 0.3))
    given = [k for k in (4, 6) if k not in columns]
    test = evidence_of(matrix).test(columns, given=given)
    _, expected = left_over(matrix, OWN + given + columns)
    assert test.coefficients == pytest.approx(expected[-len(columns) :], rel=1e-5, abs=1e-7)
    design = matrix[:, OWN + given + columns]
    inverse = np.linalg.inv(design.T @ design)[-len(columns) :, -len(columns) :]
    assert test.information == pytest.approx(np.linalg.inv(inverse), rel=1e-5)


def test_each_column_alone_as_one_by_one():
    evidence = evidence_of(drawn(3, (0.05, 0.0, 0.2)))
    z, found, information = evidence.test_each([3, 4, 5, 7], given=[6])
    for k, column in enumerate([3, 4, 5, 7]):
        alone = evidence.test([column], given=[6])
        assert found[k] == pytest.approx(alone.coefficients[0], rel=1e-6)
        assert information[k] == pytest.approx(alone.information[0, 0], rel=1e-6)
        # t and F of one column are the same test.
        assert z[k] == pytest.approx(alone.z, rel=1e-3, abs=1e-6)


def test_size_is_the_rms_of_what_is_left_of_a_column():
    matrix = drawn(4)
    spread = np.linspace(0.5, 2.0, len(matrix))
    evidence = evidence_of(matrix, spread=spread)
    scaled = matrix / spread[:, None]
    rest = scaled[:, [*OWN, 6]]
    column = scaled[:, 4]
    clear = column - rest @ np.linalg.lstsq(rest, column, rcond=None)[0]
    expected = 1.7 * np.sqrt(np.mean(clear**2))
    assert evidence.size([4], np.array([1.7]), given=[6]) == pytest.approx(expected, rel=1e-6)


def test_what_the_model_absorbs():
    matrix = drawn(5)
    matrix[:, 3] = matrix[:, :3] @ [1.0, 2.0, 3.0]
    matrix[:, 4] = matrix[:, 0] + 1e-2 * matrix[:, 4]
    evidence = evidence_of(matrix)
    assert evidence.tolerance(3) < 1e-8
    own = matrix[:, :3]
    for column in (4, 5):
        clear = matrix[:, column] - own @ np.linalg.lstsq(own, matrix[:, column], rcond=None)[0]
        share = float(clear @ clear / (matrix[:, column] @ matrix[:, column]))
        assert evidence.tolerance(column) == pytest.approx(share, rel=1e-4)
    # What is absorbed gains nothing and is never significant.
    assert evidence.gain([3])[0] == pytest.approx(0.0, abs=1e-3)
    assert evidence.test_each([3])[0] == pytest.approx([0.0])


def test_likeness_is_a_cosine():
    matrix = drawn(6)
    evidence = evidence_of(matrix)
    rest = matrix[:, OWN]
    first, second = (
        matrix[:, k] - rest @ np.linalg.lstsq(rest, matrix[:, k], rcond=None)[0] for k in (4, 5)
    )
    cosine = abs(float(first @ second)) / np.sqrt(float(first @ first) * float(second @ second))
    assert evidence.collinearity(4, 5) == pytest.approx(cosine, rel=1e-6)
    assert evidence.collinearity(4, 4) == pytest.approx(1.0)


def test_comparison_is_antisymmetric_and_a_difference_of_likelihoods():
    matrix = drawn(7, (0.2, 0.1))
    evidence = evidence_of(matrix)
    there, back = evidence.compare([3], [4, 5]), evidence.compare([4, 5], [3])
    assert there == pytest.approx([-v for v in back])
    first, second = left_over(matrix, [*OWN, 3])[0], left_over(matrix, [*OWN, 4, 5])[0]
    assert there[0] == pytest.approx(0.5 * (second - first), rel=1e-6)
    assert evidence.compare([3], [3]) == pytest.approx((0.0, 0.0))


def test_the_truth_wins_clearly():
    wins = [evidence_of(drawn(seed, (0.25,))).compare([3], [4])[1] for seed in range(20)]
    # How alike the two columns are differs from draw to draw.
    assert min(wins) > 0.0
    assert np.mean(np.array(wins) > 1.64) > 0.85


@pytest.mark.parametrize("columns", [[3], [4, 6]])
def test_pure_noise_is_significant_as_rarely_as_it_should_be(columns):
    p = np.array([evidence_of(drawn(1000 + k, rows=400)).test(columns).p_value for k in range(400)])
    # The largest of several scatters counts, so that the test errs on the careful side.
    assert 0.01 <= np.mean(p < 0.05) <= 0.07
    assert 0.3 <= np.mean(p < 0.5) <= 0.56


def with_lasting_noise(matrix, seed):
    """A matrix of 400 rows in which a column and the residual hold for blocks of ten rows."""
    random = np.random.default_rng(seed)
    blocks = np.repeat(np.arange(40), 10)
    matrix[:, 3] = random.standard_normal(40)[blocks]
    matrix[:, -1] = random.standard_normal(400) + 2.0 * random.standard_normal(40)[blocks]
    return matrix


def test_noise_that_is_correlated_within_blocks_is_not_significant_either():
    significant = []
    for seed in range(200):
        matrix = with_lasting_noise(drawn(3000 + seed, rows=400), seed)
        significant.append(evidence_of(matrix).test([3]).p_value < 0.05)
    assert np.mean(significant) < 0.1


def test_noise_that_lasts_gains_likelihood_and_hardly_any_robust_one():
    plain, robust = [], []
    for seed in range(100):
        matrix = with_lasting_noise(drawn(7000 + seed, rows=400), seed)
        evidence = evidence_of(matrix)
        plain.append(evidence.gain([3])[0])
        robust.append(evidence.robust_gain([3], []))
    # A column of nothing gains half a unit on average.
    assert np.mean(plain) > 5.0
    assert np.mean(robust) < 1.0


def test_of_independent_noise_both_gains_are_much_the_same():
    plain, robust = [], []
    for seed in range(40):
        evidence = evidence_of(drawn(8000 + seed, (0.1, 0.1, -0.1)))
        for columns, given in (([3], []), ([4, 5], [3])):
            plain.append(evidence.gain([*given, *columns])[0] - evidence.gain(given)[0])
            robust.append(evidence.robust_gain(columns, given))
    assert np.mean(plain) > 4.0
    # The widest scatter counts, known from forty clusters.
    assert 0.6 * np.mean(plain) < np.mean(robust) < np.mean(plain)


def test_a_column_that_changes_between_runs_alone_is_judged_by_runs():
    # Ten runs of four blocks; the column and the error are constants of the runs.
    significant = {True: 0, False: 0}
    for seed in range(150):
        matrix = drawn(5000 + seed, rows=400)
        random = np.random.default_rng(seed)
        run = np.repeat(np.arange(10), 40)
        matrix[:, 3] = random.standard_normal(10)[run]
        matrix[:, -1] = random.standard_normal(400) + random.standard_normal(10)[run]
        for slow in significant:
            evidence = evidence_of(matrix)
            evidence.slow[3] = float(slow)
            significant[slow] += evidence.test([3]).p_value < 0.05
    assert significant[True] / 150 < 0.15
    assert significant[True] < 0.5 * significant[False]


def test_a_huge_effect_does_not_hide_itself_in_the_scatter():
    weak, strong = (evidence_of(drawn(9, (size,))).test([3]) for size in (0.5, 50.0))
    assert strong.z > weak.z > 5.0
