"""The power meter of a log: how it averages, and the moment that a row's reading belongs to.

    meter = Meter(time_constant_s=0.4)
    replace(log, meter=meter)      # every prediction for this log is then what the meter shows
    meter.sentence                 # "your meter averages over 0.40 ± 0.02 s"

Sign
    a positive delay is a reading that comes late.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

Sampling = Literal["mean", "end", "held", "window"]
SAME_PERIOD = 0.01
"""Share by which estimates of one period may differ."""
NO_DELAY = 1e-9
"""s; a shorter delay is none."""
SETTLED_ERRORS = 0.5
"""Standard errors by which estimates of one meter may differ."""


@dataclass(frozen=True)
class Meter:
    """A first-order filter with a delay.

    Attributes:
        time_constant_s, delay_s: of the filter, and by how much later the reading comes.
        sampling: a row's reading is its "mean", that of its "end", or one "held" from the last row
            in which a slower meter had a new one. That of a "window" is no filter's but an even
            mean over time_constant_s before the row's end.
        time_constant_error_s, delay_error_s: standard errors by the power's noise alone; 0 for
            what was not fitted.
        time_constant_shift_s: what the motion's noise and the data sheet add to the first.
        period_s: between readings of a "held" meter; 0 where equal rows show which ones it held.
    """

    time_constant_s: float = 0.0
    delay_s: float = 0.0
    sampling: Sampling = "mean"
    time_constant_error_s: float = 0.0
    delay_error_s: float = 0.0
    time_constant_shift_s: float = 0.0
    period_s: float = 0.0

    LONGEST_LAG: ClassVar[float] = 5.0
    """s; longest time constant and delay that are believed."""

    def with_number(self, name: str, value: float) -> Meter:
        """The meter with another ``time_constant_s`` or ``delay_s``."""
        numbers: dict[str, Any] = {name: value}
        return replace(self, **numbers)

    def half_a_row_later(self, interval: float) -> Meter:
        """The same meter beside a motion that is half a row of ``interval`` s earlier."""
        lag = self.delay_s - 0.5 * interval
        if self.sampling in ("held", "window"):
            return replace(self, delay_s=lag)
        # What leads the mean of its row by half a row is read at its end.
        lag -= 0.5 * interval * (self.sampling == "end")
        if lag < -0.25 * interval:
            return replace(self, sampling="end", delay_s=lag + 0.5 * interval)
        return replace(self, sampling="mean", delay_s=lag)

    @property
    def plain(self) -> bool:
        """Whether it shows the power of its rows, as far as the error of its delay shows."""
        no_filter = self.time_constant_s == 0.0 and self.sampling == "mean"
        return no_filter and abs(self.delay_s) <= max(self.delay_error_s, NO_DELAY)

    @property
    def time_constant_stderr_s(self) -> float:
        """Standard error of the time constant with all that is known to shift it."""
        return math.hypot(self.time_constant_error_s, self.time_constant_shift_s)

    @property
    def sentence(self) -> str:
        """What the meter does, in words."""
        said = []
        tau, error = self.time_constant_s, self.time_constant_stderr_s
        if tau > 0.0:
            over = _seconds(tau, error) if tau > error else f"less than {tau + error:.2g} s"
            said.append(f"averages {'evenly ' * (self.sampling == 'window')}over {over}")
        if abs(self.delay_s) > self.delay_error_s:
            late = "lags" if self.delay_s > 0.0 else "leads"
            said.append(f"{late} the motion by {_seconds(abs(self.delay_s), self.delay_error_s)}")
        moment = {
            "mean": "",
            "window": "",
            "end": "is read at the end of each row",
            "held": f"holds each reading for {self.period_s:.3g} s"
            if self.period_s
            else "holds a reading over several rows",
        }[self.sampling]
        said += [moment] if moment else []
        return "Your meter " + " and ".join([", ".join(said[:-1]), said[-1]] if said[1:] else said)

    def to_json(self) -> dict[str, Any]:
        """The entry ``meter`` of a comparison and of a diagnosis."""
        return {
            "time_constant_s": _estimate(self.time_constant_s, self.time_constant_stderr_s),
            "delay_s": _estimate(self.delay_s, self.delay_error_s),
            "sampling": self.sampling,
            "sentence": self.sentence,
        }


def same_meter(one: Meter | None, other: Meter | None) -> bool:
    """Whether two estimates of a meter are the same but for their errors."""
    if one is None or other is None:
        return one is other
    near = abs(one.time_constant_s - other.time_constant_s) <= SETTLED_ERRORS * math.hypot(
        one.time_constant_error_s, other.time_constant_error_s
    ) and abs(one.delay_s - other.delay_s) <= SETTLED_ERRORS * math.hypot(
        one.delay_error_s, other.delay_error_s
    )
    same_rows = abs(one.period_s - other.period_s) <= SAME_PERIOD * one.period_s
    return near and same_rows and one.sampling == other.sampling


def _seconds(value: float, error: float) -> str:
    places = 2 if error <= 0.0 else max(0, min(4, 1 - math.floor(math.log10(error))))
    return f"{value:.{places}f} ± {error:.{places}f} s" if error > 0.0 else f"{value:.{places}f} s"


def _estimate(value: float, error: float) -> dict[str, float | None]:
    return {"value": value, "stderr": error if error > 0.0 else None}
