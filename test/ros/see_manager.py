#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelets fly in ROS's own nodelet manager too."""

import unittest

import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from nodelet.srv import NodeletList
from understory_msgs.msg import Trajectory

from watching import PATIENCE_S, Topic, speed_mps

NODELETS = ("bridge", "sim_camera", "depth_cloud", "mapper", "explorer")
NODELETS += ("map_publisher", "monitor", "recorder")


class SeeManager(unittest.TestCase):
    def test_all_nodelets_are_loaded_healthy_and_fly(self):
        diagnostics = Topic("/diagnostics", DiagnosticArray)
        odometry = Topic("odometry", Odometry)
        trajectory = Topic("trajectory", Trajectory)

        trajectory.wait_for_one(lambda one: len(one.position_control_points) > 3)
        odometry.wait_for_one(lambda one: speed_mps(one) > 0.3)

        rospy.wait_for_service("manager/list", PATIENCE_S)
        listed = rospy.ServiceProxy("manager/list", NodeletList)().nodelets
        self.assertEqual(sorted(listed), sorted(f"/{name}" for name in NODELETS))
        diagnostics.forget()
        for name in NODELETS:
            array = diagnostics.wait_for_one(lambda one: one.status[0].name == f"/{name}")
            self.assertNotEqual(array.status[0].level, b"\x02", array.status[0].message)


if __name__ == "__main__":
    rospy.init_node("see_manager")
    rostest.rosrun("understory_ros_test", "in_manager", SeeManager)
