#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Two vehicles at one ROS master fly side by side, each with its own topics and frames."""

import unittest

import numpy
import rosgraph
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2
from understory_msgs.msg import Trajectory

from watching import PATIENCE_S, Topic, position_m, speed_mps

VEHICLES = ("uav1", "uav2")
SHARED = ("/diagnostics", "/rosout", "/rosout_agg", "/tf", "/tf_static")


class SeeTwo(unittest.TestCase):
    def test_both_fly_with_topics_of_their_own(self):
        odometry = {name: Topic(f"/{name}/odometry", Odometry) for name in VEHICLES}
        trajectory = {name: Topic(f"/{name}/trajectory", Trajectory) for name in VEHICLES}
        points = {name: Topic(f"/{name}/camera/depth/points", PointCloud2) for name in VEHICLES}

        for name in VEHICLES:
            odometry[name].wait_for_one(lambda one: speed_mps(one) > 0.3)
            trajectory[name].wait_for_one(lambda one: len(one.position_control_points) > 3)
            cloud = points[name].wait_for_one(lambda one: True)
            self.assertEqual(cloud.header.frame_id, f"{name}/camera_optical")

        for name in VEHICLES:
            for one in odometry[name].wait_for_count(10):
                self.assertEqual(one.header.frame_id, "map")
                self.assertEqual(one.child_frame_id, f"{name}/base_link")
        topics, _, _ = rosgraph.Master(rospy.get_name()).getSystemState()
        for topic, nodes in topics:
            owners = [f"/{name}/onboard" for name in VEHICLES if topic.startswith(f"/{name}/")]
            if owners:
                self.assertEqual(nodes, owners, topic)
            else:
                self.assertIn(topic, SHARED)

    def test_their_frames_do_not_mix(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        patience = rospy.Duration.from_sec(PATIENCE_S)
        for name in VEHICLES:
            odometry = Topic(f"/{name}/odometry", Odometry)
            odometry.wait_for_one(lambda one: speed_mps(one) > 0.3)
            buffer.lookup_transform("map", f"{name}/camera_optical", rospy.Time(0), patience)
            odometry.forget()
            newest = odometry.wait_for_one(lambda one: True)

            transform = buffer.lookup_transform(
                "map", f"{name}/base_link", newest.header.stamp, patience
            ).transform.translation

            told_m = numpy.array((transform.x, transform.y, transform.z))
            self.assertLess(numpy.abs(told_m - position_m(newest)).max(), 1e-6)
        listener.unregister()
        frames = ("base_link", "camera_optical")
        wanted = {f"{name}/{frame}" for name in VEHICLES for frame in frames}
        seen = set(buffer.all_frames_as_yaml().replace(":", " ").split())
        self.assertTrue(wanted <= seen, seen)
        self.assertFalse(set(frames) & seen, seen)


if __name__ == "__main__":
    rospy.init_node("see_two")
    rostest.rosrun("understory_ros_test", "two", SeeTwo)
