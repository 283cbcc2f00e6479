"""Writes docs/effects.md from the declarations of the effects: python -m docs.make_effects.

A test compares the page with what this makes of the catalogue, so that it cannot go stale.
"""

from __future__ import annotations

import inspect
from pathlib import Path

from planner.power.catalogue import all_effects
from planner.power.effect import HOOKS, Effect, Parameter

TITLES = ("Sign", "Source", "Holds for", "Left out")
PAGE = Path(__file__).with_name("effects.md")

HEAD = """# Effects of the power model

`python -m docs.make_effects` writes this page from the files in `planner/power/effects/`.
[Adding an effect](adding-an-effect.md) explains how an effect is declared, and
[decision 2](decisions/0002-effects-as-hooks.md) gives the reasons. [Physics](physics.md) compares
the effects with the source paper.

The eight effects of the **base model** are always active. All others are **candidates**: at their
null values they change nothing. A parameter marked "given" is not fitted. One marked "scanned" is
tried at the listed values. Stages are in the order of the physics.
"""


def effects_page() -> str:
    """Text of docs/effects.md."""
    effects = all_effects()
    lines = [HEAD, "| effect | stage | what it is | parameters |", "|---|---|---|---|"]
    for slug, effect in effects.items():
        names = ", ".join(f"`{name}`" for name in effect.parameters) or "none"
        stages = ", ".join(effect.stages())
        base = " (base)" if effect.base else ""
        lines.append(f"| [{slug}](#{slug}){base} | {stages} | {effect.title} | {names} |")
    for effect in effects.values():
        lines += ["", *_section(effect)]
    return "\n".join(lines) + "\n"


def _section(effect: type[Effect]) -> list[str]:
    module = inspect.getmodule(effect)
    head = inspect.cleandoc((module and module.__doc__) or "")
    lines = [f"## {effect.slug}", ""]
    for title, text in _parts(head):
        if title:
            lines.append(f"- **{title}.** " + " ".join(text.split()))
        else:
            lines += [_fenced(text), ""]
    places = "; ".join(f"`{name}`, {HOOKS[name].doc}" for name in HOOKS if name in effect.hooks)
    lines += ["", f"Acts through {places}."]
    if effect.parameters:
        lines += [
            "",
            "| parameter | unit | default | null | range | |",
            "|---|---|---|---|---|---|",
        ]
        lines += [_parameter(name, p) for name, p in effect.parameters.items()]
    return lines


def _parts(head: str) -> list[tuple[str, str]]:
    """What stands before the first title, under "", then each titled part."""
    parts: list[tuple[str, list[str]]] = [("", [])]
    for line in head.splitlines():
        if line in TITLES:
            parts.append((line, []))
        else:
            parts[-1][1].append(line)
    return [(title, "\n".join(lines).strip()) for title, lines in parts]


def _fenced(text: str) -> str:
    """The text with its indented paragraphs, which are equations, fenced."""
    done = []
    for paragraph in text.split("\n\n"):
        if paragraph.startswith("    "):
            paragraph = "```text\n" + inspect.cleandoc("\n" + paragraph) + "\n```"
        done.append(paragraph)
    return "\n\n".join(done)


def _parameter(name: str, parameter: Parameter) -> str:
    null = "" if parameter.null is None else f"{parameter.null:g}"
    low, high = parameter.bounds
    how = "" if parameter.fitted else "given. "
    if parameter.grid:
        how = "scanned: " + ", ".join(f"{value:g}" for value in parameter.grid) + ". "
    if parameter.per:
        how += f"one a {parameter.per}. "
    return (
        f"| `{name}` | {parameter.unit} | {parameter.default:g} | {null} | {low:g} to {high:g} "
        f"| {how}{parameter.doc} |"
    )


if __name__ == "__main__":
    PAGE.write_text(effects_page(), encoding="utf-8")
