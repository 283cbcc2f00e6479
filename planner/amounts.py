"""How amounts are written for people, the same in sentences, terminals, pages and notebooks.

joules(1118.4)                     # "1,118 J"
estimate(0.2213, 0.0041, "m²")     # "0.2213 ± 0.0041 m²"
"""

from __future__ import annotations

import math


def joules(value: float) -> str:
    """Energy with a unit that keeps three to five digits: 812.0 J, 12.30 kJ, 1.24 MJ."""
    value = 0.0 if abs(value) < 0.05 else value  # no "-0.0 J"
    for scale, unit in ((1e6, "MJ"), (1e3, "kJ")):
        if abs(value) >= (scale if unit == "MJ" else 10 * scale):
            return f"{value / scale:,.2f} {unit}"
    return f"{value:,.0f} J" if abs(value) >= 1000 else f"{value:.1f} J"


def seconds(value: float) -> str:
    """A duration as a person says it: 42.0 s, 3 min 05 s, 2 h 14 min."""
    if value < 60:
        return f"{value:z.1f} s"
    minutes, rest = divmod(round(value), 60)
    if minutes < 60:
        return f"{minutes} min {rest:02d} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min"


def metres(value: float) -> str:
    """A length: 12.30 m, 1,204 m."""
    return f"{value:z.2f} m" if value < 100 else f"{value:,.0f} m"


def coordinates(x: float, y: float) -> str:
    """A place to the centimetre, without exponents: "2, 17.5", "712034.5, 4051234"."""
    return ", ".join(f"{round(value, 2):z.12g}" for value in (x, y))


def span(least: float, most: float) -> str:
    """A range of coordinates to the millimetre: "0 to 24", "4070120.125 to 4070140"."""
    return f"{round(least, 3):z.12g} to {round(most, 3):z.12g}"


def watts(value: float | None) -> str:
    """Power: 0.041 W, 0.52 W, 3.10 W, 21.4 W, 1,204 W."""
    if value is None:
        return ""
    size = abs(value)
    digits = 3 if size < 0.1 else 2 if size < 10 else 1 if size < 100 else 0
    return f"{value:z,.{digits}f} W"


def signed(value: float | None) -> str:
    """A bias: +1.20 W measured above predicted."""
    if value is None:
        return ""
    size = watts(abs(value))
    return ("−" if value < 0 and size != watts(0.0) else "+") + size


def share(value: float | None) -> str:
    """A share as per cent."""
    return "" if value is None else f"{100 * value:z.{0 if abs(value) >= 0.1 else 1}f} %"


def chance(probability: float) -> str:
    """A probability as a person says it: 97 %, 99.98 %, over 99.99 %, under 0.01 %."""
    percent = 100.0 * probability
    if percent > 99.99 or percent < 0.01:
        return "over 99.99 %" if percent > 50.0 else "under 0.01 %"
    other = min(percent, 100.0 - percent)
    return f"{percent:.{0 if other >= 1.0 else 1 if other >= 0.1 else 2}f} %"


def number(value: float | None, stderr: float | None = None) -> str:
    """Any number with four significant digits; if its standard error is larger, with the error's.

    What four digits of the error do not show is no figure of the number: -1.4e-14 ± 0.01 is 0.
    """
    if value is None:
        return ""
    if stderr is not None and math.isfinite(stderr) and stderr > abs(value):
        value = round(value, 3 - math.floor(math.log10(stderr)))
    return f"{value:z.4g}"


def estimate(value: float, stderr: float | None, unit: str) -> str:
    """A parameter with its standard error and unit: 0.2213 ± 0.0041 m²."""
    unit = "" if unit in ("", "1") else f" {unit}"
    between = "" if stderr is None else f" ± {stderr:.2g}"
    return f"{number(value, stderr)}{between}{unit}"


def finite(value: float | None) -> float | None:
    """A number, or None where it is not known."""
    return None if value is None or not math.isfinite(value) else float(value)
