"""What the benchmark of naming hides: one entry a log, told by kind, group and seed.

    for case in cases(["one", "none"], seeds=5): ...

    one       each effect of the catalogue, twins included, also those that were added later
    none      nothing hidden, white noise;  none_ar: nothing hidden, autocorrelated noise
    two       thirty pairs
    outside   an effect that the catalogue does not have
    tied      designs in which quantities move together or do not move
    hard      autocorrelation 0.7, outliers, a slope sensor off by 2 degrees, speeds 5 % too high

Every draw comes from the case's own name and seed, so that a list cut short holds the same cases.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from planner.power.catalogue import all_effects, find_effect

Settings = dict[str, dict[str, Any]]

KINDS = ("one", "none", "none_ar", "two", "outside", "tied", "hard")

# Pairs that no log of this kind parts, after design.md's list of twins: naming the tie is right.
TWINS = {
    "current_ripple": "resistance",
    "converter_efficiency": "electronics",
    "vibration": "coulomb_drag",
    "sinkage": "load_dependent_rolling",
    "load_dependent_rolling": "sinkage",
}

FIRST = (
    "motor_heating", "load_dependent_rolling", "com_offset", "gear_asymmetry", "regeneration_limit",
    "viscous_drag", "stiction", "driver_loss", "sensor_rate", "slope_transition", "current_ripple",
    "wheel_preload", "wheel_slip", "yaw_scrub", "surface_rolling", "sinkage", "battery_sag",
    "converter_efficiency", "air_drag", "vibration", "cold_grease", "light_load_gear_drag", "wear",
    "wheel_imbalance", "roller_presliding",
)  # fmt: skip
"""Effects of the first edition: their order draws the pairs, so that these stay as they are."""
CATALOGUE = tuple(slug for slug, effect in all_effects().items() if not effect.base)
EFFECTS = (
    *(slug for slug in FIRST if slug in CATALOGUE),
    *(slug for slug in CATALOGUE if slug not in FIRST),
)

# Quantity that an effect outside the catalogue depends on, and those that may stand beside it.
OUTSIDE: dict[str, tuple[str, tuple[str, ...]]] = {
    "resonance": ("speed", ()),
    "heading_ripple": ("heading", ()),
    "start_decay": ("time_since_start", ()),
    "slope_threshold": ("slope_along", ()),
    "yaw_speed": ("yaw_rate", ("speed",)),
}

# Effects that each design hides from view or ties to others.
TIED: dict[str, tuple[str, ...]] = {
    "speed_heats_motor": ("motor_heating", "viscous_drag", "air_drag", "cold_grease", "stiction"),
    "one_heading": ("wheel_imbalance", "com_offset", "wheel_preload", "viscous_drag", "yaw_scrub"),
    "one_load": ("load_dependent_rolling", "sinkage", "com_offset", "wear", "wheel_slip"),
}

LEVELS = (0.01, 0.015, 0.02, 0.03, 0.05)
SMALLEST_RHO = 0.3


@dataclass(frozen=True)
class Case:
    """One log to be made.

    Attributes:
        kind: one of KINDS.
        group: what is hidden or wrong, a row of the kind's table.
        seed: of this group.
        hidden: slug → settings of the virtual robot; ``size`` is a share of mean power.
        outside: slug of the effect that the catalogue does not have; also in ``hidden``.
        sensor: what is wrong with a sensor, as a kind of sensor explanation.
        design: of the drive.
        noise, sensors: fields of the virtual robot's Noise and Sensors.
        power_at_source: the log comes with a mapping file that says so.
        seek_rho: enlarge sizes, then lower noise, until each effect is visible.
    """

    kind: str
    group: str
    seed: int
    hidden: Settings = field(default_factory=dict)
    outside: str = ""
    sensor: str = ""
    design: str = "rich"
    noise: dict[str, Any] = field(default_factory=dict)
    sensors: dict[str, Any] = field(default_factory=dict)
    power_at_source: bool = False
    seek_rho: bool = True

    @property
    def name(self) -> str:
        """kind/group/seed."""
        return f"{self.kind}/{self.group}/{self.seed}"

    @property
    def truth(self) -> tuple[str, ...]:
        """Slugs of the catalogue that are hidden."""
        return tuple(slug for slug in self.hidden if slug != self.outside)

    @property
    def number(self) -> int:
        """Seed of everything drawn for this case."""
        return number_of(self.name)


def number_of(name: str) -> int:
    """A seed that is the same on every machine."""
    return zlib.crc32(name.encode())


def cases(kinds: Sequence[str] = KINDS, seeds: int = 5) -> list[Case]:
    """All cases of these kinds, with ``seeds`` of the usual five.

    Args:
        kinds: of KINDS.
        seeds: 5 gives the whole table; logs without groups are as many in proportion.
    """
    return [case for kind in kinds for case in MAKERS[kind](seeds)]


def settings_of(slug: str, rng: np.random.Generator) -> dict[str, Any]:
    """Settings of an effect with a random size and random proportions of its parameters."""
    own: dict[str, Any] = {"size": math.exp(rng.uniform(math.log(0.015), math.log(0.08)))}
    if slug == "motor_heating":
        own["magnet_coefficient"] = -0.0020 * rng.uniform(0.3, 1.2)
    elif slug == "com_offset" and rng.random() < 0.4:
        angle = rng.uniform(0.0, 2.0 * math.pi)
        own |= {"gain": 0.0, "offset_x": 0.03 * math.cos(angle), "offset_y": 0.03 * math.sin(angle)}
    elif slug == "regeneration_limit":
        both = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))[int(rng.integers(3))]
        own |= {"motor_share": both[0], "source_share": both[1]}
    elif slug == "gear_asymmetry":
        own["return_change"] = -0.1
    elif slug == "stiction":
        own["stiction_speed"] = rng.uniform(0.015, 0.06)
    elif slug == "driver_loss":
        own |= {"diode_voltage": rng.uniform(0.2, 0.8), "switching_power": rng.uniform(0.0, 0.3)}
    elif slug == "cold_grease":
        own["temperature_rate"] = rng.uniform(0.015, 0.06)
    elif slug == "light_load_gear_drag":
        own["fading_torque"] = rng.uniform(0.1, 0.4)
    elif slug == "surface_rolling":
        own["excess"] = {"carpet": rng.uniform(0.3, 0.8), "asphalt": rng.uniform(-0.3, 0.1)}
    elif slug == "wheel_imbalance":
        uneven = rng.uniform(-0.5, 0.5, 4)
        own["excess"] = [float(e) for e in uneven - uneven.mean()]
    else:
        for name, parameter in find_effect(slug).parameters.items():
            if parameter.grid:
                own[name] = rng.uniform(min(parameter.grid), max(parameter.grid))
    return own


def _noise(rng: np.random.Generator, seed: int) -> dict[str, Any]:
    """1 to 5 %, half of the logs with an autocorrelated half."""
    return {
        "level": LEVELS[(int(rng.integers(5)) + seed) % 5],
        "autocorrelated": 0.5 * float(rng.random() < 0.5),
        "correlation": 0.7,
    }


def _hiding(kind: str, group: str, seed: int, slugs: Sequence[str], **more: Any) -> Case:
    rng = np.random.default_rng(number_of(f"{kind}/{group}/{seed}"))
    hidden = {slug: settings_of(slug, rng) for slug in slugs}
    noise = _noise(rng, seed) | more.pop("noise", {})
    at_source = "battery_sag" in slugs or bool(rng.random() < 0.25)
    lacks_com = hidden.get("com_offset", {}).get("gain") == 0.0  # nobody measured where loads lie
    may_lack_com = "com_offset" not in slugs
    absent = _absent(rng, at_source, lacks_com or (may_lack_com and bool(rng.random() < 0.1)))
    sensors = {**more.pop("sensors", {}), "absent": absent}
    return Case(
        kind, group, seed, hidden, noise=noise, sensors=sensors, power_at_source=at_source, **more
    )


def _absent(rng: np.random.Generator, at_source: bool, com: bool) -> tuple[str, ...]:
    """Columns that a robot's log may well lack."""
    absent: list[str] = []
    if rng.random() < 0.6:
        absent += [f"wheel_current_{k}" for k in range(1, 5)]
    if rng.random() < 0.3 and not at_source:
        absent += ["battery_voltage", "battery_current"]
    if rng.random() < 0.2:
        absent += ["ax", "ay"]
    return tuple(absent + (["com_x", "com_y"] if com else []))


