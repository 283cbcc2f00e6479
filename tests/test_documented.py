"""Commands, options, settings and HTTP routes that users meet are named in docs/; links hold."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest
from typer.models import OptionInfo

import planner
from service.cli import app as commands
from service.http import create_app
from service.settings import Settings

ROOT = Path(__file__).resolve().parent.parent
DOCS = {path.name: path.read_text() for path in sorted((ROOT / "docs").glob("*.md"))}
COMMANDS = {
    c.callback.__name__.replace("_", "-"): c.callback
    for c in commands.registered_commands
    if c.callback
}


@pytest.mark.parametrize("command", COMMANDS)
def test_command_is_documented(command: str) -> None:
    assert re.search(rf"joulepath (\w+, )*{command}|, {command}\b", DOCS["cli.md"])


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_is_documented(command: str) -> None:
    parameters = inspect.signature(COMMANDS[command], eval_str=True).parameters
    options = {
        "--" + name.rstrip("_").replace("_", "-")
        for name, parameter in parameters.items()
        if isinstance(parameter.annotation.__metadata__[0], OptionInfo)
    }
    named = re.findall(r"--[a-z-]+", DOCS["cli.md"])
    assert options - set(named) == set()


@pytest.mark.parametrize("setting", Settings.model_fields)
def test_setting_is_documented(setting: str) -> None:
    assert f"`JOULEPATH_{setting.upper()}`" in DOCS["configuration.md"]


def test_variable_read_elsewhere_is_documented() -> None:
    sources = [p.read_text() for top in ("planner", "service") for p in (ROOT / top).rglob("*.py")]
    named = {name for source in sources for name in re.findall(r"JOULEPATH_[A-Z_]+[A-Z]", source)}
    assert "JOULEPATH_CACHE_DIR" in named
    assert {name for name in named if f"`{name}`" not in DOCS["configuration.md"]} == set()


def test_every_route_is_documented() -> None:
    for path, methods in create_app(Settings()).openapi()["paths"].items():
        for method in methods:
            assert f"`{method.upper()} {path}`" in DOCS["http.md"]


@pytest.mark.parametrize(
    "target", ["demo", "test", "check", "docs", "bench", "serve", "setup", "lock", "clean"]
)
def test_make_target_is_documented(target: str) -> None:
    assert f"`make {target}`" in DOCS["development.md"]
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), re.MULTILINE)


@pytest.mark.parametrize("name", planner.__all__)
def test_public_name_is_in_the_api_reference(name: str) -> None:
    reference = (ROOT / "docs" / "api" / "planner.md").read_text()
    assert re.search(rf"^::: planner\.[a-z.]+\.{name}$", reference, re.MULTILINE)


TOP = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")


@pytest.mark.parametrize("name", [*DOCS, *(f"../{top}" for top in TOP)])
def test_links_between_documents_hold(name: str) -> None:
    document = (ROOT / "docs" / name).resolve()
    links = re.findall(r"\]\(([^)#]+)", document.read_text())
    local = [link for link in links if "://" not in link]
    assert [link for link in local if not (document.parent / link).exists()] == []
