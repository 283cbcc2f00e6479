"""Sections of a page about a comparison, a diagnosis, an adoption or a model's history.

Each takes what it shows and gives HTML, or nothing where there is nothing to show.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from planner.amounts import estimate, finite, number, share, signed, watts
from planner.report.markup import (
    Markup,
    bullets,
    element,
    figure,
    folded,
    joined,
    pair,
    paragraph,
    section,
    table,
)
from planner.report.workbench.residuals import Look, axis_of
from planner.report.workbench_wording import (
    RUN_HEADS,
    Document,
    about,
    model_name,
    run_name,
    run_row,
    untestable,
)
from planner.telemetry.diagnosis import Diagnosis, Experiment
from planner.telemetry.pictures import ResidualCurve, Stretch
from planner.telemetry.regimes import Regime

MOST_OPEN_RUNS = 12
"""More runs than these are folded away."""

VERDICTS = {
    "missing_effect": (
        "An effect is missing",
        "A physical effect of the catalogue explains what the model misses. Adopt it, and the "
        "error on runs that the fit has not seen falls as shown.",
    ),
    "complete": (
        "Nothing is missing",
        "What the model misses looks like noise. Only a log of other motions can show whether "
        "this holds elsewhere.",
    ),
    "too_little": (
        "Too little to tell",
        "What the model misses looks like noise, but no effect of the catalogue could be seen in "
        "this log. The last table but one says what would help.",
    ),
    "not_identifiable": (
        "Cannot be attributed",
        "Something is missing, but this log does not show clearly what. To adopt an effect would "
        "be a guess. The pictures below show where the model fails, and what to measure next "
        "would tell causes apart.",
    ),
    "outside_catalogue": (
        "Outside the catalogue",
        "No effect of the catalogue has the shape of what the model misses. A formula describes "
        "it and can be adopted; what physics is behind it, the formula does not say.",
    ),
    "sensor_error": (
        "A sensor is wrong",
        "An error of a sensor explains what the model misses better than any effect. Correct "
        "the sensor first; everything below is of the log corrected for it.",
    ),
}
"""Verdict → heading, and what follows from it; "too_little" stands for a log that shows nothing."""

Pictures = Mapping[str, str]


def headline(
    lead: str,
    drawing: str,
    facts: Iterable[object],
    *,
    verdict: str = "",
    warnings: Iterable[str] = (),
    caption: str = "",
) -> Markup:
    """The answer: badge, sentence, the errors as a picture, and the few figures beside it."""
    heading, meaning = VERDICTS.get(verdict, ("", ""))
    badge = paragraph(heading, f"badge {verdict}") if heading else ""
    meant = paragraph(meaning) if meaning else ""
    first, end, rest = lead.partition(". ") if verdict else (lead, "", "")
    said = paragraph(first + end.rstrip(), "lead")
    more = paragraph(rest) if rest else ""
    warned = [paragraph(warning, "warning") for warning in dict.fromkeys(warnings)]
    beside = element("div", meant, *warned, bullets(facts))
    content = pair(figure(drawing, caption), beside)
    return section("", badge, said, more, content, kind="verdict")


def taken_away(before: float, after: float, floor: float | None) -> str:
    """How much of the squared error above the noise is gone; "" where there was next to none."""
    noise = (floor or 0.0) ** 2
    excess = before**2 - noise
    if excess < 0.1 * noise or excess <= 0.0:
        return ""
    gone = min((before**2 - after**2) / excess, 1.0)
    if gone < 0.0:
        return "The error on unseen runs grows."
    return f"Of the squared error above the noise, {100 * gone:.0f} % is gone."


def legend(names: Mapping[str, str]) -> Markup:
    """What the colours mean: class → words."""
    entries = [joined(element("i", kind=f"swatch {k}"), words) for k, words in names.items()]
    return bullets(entries, "legend")


def evidence(result: Diagnosis, pictures: Pictures, names: Mapping[str, str]) -> Markup:
    """What a person looks at first: the worst stretch, the claim, and where the error is."""
    shown = result.pictures
    time = ""
    if shown.stretch is not None:
        time = _over_time(shown.stretch, pictures)
    drawn = [
        figure(pictures[name], _about_curve(curve, len(shown.curves)))
        for name, curve in zip(curve_names(shown.curves), shown.curves, strict=True)
    ]
    if shown.shares:
        caption = (
            "A row counts in the first line that it fits. Few rows may hold most of the error. "
            "Watts: measured minus predicted, on average."
        )
        drawn.append(figure(pictures["shares"], caption))
    both = element("div", *drawn, kind="pair") if drawn else ""
    return section("The evidence", legend(names), time, both)


def curve_names(curves: Sequence[ResidualCurve]) -> list[str]:
    """Names of the pictures of claims: curve, curve-2 …"""
    return [f"curve-{k}" if k > 1 else "curve" for k in range(1, len(curves) + 1)]


def _over_time(shown: Stretch, pictures: Pictures) -> Markup:
    """Power over time; on a narrow screen it scrolls by itself."""
    caption = f"{run_name(shown.run)}: the stretch in which the model at the start errs most."
    drawing = element("div", figure(pictures["time"]), kind="wide", tabindex=0)
    return joined(drawing, paragraph(caption, "note"))


def _about_curve(curve: ResidualCurve, claims: int) -> str:
    over = axis_of(curve.quantity).words
    dots = f"Dots: what the model as it is misses, over {over}, with 95 % intervals."
    if curve.fitted is None:
        return dots
    others = " and all else that is claimed" if claims > 1 else ""
    return f"{dots} Line: what {curve.of}{others} changes. It should go through the dots."


def agreement(look: Look, pictures: Pictures, names: Mapping[str, str]) -> Markup:
    """Prediction beside measurement."""
    noise = "All errors; the dashed line is the log's own noise, beyond which no model gets."
    both = pair(
        figure(pictures["predicted"], "Rows spread over the log; on the line both agree."),
        figure(pictures["distribution"], noise),
    )
    return section("Prediction and measurement", legend(names), both)


def stretch(look: Look, pictures: Pictures, names: Mapping[str, str]) -> Markup:
    """Power over time, where the model at the start errs most."""
    if look.stretch is None:
        return Markup("")
    return section("Over time", legend(names), _over_time(look.stretch, pictures))


def axes(look: Look, pictures: Pictures, names: Mapping[str, str]) -> Markup:
    """The residual over every axis that varies."""
    total = float((look.residuals["before"] ** 2).mean())
    drawn = []
    for axis, curve in look.curves.items():
        shares = [share(bins.structure / total) for bins in curve.values()] if total else []
        reduction = f" tells {' → '.join(shares)} of the squared error"
        words = joined(element("b", axis_of(axis).words), reduction)
        drawn.append(figure(pictures[axis], words, "tall" if axis == "heading" else ""))
    if not drawn:
        return Markup("")
    note = paragraph(
        "Mean of measured minus predicted in bins, with 95 % intervals, most informative first. "
        "All charts have the same scale of watts. Axes are correlated in a log: an axis that "
        "follows another is not a cause.",
        "note",
    )
    first, rest = (element("div", *part, kind="cards") for part in (drawn[:9], drawn[9:]))
    more = folded(f"{len(drawn) - 9} less informative", rest) if drawn[9:] else ""
    return section("The residual over what varied", legend(names), first, more, note)


def where(regimes: Sequence[Regime], pictures: Pictures) -> Markup:
    """Regimes in which the model at the start is off."""
    if not regimes:
        nothing = (
            "The residual has no structure that stands out of the noise, over anything that the "
            "log has a column for."
        )
        return section("Where the model is wrong", paragraph(nothing))
    heads = ["where", "rows", "measured − predicted", "rms", "of the squared error"]
    rows = [
        [
            r.where,
            f"{r.rows:,}",
            f"{signed(r.bias_w)} ± {watts(r.stderr_w)}",
            watts(r.rmse_w),
            share(r.share_of_squared_error),
        ]
        for r in regimes
    ]
    return section(
        "Where the model is wrong",
        figure(pictures["regimes"], "Lines are 95 % intervals. Regimes may overlap."),
        table("", heads, rows, words=(0,)),
    )


def outside(diagnosis: Diagnosis, pictures: Pictures) -> Markup:
    """What the catalogue does not have."""
    found = diagnosis.outside
    if found is None:
        return Markup("")
    over = " and ".join(axis_of(q).words for q in found.quantities)
    fitted = [
        [p.name, estimate(p.value, finite(p.stderr), p.unit)]
        for p in diagnosis.fitted.parameters
        if p.effect == found.name
    ]
    caption = (
        "Dots: what the model lacks without the formula, with 95 % intervals. Line: the formula."
    )
    said = element(
        "div",
        paragraph(f"Over {over}, in watts:"),
        paragraph(element("code", found.formula)),
        table("", ["fitted", "value"], fitted),
        paragraph(
            f"It can be adopted as {found.name}. It stands out of the noise with z = "
            f"{found.z:.1f}; its size over the noise is {found.rho:.2g}."
        ),
    )
    return section(
        "A shape that the catalogue does not have", pair(figure(pictures["shape"], caption), said)
    )


def sensors(diagnosis: Diagnosis) -> Markup:
    """Faulty sensors."""
    heads = ["error", "size", "what it is"]
    rows = [
        [s.kind.replace("_", " "), estimate(s.value, finite(s.stderr), s.unit), s.sentence]
        for s in diagnosis.sensors
    ]
    return section("Sensors", table("", heads, rows, words=(0, 2)))


def experiments(diagnosis: Diagnosis) -> Markup:
    """What to measure next."""
    shown = [_experiment(entry) for entry in Experiment.documents(diagnosis.experiments)]
    drives = any(entry.settings for entry in diagnosis.experiments)
    command = element("code", "joulepath experiment DIAGNOSIS.json --out drive.csv")
    how = paragraph(joined(command, " writes the drives as velocity commands."), "note")
    return section("What to measure next", *shown, how if drives else "")


def not_identifiable(diagnosis: Diagnosis) -> Markup:
    """What the log cannot identify, and what would help."""
    heads = ["reason", "effects", "what would help"]
    entries = {"not_testable": [n.to_json() for n in diagnosis.not_testable]}
    rows = [
        [cause, ", ".join(effects), _helps(helps)]
        for cause, (effects, helps) in untestable(entries).items()
    ]
    return section("What this log cannot identify", table("", heads, rows, words=(0, 1, 2)))


def _helps(helps: Mapping[str, Sequence[str]]) -> str:
    """What would help; of several things, which effects each helps."""
    if len(helps) == 1:
        return next(iter(helps))
    return " ".join(f"{', '.join(names)}: {help_}" for help_, names in helps.items())


def _experiment(experiment: Document) -> Markup:
    names = " and ".join(experiment["separates"])
    lead = paragraph(joined(about(experiment), element("b", experiment["run"])), "experiment")
    settings = experiment["settings"]
    if not settings:
        return lead
    length, width = settings["area"]
    facts = [
        f"{experiment['minutes']:g} minutes, changes of load and temperature included",
        f"the standard error of {names} falls by a factor of {2 ** experiment['gain']:.2g} "
        "in the simulation",
        f"free area: {length:g} m by {width:g} m",
    ]
    runs = [
        f"run {k}: load {number(run['payload'])} kg, motors "
        + ("as they are" if run["motor_temp"] is None else f"at {run['motor_temp']:g} °C")
        for k, run in enumerate(settings["runs"], start=1)
    ]
    heads = ["leg", "vx (m/s)", "vy (m/s)", "yaw rate (rad/s)", "ramp (s)", "steady (s)"]
    rows = [
        [k, *(number(leg[name]) for name in ("vx", "vy", "wz", "ramp", "hold"))]
        for k, leg in enumerate(settings["legs"], start=1)
    ]
    rounds = f"every run: {settings['rounds']} times these legs"
    parts = joined(bullets([*runs, rounds]), table("", heads, rows))
    return joined(lead, bullets(facts), folded("settings", parts))


def by_run(runs: Sequence[Document], pictures: Pictures) -> Markup:
    """Energy of every run."""
    rows = [run_row(run) for run in runs]
    made = table("", RUN_HEADS, rows)
    if len(rows) > MOST_OPEN_RUNS:
        made = folded(f"all {len(rows)} runs", made)
    drawing = figure(pictures.get("runs", ""))
    return section("Energy by run", pair(drawing, made) if drawing else made)


def about_log(log: Document, model: Document) -> Markup:
    """Which log this was, what was found in it, derived from it and taken for granted."""
    digest = f", SHA-256 {log['sha256']}" if log.get("sha256") else ""
    said = (
        f"{log['source'] or 'A log in memory'}: {log['rows']:,} rows in {log['runs']:,} "
        f"runs{digest}. Model {model_name(model)}, of kind {model['kind']}."
    )
    parts = [paragraph(said)]
    findings = [finding["sentence"] for finding in log.get("report", ())]
    lists = {"Found": findings, "Derived": log.get("derived"), "Assumed": log.get("assumed")}
    for heading, items in lists.items():
        if items:
            parts += [element("h3", heading), bullets(items)]
    return section("The log", *parts)