def one(seeds: int) -> list[Case]:
    """One effect of the catalogue."""
    return [_hiding("one", slug, seed, [slug]) for slug in EFFECTS for seed in range(seeds)]


def none(seeds: int) -> list[Case]:
    """Nothing hidden, white noise; 200 at five seeds."""
    white = {"autocorrelated": 0.0}
    return [_hiding("none", "nothing", k, [], noise=white) for k in range(40 * seeds)]


def none_ar(seeds: int) -> list[Case]:
    """Nothing hidden, at least half of the variance autocorrelated at 0.5 to 0.9; 200."""
    made = []
    for k in range(40 * seeds):
        rng = np.random.default_rng(number_of(f"none_ar noise {k}"))
        slow = {"autocorrelated": rng.uniform(0.5, 1.0), "correlation": rng.uniform(0.5, 0.9)}
        if k % 4 == 3:
            slow["run_offset"] = rng.uniform(0.002, 0.01)
        made.append(_hiding("none_ar", "nothing", k, [], noise=slow))
    return made


def two(seeds: int) -> list[Case]:
    """Pairs in which each effect that is nobody's twin meets three others; 30 at five seeds.

    An effect of a later edition meets three of the first.
    """
    lone = [slug for slug in EFFECTS if slug in FIRST and slug not in TWINS]
    rng = np.random.default_rng(11)
    pairs: list[tuple[str, str]] = []
    while len(pairs) < 30:
        order = [lone[k] for k in rng.permutation(len(lone))]
        for first, second in zip(order[::2], order[1::2], strict=False):
            pair = (min(first, second), max(first, second))
            if pair not in pairs and len(pairs) < 30:
                pairs.append(pair)
    pairs = pairs[: 6 * seeds]
    for slug in EFFECTS:
        if slug not in FIRST:
            drawn = np.random.default_rng(number_of(f"two {slug}")).permutation(len(lone))
            pairs += [(lone[k], slug) for k in drawn[: math.ceil(0.6 * seeds)]]
    return [_hiding("two", "+".join(pair), 0, pair) for pair in pairs]


