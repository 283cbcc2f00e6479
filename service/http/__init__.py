"""The service over HTTP: endpoints, the page, and the server that runs them.

app = create_app(Settings())
serve(port=8000)
"""

from service.http.app import create_app
from service.http.serving import serve

__all__ = ["create_app", "serve"]
