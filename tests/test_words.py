"""The field's words: names, headings and first lines of docstrings use no private vocabulary.

A reader who knows path planning and system identification shall find the terms of docs/glossary.md.
Three places are searched: identifiers and file names below planner/ and service/, headings of the
documents, and the first line of every docstring there. Text further on is ordinary English.

    python -m tests.test_words          # every hit, then counts by word and by file
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

NAMES = {
    # A path through the map.
    "way": "path or route",
    "ways": "paths or routes",
    "ride": "trajectory or drive",
    "rides": "trajectory or drive",
    "ridden": "trajectory, driven",
    "knot": "waypoint",
    "knots": "waypoints",
    "station": "sample",
    "stations": "samples",
    "polish": "waypoint descent",
    "polished": "descended, improved",
    "toll": "corner penalty",
    "tolls": "corner penalties",
    "lean": "crab angle (of a fit: coefficients)",
    "leans": "crab angles",
    "programme": "profile (dynamic programming)",
    "programmes": "profiles (dynamic programming)",
    # Search.
    "stuck": "infeasible",
    "hindered": "detour indicator, constrained",
    "rooms": "clearance penalties",
    "preferring_room": "clearance penalty",
    "shunned": "penalised",
    "dear": "penalty",
    "dearer": "penalty, more expensive",
    "shake": "perturbation",
    "shaken": "perturbed",
    "valley": "homotopy class or local minimum",
    "valleys": "homotopy classes or local minima",
    "ahead": "cost-to-go",
    "onward": "cost-to-come",
    "haste": "fast profile",
    "price_of_time": "time weight",
    "force_prices": "multipliers",
    # Identification.
    "told": "identifiable, testable, reported",
    "tells": "identifies",
    "tie": "alias, confounded",
    "ties": "aliased terms",
    "tied": "aliased",
    "twin": "alias",
    "twins": "aliases",
    "lookalike": "alias",
    "lookalikes": "aliases",
    "look_alike": "collinear",
    "look_alikes": "collinear",
    "contest": "model comparison",
    "contests": "model comparisons",
    "rival": "competing model",
    "rivals": "competing models",
    "standing": "ranking, ranked term",
    "standings": "ranking, ranked terms",
    "doubt": "input uncertainty",
    "doubts": "input uncertainties",
    "strained": "at bounds",
    "blame": "attribute to",
    "blamed": "attributed to",
    "around": "conditions",
}
"""Words of identifiers and file names, in lower case with ``_`` between → what to use."""

SENTENCES = {
    "way": "path or route",
    "ways": "paths or routes",
    "ride": "drive",
    "rides": "drives",
    "ridden": "driven",
    "knot": "waypoint",
    "knots": "waypoints",
    "station": "sample",
    "stations": "samples",
    "polish": "waypoint descent",
    "polished": "improved by waypoint descent",
    "toll": "corner penalty",
    "tolls": "corner penalties",
    "lean": "crab angle",
    "leans": "crab angle",
    "programme": "profile, dynamic programming",
    "programmes": "profiles, dynamic programming",
    "stuck": "infeasible",
    "hindered": "constrained",
    "shunned": "penalised",
    "dear": "expensive",
    "dearer": "more expensive",
    "shaken": "perturbed",
    "valley": "homotopy class or local minimum",
    "valleys": "homotopy classes or local minima",
    "onward": "cost-to-come",
    "haste": "fast",
    "told": "identified, reported, distinguished",
    "tell": "identify, report, distinguish",
    "tells": "identifies, reports, distinguishes",
    "ties": "aliased terms",
    "twin": "alias",
    "twins": "aliases",
    "lookalike": "alias",
    "lookalikes": "aliases",
    "look alike": "collinear",
    "contest": "model comparison",
    "rival": "competing model",
    "rivals": "competing models",
    "doubt": "uncertainty",
    "strained": "at bounds",
    "blame": "attribute to",
    "blamed": "attributed to",
    "price of time": "time weight",
    "prices of force": "multipliers",
    "left over": "residual",
    "memory that is kept": "cached bytes",
    "tamer": "simpler",
    "mend": "fix",
    "mended": "fixed",
    "in the median": "median",
}
"""Words and phrases of headings and first lines, in lower case → what to use."""

ORDINARY_PHRASES = (
    *("in the way", "gives way", "give way", "by way of", "way of", "ways of", "way round"),
    *("both ways", "one way", "another way", "either way", "this way", "same way", "two ways"),
)
"""Phrases in which a word of SENTENCES has its ordinary English meaning."""


@dataclass(frozen=True)
class Ordinary:
    """An identifier that has a word in its ordinary meaning, or by contract, below a folder."""

    name: str
    below: str
    reason: str


EXCEPTIONS = (
    Ordinary("around", "planner/telemetry/", "the linearisation's point"),
    Ordinary("window_around", "planner/", "a window round a place"),
    Ordinary("ahead", "planner/power/", "the direction of travel"),
    Ordinary("ahead", "planner/telemetry/", "the direction of travel, or rows further on"),
    Ordinary("ahead", "planner/search/steady/", "the direction of travel"),
    Ordinary("slope_ahead", "planner/", "the slope in the direction of travel"),
    Ordinary("use_ahead", "planner/telemetry/logs/", "rows further on"),
    Ordinary("standing", "planner/power/", "a wheel at standstill"),
    Ordinary("standing", "planner/search/", "a wheel at standstill"),
    Ordinary("standing", "planner/telemetry/sampling/", "a robot at standstill"),
    Ordinary("standing", "planner/telemetry/virtual/", "a robot at standstill"),
    Ordinary("standing", "planner/telemetry/regimes/", "a robot at standstill"),
)
"""JSON keys, commands and endpoints (front, reach, half_track, gain, motion) have no word above."""


@dataclass(frozen=True)
class Hit:
    """A word of the private vocabulary: where it stands, and what to use."""

    file: str
    line: int
    found: str
    word: str
    use: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.found!r} has {self.word!r}; use: {self.use}"


def tokens(name: str) -> str:
    """Words of a snake_case or CamelCase name, in lower case with ``_`` between and at the ends."""
    words = re.findall(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+", name)
    return "_" + "_".join(word.lower() for word in words) + "_"


def words_in_name(name: str, file: str) -> list[str]:
    """Words of NAMES that an identifier has, unless it is an exception."""
    if any(e.name == name.lower().strip("_") and file.startswith(e.below) for e in EXCEPTIONS):
        return []
    whole = tokens(name)
    return [word for word in NAMES if f"_{word}_" in whole]


def words_in_sentence(sentence: str) -> list[str]:
    """Words of SENTENCES in a heading or a docstring's first line; code in it does not count."""
    text = " ".join(re.findall(r"[a-z]+", re.sub(r"`+[^`]*`+", " ", sentence.lower())))
    for phrase in ORDINARY_PHRASES:
        text = re.sub(rf"\b{phrase}\b", " ", text)
    return [word for word in SENTENCES if re.search(rf"\b{word}\b", text)]


