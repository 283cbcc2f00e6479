"""Keys by content: equal for equal code wherever it stands, and changed by what it follows from."""

import os
from pathlib import Path

import pytest

from planner.code_cache import Sources

PACKAGE = {
    "__init__.py": "",
    "numbers.py": '"""Numbers."""\nTWO = 2.0  # a comment\nTHREE = 3.0\n',
    "room/__init__.py": "from toy.room.one import first\nfrom toy.room.other import second\n",
    "room/one.py": "from toy.numbers import TWO\n\ndef first(x):\n    return TWO * x\n",
    "room/other.py": "def second(x):\n    return x\n",
    "user.py": "from toy.room import first\nimport math\n\ndef use(x):\n    return first(x)\n",
}


def write(folder: Path, **changed: str) -> Path:
    """The toy package below a folder, with other texts of some files."""
    for name, text in PACKAGE.items():
        file = folder / "toy" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(changed.get(name.removesuffix(".py").replace("/", "_"), text), "utf-8")
    return folder / "toy"


def key(folder: Path, module: str = "toy.user") -> str:
    return Sources(folder).key(module)


def test_the_path_does_not_count(tmp_path: Path) -> None:
    assert key(write(tmp_path / "a")) == key(write(tmp_path / "b"))


@pytest.mark.parametrize(
    ("name", "text", "follows"),
    [
        ("numbers", "TWO = 2.5\nTHREE = 3.0\n", True),
        ("numbers", '"""Other words."""\n\n\nTWO = 2.0\nTHREE = 3.0\n', False),
        ("room_one", "from toy.numbers import TWO\n\ndef first(x):\n    return TWO + x\n", True),
        # The face passes both names on; only one of them is used.
        ("room_other", "def second(x):\n    return -x\n", False),
        ("user", PACKAGE["user.py"].replace("import math\n", ""), True),
    ],
)
def test_what_counts(tmp_path: Path, name: str, text: str, follows: bool) -> None:
    changed = key(write(tmp_path / "b", **{name: text}))
    assert (changed != key(write(tmp_path / "a"))) is follows


def test_imports_for_the_type_checker_do_not_count(tmp_path: Path) -> None:
    guarded = "if TYPE_CHECKING:\n    from toy.room import first\n"
    sources = Sources(write(tmp_path, user=guarded))
    assert sources.closure("toy.user") == {"toy.user"}


def test_circles_end(tmp_path: Path) -> None:
    circle = write(tmp_path, numbers="from toy.user import use\nTWO = 2.0\n")
    found = Sources(circle).closure("toy.numbers")
    assert found == {"toy.numbers", "toy.user", "toy.room.one"}


def test_a_changed_file_is_read_again(tmp_path: Path) -> None:
    kept = tmp_path / "sources.json"
    folder = write(tmp_path)
    first = Sources(folder, kept).key("toy.user")
    assert kept.exists()
    assert Sources(folder, kept).key("toy.user") == first
    file = folder / "numbers.py"
    state = file.stat()
    file.write_text("TWO = 9.0\nTHREE = 3.0\n", "utf-8")
    os.utime(file, ns=(state.st_atime_ns, state.st_mtime_ns + 1))
    assert Sources(folder, kept).key("toy.user") != first


@pytest.mark.parametrize("content", ["", "[", '{"x": 1}', "null"])
def test_a_broken_file_of_what_was_read_does_not_matter(tmp_path: Path, content: str) -> None:
    kept = tmp_path / "sources.json"
    kept.write_text(content, "utf-8")
    folder = write(tmp_path)
    assert Sources(folder, kept).key("toy.user") == key(folder)


def test_a_module_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"toy\.nothing is not a module"):
        key(write(tmp_path), "toy.nothing")
