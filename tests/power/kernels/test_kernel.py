"""Kernels over many rows: what a call for each row gives, whatever the order in memory."""

from __future__ import annotations

import numpy as np
import pytest

from planner.power.account import ACCOUNT, ACCOUNT_LENGTH, LIMITS, PER_WHEEL
from planner.power.kernels.row_blocks import BLOCK
from planner.power.model import PowerModel
from planner.power.rows import rows_from
from tests.power.states import Array, model_with, random_columns


@pytest.fixture(scope="module")
def model() -> PowerModel:
    return model_with("stiction")


@pytest.fixture(scope="module")
def rows() -> Array:
    return rows_from(**random_columns(BLOCK + 7, seed=31))


def test_accounts_are_those_of_a_call_for_each_row(model: PowerModel, rows: Array) -> None:
    numbers = (model.parameters, model.body, model.wheels)
    accounts, per_wheel = model.kernel.accounts(rows, *numbers)
    assert accounts.shape == (len(rows), ACCOUNT_LENGTH)
    account, wheel = np.empty(ACCOUNT_LENGTH), np.empty((4, len(PER_WHEEL)))
    for row, found in zip(rows, accounts, strict=True):
        watts = model.kernel(row, *numbers, account, wheel)
        assert watts == found[0]
        assert np.array_equal(account, found)
    assert np.array_equal(per_wheel, wheel)


def test_results_of_blocks_are_columns_of_the_accounts(model: PowerModel, rows: Array) -> None:
    numbers = (model.parameters, model.body, model.wheels)
    columns = [0, *(ACCOUNT.index(name) for name in LIMITS)]
    accounts, _ = model.kernel.accounts(rows, *numbers)
    results = model.limits_kernel.results(rows, *numbers, count=len(columns))
    assert np.array_equal(results, accounts[:, columns])
    assert np.array_equal(model.power_kernel.results(rows, *numbers, count=1), accounts[:, :1])


def test_rows_may_lie_in_memory_in_any_order(model: PowerModel, rows: Array) -> None:
    numbers = (model.parameters, model.body, model.wheels)
    expected, _ = model.kernel.accounts(rows, *numbers)
    for given in (np.asfortranarray(rows), rows.repeat(2, axis=0)[::2]):
        assert np.array_equal(model.kernel.accounts(given, *numbers)[0], expected)
        assert np.array_equal(model.power_kernel.results(given, *numbers, count=1), expected[:, :1])


def test_no_rows_give_no_results(model: PowerModel, rows: Array) -> None:
    numbers = (model.parameters, model.body, model.wheels)
    assert model.kernel.accounts(rows[:0], *numbers)[0].shape == (0, ACCOUNT_LENGTH)
    assert model.power_kernel.results(rows[:0], *numbers, count=1).shape == (0, 1)
