"""The page: one HTML file, its style and its modules, served from the package."""

from __future__ import annotations

from importlib.resources import files

from fastapi import APIRouter, FastAPI, Response
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles

from planner.report.markup import STYLES, asset

router = APIRouter()
WEB = files("service") / "web"


@router.get("/", include_in_schema=False, response_class=HTMLResponse)
def index() -> str:
    """The page itself."""
    return (WEB / "index.html").read_text(encoding="utf-8")


@router.get("/report.css", include_in_schema=False)
def report_style() -> Response:
    """What reports look like."""
    return Response(asset(*STYLES, "page.css"), media_type="text/css")


@router.get("/report.js", include_in_schema=False)
def report_script() -> Response:
    """Moves the cursor over the pictures of a report."""
    return Response(asset("page.js"), media_type="text/javascript")


def install(app: FastAPI) -> None:
    """Serve the page at / and what it loads under /static."""
    app.include_router(router)
    app.mount("/static", StaticFiles(directory=str(WEB)), name="static")
