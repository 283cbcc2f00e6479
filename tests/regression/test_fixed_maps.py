"""Routes on the fixed maps cost what they cost; a change needs a reason in expected.json."""

from __future__ import annotations

import json

import pytest

from tests.regression.cases import CASES, EXPECTED, measure

KEPT = json.loads(EXPECTED.read_text())


@pytest.mark.parametrize("name", CASES)
def test_energy_length_and_account(name):
    """Energy and length within the case's tolerance, every effect within it of the energy."""
    kept = KEPT["cases"][name]
    share = kept["tolerance"]
    found = measure(name)
    assert "energy_j" in found, found
    assert found["energy_j"] == pytest.approx(kept["energy_j"], rel=share)
    assert found["length_m"] == pytest.approx(kept["length_m"], rel=2.0 * share)
    for slug, joules in kept["breakdown_j"].items():
        allowed = 2.0 * share * abs(kept["energy_j"])
        assert found["breakdown_j"][slug] == pytest.approx(joules, abs=allowed)


def test_every_expectation_has_a_reason():
    """No figure without why it is what it is, and none for a case that is gone."""
    assert set(KEPT["cases"]) == set(CASES)
    for kept in KEPT["cases"].values():
        assert len(kept["reason"]) > 20
        assert 0.0 < kept["tolerance"] <= 0.02
