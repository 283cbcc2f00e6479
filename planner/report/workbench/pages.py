"""Views of a comparison, a diagnosis, an adoption and a model's history.

Their pages run no script. They are light or dark as the reader's screen is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from planner.amounts import joules, share, signed, watts
from planner.power.model import PowerModel
from planner.report.markup import Markup, element, joined, paragraph, section
from planner.report.markup import figure as figure_of
from planner.report.view import View
from planner.report.workbench import ranking, sections
from planner.report.workbench.bars import (
    candidates_chart,
    errors_chart,
    regimes_chart,
    runs_chart,
    shares_chart,
)
from planner.report.workbench.history import history_chart, history_table
from planner.report.workbench.parameter_tables import known_parameters, parameters
from planner.report.workbench.residual_charts import (
    claim_chart,
    cloud,
    common_range,
    distribution,
    over_time,
    residual_chart,
    shape_chart,
)
from planner.report.workbench.residuals import Look, lacking, look_of
from planner.report.workbench_wording import how_far, how_it_came_about, model_name, what_came_of_it
from planner.telemetry.adoption import Adoption, history
from planner.telemetry.comparison import Comparison
from planner.telemetry.diagnosis import Diagnosis, Errors

_START = "model as it is"
_NOISE, _MEASURED = {"noise": "the log's own noise"}, {"measured": "measured"}
_CLOUDS: dict[str, dict[str, str]] = {"predicted": {}, "distribution": _NOISE, "time": _MEASURED}
"""Pictures of single rows, and what they show beside the models."""


def _view(
    title: str, look: Look, names: dict[str, str], pictures: dict[str, str], parts: list[Markup]
) -> View:
    """With a card of the first section and the most telling pictures."""
    main = [name for name in ("shape", "curve", "candidates") if name in pictures][:1]
    shown = [*main, *[*look.curves][: 2 if main else 3]]
    grid = [figure_of(pictures[name], kind="main" if name in main else "") for name in shown]
    # Labels of bars say what their colours mean.
    legends = {name: {**names, **_CLOUDS.get(name, {})} for name in (*_CLOUDS, *look.curves)}
    card = joined(parts[0], element("div", *grid, kind="cards"))
    return View(title, pictures, tuple(parts), card, legends)


def _pictures(
    look: Look, floor: float | None, errors: Mapping[str, float], **more: str
) -> dict[str, str]:
    """The pictures that every result of a log has, and more; without those that are empty."""
    most = common_range([*look.curves.values()])
    pictures = {
        "errors": errors_chart(errors, floor or 0.0),
        "predicted": cloud(look),
        "distribution": distribution(look, floor or 0.0),
        "time": "" if look.stretch is None else over_time(look.stretch),
        **more,
        **{axis: residual_chart(axis, curve, most) for axis, curve in look.curves.items()},
    }
    return {name: drawing for name, drawing in pictures.items() if drawing}


def _comparison(result: Comparison) -> View:
    said, look, names = result.to_json(), look_of(result), {"before": "model"}
    rows = "model, on held-out runs" if result.fitted else "model, on all rows"
    pictures = _pictures(
        look,
        result.noise_floor_w,
        {rows: result.heldout_rmse_w},
        regimes=regimes_chart(result.regimes),
        runs=runs_chart(result.runs),
    )
    whole, off = result.whole, result.whole.error_share
    energy = f"Energy: measured {joules(whole.measured_j)}, predicted {joules(whole.predicted_j)}"
    facts = [
        energy + ("" if off is None else f", {share(abs(off))} too {'high' if off > 0 else 'low'}"),
        f"Mean error {watts(result.mae_w)}, bias {signed(result.bias_w)}"
        + ("" if result.r2 is None else f", R² {result.r2:.4g}"),
        *(regime.sentence for regime in result.regimes[:1]),
    ]
    parts = [
        sections.headline(how_far(said), pictures["errors"], facts),
        sections.where(result.regimes, pictures),
        sections.axes(look, pictures, names),
        sections.agreement(look, pictures, {**names, **_CLOUDS["distribution"]}),
        sections.by_run(said["runs"], pictures),
        parameters(result.parameters, result.model, None),
        sections.about_log(said["log"], said["model"]),
    ]
    return _view(f"Comparison with {_source(result.log)}", look, names, pictures, parts)


def _diagnosis(result: Diagnosis) -> View:
    claimed = (*(f"{fault.kind} corrected" for fault in result.sensors), *result.proposed)
    look, names = look_of(result), _names(claimed)
    before, after, found = result.baseline, result.after, result.outside
    errors, facts = {_START: before.heldout_rmse_w}, []
    if claimed:
        errors[_with(claimed)] = after.heldout_rmse_w
        facts = _less(before, after)
    if result.proposed:
        facts.append(f"To adopt: {', '.join(result.proposed)}")
    candidates, _ = ranking.shown_candidates(result)
    shown = result.pictures
    curves = zip(sections.curve_names(shown.curves), shown.curves, strict=True)
    pictures = _pictures(
        look,
        before.noise_floor_w,
        errors,
        **{name: claim_chart(curve) for name, curve in curves},
        shares=shares_chart(shown.shares),
        candidates=candidates_chart(
            candidates,
            result.selected,
            ranking.without_any(result),
            before.noise_floor_w or 0.0,
            ranking.chances(result),
        ),
        shape=""
        if found is None
        else shape_chart(found.quantities[0], found.curve, lacking(result)),
        regimes=regimes_chart(result.regimes),
    )
    without = result.base if result.proposed else None
    parts = [
        sections.headline(
            result.sentence,
            pictures["errors"],
            facts,
            verdict="too_little" if result.shows_nothing else result.verdict,
            warnings=ranking.aliases(result),
            caption="Error on runs that the fit has not seen (root mean square).",
        ),
        sections.evidence(result, pictures, {**names, **_MEASURED}),
        sections.sensors(result),
        sections.outside(result, pictures),
        ranking.ranking(result, pictures.get("candidates", "")),
        sections.experiments(result),
        sections.where(result.regimes, pictures),
        sections.axes(look, pictures, names),
        sections.agreement(look, pictures, {**names, **_NOISE}),
        parameters(result.fitted.parameters, result.model, without),
        sections.not_identifiable(result),
        sections.about_log(result.log, result.base.describe()),
    ]
    return _view(f"Diagnosis of {_source(result.log)}", look, names, pictures, parts)


def _adoption(result: Adoption) -> View:
    look, names, found = look_of(result), _names(result.adopted), result.diagnosis
    before, after = result.before, result.after
    errors = {_START: before.heldout_rmse_w, _with(result.adopted): after.heldout_rmse_w}
    versions = history_chart(history(result.model))
    pictures = _pictures(look, before.noise_floor_w, errors, history=versions)
    facts = [*_less(before, after), f"The diagnosis of this log: {found.sentence}"]
    lead = what_came_of_it(result.to_json())
    warnings = [f"Warning: {warning}" for warning in result.warnings]
    parts = [
        sections.headline(lead, pictures["errors"], facts, warnings=warnings),
        parameters(result.parameters, result.model, found.base),
        _history(result.model, versions),
        sections.stretch(look, pictures, {**names, **_MEASURED}),
        sections.axes(look, pictures, names),
        sections.agreement(look, pictures, {**names, **_NOISE}),
        sections.about_log(found.log, result.model.describe()),
    ]
    return _view(f"Adopted from {_source(found.log)}", look, names, pictures, parts)


def _less(before: Errors, after: Errors) -> list[str]:
    """By how much the error has fallen."""
    gone = sections.taken_away(before.heldout_rmse_w, after.heldout_rmse_w, before.noise_floor_w)
    fitted = f"Rows that were fitted: {watts(before.rmse_w)} → {watts(after.rmse_w)}"
    return [fitted, gone] if gone else [fitted]


def _model(result: PowerModel) -> View:
    entries, described = history(result), result.describe()
    drawing = history_chart(entries)
    lead = paragraph(how_it_came_about(described, entries), "lead")
    effects = ", ".join(effect.slug for effect in result.effects)
    first = section("", lead, paragraph(f"Effects: {effects}."))
    return View(
        f"History of {model_name(described)}",
        {"history": drawing} if drawing else {},
        (first, _history(result, drawing), known_parameters(result)),
        joined(first, figure_of(drawing)),
        absent="this model has no history",
    )


def _history(model: PowerModel, drawing: str) -> Markup:
    entries = history(model)
    if not entries:
        return Markup("")
    caption = (
        "Rings: before, dots: after, shaded: the log's own noise. Lines join versions that were "
        "measured on the same log; errors on different logs are not to be compared."
    )
    return section("Version by version", figure_of(drawing, caption), history_table(entries))


def _names(added: tuple[str, ...]) -> dict[str, str]:
    return {"before": _START, **({"after": _with(added)} if added else {})}


def _with(added: tuple[str, ...]) -> str:
    return f"with {' + '.join(added)}"


def _source(log: Mapping[str, Any]) -> str:
    return Path(str(log["source"])).name or "a log"


VIEWS: dict[str, Callable[[Any], View]] = {
    "Adoption": _adoption,
    "Comparison": _comparison,
    "Diagnosis": _diagnosis,
    "PowerModel": _model,
}
"""Kind of a result → what makes its view."""


def as_html(result: Any) -> str:
    """The sections of a result's page, for a page of somebody else."""
    return "".join(VIEWS[type(result).__name__](result).sections)
