"""Answers of the workbench's endpoints, as models for the OpenAPI document."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import ConfigDict, Field

from service.http.schemas import Described


class _Open(Described):
    """A document of the planner, which may hold further members."""

    model_config = ConfigDict(extra="allow")


class Finding(Described):
    """One finding about a log."""

    kind: str = Field(examples=["gap"])
    column: str
    rows: int
    sentence: str


class LogSummary(Described):
    """An uploaded log."""

    id: str = Field(examples=["5f2d0c1b7a9e4433"])
    name: str = Field(examples=["drive.csv"])
    sha256: str
    mapped: bool
    """whether it has a mapping file"""
    bytes: int
    rows: int
    runs: int
    uploaded_at: str = Field(examples=["2026-03-04T05:06:07.000000+00:00"])


class Log(LogSummary):
    """A log with the findings in it."""

    model_config = ConfigDict(extra="allow")

    duration_s: float
    present: list[str]
    """quantities that were measured"""
    report: list[Finding]
    derived: list[str]
    assumed: list[str]


class Regime(_Open):
    """Where a model fails."""

    where: str = Field(examples=["sideways faster than 0.4 m/s"])
    rows: int
    bias_w: float
    """measured minus predicted"""
    rmse_w: float
    share_of_squared_error: float


class Meter(_Open):
    """How the power meter of a log averages."""

    time_constant_s: dict[str, float | None]
    """value and stderr of a first-order filter"""
    delay_s: dict[str, float | None]
    """value and stderr; a positive delay is a reading that comes late"""
    sampling: Literal["mean", "end", "held", "window"]
    """a row's reading is its mean, that of its end, or one held from an earlier row"""
    sentence: str


class RefusedFit(Described):
    """A fit of the base model that held-out runs refute; the model as stated is used."""

    heldout_rmse_w: float
    """error of the fit on held-out runs"""
    stated_rmse_w: float
    """error of the model as stated"""
    sentence: str


class Comparison(_Open):
    """Measured power against predicted."""

    rmse_w: float
    mae_w: float
    bias_w: float
    r2: float | None
    heldout_rmse_w: float
    refused_fit: RefusedFit | None = None
    meter: Meter | None = None
    noise_floor_w: float
    """lowest error that a model can reach"""
    apart: list[str] = Field(default_factory=list)
    """what does not belong together in the log, in clauses"""
    energy: dict[str, Any]
    """measured_j, predicted_j, error_share"""
    runs: list[dict[str, Any]]
    regimes: list[Regime]
    pictures: dict[str, Any]
    """curves: mean residual over each quantity; cloud: thinned measured_w, predicted_w"""


class Candidate(_Open):
    """One effect of the catalogue, with the evidence for it."""

    effect: str
    probability: float | None
    """null where held-out runs overruled the search that it comes from"""
    heldout_rmse_w: float | None
    parameters: dict[str, Any]
    evidence: dict[str, Any]
    indistinguishable_from: list[str]


class Unexplained(_Open):
    """What the answer to a log leaves."""

    heldout_over_floor: float
    """held-out error over the noise floor; 1 is perfect"""
    where: list[Regime]
    """regimes whose mean residual makes 5 % or more of the held-out squared error"""


class Diagnosis(_Open):
    """Which effects a model lacks."""

    verdict: Literal[
        "missing_effect", "complete", "not_identifiable", "outside_catalogue", "sensor_error"
    ]
    selected: list[str]
    """every effect to adopt, in order"""
    sentence: str
    baseline: dict[str, float]
    after: dict[str, float | None]
    candidates: list[Candidate]
    """best first"""
    regimes: list[Regime]
    unexplained: Unexplained
    outside_catalogue: dict[str, Any] | None
    experiments: list[dict[str, Any]]
    """what to measure next, best first: drives with ``settings``, and quantities to log"""
    refused_fit: RefusedFit | None = None
    meter: Meter | None = None
    pictures: dict[str, Any] | None = None
    """the evidence as numbers: worst stretch, curves of the residual, shares of the error"""


class Adoption(_Open):
    """Result of an adoption."""

    model: dict[str, Any]
    model_id: str
    """id of the new version, for GET /v1/models/{id}"""
    adopted: list[str]
    before: dict[str, Any]
    after: dict[str, Any]
    noise_floor_w: float | None
    warnings: list[str]
    parameters: list[dict[str, Any]]
    history: list[dict[str, Any]]


class Progress(Described):
    """Progress of a job."""

    share: float = Field(ge=0, le=1)
    sentence: str


class JobSummary(Described):
    """A job without its result."""

    id: str
    kind: Literal["check", "compare", "diagnose", "adopt"]
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: Progress
    request: dict[str, Any]
    error: dict[str, Any] | None
    """problem document of a failed job"""
    created_at: str
    started_at: str | None
    finished_at: str | None


class Job(JobSummary):
    """A job with its result."""

    result: dict[str, Any] | None


class ModelSummary(Described):
    """One version of a model."""

    id: str
    name: str
    title: str = Field(examples=["version 2, air_drag: 0.52 W"])
    version: int
    parent_id: str | None
    """id of the version before, if stored here"""
    vehicle: str
    effects: list[str]
    adopted: list[str]
    """effects that this version added"""
    heldout_rmse_w: float | None
    noise_floor_w: float | None
    created_at: str


class HistoryEntry(_Open):
    """One change of a model."""

    id: str | None
    """id of that version, if stored here"""
    version: int
    action: str
    adopted: list[str] = Field([])
    before: dict[str, Any] | None = None
    after: dict[str, Any] | None = None
    noise_floor_w: float | None = None
