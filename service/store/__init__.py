"""What the service keeps across restarts: logs, versions of models, jobs; files and a database.

store = Store.open(settings)
store.logs.all(), store.models.save(document, parent=None, at=now()), store.jobs.get(id)
"""

from service.store.files import MAPPING
from service.store.jobs import LEASE_S, UNFINISHED, now
from service.store.logs import log_id
from service.store.store import Store

__all__ = ["LEASE_S", "MAPPING", "UNFINISHED", "Store", "log_id", "now"]
