"""What an effect is: the place where physics acts, its parameters, a worked example, a source.

One file in ``planner/power/effects/`` declares one effect::

    class ViscousDrag(Effect):
        slug = "viscous_drag"
        title = "viscous drag of motor and gear"
        viscous_torque = Parameter(unit="N·m·s", default=2.3e-6, null=0.0, bounds=(0.0, 1.0))
        \"\"\"Torque at the motor's shaft over its speed.\"\"\"

        @staticmethod
        def motor_torque(motor_speed, viscous_torque):
            return viscous_torque * motor_speed

The name of a static method is the *hook*: it says at which stage of the pipeline the effect acts
(``HOOKS`` lists them in the order of the physics). The names of a hook's arguments say what it
reads: a parameter of the effect, a quantity of ``planner.quantities``, or a value that the pipeline
has computed before that stage. Any other name fails at import. Formulas use only arithmetic and
``planner.power.kernel_math``, so that one text serves the compiled planning kernel, its exact
derivatives, the documentation and the forms of the service. What breaks the derivatives fails at
import, too (planner.power.complex_step).

At the *null values* of its parameters an effect changes nothing: comparing models is then always
comparing nested ones.

The file is all that an effect needs: catalogue, documentation, command line, fit, ranking and tests
find it. A virtual robot hides it by its own formula, unless the robot has an equation of motion for
it (planner.telemetry.virtual). Optional attributes say what cannot be derived: ``loss``,
``before_meter``, ``how_to_measure``, and ``hidden_at`` and ``tried_at`` of a parameter.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Literal

from planner.power.complex_step import check_differentiable, source_tree
from planner.quantities import INDEX

Stage = Literal["body force", "wheel load", "contact", "drive", "driver", "bus", "supply"]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    Attributes:
        unit: SI unit, "1" for a pure number.
        default: value when neither vehicle nor model gives one.
        bounds: physically possible range; a fit stays inside, a TOML value outside is refused.
        doc: one sentence; left out, it is the docstring below the parameter.
        null: value at which the effect is absent; None in the base model's effects and in
            parameters that only shape an effect.
        fitted: whether a fit may change it; False for what is given or scanned on ``grid``.
        grid: values to scan for a shape parameter that means nothing without the effect.
        per: "wheel" or "surface" where each wheel or each surface label has a value of its own.
        spread: relative standard deviation of the value before any calibration.
        hidden_at: value in a virtual robot that hides the effect; None takes the default.
        tried_at: distance from null at which a search tries it first; None takes the default.
    """

    unit: str
    default: float
    bounds: tuple[float, float]
    doc: str = ""
    null: float | None = None
    fitted: bool = True
    grid: tuple[float, ...] = ()
    per: Literal["wheel", "surface"] | None = None
    spread: float = 0.15
    hidden_at: float | None = None
    tried_at: float | None = None

    @property
    def in_virtual_robot(self) -> float:
        """Value in a virtual robot that has the effect."""
        return self.default if self.hidden_at is None else self.hidden_at


@dataclass(frozen=True)
class WorkedExample:
    """A hook's value computed by hand, with numbers chosen so that swapped arguments fail."""

    hook: str
    given: Mapping[str, float]
    result: float | tuple[float, ...]
    source: str


@dataclass(frozen=True)
class Hook:
    """A place in the pipeline: its stage, what it may read, and how its result enters."""

    stage: Stage
    reads: tuple[str, ...]
    combine: Literal["add", "multiply", "replace"]
    doc: str


_BODY = ("mass", "speed")
_WHEEL = (
    *(*_BODY, "wheel", "wheel_count", "rim_speed", "roller_speed", "wheel_radius"),
    *("nominal_load", "sliding_speed"),
)
_CONTACT = (*_WHEEL, "load")
_AXLE = (*_CONTACT, "axis_force", "wheel_acceleration")
_DRIVE = (
    *("wheel_radius", "wheel_count", "wheel_torque", "wheel_speed", "wheel_acceleration"),
    *("motor_speed", "motor_acceleration", "gear_ratio", "load"),
)
_MOTOR = (*_DRIVE, "motor_torque_in", "resistance_now", "torque_constant_now", "current")

