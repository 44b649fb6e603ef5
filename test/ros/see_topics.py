#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What another process gets to see of an onboard process that flies the scenario `clearing`."""

import unittest

import numpy
import rospy
import rostest
import tf2_ros
from nav_msgs.msg import Odometry
from octomap_msgs.msg import Octomap
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from understory_msgs.msg import MapUpdate, MissionStatus, Trajectory
from visualization_msgs.msg import MarkerArray

from watching import PATIENCE_S, Topic, position_m, speed_mps

WIDTH, HEIGHT, RANGE_M = 160, 120, 4.5
TILE_VOXELS = 16**3
UNKNOWN = -128


def points_of(cloud):
    """x, y, z per pixel."""
    floats = numpy.frombuffer(cloud.data, dtype=numpy.float32)
    return floats.reshape(cloud.height, cloud.width, cloud.point_step // 4)[..., :3]


def run_from_whole(updates, length):
    """`length` updates that follow on each other, the first of them a whole map; or None."""
    run = []
    for update in updates:
        follows = run and update.revision == run[-1].revision + 1
        run = run + [update] if follows else [update] if update.is_whole else []
        if len(run) == length:
            return run
    return None


class SeeTopics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.points = Topic("camera/depth/points", PointCloud2)
        cls.image = Topic("camera/depth/image_rect", Image)
        cls.info = Topic("camera/depth/camera_info", CameraInfo)
        cls.maps = Topic("map_updates", MapUpdate)
        cls.trajectory = Topic("trajectory", Trajectory)
        cls.status = Topic("status", MissionStatus)
        cls.octomap = Topic("octomap_binary", Octomap)
        cls.markers = Topic("markers", MarkerArray)
        cls.odometry = Topic("odometry", Odometry)

    def test_clouds_are_organised_and_in_the_optical_frame(self):
        def is_seeing(cloud):
            return numpy.isfinite(points_of(cloud)[..., 2]).sum() > 100

        cloud = self.points.wait_for_one(is_seeing)

        self.assertEqual((cloud.width, cloud.height), (WIDTH, HEIGHT))
        self.assertEqual(cloud.header.frame_id, "camera_optical")
        self.assertEqual([field.name for field in cloud.fields], ["x", "y", "z"])
        self.assertFalse(cloud.is_dense)
        points = points_of(cloud)
        points = points[numpy.isfinite(points[..., 2])]
        self.assertGreaterEqual(points[:, 2].min(), 0.2)
        self.assertLessEqual(numpy.linalg.norm(points, axis=1).max(), RANGE_M + 0.01)

    def test_images_and_clouds_are_of_the_same_exposures(self):
        images = self.image.wait_for_count(15)
        self.points.wait_for_one(lambda cloud: cloud.header.stamp == images[-1].header.stamp)
        info = self.info.wait_for_one(lambda info: info.header.stamp == images[-1].header.stamp)

        for image in images:
            self.assertEqual((image.width, image.height, image.encoding), (WIDTH, HEIGHT, "32FC1"))
            self.assertEqual(len(image.data), image.step * image.height)
            self.assertEqual(image.header.frame_id, "camera_optical")
        self.assertEqual((info.width, info.height), (WIDTH, HEIGHT))
        self.assertGreater(info.K[0], 0.0)
        stamps = [image.header.stamp for image in images]
        self.assertEqual(stamps, sorted(set(stamps)))

    def test_maps_come_as_a_whole_and_then_as_what_changed(self):
        updates = self.maps.wait_for(lambda updates: run_from_whole(updates, 12))

        known_tiles = {tile.slot for tile in updates[0].tiles}
        self.assertTrue(known_tiles)
        for update in updates:
            self.assertEqual(update.resolution_m, 0.1)
            self.assertEqual(tuple(update.voxel_min), (-50, -50, 0))
            self.assertEqual(tuple(update.voxel_end), (50, 50, 20))
            self.assertEqual(update.header.frame_id, "map")
            slots = [tile.slot for tile in update.tiles]
            self.assertEqual(slots, sorted(set(slots)))
            for tile in update.tiles:
                log_odds = numpy.array(tile.log_odds, dtype=numpy.int8)
                self.assertEqual(log_odds.size, TILE_VOXELS)
                self.assertTrue((log_odds != UNKNOWN).any())
        self.assertFalse(any(update.is_whole for update in updates[1:]))

    def test_a_whole_map_has_all_tiles_that_changed_before(self):
        def find(updates):
            wholes = [at for at, update in enumerate(updates) if update.is_whole]
            return updates[wholes[0] : wholes[-1] + 1] if len(wholes) > 1 else None

        updates = self.maps.wait_for(find)

        changed = {tile.slot for update in updates for tile in update.tiles}
        self.assertEqual(changed, {tile.slot for tile in updates[-1].tiles})

    def test_trajectories_can_be_flown(self):
        trajectory = self.trajectory.wait_for_one(lambda one: True)

        self.assertEqual(trajectory.header.frame_id, "map")
        self.assertGreater(trajectory.id, 0)
        self.assertGreaterEqual(len(trajectory.position_control_points), 4)
        self.assertGreaterEqual(len(trajectory.yaw_control_points), 4)
        self.assertGreater(trajectory.position_knot_s, 0.0)
        self.assertGreater(trajectory.yaw_knot_s, 0.0)
        self.assertGreater(trajectory.max_speed_mps, 0.0)
        self.assertLess(abs((trajectory.header.stamp - rospy.Time.now()).to_sec()), PATIENCE_S)

    def test_the_mission_says_that_it_explores(self):
        status = self.status.wait_for_one(lambda one: one.state == MissionStatus.EXPLORE)

        self.assertEqual(status.stop_reason, MissionStatus.NONE)
        self.assertEqual(len(status.counter_names), len(status.counter_values))
        self.status.wait_for_one(lambda one: one.has_target)

    def test_octomaps_are_those_of_ros(self):
        octomap = self.octomap.wait_for_one(lambda one: len(one.data) > 100)

        # pylint: disable=protected-access
        self.assertEqual(Octomap._md5sum, "9a45536b45c5e409cd49f04bb2d9999f")
        self.assertEqual(octomap._connection_header["md5sum"], Octomap._md5sum)
        self.assertEqual(octomap._connection_header["type"], "octomap_msgs/Octomap")
        self.assertEqual((octomap.id, octomap.binary), ("OcTree", True))
        self.assertAlmostEqual(octomap.resolution, 0.1)
        self.assertEqual(octomap.header.frame_id, "map")

    def test_markers_show_clusters_in_the_map(self):
        array = self.markers.wait_for_one(lambda one: any(mark.points for mark in one.markers))

        for marker in array.markers:
            self.assertEqual(marker.header.frame_id, "map")
            self.assertTrue(not marker.points or marker.scale.x > 0.0)

    def test_odometry_and_transforms_tell_the_same(self):
        buffer = tf2_ros.Buffer()
        listener = tf2_ros.TransformListener(buffer)
        self.odometry.wait_for_one(lambda one: speed_mps(one) > 0.3)
        buffer.lookup_transform(
            "map", "camera_optical", rospy.Time(0), rospy.Duration.from_sec(PATIENCE_S)
        )
        self.odometry.forget()
        odometry = self.odometry.wait_for_one(lambda one: True)

        transform = buffer.lookup_transform(
            "map", "base_link", odometry.header.stamp, rospy.Duration.from_sec(PATIENCE_S)
        )

        listener.unregister()
        self.assertEqual((odometry.header.frame_id, odometry.child_frame_id), ("map", "base_link"))
        translation = transform.transform.translation
        told_m = numpy.array((translation.x, translation.y, translation.z))
        self.assertLess(numpy.abs(told_m - position_m(odometry)).max(), 1e-6)
        self.assertLess(speed_mps(odometry), 3.0)


if __name__ == "__main__":
    rospy.init_node("see_topics")
    rostest.rosrun("understory_ros_test", "topics", SeeTopics)
