"""What every effect would add is what a model that has it adds."""

from __future__ import annotations

import pytest

from planner.power.model import PowerModel
from planner.telemetry.evidence import DesignColumns
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.terms.candidate_terms import candidate_library
from tests.power.states import changed
from tests.telemetry.rows import measured


def test_what_every_effect_adds_is_what_its_model_adds(motion, base):
    log = motion.take(slice(0, 300))
    library = candidate_library(base, log)
    design = DesignColumns(library, Dictionary.of(log), ())
    watts, columns = design.raw(log)
    for number, column in enumerate(library.candidates):
        if column.effect not in ("yaw_scrub", "air_drag"):
            continue
        extended = PowerModel.from_vehicle(base.vehicle, effects=(column.effect,))
        size = float(library.amplitudes[number])
        name = f"{column.effect}__{column.parameter}"
        null = library.model.parameters[column.place]
        on, off = (changed(extended, **{name: null + value}) for value in (size, 0.0))
        exact = measured(log, on, 0.0, 0).power - measured(log, off, 0.0, 0).power
        assert columns[:, design.candidate(number)] * size == pytest.approx(exact, abs=1e-9)
    assert watts == pytest.approx(measured(log, base, 0.0, 0).power)