REAL_INPUTS = frozenset(
    (
        *("wheel", "wheel_count", "wheel_radius", "gear_ratio", "nominal_load", "mass", "speed"),
        "sliding_speed",
        *("rim_speed", "roller_speed", "wheel_acceleration", "motor_acceleration"),
        *INDEX,
    )
)
"""Inputs that depend on no parameter: real in every kernel, so that formulas may compare them."""

HOOKS: dict[str, Hook] = {
    "centre_of_mass": Hook(
        "wheel load", _BODY, "add", "m, the centre of mass from the geometric centre"
    ),
    "centre_spread": Hook("wheel load", (), "add", "m ≥ 0, the same towards an unknown side"),
    "body_force": Hook(
        "body force",
        (*_BODY, "centre_x", "centre_y"),
        "add",
        "N, N, N·m that the wheels must supply",
    ),
    "contact_factor": Hook(
        "contact", _CONTACT, "multiply", "factor on rolling and roller drag of a wheel"
    ),
    "roller_factor": Hook(
        "contact", _CONTACT, "multiply", "factor on the roller drag of a wheel alone"
    ),
    "wheel_drag": Hook(
        "contact", _CONTACT, "add", "N at the rim, ≥ 0, against the wheel's rolling"
    ),
    "roller_drag": Hook("contact", _CONTACT, "add", "N, signed as the roller's surface speed"),
    "circulation": Hook(
        "contact", _BODY, "add", "N per wheel of the force mode in which wheels fight"
    ),
    "slip": Hook(
        "contact",
        (*_CONTACT, "axis_force"),
        "add",
        "speed of sliding along the roller's axle over the rim's speed",
    ),
    "axle_torque": Hook(
        "contact", _AXLE, "add", "N·m at the wheel's axle, signed as the wheel's speed"
    ),
    "gear_return": Hook(
        "drive", _DRIVE, "add", "change of the gear's efficiency when driven backwards"
    ),
    "gear": Hook(
        "drive",
        (*_DRIVE, "gear_return"),
        "replace",
        "N·m at the motor's side of the gear for the wheel's torque",
    ),
    "static_torque": Hook(
        "drive", _DRIVE, "add", "N·m at the motor that friction can hold at rest"
    ),
    "motor_torque": Hook(
        "drive", (*_DRIVE, "motor_torque_in"), "add", "N·m added at the motor's shaft"
    ),
    "winding": Hook("drive", _DRIVE, "multiply", "factors on R and on k_t"),
    "winding_resistance": Hook("drive", (), "add", "Ω of one motor when cold"),
    "motor_constant": Hook("drive", (), "add", "N·m/A of one motor when cold"),
    "motor_loss": Hook("drive", _MOTOR, "add", "W lost in one motor"),
    "motor_power": Hook("driver", ("motor_watts",), "add", "W added to one motor's terminal power"),
    "driver": Hook("driver", (*_MOTOR, "active"), "add", "W of one motor's bridge"),
    "electronics": Hook("bus", _BODY, "add", "W of control and sensors"),
    "converter": Hook("bus", ("electronics_watts",), "add", "W lost in feeding the electronics"),
    "bus": Hook("bus", (*_BODY, "motors_watts"), "add", "W of anything else on the bus"),
    "supply": Hook("supply", ("bus_watts",), "add", "W between the bus and what the source gives"),
}
"""Hooks in the order in which the pipeline calls them."""


