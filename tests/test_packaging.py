"""What is installed is what the repository says: names, versions, locked files, no addresses."""

from __future__ import annotations

import importlib.metadata
import re
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
LOCKS = ("lock.txt", "dev.txt", "bench.txt", "build.txt", "docs.txt", "notebooks.txt")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def locked(name: str) -> dict[str, list[str]]:
    """Requirement name -> its lines (one per environment marker), hashes left out."""
    found: dict[str, list[str]] = {}
    for line in (ROOT / "requirements" / name).read_text().splitlines():
        if match := re.match(r"([a-z0-9._-]+)==\S+", line):
            found.setdefault(match[1], []).append(line)
    return found


def test_the_command_and_the_distribution_are_installed() -> None:
    distribution = importlib.metadata.distribution("joulepath")
    assert distribution.version == PROJECT["version"]
    commands = {e.name: e.value for e in distribution.entry_points if e.group == "console_scripts"}
    assert commands == PROJECT["scripts"]


@pytest.mark.parametrize("name", LOCKS)
def test_every_locked_requirement_has_a_hash(name: str) -> None:
    text = (ROOT / "requirements" / name).read_text()
    requirements = re.split(r"\n(?=[a-z0-9])", text.strip())
    assert requirements
    assert [r for r in requirements if "--hash=sha256:" not in r] == []


@pytest.mark.parametrize("name", LOCKS)
def test_locks_name_no_address(name: str) -> None:
    text = (ROOT / "requirements" / name).read_text()
    assert not re.search(r"://|--(extra-)?index-url|--find-links|file:", text)


def test_every_declared_dependency_is_locked() -> None:
    def names(requirements: list[str]) -> set[str]:
        return {re.split(r"[<>=!~ \[;]", r)[0].lower() for r in requirements}

    runtime = names(PROJECT["dependencies"])
    assert runtime <= set(locked("lock.txt"))
    for extra in ("bench", "dev", "docs", "notebooks"):
        declared = names(PROJECT["optional-dependencies"][extra])
        assert runtime | declared <= set(locked(f"{extra}.txt"))


def test_development_runs_the_versions_that_users_get() -> None:
    def versions(lines: list[str] | None) -> set[str]:
        return {line.split(" ")[0] for line in lines or []}

    runtime, development = locked("lock.txt"), locked("dev.txt")
    different = {
        name: (versions(lines), versions(development.get(name)))
        for name, lines in runtime.items()
        if versions(lines) != versions(development.get(name))
    }
    assert different == {}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel and the source distribution of this repository."""
    folder = tmp_path_factory.mktemp("built")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
        timeout=120,
    )
    return folder


def test_both_distributions_carry_the_licence(built: Path) -> None:
    text = (ROOT / "LICENSE").read_text()
    assert text.startswith("BSD 3-Clause License\n\nCopyright (c) 2026 the joulepath developers\n")
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        info = f"joulepath-{PROJECT['version']}.dist-info"
        assert wheel.read(f"{info}/licenses/LICENSE").decode() == text
        metadata = wheel.read(f"{info}/METADATA").decode()
    assert "\nLicense-Expression: BSD-3-Clause\n" in metadata
    assert "\nLicense-File: LICENSE\n" in metadata
    with tarfile.open(next(built.glob("*.tar.gz"))) as source:
        inside = source.extractfile(f"joulepath-{PROJECT['version']}/LICENSE")
        assert inside is not None
        assert inside.read().decode() == text


def test_the_image_is_built_with_every_file_that_the_project_names() -> None:
    copied = re.findall(r"^COPY (?!--from)(.+) \S+$", (ROOT / "Dockerfile").read_text(), re.M)
    ignored = (ROOT / ".dockerignore").read_text().splitlines()
    for name in ("pyproject.toml", PROJECT["readme"], *PROJECT["license-files"]):
        assert name in " ".join(copied).split()
        assert f"!{name}" in ignored
