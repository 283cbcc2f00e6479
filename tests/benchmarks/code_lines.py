"""Code lines of planner, service and maps in commits, Python and JavaScript.

    python -m tests.benchmarks.code_lines main 9e27ca1

Blank lines, comments and docstrings do not count. A line of a text over several lines does.
"""

from __future__ import annotations

import argparse
import ast
import io
import subprocess
import sys
import tarfile
import tokenize
from collections import Counter
from collections.abc import Sequence

TOPS = ("planner", "service", "maps")
_SPACE = {
    *(tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT),
    *(tokenize.ENCODING, tokenize.ENDMARKER),
}


def python_lines(text: str) -> int:
    """Lines of a module with code on them."""
    said: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        match node:
            case ast.Expr(value=ast.Constant(value=str())):
                said.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    code: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _SPACE:
            code.update(range(token.start[0], token.end[0] + 1))
    return len(code - said)


def script_lines(text: str) -> int:
    """The same of JavaScript, whose comments stand on lines of their own."""
    count, inside = 0, False
    for line in map(str.strip, text.splitlines()):
        begins = line.startswith("/*")
        if not (inside or begins or line.startswith("//")):
            count += bool(line)
        inside = (inside or begins) and "*/" not in line
    return count


def counted(commit: str) -> Counter[str]:
    """Code lines of a commit by folder and language."""
    command = ("git", "archive", commit, *TOPS)
    packed = subprocess.run(command, capture_output=True, check=True).stdout
    found: Counter[str] = Counter()
    with tarfile.open(fileobj=io.BytesIO(packed)) as files:
        for member in files:
            top, kind = member.name.partition("/")[0], member.name.rpartition(".")[2]
            file = files.extractfile(member) if kind in ("py", "js") else None
            if file is not None:
                text = file.read().decode("utf-8")
                found[f"{top} {kind}"] += (python_lines if kind == "py" else script_lines)(text)
    return found


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commits", nargs="*", default=["HEAD"], help="as git names them")
    for commit in parser.parse_args(arguments).commits:
        found = counted(commit)
        parts = ", ".join(f"{name} {lines:,}" for name, lines in sorted(found.items()))
        print(f"{commit:<12} {found.total():>7,}   {parts}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
