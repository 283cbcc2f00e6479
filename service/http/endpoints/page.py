"""The page: one HTML file, its style and its modules, served from the package."""

from __future__ import annotations

from importlib.resources import files

from fastapi import APIRouter, FastAPI
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles

router = APIRouter()
WEB = files("service") / "web"


@router.get("/", include_in_schema=False, response_class=HTMLResponse)
def index() -> str:
    """The page itself."""
    return (WEB / "index.html").read_text(encoding="utf-8")


def install(app: FastAPI) -> None:
    """Serve the page at / and what it loads under /static."""
    app.include_router(router)
    app.mount("/static", StaticFiles(directory=str(WEB)), name="static")
