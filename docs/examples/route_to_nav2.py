"""ROS 2 node: asks a joulepath service for the route of least energy and publishes it as a path.

    joulepath serve &
    python3 route_to_nav2.py --ros-args -p map:=hall -p vehicle:=my-robot.toml

It needs rclpy and the messages of ROS 2 Humble or newer, and nothing of joulepath. A goal that is
set in RViz ("2D Goal Pose") is planned from the pose that localisation last gave:

    subscribes  /amcl_pose   geometry_msgs/PoseWithCovarianceStamped
                /goal_pose   geometry_msgs/PoseStamped
    publishes   /plan        nav_msgs/Path; Nav2's controller follows it by FollowPath

The frame of both is ``map``, that of the floor plan which ``map`` names in the service. While the
service plans, the node waits; a new goal is taken after that.
"""

import json
import math
import urllib.error
import urllib.request

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Path
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

NAV_PATH = "application/vnd.joulepath.nav-path+json"
PARAMETERS = {
    "service": "http://127.0.0.1:8000",
    "map": "warehouse",
    "vehicle": "minibalance",
    "api_key": "",
    "timeout_s": 60.0,
}


class RouteToNav2(Node):
    """Answers goals with paths."""

    def __init__(self):
        super().__init__("route_to_nav2")
        for name, value in PARAMETERS.items():
            self.declare_parameter(name, value)
        # The last pose and the last path are also for those who join later.
        kept = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pose = None
        self.paths = self.create_publisher(Path, "plan", kept)
        self.create_subscription(PoseWithCovarianceStamped, "amcl_pose", self.remember, kept)
        self.create_subscription(PoseStamped, "goal_pose", self.answer, 1)

    def remember(self, message):
        """Keep the robot's pose."""
        self.pose = message.pose.pose

    def answer(self, goal):
        """Publish the path to a goal, or say why there is none."""
        if self.pose is None:
            self.get_logger().warning("no pose on amcl_pose yet, the goal is left")
            return
        if goal.header.frame_id not in ("", "map"):
            self.get_logger().error(f"the goal is in the frame {goal.header.frame_id}, not in map")
            return
        request = {
            "map": self.value("map"),
            "vehicle": self.value("vehicle"),
            "start": place(self.pose),
            "goal": place(goal.pose),
        }
        try:
            route = self.ask(request, NAV_PATH)
            if not route["poses"]:
                reason = self.ask(request, "application/json").get("reason")
                self.get_logger().error(f"no route: {reason}")
                return
        except urllib.error.HTTPError as problem:
            self.get_logger().error(f"refused: {json.load(problem).get('detail')}")
            return
        except OSError as problem:
            self.get_logger().error(f"no service at {self.value('service')}: {problem}")
            return
        self.paths.publish(self.path(route))

    def value(self, name):
        """A parameter's value."""
        return self.get_parameter(name).value

    def ask(self, request, format_):
        """The service's answer to a route request, in a format."""
        headers = {"Content-Type": "application/json", "Accept": format_}
        if key := self.value("api_key"):
            headers["Authorization"] = f"Bearer {key}"
        body = json.dumps(request).encode()
        asked = urllib.request.Request(f"{self.value('service')}/v1/routes", body, headers)
        with urllib.request.urlopen(asked, timeout=self.value("timeout_s")) as answer:
            return json.load(answer)

    def path(self, route):
        """A message of the answer; its stamps, times since the start, count from now."""
        now = self.get_clock().now()
        path = Path()
        path.header.frame_id = route["header"]["frame_id"]
        path.header.stamp = now.to_msg()
        for entry in route["poses"]:
            stamp, pose = entry["header"]["stamp"], entry["pose"]
            stamped = PoseStamped()
            stamped.header.frame_id = path.header.frame_id
            later = Duration(seconds=stamp["sec"], nanoseconds=stamp["nanosec"])
            stamped.header.stamp = (now + later).to_msg()
            for name, value in pose["position"].items():
                setattr(stamped.pose.position, name, value)
            for name, value in pose["orientation"].items():
                setattr(stamped.pose.orientation, name, value)
            path.poses.append(stamped)
        return path


def place(pose):
    """Place of a request: metres, and the yaw in rad."""
    at, turned = pose.position, pose.orientation
    yaw = math.atan2(
        2.0 * (turned.w * turned.z + turned.x * turned.y),
        1.0 - 2.0 * (turned.y**2 + turned.z**2),
    )
    return {"x": at.x, "y": at.y, "yaw": yaw}


def main():
    """Run until Ctrl-C."""
    rclpy.init()
    node = RouteToNav2()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
