#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What the camera sees in flight can be recorded with rosbag."""

import pathlib
import subprocess
import tempfile
import unittest

import rosbag
import rospy
import rostest
from sensor_msgs.msg import Image

from watching import PATIENCE_S, Topic

TOPICS = ("/camera/depth/image_rect", "/camera/depth/camera_info", "/camera/depth/points")
RECORDED_S = 3
LEAST_FRAMES = 15  # of 45


class RecordBag(unittest.TestCase):
    def test_camera_topics_can_be_recorded(self):
        Topic(TOPICS[0], Image).wait_for_count(5)
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "camera.bag"
            subprocess.run(
                ["rosbag", "record", "-O", path, f"--duration={RECORDED_S}", *TOPICS],
                stdin=subprocess.DEVNULL,
                timeout=RECORDED_S + PATIENCE_S,
                check=True,
            )
            with rosbag.Bag(path) as bag:
                recorded = {topic: [] for topic in TOPICS}
                for topic, message, _ in bag.read_messages():
                    recorded[topic].append(message)
                about = bag.get_type_and_topic_info().topics

        self.assertEqual(about[TOPICS[2]].msg_type, "sensor_msgs/PointCloud2")
        for topic, messages in recorded.items():
            self.assertGreaterEqual(len(messages), LEAST_FRAMES, topic)
            stamps = [message.header.stamp for message in messages]
            self.assertEqual(stamps, sorted(set(stamps)), topic)
        for image in recorded[TOPICS[0]]:
            self.assertEqual(len(image.data), image.step * image.height)


if __name__ == "__main__":
    rospy.init_node("record_bag")
    rostest.rosrun("understory_ros_test", "bag", RecordBag)
