"""Database and files together.

store = Store.open(settings)
store.logs.all(), store.models.save(document, parent=None, at=now()), store.jobs.get(id)
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self

from service.settings import Settings
from service.store.database import Database
from service.store.files import Files, default_folder
from service.store.jobs import Jobs, new_owner
from service.store.logs import Logs
from service.store.models import Models


@dataclass(frozen=True)
class Store:
    """What the service keeps.

    Attributes:
        database: sessions.
        files: folders for logs and models.
        logs, models, jobs: what is in the database.
    """

    database: Database
    files: Files
    logs: Logs
    models: Models
    jobs: Jobs

    @classmethod
    def open(cls, settings: Settings, owner: str | None = None) -> Self:
        """Open the store; it is created if it does not exist.

        Args:
            settings: its location.
            owner: name of this service among those that share the database.

        Raises:
            InputError: the folder or the database cannot be used.
        """
        files = Files((settings.store_dir or default_folder()).absolute())
        files.prepare()
        url = settings.database_url
        database = Database(
            url.get_secret_value() if url else f"sqlite:///{files.folder / 'joulepath.db'}"
        )
        jobs = Jobs(database, owner or new_owner())
        return cls(database, files, Logs(database), Models(database), jobs)

    def model_file(self, model: str) -> Path | None:
        """Path of a stored model's file, or None if there is no such model."""
        document = self.models.document(model)
        return None if document is None else self.files.model(model, document)

    def problem(self) -> str | None:
        """Why the store cannot be used any more, or None; such as files that were removed."""
        return self.files.problem() or self.database.problem()

    def close(self) -> None:
        """Close the database."""
        self.database.close()
