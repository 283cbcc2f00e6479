"""Compiled kernels of the power model, and their types in numba.

Active effects become the text of one function. The text is compiled and kept on disk. The
kernel then runs over rows. PowerModel calls ``compile_kernel``; compiled loops elsewhere take a
model's kernel as an argument of type ``KERNEL`` (one row) or ``BLOCK_KERNEL`` (``BLOCK`` rows
side by side).
"""

from planner.power.kernels.compiler import compile_kernel
from planner.power.kernels.kernel import BLOCK_KERNEL, KERNEL, Kernel
from planner.power.kernels.row_blocks import BLOCK
from planner.power.kernels.specialise import KernelSpec

__all__ = ["BLOCK", "BLOCK_KERNEL", "KERNEL", "Kernel", "KernelSpec", "compile_kernel"]
