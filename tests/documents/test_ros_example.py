"""The ROS 2 node of docs/examples, with a service and a stub of rclpy."""

from __future__ import annotations

import runpy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.documents import ros_stub
from tests.documents.blocks import ROOT
from tests.documents.running import served


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of a service."""
    with served(tmp_path_factory.mktemp("store")) as found:
        yield found


@pytest.fixture
def node(address: str, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The node, on the flat ends of the test bench."""
    ros_stub.install(monkeypatch)
    made = runpy.run_path(str(ROOT / "docs/examples/route_to_nav2.py"))["RouteToNav2"]()
    made.parameters |= {"service": address, "map": "test-bench"}
    return made


def localised(node: Any, x: float, y: float) -> None:
    """Localisation gives a pose that looks along x."""
    pose = ros_stub.message("geometry_msgs/msg/PoseWithCovarianceStamped")()
    pose.pose.pose.position.x, pose.pose.pose.position.y = x, y
    pose.pose.pose.orientation.w = 1.0
    node.heard["amcl_pose"](pose)


def goal(node: Any, x: float, y: float, frame: str = "map") -> None:
    """A goal is set that looks along y."""
    pose = ros_stub.message("geometry_msgs/msg/PoseStamped")()
    pose.header.frame_id = frame
    pose.pose.position.x, pose.pose.position.y = x, y
    pose.pose.orientation.z = pose.pose.orientation.w = float(np.sqrt(0.5))
    node.heard["goal_pose"](pose)


def test_a_goal_becomes_a_path_of_valid_messages(node: Any) -> None:
    localised(node, 1.0, 1.5)
    goal(node, 3.0, 1.5)
    assert node.said == []
    (sent,) = node.sent
    path = ros_stub.as_sent(sent)
    assert path.header.frame_id == "map"
    places = np.array([(p.pose.position.x, p.pose.position.y) for p in path.poses])
    assert places[0] == pytest.approx([1.0, 1.5])
    assert places[-1] == pytest.approx([3.0, 1.5])
    turns = np.array([(p.pose.orientation.z, p.pose.orientation.w) for p in path.poses])
    assert np.hypot(*turns.T) == pytest.approx(1.0)
    assert 2.0 * np.arctan2(*turns[0]) == pytest.approx(0.0, abs=1e-6)
    assert 2.0 * np.arctan2(*turns[-1]) == pytest.approx(np.pi / 2)
    stamps = [p.header.stamp.sec * 10**9 + p.header.stamp.nanosec for p in path.poses]
    assert stamps[0] == ros_stub.NOW
    assert np.all(np.diff(stamps) > 0)
    # Two metres at the vehicle's 1 m/s and below.
    assert stamps[-1] - stamps[0] > 2 * 10**9


@pytest.mark.parametrize(
    ("change", "where", "said"),
    [
        ({}, {"x": 3.0, "y": 99.0}, "goal"),
        ({"map": "no-such-map"}, {"x": 3.0, "y": 1.5}, "refused: map"),
        ({"service": "http://127.0.0.1:9"}, {"x": 3.0, "y": 1.5}, "no service at"),
        ({}, {"x": 3.0, "y": 1.5, "frame": "odom"}, "frame odom"),
    ],
)
def test_what_cannot_be_planned_is_said(
    node: Any, change: dict[str, Any], where: dict[str, Any], said: str
) -> None:
    node.parameters |= change
    localised(node, 1.0, 1.5)
    goal(node, **where)
    assert node.sent == []
    assert len(node.said) == 1
    assert said in node.said[0]


def test_without_a_pose_a_goal_is_left(node: Any) -> None:
    goal(node, 3.0, 1.5)
    assert node.sent == []
    assert "amcl_pose" in node.said[0]


def test_the_documents_name_the_node() -> None:
    named = [p for p in (ROOT / "docs").rglob("*.md") if "route_to_nav2.py" in p.read_text("utf-8")]
    assert Path(ROOT / "docs/tutorials/my-building.md") in named