class Effect:
    """Base of all effects; subclasses are declarations and are never instantiated."""

    slug: ClassVar[str]
    title: ClassVar[str]
    base: ClassVar[bool] = False
    """True for the effects of the base model, which is always there and has no null values."""
    exchange: ClassVar[bool] = False
    """True where energy is stored and given back (height, motion) rather than lost."""
    loss: ClassVar[bool] = False
    """True where it never gives energy back, whatever the motion. The lower bound of a route's
    energy is proven only where it knows this of every effect outside the base model."""
    before_meter: ClassVar[bool] = False
    """True where it acts between the source and the terminals: only a log whose power was measured
    at the source can show it."""
    how_to_measure: ClassVar[str] = "No run of the robot alone; measure the effect by itself."
    """One sentence: what to measure or do where no recommended run would show the effect."""
    examples: ClassVar[tuple[WorkedExample, ...]] = ()
    definition: ClassVar[Mapping[str, Any] | None] = None
    """What a custom effect was made of, None for those of the catalogue."""
    kernel_text: ClassVar[Mapping[str, str]] = {}
    """Hook to the text of its compiled function, for effects that are not written as a file."""

    parameters: ClassVar[dict[str, Parameter]] = {}
    hooks: ClassVar[dict[str, Callable[..., Any]]] = {}
    reads: ClassVar[frozenset[str]] = frozenset()
    """Quantities that the formulas read."""

    def __init_subclass__(cls) -> None:
        """Collect parameters and hooks; refuse undefined names."""
        super().__init_subclass__()
        own = vars(cls)
        cls.hooks = {k: v.__func__ for k, v in own.items() if isinstance(v, staticmethod)}
        declared = {k: v for k, v in own.items() if isinstance(v, Parameter)}
        docs = cls._docstrings() if cls.definition is None else {}
        cls.parameters = {k: replace(v, doc=v.doc or docs.get(k, "")) for k, v in declared.items()}
        for name, formula in cls.hooks.items():
            cls._check_hook(name, formula)
        arguments = (name for hook in cls.hooks.values() for name in _arguments(hook))
        cls.reads = frozenset(name for name in arguments if name in INDEX)
        if not cls.base and not any(p.null is not None for p in cls.parameters.values()):
            raise TypeError(f"{cls.__name__}: an effect outside the base model needs a null value")
        for name in ("slug", "title"):
            if not isinstance(getattr(cls, name, None), str):
                raise TypeError(f"{cls.__name__}.{name}: missing; an effect declares it as text")

    @classmethod
    def _docstrings(cls) -> dict[str, str]:
        """Texts below the assignments of the class's body; none where its source is not known."""
        for hook in cls.hooks.values():
            for node in ast.walk(source_tree(hook)):
                if isinstance(node, ast.ClassDef) and node.name == cls.__name__:
                    return {
                        ast.unparse(line.targets[0]): " ".join(str(below.value.value).split())
                        for line, below in pairwise(node.body)
                        if isinstance(line, ast.Assign)
                        and isinstance(below, ast.Expr)
                        and isinstance(below.value, ast.Constant)
                    }
        return {}

    @classmethod
    def _check_hook(cls, name: str, formula: Callable[..., Any]) -> None:
        where = f"{cls.__name__}.{name}"
        if name not in HOOKS:
            raise TypeError(f"{where}: no such hook; there are {', '.join(HOOKS)}")
        known = {*cls.parameters, *INDEX, *HOOKS[name].reads}
        for argument in _arguments(formula):
            if argument not in known:
                raise TypeError(
                    f"{where}: argument {argument!r} is neither a parameter of this effect, nor a "
                    f"quantity, nor one of {', '.join(HOOKS[name].reads)}"
                )
        if cls.definition is None:  # formulas of users are checked where they are read
            check_differentiable(formula, REAL_INPUTS - {*cls.parameters}, where)

    @classmethod
    def stages(cls) -> tuple[Stage, ...]:
        """Stages at which the effect acts, in the order of the pipeline."""
        seen = dict.fromkeys(HOOKS[name].stage for name in HOOKS if name in cls.hooks)
        return tuple(seen)

    @classmethod
    def summary(cls) -> str:
        """First paragraph of the module's head."""
        module = inspect.getmodule(cls)
        return inspect.cleandoc(module.__doc__ or "").split("\n\n")[0] if module else ""


def _arguments(formula: Callable[..., Any]) -> Sequence[str]:
    return list(inspect.signature(formula).parameters)


def parameter_slots(
    effects: Sequence[type[Effect]], *, wheel_count: int, surface_count: int
) -> list[tuple[type[Effect], str, Parameter, int]]:
    """One entry for every number in the parameter array: effect, name, declaration, element.

    The element counts the wheels or surface labels of a parameter that has one value for each.
    """
    slots = []
    for effect in effects:
        for name, parameter in effect.parameters.items():
            count = {None: 1, "wheel": wheel_count, "surface": surface_count}[parameter.per]
            slots += [(effect, name, parameter, element) for element in range(count)]
    return slots
