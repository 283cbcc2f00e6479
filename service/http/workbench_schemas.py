"""What the workbench's endpoints answer, as models for the OpenAPI document."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field


class _Open(BaseModel):
    """The planner's documents may say more than is described here."""

    model_config = ConfigDict(extra="allow")


class Finding(BaseModel):
    """One thing that a user should know about a log."""

    kind: str = Field(examples=["gap"])
    column: str
    rows: int
    sentence: str


class LogSummary(BaseModel):
    """A log that was uploaded and can be read."""

    id: str = Field(examples=["5f2d0c1b7a9e4433"])
    name: str = Field(examples=["drive.csv"])
    sha256: str
    mapped: bool = Field(description="a mapping file came with it")
    bytes: int
    rows: int
    runs: int
    uploaded_at: str = Field(examples=["2026-03-04T05:06:07.000000+00:00"])


class Log(LogSummary):
    """The same with what was found in it."""

    model_config = ConfigDict(extra="allow")

    duration_s: float
    present: list[str] = Field(description="quantities that were measured")
    report: list[Finding]
    derived: list[str]
    assumed: list[str]


class Regime(_Open):
    """Where a model fails."""

    where: str = Field(examples=["sideways faster than 0.4 m/s"])
    rows: int
    bias_w: float = Field(description="measured minus predicted")
    rmse_w: float
    share_of_squared_error: float


class RefusedFit(BaseModel):
    """A fit of the base model that held-out runs refute; the model as stated is used."""

    heldout_rmse_w: float = Field(description="of the fit, on runs that it has not seen")
    stated_rmse_w: float = Field(description="of the model as stated")
    sentence: str


class Comparison(_Open):
    """Measured power against predicted."""

    rmse_w: float
    mae_w: float
    bias_w: float
    r2: float | None
    heldout_rmse_w: float
    refused_fit: RefusedFit | None = None
    noise_floor_w: float = Field(description="what no model can go below")
    energy: dict[str, Any] = Field(description="measured_j, predicted_j, error_share")
    runs: list[dict[str, Any]]
    regimes: list[Regime]
    pictures: dict[str, Any] = Field(
        description="curves: mean residual over each quantity; cloud: thinned measured_w, "
        "predicted_w"
    )


class Candidate(_Open):
    """One effect of the catalogue, and what speaks for it."""

    effect: str
    probability: float
    heldout_rmse_w: float | None
    parameters: dict[str, Any]
    evidence: dict[str, Any]
    indistinguishable_from: list[str]


class Diagnosis(_Open):
    """Which effects a model lacks."""

    verdict: Literal[
        "missing_effect", "complete", "not_identifiable", "outside_catalogue", "sensor_error"
    ]
    selected: list[str] = Field(description="every effect to adopt, in order")
    sentence: str
    baseline: dict[str, float]
    after: dict[str, float | None]
    candidates: list[Candidate] = Field(description="best first")
    regimes: list[Regime]
    outside_catalogue: dict[str, Any] | None
    experiments: list[dict[str, Any]] = Field(description="runs that would separate ties")
    refused_fit: RefusedFit | None = None


class Adoption(_Open):
    """What an adoption was worth."""

    model: dict[str, Any]
    model_id: str = Field(description="of the new version, for GET /v1/models/{id}")
    adopted: list[str]
    before: dict[str, Any]
    after: dict[str, Any]
    noise_floor_w: float | None
    warnings: list[str]
    parameters: list[dict[str, Any]]
    history: list[dict[str, Any]]


class Progress(BaseModel):
    """How far a job is."""

    share: float = Field(ge=0, le=1)
    sentence: str


class JobSummary(BaseModel):
    """Long work."""

    id: str
    kind: Literal["check", "compare", "diagnose", "adopt"]
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    progress: Progress
    request: dict[str, Any]
    error: dict[str, Any] | None = Field(description="a problem document, when it failed")
    created_at: str
    started_at: str | None
    finished_at: str | None


class Job(JobSummary):
    """The same with its result, which is what the verb answers."""

    result: dict[str, Any] | None


class ModelSummary(BaseModel):
    """One version of a model."""

    id: str
    name: str
    title: str = Field(examples=["version 2, air_drag: 0.52 W"])
    version: int
    parent_id: str | None = Field(description="the version it was made from, if it is here")
    vehicle: str
    effects: list[str]
    adopted: list[str] = Field(description="what this version took in")
    heldout_rmse_w: float | None
    noise_floor_w: float | None
    created_at: str


class HistoryEntry(_Open):
    """One change of a model."""

    id: str | None = Field(description="of that version, if it is here")
    version: int
    action: str
    adopted: list[str] = []
    before: dict[str, Any] | None = None
    after: dict[str, Any] | None = None
    noise_floor_w: float | None = None
