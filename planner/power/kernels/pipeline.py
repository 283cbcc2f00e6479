"""The module that evaluates a model: imports of its effects, and the stages made for them.

``kernel_source`` writes a plain Python module out of ``stages.power`` (specialise.py):

    evaluate(row, parameters, body, wheels, account, per_wheel) → W at the supply

        row, body, wheels, account, per_wheel: as in ``stages.power``
        parameters: (P,) values of all effects' parameters; complex for derivatives

    evaluate(columns, count, parameters, body, wheels, found)

        for blocks of rows (row_blocks.py): the power alone, or the power and the limits

numba can cache compiled code on disk only for functions that stand in a file, so the module is
written to a cache folder under a name that is the hash of all that it follows from
(``compile_kernel``). So a model seen before starts without writing and compiling.
"""

from __future__ import annotations

import ast
import inspect

from planner.code_cache import parsed
from planner.power.effect import Effect
from planner.power.kernels import stages
from planner.power.kernels.row_blocks import BLOCK_ARGUMENTS, in_blocks
from planner.power.kernels.specialise import KernelSpec, specialise

FORMULA_FUNCTIONS = (
    *("bell", "cosine", "exponential", "positive", "real_power", "root", "saturating", "sine"),
    "whole_power",
)
"""Functions of planner.power.kernel_math that the formulas of custom effects call besides."""


def stages_function() -> ast.FunctionDef:
    """A new tree of ``stages.power``, with the line numbers of its file."""
    [function] = (
        node for node in parsed(inspect.getsource(stages)).body if isinstance(node, ast.FunctionDef)
    )
    return function


def kernel_source(spec: KernelSpec) -> str:
    """Text of the module that evaluates a model."""
    body = specialise(stages_function(), spec)
    number, real = f"types.{spec.number}", "types.Array(types.float64, {}, 'C')"
    array = f"types.Array({number}, {{}}, 'C')"
    if spec.output == "account":
        arguments = ("row", "parameters", "body", "wheels", "account", "per_wheel")
        kinds = [real.format(1), array.format(1), real.format(1), real.format(2)]
        signature = f"{number}({', '.join([*kinds, array.format(1), array.format(2)])})"
        lines = [line for node in body for line in ast.unparse(node).splitlines()]
    else:
        arguments = BLOCK_ARGUMENTS
        kinds = [real.format(1), "types.int64", array.format(1), real.format(1), real.format(2)]
        signature = f"types.void({', '.join([*kinds, real.format(1)])})"
        lines = in_blocks(body)
    custom = [effect for effect in spec.effects if effect.definition is not None]
    head = [
        f'"""Power model written out by {__name__}; not to be edited."""',
        "from numba import types",
        "import numpy as np",
        "from planner.compiled_code import njit, njit_once",
        "from planner.power.kernel_math import absolute, larger, sign, smaller, still",
        *([f"from {__package__} import printed"] if spec.printed else []),
        *(line for effect in spec.effects if effect not in custom for line in _imports(effect)),
        *([f"from planner.power.kernel_math import {', '.join(FORMULA_FUNCTIONS)}"] * bool(custom)),
        *(text for effect in custom for text in effect.kernel_text.values()),
        "",
        f"SIGNATURE = {signature}",
        "",
        "@njit(SIGNATURE, cache=True, error_model='numpy')",
        f"def evaluate({', '.join(arguments)}):",
    ]
    return "\n".join([*head, *("    " + line for line in lines), ""])


def _imports(effect: type[Effect]) -> list[str]:
    name = effect.__name__
    calls = [f"{effect.slug}__{hook} = njit_once({name}.{hook})" for hook in effect.hooks]
    return [f"from {effect.__module__} import {name}", *calls]
