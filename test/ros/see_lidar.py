#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A LiDAR's clouds make a map without any camera."""

import math
import unittest

import rospy
import rostest
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from understory_msgs.msg import MapUpdate, MissionStatus

from watching import PATIENCE_S, Topic

RADIUS_M = 3.0


def ring_cloud():
    """A wall all around the vehicle, seen from its body; some points are no measurement."""
    points = [(float("nan"), 0.0, 0.0)]
    for i in range(720):
        angle = math.radians(0.5 * i)
        for height in (-0.4, 0.0, 0.4):
            points.append((RADIUS_M * math.cos(angle), RADIUS_M * math.sin(angle), height))
    header = Header(stamp=rospy.Time.now(), frame_id="base_link")
    return point_cloud2.create_cloud_xyz32(header, points)


class SeeLidar(unittest.TestCase):
    def test_clouds_of_a_lidar_are_mapped(self):
        updates = Topic("/map_updates", MapUpdate)
        status = Topic("/status", MissionStatus)
        publisher = rospy.Publisher("/lidar/points", PointCloud2, queue_size=1)
        rate = rospy.Rate(10)
        until = rospy.Time.now() + rospy.Duration(PATIENCE_S)

        while len(updates.messages) < 20 and rospy.Time.now() < until:
            publisher.publish(ring_cloud())
            rate.sleep()

        whole = updates.wait_for_one(lambda update: update.is_whole)
        occupied = sum(value > 40 for tile in whole.tiles for value in tile.log_odds)
        free = sum(-128 < value < 0 for tile in whole.tiles for value in tile.log_odds)
        self.assertGreater(occupied, 100)
        self.assertGreater(free, 1000)
        status.wait_for_one(lambda message: message.state == MissionStatus.WAITING)


if __name__ == "__main__":
    rospy.init_node("see_lidar")
    rostest.rosrun("understory_ros_test", "lidar", SeeLidar)
