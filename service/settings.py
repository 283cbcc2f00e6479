"""How the service runs: every setting is an environment variable JOULEPATH_*, see docs."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from planner.errors import InputError
from planner.validation import first_complaint, problem_of


def _share_of_memory_mb() -> int:
    """Half of the machine's memory, divided by its cores; from 512 to 4096 MiB."""
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") >> 20
    return min(4096, max(512, machine // (2 * (os.cpu_count() or 1))))


class Settings(BaseSettings):
    """Settings of ``joulepath serve``, read from the environment."""

    model_config = SettingsConfigDict(
        env_prefix="JOULEPATH_", frozen=True, extra="ignore", use_attribute_docstrings=True
    )

    host: str = "127.0.0.1"
    """address to listen on"""
    port: int = Field(8000, ge=0, le=65535)
    """port to listen on; 0 picks one"""
    api_keys: SecretStr | None = None
    """keys that open the service, with commas between; by default none is needed"""
    open: bool = False
    """1 lets other machines ask without a key"""
    workers: int = Field(default_factory=lambda: os.cpu_count() or 1, ge=1, le=256)
    """processes that plan at the same time; by default one per core"""
    queue: int = Field(16, ge=0, le=10_000)
    """requests that may wait for a worker; further ones get 503"""
    time_limit_s: float = Field(120.0, gt=0, le=3600)
    """seconds from arrival after which a request is ended with 504"""
    max_time_budget_s: float = Field(60.0, gt=0, le=600)
    """largest time_budget_s, and certify_s, that a request may ask for"""
    max_body_bytes: int = Field(65_536, ge=1024)
    """largest request body in bytes; a larger one gets 413"""
    max_graph_bytes: int = Field(4 * 2**20, ge=1024)
    """largest body of a graph in bytes; a larger one gets 413"""
    memory_limit_mb: int = Field(8192, ge=512)
    """address space that a worker may use, in MiB"""
    worker_memory_mb: int = Field(default_factory=_share_of_memory_mb, ge=256)
    """memory in MiB above which a worker is replaced after its request; half of it is cache"""
    worker_age_s: float = Field(3600.0, ge=0)
    """seconds after which a worker is replaced; 0 gives every request a fresh one"""
    data_dir: Path | None = None
    """folder with further maps, vehicles and models that requests may name; by default none"""
    store_dir: Path | None = None
    """folder for uploaded logs, models and jobs; by default joulepath in the user's data folder"""
    database_url: SecretStr | None = None
    """SQLAlchemy URL of the database; by default an SQLite file in the store's folder"""
    job_workers: int = Field(
        default_factory=lambda: max(1, (os.cpu_count() or 1) // 2), ge=1, le=256
    )
    """processes that run jobs at the same time; by default one for every two cores"""
    job_queue: int = Field(100, ge=0, le=10_000)
    """jobs that may wait; further ones get 503"""
    job_time_limit_s: float = Field(3600.0, gt=0, le=86_400)
    """seconds after which a job is ended"""
    max_log_bytes: int = Field(4 * 2**30, ge=1024)
    """largest log in bytes that may be uploaded"""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """lowest severity that is logged"""

    @field_validator("api_keys")
    @classmethod
    def _keys_of_headers(cls, value: SecretStr | None) -> SecretStr | None:
        if value and not re.fullmatch(r"[A-Za-z0-9._~+/=, -]*", value.get_secret_value()):
            raise ValueError("a key has letters, digits and . _ ~ + / = - only")
        return value

    @property
    def keys(self) -> tuple[str, ...]:
        """The API keys."""
        given = self.api_keys.get_secret_value() if self.api_keys else ""
        return tuple(key for part in given.split(",") if (key := part.strip()))


def read_settings() -> Settings:
    """Settings of the environment, for a person who set it.

    Raises:
        InputError: naming the first variable that cannot be used.
    """
    try:
        settings = Settings()
    except ValidationError as error:
        first = first_complaint(error.errors(include_url=False))
        declared = Settings.model_fields[first.place]
        # A key, or a password in an address, is not for a terminal.
        secret = "SecretStr" in str(declared.annotation)
        # "Input should be a valid integer, unable to parse …"
        bounds = first.message.removeprefix("Input should be ").partition(", unable")[0]
        raise InputError(
            f"JOULEPATH_{first.place.upper()}",
            problem_of(first, "cannot be used"),
            value=None if secret else first.value,
            accepted=f"{declared.description}; {bounds}",
        ) from None
    if settings.data_dir is not None and not settings.data_dir.is_dir():
        raise InputError(
            "JOULEPATH_DATA_DIR",
            "is not a folder",
            value=str(settings.data_dir),
            accepted="a folder with maps, vehicles and models, or none",
        )
    return settings
