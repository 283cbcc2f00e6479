"""Compiling once: each step after those it needs, side by side, and not a second time."""

from pathlib import Path

import pytest

from planner.code_cache import compiled_modules, is_compiled, state
from service import compiling
from service.compiling import compile_once, order, show_on_stderr

MODULES = compiled_modules()


@pytest.fixture(autouse=True)
def new_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Nothing is compiled here, and a step compiles nothing."""
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "compiled").mkdir()
    return tmp_path / "compiled"


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, int]]:
    """What was said of the progress, by steps that take no time."""
    monkeypatch.setattr(compiling, "run", lambda waiting, say, processes: say(len(waiting), 9))
    return []


def test_modules_with_compiled_code_know_what_they_import() -> None:
    assert "planner.search.grid.lattice" in MODULES["planner.search.grid.least_cost"]
    assert all(needed <= {*MODULES} for needed in MODULES.values())


def test_every_step_comes_after_what_it_needs() -> None:
    needs = compiling.needs()
    done: set[str] = set()
    while ready := order(needs, done, [], most=3):
        for name in ready:
            assert done >= needs.pop(name), name
        done |= {*ready}
    assert not needs
    assert done == {*MODULES, *compiling.QUESTIONS}


def test_no_two_steps_side_by_side_compile_the_same() -> None:
    needs = compiling.needs()
    first = order(needs, set(), [], most=9)
    assert len(first) > 1
    assert len({compiling.part_of(name) for name in first}) == len(first)
    for name in first:
        del needs[name]
    assert order(needs, set(), first, most=9) == []
    assert order(needs, set(), [], most=9) != []
    assert len(order(needs, {*MODULES}, [], most=2)) == 2


def test_a_new_machine_compiles_and_the_second_time_does_not(
    new_machine: Path, said: list[tuple[int, int]]
) -> None:
    assert not any(map(is_compiled, MODULES))
    assert compile_once(lambda *numbers: said.append(numbers))
    assert said == [(len(MODULES) + len(compiling.QUESTIONS), 9)]
    assert [file.name for file in new_machine.glob("ready-*")] == [f"ready-{state()}"]
    assert not compile_once(lambda *numbers: said.append(numbers))
    assert len(said) == 1


def test_what_is_left_to_numba_is_not_compiled(
    monkeypatch: pytest.MonkeyPatch, said: list[tuple[int, int]]
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/somewhere")
    assert not compile_once(lambda *numbers: said.append(numbers))


def test_a_step_that_fails_is_not_marked_as_done(
    new_machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiling, "needs", lambda: {"planner.no_such_module": set[str]()})
    with pytest.raises(ModuleNotFoundError):
        compile_once(lambda done, steps: None)
    assert not list(new_machine.glob("ready-*"))


def test_progress_is_said_first_and_last_where_nobody_looks(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for done in range(4):
        show_on_stderr(done, 3)
    assert capsys.readouterr().err.splitlines() == [
        "joulepath: compiling for this machine, once: 0 of 3",
        "joulepath: compiling for this machine, once: 3 of 3",
    ]
