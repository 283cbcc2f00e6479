"""Functions that an effect's formula may use, each differentiable by a complex step.

A formula is compiled twice: for real parameters (planning) and for complex ones, where an
imaginary step of 1e-20 on a parameter carries its exact derivative through the arithmetic
(Squire & Trapp, SIAM Review 40(1), 1998). The built-in ``abs`` would drop the imaginary part, so
that the derivative became a silent zero, and ``max`` does not compile. The functions here branch on
the real part and keep the whole number.

``sign(x, width)`` and ``still(x, width)`` belong together: sign² + still = 1. The first is dry
friction made smooth over ``width``, the second is 1 at rest and 0 in motion.

Here they are plain functions, so that a list of effects loads no compiler. Compiled code can call
them once planner.power.kernels is imported.
"""

from __future__ import annotations

from typing import Any

import numpy as np

SLIDING_SPEED = 0.005
"""m/s, width over which rim and roller friction change sign: below what wheel encoders resolve."""
REST_SPEED = 2.0
"""rad/s at the motor below which static friction helps to hold (docs/physics.md)."""


def absolute(x: Any) -> Any:
    """|x| of the real part's sign, keeping the derivative."""
    return x if x.real >= 0.0 else -x


def positive(x: Any) -> Any:
    """X where it is above zero, otherwise 0."""
    return x if x.real > 0.0 else 0.0 * x


def negative(x: Any) -> Any:
    """X where it is below zero, otherwise 0."""
    return x if x.real < 0.0 else 0.0 * x


def smaller(x: Any, y: Any) -> Any:
    """The one of x and y whose real part is smaller."""
    return x + 0.0 * y if x.real <= y.real else y + 0.0 * x


def larger(x: Any, y: Any) -> Any:
    """The one of x and y whose real part is larger."""
    return x + 0.0 * y if x.real >= y.real else y + 0.0 * x


def sign(x: Any, width: float) -> Any:
    """Smooth sign of x: x / √(x² + width²)."""
    return x / np.sqrt(x * x + width * width)


def still(x: Any, width: float) -> Any:
    """1 at x = 0, falling to 0 once |x| exceeds ``width``: width² / (x² + width²)."""
    return width * width / (x * x + width * width)


def root(x: Any) -> Any:
    """Square root; 0 for real parts at or below zero without an imaginary step."""
    if x.real <= 0.0 and x.imag == 0.0:
        return 0.0 * x
    return np.sqrt(x)


def exponential(x: Any) -> Any:
    """Exponential function e to the power of x."""
    return np.exp(x)


def power_of(x: Any, exponent: Any) -> Any:
    """X to the power of ``exponent`` for x > 0, written so that both may carry a complex step."""
    return np.exp(exponent * np.log(x))


def known(x: float) -> bool:
    """True unless x is NaN, which is how a row says that a quantity was not measured."""
    return x == x


def sine(x: Any) -> Any:
    """Sine of an angle in rad."""
    return np.sin(x)


def cosine(x: Any) -> Any:
    """Cosine of an angle in rad."""
    return np.cos(x)


def saturating(x: Any) -> Any:
    """Hyperbolic tangent; the library's complex one is NaN for large arguments."""
    if x.real >= 0.0:
        fading = np.exp(-2.0 * x)
        return (1.0 - fading) / (1.0 + fading)
    fading = np.exp(2.0 * x)
    return (fading - 1.0) / (fading + 1.0)


def bell(x: Any, centre: Any, width: Any) -> Any:
    """exp(-((x - centre) / width)²); 0 for a width of 0."""
    apart = x - centre
    return np.exp(-apart * apart / (width * width + 1e-300))


def whole_power(x: Any, exponent: int) -> Any:
    """Power by multiplication; the library's complex power blurs an imaginary step at x < 0."""
    result = 1.0 + 0.0 * x
    for _ in range(abs(exponent)):
        result = result * x
    if exponent < 0:
        return 1.0 / result
    return result


def real_power(x: Any, exponent: float) -> Any:
    """X to a broken exponent for x > 0, otherwise 0."""
    if x.real <= 0.0:
        return 0.0 * x
    return np.exp(exponent * np.log(x))
