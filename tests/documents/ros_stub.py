"""As much of rclpy as docs/examples needs; its messages are those of ROS 2 Humble.

The definitions come from rosbags, which also serialises: a message with a wrong field, or with a
value of a wrong type, does not pass ``as_sent``.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable
from enum import Enum
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
NOW = 1_760_000_000_250_000_000  # ns, the stub's clock


class Message:
    """A message whose fields begin at zero, and that takes no others; as rclpy's."""

    kind = ""

    def __init__(self) -> None:
        for name, (what, detail) in STORE.get_msgdef(self.kind).fields:
            object.__setattr__(self, name, _empty(what.name, detail))

    def __setattr__(self, name: str, value: Any) -> None:
        before = getattr(self, name)  # AttributeError: no such field
        assert isinstance(value, type(before)), f"{self.kind}.{name} = {value!r}"
        object.__setattr__(self, name, value)


def _empty(what: str, detail: Any) -> Any:
    """What a field begins with, by its definition."""
    match what:
        case "NAME":
            return message(detail)()
        case "SEQUENCE":
            return []
        case "ARRAY":
            return np.zeros(detail[1])
    basic = detail[0]
    return "" if basic == "string" else 0.0 if basic.startswith("float") else 0


@functools.cache
def message(kind: str) -> type[Message]:
    """Class of a message: ``message("nav_msgs/msg/Path")``."""
    return type(kind.rpartition("/")[2], (Message,), {"kind": kind})


def as_sent(sent: Message) -> Any:
    """The message as a reader gets it: serialised and read again."""
    return STORE.deserialize_cdr(STORE.serialize_cdr(_real(sent), sent.kind), sent.kind)


def _real(value: Any) -> Any:
    if isinstance(value, list):
        return [_real(one) for one in value]
    if not isinstance(value, Message):
        return value
    names = [name for name, _ in STORE.get_msgdef(value.kind).fields]
    return STORE.types[value.kind](**{name: _real(getattr(value, name)) for name in names})


class Duration:
    """A time in ns; also the clock's time."""

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        self.nanoseconds = round(seconds * 1e9) + nanoseconds

    def __add__(self, other: Duration) -> Duration:
        return Duration(nanoseconds=self.nanoseconds + other.nanoseconds)

    def to_msg(self) -> Message:
        """As builtin_interfaces/Time."""
        stamp = message("builtin_interfaces/msg/Time")()
        stamp.sec, stamp.nanosec = divmod(self.nanoseconds, 10**9)
        return stamp


class Node:
    """A node whose topics and log a test looks at."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.parameters: dict[str, Any] = {}
        self.heard: dict[str, Callable[[Any], None]] = {}
        self.sent: list[Message] = []
        self.said: list[str] = []

    def declare_parameter(self, name: str, value: Any) -> None:
        """With its default."""
        self.parameters[name] = value

    def get_parameter(self, name: str) -> SimpleNamespace:
        """With ``value``."""
        return SimpleNamespace(value=self.parameters[name])

    def create_publisher(self, kind: type[Message], topic: str, qos: Any) -> SimpleNamespace:
        """Publishes into ``sent``."""
        return SimpleNamespace(publish=self.sent.append)

    def create_subscription(
        self, kind: type[Message], topic: str, heard: Callable[[Any], None], qos: Any
    ) -> None:
        """Calls of a test go to ``heard[topic]``."""
        self.heard[topic] = heard

    def get_logger(self) -> SimpleNamespace:
        """Into ``said``."""
        return SimpleNamespace(warning=self.said.append, error=self.said.append)

    def get_clock(self) -> SimpleNamespace:
        """A clock that stands."""
        return SimpleNamespace(now=lambda: Duration(nanoseconds=NOW))


def install(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the stubs where ``import`` finds them."""

    def module(name: str, **content: Any) -> None:
        made = ModuleType(name)
        vars(made).update(content)
        monkeypatch.setitem(sys.modules, name, made)

    def messages(package: str, *names: str) -> None:
        module(package)
        module(f"{package}.msg", **{name: message(f"{package}/msg/{name}") for name in names})

    module("rclpy")
    module("rclpy.node", Node=Node)
    module("rclpy.duration", Duration=Duration)
    module("rclpy.qos", QoSProfile=SimpleNamespace, DurabilityPolicy=Enum("D", "TRANSIENT_LOCAL"))
    messages("geometry_msgs", "PoseStamped", "PoseWithCovarianceStamped")
    messages("nav_msgs", "Path")