def sources() -> list[Path]:
    return sorted(p for top in ("planner", "service") for p in (ROOT / top).rglob("*.py"))


def hits_in_names() -> Iterator[Hit]:
    """Hits in file names and identifiers; of an identifier every line where it stands."""
    for path in sources():
        file = path.relative_to(ROOT).as_posix()
        own = path.parent.name if path.name == "__init__.py" else path.stem
        for word in words_in_name(own, file):
            yield Hit(file, 1, own, word, NAMES[word])
        seen = set()
        for token in tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline):
            if token.type == tokenize.NAME and (token.string, token.start[0]) not in seen:
                seen.add((token.string, token.start[0]))
                for word in words_in_name(token.string, file):
                    yield Hit(file, token.start[0], token.string, word, NAMES[word])


def hits_in_docstrings() -> Iterator[Hit]:
    """Hits in the first line of every text that stands alone: docstrings, also of constants."""
    for path in sources():
        file = path.relative_to(ROOT).as_posix()
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            value = node.value if isinstance(node, ast.Expr) else None
            if isinstance(value, ast.Constant) and isinstance(value.value, str):
                first = value.value.strip().partition("\n")[0]
                for word in words_in_sentence(first):
                    yield Hit(file, value.lineno, first, word, SENTENCES[word])


def hits_in_headings() -> Iterator[Hit]:
    """Hits in the headings of README.md and of the documents, decisions included."""
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        code = False
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            code ^= line.startswith("```")
            if line.startswith("#") and not code:
                for word in words_in_sentence(line):
                    file = path.relative_to(ROOT).as_posix()
                    yield Hit(file, number, line, word, SENTENCES[word])


PLACES = {"names": hits_in_names, "docstrings": hits_in_docstrings, "headings": hits_in_headings}


@pytest.mark.parametrize("place", PLACES)
def test_the_fields_words_are_used(place: str) -> None:
    hits = [str(hit) for hit in PLACES[place]()]
    assert not hits, "\n" + "\n".join(hits)


def test_every_exception_is_needed() -> None:
    words = {tokens(name).strip("_") for name in NAMES}
    assert [e for e in EXCEPTIONS if not any(f"_{w}_" in tokens(e.name) for w in words)] == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("best_way", ["way"]),
        ("WayRequest", ["way"]),
        ("always_away", []),
        ("_KNOTS", ["knots"]),
        ("with_price_of_time", ["price_of_time"]),
        ("stations_m", ["stations"]),
    ],
)
def test_names_are_read_word_by_word(name: str, words: list[str]) -> None:
    assert words_in_name(name, "planner/x.py") == words


@pytest.mark.parametrize(
    ("sentence", "words"),
    [
        ("The cheapest way to the goal.", ["way"]),
        ("Each roller gives way a little.", []),
        ("Knots moved while ``way`` gets cheaper.", ["knots"]),
        ("Price of time, W.", ["price of time"]),
    ],
)
def test_ordinary_english_is_no_hit(sentence: str, words: list[str]) -> None:
    assert words_in_sentence(sentence) == words


def main(prefixes: list[str]) -> int:
    """Print hits below these folders (default: all) and counts by word and file; 1 with any hit."""
    every = [hit for place in PLACES.values() for hit in place()]
    hits = [h for h in every if not prefixes or h.file.startswith(tuple(prefixes))]
    for hit in hits:
        print(hit)
    for title, counts in (
        ("by word", Counter(f"{h.word} → {h.use}" for h in hits)),
        ("by file", Counter(h.file for h in hits)),
    ):
        print(f"\n{title}")
        for key, count in counts.most_common():
            print(f"{count:6d}  {key}")
    print(f"\n{len(hits)} in all")
    return bool(hits)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
