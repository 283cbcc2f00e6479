"""The page about a comparison, a diagnosis, an adoption or a model's history, and its pieces.

    write_telemetry_report(diagnosis, "diagnosis.html", "Diagnosis of drive.csv")
    figure_names(diagnosis); figure(diagnosis, "candidates").save("candidates.svg")
    fragment(diagnosis)                        # a card for notebooks

Everything is inside the page: no network, no script. It is light or dark as the reader's screen is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import singledispatch
from pathlib import Path
from typing import Any

from planner.errors import RequestError
from planner.power.model import PowerModel
from planner.report import telemetry_sections as sections
from planner.report.bars import candidates_chart, errors_chart, regimes_chart, runs_chart
from planner.report.figure import Figure
from planner.report.history import history_chart, history_table
from planner.report.markup import STYLES, Markup, asset, document, plain, section, write
from planner.report.markup import figure as figure_of
from planner.report.parameter_tables import known_parameters, parameters
from planner.report.residual_drawing import (
    cloud,
    common_range,
    distribution,
    over_time,
    residual_chart,
    shape_chart,
)
from planner.report.residuals import Look, lacking, look_of
from planner.search.wording import joules
from planner.telemetry.adopt import Adoption, history
from planner.telemetry.compare import Comparison
from planner.telemetry.diagnosis import Diagnosis
from planner.telemetry.wording import (
    how_far,
    how_it_came_about,
    model_name,
    share,
    signed,
    watts,
    what_came_of_it,
)

_START = "model as it is"
_NOISE, _MEASURED = {"noise": "the log's own noise"}, {"measured": "measured"}
_MORE = {**_MEASURED, **_NOISE}
_CLOUDS: dict[str, dict[str, str]] = {"predicted": {}, "distribution": _NOISE, "time": _MEASURED}
"""Pictures of single rows, and what they show beside the models."""


@dataclass(frozen=True)
class _Drawn:
    """Pictures of a result by name, what their colours mean, and what they were drawn from."""

    look: Look | None
    pictures: dict[str, str]
    names: dict[str, str]

    def legend(self, name: str) -> dict[str, str]:
        """What the colours of a picture mean: class → words; of bars their labels say it."""
        if self.look is None or name not in (*_CLOUDS, *self.look.curves):
            return {}
        return {**self.names, **_CLOUDS.get(name, {})}


def write_telemetry_report(result: Any, path: str | Path, title: str = "") -> None:
    """Write a self-contained HTML page.

    Args:
        result: a Comparison, Diagnosis, Adoption, or a PowerModel for its history.
        path: where to; its folder is made.
        title: of the page; one that names the log, or the model, when it is empty.
    """
    write(document(title or _title(result), "".join(_body(result, _draw(result)))), path)


def fragment(result: Any) -> str:
    """A card for notebooks: the answer, the errors, and the most telling pictures."""
    drawn = _draw(result)
    first = _body(result, drawn)[0]
    axes = () if drawn.look is None else tuple(drawn.look.curves)
    main = [name for name in ("shape", "candidates") if name in drawn.pictures][:1]
    shown = [*main, *axes[: 2 if main else 3]]
    grid = "".join(
        figure_of(drawn.pictures[name], kind="main" if name in main else "") for name in shown
    )
    return (
        f"<div class='joulepath card'><style>{asset(*STYLES)}</style>{first}"
        f"<div class='cards'>{grid}</div></div>"
    )


def figure_names(result: Any) -> tuple[str, ...]:
    """Names of the pictures that a result has."""
    return tuple(_draw(result).pictures)


def figure(result: Any, name: str) -> Figure:
    """One picture of a result.

    Raises:
        RequestError: the result has no such picture.
    """
    drawn = _draw(result)
    if name not in drawn.pictures:
        accepted = ", ".join(drawn.pictures) or "none: this model has no history"
        raise RequestError("figure", "no such picture", value=name, accepted=accepted)
    return Figure.of(name, drawn.pictures[name], drawn.legend(name))


@singledispatch
def _draw(result: Any) -> _Drawn:
    raise RequestError(
        "result",
        "cannot be shown",
        value=type(result).__name__,
        accepted="a Comparison, Diagnosis, Adoption or PowerModel",
    )


@singledispatch
def _title(result: Any) -> str:
    raise TypeError(result)


@singledispatch
def _body(result: Any, drawn: _Drawn) -> list[str]:
    raise TypeError(result)


def _drawn(
    look: Look,
    floor: float | None,
    errors: Mapping[str, float],
    names: dict[str, str],
    **more: str,
) -> _Drawn:
    """The pictures that every result of a log has, and more; without those that are empty."""
    most = common_range([*look.curves.values()])
    pictures = {
        "errors": errors_chart(errors, floor or 0.0),
        "predicted": cloud(look),
        "distribution": distribution(look, floor or 0.0),
        "time": "" if look.stretch is None else over_time(look.stretch),
        **more,
        **{axis: residual_chart(curve, most) for axis, curve in look.curves.items()},
    }
    return _Drawn(look, {n: drawing for n, drawing in pictures.items() if drawing}, names)


# A comparison.


@_draw.register
def _(result: Comparison) -> _Drawn:
    errors = {
        "model, on held-out runs" if result.fitted else "model, on all rows": result.heldout_rmse_w
    }
    return _drawn(
        look_of(result),
        result.noise_floor_w,
        errors,
        {"before": "model"},
        regimes=regimes_chart(result.regimes),
        runs=runs_chart(result.runs),
    )


@_title.register
def _(result: Comparison) -> str:
    return f"Comparison with {_source(result.log)}"


@_body.register
def _(result: Comparison, drawn: _Drawn) -> list[str]:
    said, pictures, look = result.to_json(), drawn.pictures, _known(drawn)
    off = result.whole.error_share
    energy = (
        f"Energy: measured {joules(result.whole.measured_j)}, predicted "
        f"{joules(result.whole.predicted_j)}"
    )
    facts = [
        energy + ("" if off is None else f", {share(abs(off))} too {'high' if off > 0 else 'low'}"),
        f"Mean error {watts(result.mae_w)}, bias {signed(result.bias_w)}"
        + ("" if result.r2 is None else f", R² {result.r2:.4g}"),
        *(regime.sentence for regime in result.regimes[:1]),
    ]
    return [
        sections.headline(how_far(said), pictures["errors"], facts),
        sections.where(result.regimes, pictures),
        sections.axes(look, pictures, drawn.names),
        sections.agreement(look, pictures, {**drawn.names, **_CLOUDS["distribution"]}),
        sections.by_run(result.runs, pictures),
        parameters(result.parameters, result.model, None),
        sections.about_log(said["log"], said["model"]),
    ]


# A diagnosis.


@_draw.register
def _(result: Diagnosis) -> _Drawn:
    errors = {_START: result.baseline.heldout_rmse_w}
    if result.proposed:
        errors[_with(result.proposed)] = result.after.heldout_rmse_w
    floor = result.baseline.noise_floor_w
    testable = [c for c in result.candidates if c.why_not is None]
    found = result.outside
    return _drawn(
        look_of(result),
        floor,
        errors,
        _names(result.proposed),
        candidates=candidates_chart(
            testable,
            result.selected,
            result.baseline.heldout_rmse_w,
            floor or 0.0,
            likely=sections.likely(result),
        ),
        shape=""
        if found is None
        else shape_chart(found.quantities[0], found.curve, lacking(result)),
        regimes=regimes_chart(result.regimes),
    )


@_title.register
def _(result: Diagnosis) -> str:
    return f"Diagnosis of {_source(result.log)}"


@_body.register
def _(result: Diagnosis, drawn: _Drawn) -> list[str]:
    pictures, look = drawn.pictures, _known(drawn)
    before, after = result.baseline, result.after
    facts = []
    if result.proposed:
        gone = sections.taken_away(
            before.heldout_rmse_w, after.heldout_rmse_w, before.noise_floor_w
        )
        facts += [
            f"Rows that were fitted: {watts(before.rmse_w)} → {watts(after.rmse_w)}",
            *filter(None, [gone]),
            f"To adopt: {', '.join(result.proposed)}",
        ]
    return [
        sections.headline(
            result.sentence,
            pictures["errors"],
            facts,
            verdict=result.verdict,
            warnings=sections.ties(result),
        ),
        sections.sensors(result),
        sections.outside(result, pictures),
        sections.ranking(result, pictures),
        sections.experiments(result),
        sections.where(result.regimes, pictures),
        sections.axes(look, pictures, drawn.names),
        sections.agreement(look, pictures, {**drawn.names, **_MORE}),
        parameters(
            result.fitted.parameters, result.model, result.base if result.proposed else None
        ),
        sections.not_told(result),
        sections.about_log(result.log, result.base.describe()),
    ]


# An adoption.


@_draw.register
def _(result: Adoption) -> _Drawn:
    errors = {
        _START: result.before.heldout_rmse_w,
        _with(result.adopted): result.after.heldout_rmse_w,
    }
    return _drawn(
        look_of(result),
        result.before.noise_floor_w,
        errors,
        _names(result.adopted),
        history=history_chart(history(result.model)),
    )


@_title.register
def _(result: Adoption) -> str:
    return f"Adopted from {_source(result.diagnosis.log)}"


@_body.register
def _(result: Adoption, drawn: _Drawn) -> list[str]:
    pictures, look = drawn.pictures, _known(drawn)
    before, after = result.before, result.after
    gone = sections.taken_away(before.heldout_rmse_w, after.heldout_rmse_w, before.noise_floor_w)
    facts = [
        f"Rows that were fitted: {watts(before.rmse_w)} → {watts(after.rmse_w)}",
        *filter(None, [gone]),
        f"The diagnosis of this log: {result.diagnosis.sentence}",
    ]
    lead = what_came_of_it(result.to_json())
    warnings = [f"Warning: {warning}" for warning in result.warnings]
    return [
        sections.headline(lead, pictures["errors"], facts, warnings=warnings),
        parameters(result.parameters, result.model, result.diagnosis.base),
        _history(result.model, pictures),
        sections.axes(look, pictures, drawn.names),
        sections.agreement(look, pictures, {**drawn.names, **_MORE}),
        sections.about_log(result.diagnosis.log, result.model.describe()),
    ]


# A model and its history.


@_draw.register
def _(result: PowerModel) -> _Drawn:
    drawing = history_chart(history(result))
    return _Drawn(None, {"history": drawing} if drawing else {}, {})


@_title.register
def _(result: PowerModel) -> str:
    return f"History of {model_name(result.describe())}"


@_body.register
def _(result: PowerModel, drawn: _Drawn) -> list[str]:
    entries = history(result)
    lead = how_it_came_about(result.describe(), entries)
    effects = ", ".join(effect.slug for effect in result.effects)
    return [
        section("", f"<p class='lead'>{plain(lead)}</p>", f"<p>Effects: {plain(effects)}.</p>"),
        _history(result, drawn.pictures),
        known_parameters(result),
    ]


def _history(model: PowerModel, pictures: Mapping[str, str]) -> Markup:
    entries = history(model)
    if not entries:
        return Markup("")
    caption = (
        "Rings: before, dots: after, shaded: the log's own noise. Lines join versions that were "
        "measured on the same log; errors on different logs are not to be compared."
    )
    drawing = figure_of(pictures.get("history", ""), caption)
    return section("Version by version", drawing, history_table(entries))


def _names(added: tuple[str, ...]) -> dict[str, str]:
    return {"before": _START, **({"after": _with(added)} if added else {})}


def _with(added: tuple[str, ...]) -> str:
    return f"with {' + '.join(added)}"


def _source(log: Mapping[str, Any]) -> str:
    return Path(str(log["source"])).name or "a log"


def _known(drawn: _Drawn) -> Look:
    assert drawn.look is not None  # only a model by itself has none
    return drawn.look
