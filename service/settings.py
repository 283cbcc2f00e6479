"""How the service runs: every setting is an environment variable JOULEPATH_*, see docs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """Settings of ``joulepath serve``, read from the environment."""

    model_config = SettingsConfigDict(env_prefix="JOULEPATH_", frozen=True, extra="ignore")

    host: str = Field(default="127.0.0.1", description="address to listen on")
    port: int = Field(default=8000, ge=0, le=65535, description="port to listen on; 0 picks one")
    workers: int = Field(
        default_factory=lambda: os.cpu_count() or 1,
        ge=1,
        le=256,
        description="processes that plan at the same time; by default one for each core",
    )
    queue: int = Field(
        default=16, ge=0, le=10_000, description="requests that may wait for a worker; more get 503"
    )
    time_limit_s: float = Field(
        default=120.0,
        gt=0,
        le=3600,
        description="seconds from its arrival after which a request is ended with 504",
    )
    max_time_budget_s: float = Field(
        default=60.0,
        gt=0,
        le=600,
        description="largest time_budget_s, and certify_s, that a request may ask for",
    )
    max_body_bytes: int = Field(
        default=65_536, ge=1024, description="largest request body in bytes; more gets 413"
    )
    memory_limit_mb: int = Field(
        default=8192, ge=512, description="address space that a worker may use, in MiB"
    )
    data_dir: Path | None = Field(
        default=None,
        description="folder with maps, vehicles and models that requests may name beside the "
        "catalogues; without it they can name catalogue entries only",
    )
    store_dir: Path | None = Field(
        default=None,
        description="folder in which uploaded logs, versions of models and jobs are kept; by "
        "default joulepath in the user's data folder",
    )
    database_url: SecretStr | None = Field(
        default=None,
        description="address of the database as SQLAlchemy reads it; by default an SQLite file in "
        "the store's folder",
    )
    job_workers: int = Field(
        default_factory=lambda: max(1, (os.cpu_count() or 1) // 2),
        ge=1,
        le=256,
        description="logs that are worked on at the same time, beside the processes that plan; "
        "by default one for every two cores",
    )
    job_queue: int = Field(
        default=100, ge=0, le=10_000, description="jobs that may wait; more get 503"
    )
    job_time_limit_s: float = Field(
        default=3600.0, gt=0, le=86_400, description="seconds after which a job is ended"
    )
    max_log_bytes: int = Field(
        default=4 * 2**30, ge=1024, description="largest log in bytes that may be uploaded"
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="least severity that is logged"
    )
