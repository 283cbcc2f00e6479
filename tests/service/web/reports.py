"""What the service answers a page: documents with reports, of results that are made by hand."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from planner.power.vehicles import load_vehicle
from planner.report.routes import answer_view, ground_layer, whole_map
from planner.report.workbench import as_html
from planner.report.workbench.history import history_chart, history_table
from planner.search.results import Answer, Baseline, Route
from service.jobs.outcomes import Adopted
from tests.report import synthetic
from tests.telemetry.diagnosis import synthetic_results

RELIEF = {"report": whole_map(synthetic.terrain())}
"""20 m × 10 m, rising to the east."""


GROUND = {"report": ground_layer(synthetic.terrain(), load_vehicle("minibalance"))}
"""Where the robot cannot go on it."""


def route(energy_j: float, **changes: Any) -> Route:
    """Along the middle of that map; 70 % of the energy is rolling, −10 % gravity."""
    shares = {"electronics": 0.4, "wheel_rolling": 0.7, "gravity": -0.1}
    made = replace(
        synthetic.route(watts=energy_j / 16.0),
        breakdown_j={effect: share * energy_j for effect, share in shares.items()},
    )
    return replace(made, **changes)


def answer(energy_j: float = 200.0, **changes: Any) -> Answer:
    """That route; the shortest costs 25 % more."""
    baselines = {"shortest": Baseline(route(1.25 * energy_j), 0.25)}
    return synthetic.answer(**{"routes": (route(energy_j),), "baselines": baselines, **changes})


def answered(found: Answer) -> dict[str, Any]:
    """What the page reads of an answer."""
    view = answer_view(found, window=found.terrain.extent)
    return {"status": found.status, "report": "".join(view.sections)}


def brief(sentence: str) -> str:
    """The shortest report of the workbench."""
    return f"<section class='verdict'><p class='lead'>{sentence}</p></section>"


SENTENCES = {
    "compare": "The model misses the measured power by 2.00 W rms.",
    "diagnose": "The model lacks air_drag.",
    "adopt": "Adopted air_drag: held-out error 2.10 W → 0.52 W.",
}


def reporting(
    bench: Callable[[str, tuple[Any, ...]], Any], reports: dict[str, str] | None = None
) -> Callable[[str, tuple[Any, ...]], Any]:
    """A workbench that adds reports to its documents, brief ones where none are given."""
    told = {**{verb: brief(s) for verb, s in SENTENCES.items()}, **(reports or {})}

    def work(job: str, arguments: tuple[Any, ...]) -> Any:
        if job == "relief":
            return json.dumps(RELIEF)
        if job == "ground":
            return json.dumps(GROUND)
        if job == "plan_route":
            return json.dumps(answered(answer()))
        if job == "model_report":
            entries = json.loads(Path(arguments[0]).read_text())["history"]
            drawn = history_chart(entries) + history_table(entries)
            return json.dumps({"report": told.get(job, drawn)})
        found = bench(job, arguments)
        if isinstance(found, Adopted):
            return Adopted({**found.document, "report": told[job]}, found.model)
        return {**found, "report": told[job]} if job in told and isinstance(found, dict) else found

    return work


def workbench_reports(folder: Path) -> dict[str, str]:
    """Reports as a worker draws them, with names that try to break out."""
    made = synthetic_results.material(folder)
    kinds = {"compare": "comparison", "diagnose": "diagnosis", "adopt": "adoption"}
    return {
        job: as_html(synthetic_results.RESULTS[kind](made))
        for job, kind in {**kinds, "model_report": "model"}.items()
    }
