"""Quantities that a log lacks are asked for where they would explain a misfit or part aliases."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.power.rows import gravity_columns
from planner.quantities import INDEX, STANDARD_GRAVITY
from planner.telemetry.diagnosis.advice.experiments import Advice
from planner.telemetry.diagnosis.advice.missing_columns import Aliases, slope_to_log
from planner.telemetry.estimation import fit
from planner.telemetry.evidence import DesignColumns, examine
from planner.telemetry.logs import Telemetry
from planner.telemetry.other_terms import Dictionary
from planner.telemetry.selection.select_effects import select
from planner.telemetry.terms import candidate_library
from tests.power.states import changed
from tests.telemetry.rows import measured


def unsloped(log: Telemetry) -> Telemetry:
    """The log as if nobody had measured roll and pitch."""
    rows = log.rows.copy()
    for name, value in gravity_columns(0.0, 0.0, gravity=STANDARD_GRAVITY).items():
        rows[:, INDEX[name]] = value
    return replace(log, rows=rows, present=log.present - {"roll", "pitch"})


def asked(log: Telemetry, base):
    fitted = fit(log, base)
    competitors = DesignColumns(candidate_library(fitted.model, log), Dictionary.of(log))
    return slope_to_log(examine(log, competitors), log, fitted.residual)


def test_slopes_that_nobody_logged_are_asked_for(motion, base) -> None:
    log = measured(motion, base, 0.02, seed=2)
    advice = asked(unsloped(log), base)
    assert "pitch and roll" in advice.run
    said = float(advice.run.partition("about ")[2].partition("°")[0])
    gravity = log.rows[:, [INDEX["gravity_x"], INDEX["gravity_y"]]] / STANDARD_GRAVITY
    true = math.degrees(math.sqrt(float(np.mean(gravity**2)) * 2.0))
    assert said == pytest.approx(true, rel=0.4)
    assert asked(log, base) is None  # it has them


def test_noise_of_a_meter_on_level_ground_asks_for_no_slope(motion, base) -> None:
    level = unsloped(motion)
    for share, gain in ((0.02, 0.0), (0.0, 0.1)):
        log = measured(level, base, share, seed=2)
        scatter = 1.0 + gain * np.random.default_rng(3).standard_normal(len(log))
        assert asked(replace(log, power=log.power * scatter), base) is None


def test_a_temperature_is_asked_for_where_only_it_parts_aliases(motion, base) -> None:
    """Without temperatures the drag of cold grease is a viscous drag."""
    unknown = ("motor_temp", "ambient_temp")
    rows = motion.rows.copy()
    rows[:, [INDEX[name] for name in unknown]] = np.nan
    blind = replace(motion, rows=rows, present=motion.present - set(unknown))
    dragging = changed(base, coulomb_drag__coulomb_torque=0.0045)
    speed = np.hypot(blind.rows[:, INDEX["vx"]], blind.rows[:, INDEX["vy"]])
    log = measured(blind, dragging, 0.01, seed=4, extra=6.0 * speed**2)
    competitors = DesignColumns(candidate_library(fit(log, base).model, log), Dictionary.of(log))
    examination = examine(log, competitors)
    selection = select(examination)
    aliases = Aliases(Advice(examination, selection, log))
    name = next(s.name for s in selection.ranking if s.name in ("viscous_drag", "cold_grease"))
    (other,) = {"viscous_drag", "cold_grease"} - {name}
    aliased = replace(selection, aliases={name: (other,)})
    advice = Aliases(Advice(examination, aliased, log)).parted(name)
    assert advice is not None
    assert advice.separates == (name, other)
    assert "motor_temp" in advice.run
    assert aliases.parted("air_drag") is None or "motor_temp" not in aliases.parted("air_drag").run