def outside(seeds: int) -> list[Case]:
    """An effect that the catalogue does not have."""
    made = []
    for slug in OUTSIDE:
        for seed in range(seeds):
            rng = np.random.default_rng(number_of(f"outside {slug} {seed}"))
            own: dict[str, Any] = {"size": rng.uniform(0.03, 0.08)}
            if slug == "resonance":
                own |= {"speed": rng.uniform(0.25, 0.6), "width": rng.uniform(0.04, 0.08)}
            elif slug == "heading_ripple":
                own["harmonic"] = float(rng.choice([3.0, 5.0]))
            elif slug == "start_decay":
                own["time_constant"] = rng.uniform(12.0, 40.0)
            elif slug == "slope_threshold":
                own["threshold"] = rng.uniform(0.03, 0.07)
            noise = _noise(rng, seed)
            sensors = {"absent": _absent(rng, False, False)}
            made.append(
                Case("outside", slug, seed, {slug: own}, slug, noise=noise, sensors=sensors)
            )
    return made


def tied(seeds: int) -> list[Case]:
    """Designs in which the truth cannot be told, or not from its rivals; 100 at five seeds."""
    made = []
    for design, slugs in TIED.items():
        for k in range(math.ceil(20 * seeds / 3)):
            slug, seed = slugs[k % len(slugs)], k // len(slugs)
            group = f"{design}:{slug}"
            made.append(_hiding("tied", group, seed, [slug], design=design, seek_rho=False))
    return made[: 20 * seeds + 2]


def hard(seeds: int) -> list[Case]:
    """Noise and sensors that are worse than the method assumes."""
    lone = [slug for slug in EFFECTS if slug in FIRST and slug not in TWINS]
    made = []
    for seed in range(4 * seeds):
        rng = np.random.default_rng(number_of(f"hard {seed}"))
        first, second, third = (lone[k] for k in rng.permutation(len(lone))[:3])
        slow = {"autocorrelated": 1.0, "correlation": 0.7}
        made.append(_hiding("hard", f"ar:{first}", seed, [first], noise=slow))
        wild = {"outliers": 0.01}
        made.append(_hiding("hard", f"outliers:{second}", seed, [second], noise=wild))
        beside = [third] if seed % 4 == 3 else []
        label = "+".join(["slope_offset", *beside])
        sign = 1.0 if rng.random() < 0.5 else -1.0
        off = {"slope_offset": sign * math.radians(2.0)}
        made.append(_hiding("hard", label, seed, beside, sensors=off, sensor="slope_offset"))
        label = "+".join(["speed_scale", *beside])
        fast = {"speed_scale": 1.0 + sign * 0.05}
        made.append(_hiding("hard", label, seed, beside, sensors=fast, sensor="speed_scale"))
    return made


MAKERS: dict[str, Callable[[int], list[Case]]] = {
    "one": one,
    "none": none,
    "none_ar": none_ar,
    "two": two,
    "outside": outside,
    "tied": tied,
    "hard": hard,
}
