#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What may go wrong in flight: the vehicle must end at rest in free space, with results and map
written, and diagnostics that say what happened. Each test flies its own onboard process."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rosbag
import rospy
import rostest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Point, TransformStamped
from nodelet.srv import NodeletUnload
from sensor_msgs.msg import CameraInfo, Image
from tf2_msgs.msg import TFMessage
from understory_msgs.msg import MissionStatus, Trajectory

from watching import FlightTest

FLY = Path(__file__).resolve().parents[2] / "src/understory_nodelets/onboard/fly.py"
AIRBORNE_S = 6.0  # into the flight; by then it has flown metres
VEHICLE_RADIUS_M = 0.2
MOST_SHOWN = 1000  # of what a flight said that is flown again


def wait_until(what, condition, patience_s):
    until = time.monotonic() + patience_s
    while time.monotonic() < until:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"not within {patience_s} s: {what}")


class Flight:
    """An onboard process, what it says, and what it leaves behind."""

    def __init__(self, *options, uri=None):
        self.folder = Path(tempfile.mkdtemp(prefix="understory_robustness_"))
        self.output = tempfile.TemporaryFile("w+", encoding="utf-8")
        self.status = None
        self.statuses = 0
        self.diagnostics = {}  # name: worst (level, message) so far
        self.values = {}  # name: newest counters
        self.subscribers = []
        if uri is None:
            self.subscribers = [
                rospy.Subscriber("/status", MissionStatus, self._on_status),
                rospy.Subscriber("/diagnostics", DiagnosticArray, self._on_diagnostics),
            ]
        environment = dict(os.environ)
        if uri is not None:
            environment["ROS_MASTER_URI"] = uri
        self.process = subprocess.Popen(
            ["rosrun", "understory_nodelets", "onboard", "--scenario", "clearing"]
            + ["--result-folder", str(self.folder), *options],
            env=environment,
            stdout=self.output,
            start_new_session=True,
        )

    def _on_status(self, status):
        self.status = status
        self.statuses += 1

    def _on_diagnostics(self, array):
        for status in array.status:
            worst = self.diagnostics.get(status.name, (DiagnosticStatus.OK, ""))
            if status.level >= worst[0]:
                self.diagnostics[status.name] = (status.level, status.message)
            self.values[status.name] = {pair.key: int(pair.value) for pair in status.values}

    def wait_airborne(self):
        wait_until(
            "the vehicle explores",
            lambda: self.status is not None
            and self.status.state == MissionStatus.EXPLORE
            and (self.status.header.stamp - self.status.started_at).to_sec() > AIRBORNE_S,
            30.0,
        )

    def wait_end(self, patience_s=45.0):
        try:
            return self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"onboard still runs after {patience_s} s") from None

    def result(self):
        return json.loads((self.folder / "result.json").read_text(encoding="utf-8"))

    def said(self):
        self.output.seek(0)
        return self.output.read()

    def last_tick(self):
        with open(self.folder / "ticks.csv", encoding="utf-8") as file:
            return list(csv.DictReader(file))[-1]

    def close(self):
        for subscriber in self.subscribers:
            subscriber.unregister()
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
            self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


class Robustness(FlightTest):
    def fly(self, *options, uri=None):
        flight = Flight(*options, uri=uri)
        self.flights.append(flight)
        self.addCleanup(flight.close)
        return flight

    def show_programs(self):
        for flight in self.flights:
            print(flight.said()[-MOST_SHOWN:], flush=True)

    def setUp(self):
        self.flights = []
        for name in rospy.get_param_names():
            if name.count("/") == 1 or "fail_after" in name:
                rospy.delete_param(name)  # what a process that was killed left behind

    def set_param(self, name, value):
        rospy.set_param(name, value)
        self.addCleanup(rospy.delete_param, name)

    def assert_at_rest_with_results(self, flight, stop_reason, is_gate_silent=True):
        result = flight.result()
        self.assert_never(result["collisions"], "a collision")
        self.assertEqual(result["stop_reason"], stop_reason)
        self.assertEqual(result["counters"]["gate_violations"] == 0, is_gate_silent)
        self.assertGreater(result["distance_m"], 1.0, "it never flew")
        tick = flight.last_tick()
        self.assert_never(float(tick["clearance_m"]) <= VEHICLE_RADIUS_M, "no room to rest")
        self.assertLess(float(tick["speed_mps"]), 0.05)
        self.assertGreater((flight.folder / "map.ot").stat().st_size, 1000)

    def assert_reported(self, flight, name, level, words):
        worst = flight.diagnostics.get(name)
        self.assertIsNotNone(worst, f"{name} never spoke; {sorted(flight.diagnostics)} did")
        self.assertGreaterEqual(worst[0], level, worst[1])
        self.assertIn(words, worst[1])

    def test_an_explorer_that_throws_ends_at_rest(self):
        self.set_param("/explorer/fail_after_calls", 120)
        flight = self.fly()

        self.assertEqual(flight.wait_end(), 1)

        self.assert_at_rest_with_results(flight, "stage_failed")
        self.assert_reported(flight, "/explorer", DiagnosticStatus.ERROR, "made to fail")

    def test_a_mapper_that_throws_ends_at_rest(self):
        self.set_param("/mapper/fail_after_calls", 250)  # clouds and camera infos
        flight = self.fly()

        self.assertEqual(flight.wait_end(), 1)

        self.assert_at_rest_with_results(flight, "sensor_lost")
        self.assert_reported(flight, "/mapper", DiagnosticStatus.ERROR, "made to fail")

    def test_a_camera_that_freezes_ends_at_rest(self):
        flight = self.fly()
        flight.wait_airborne()

        rospy.wait_for_service("/onboard/unload_nodelet", 5.0)
        rospy.ServiceProxy("/onboard/unload_nodelet", NodeletUnload)("/sim_camera")

        self.assertEqual(flight.wait_end(), 1)
        self.assert_at_rest_with_results(flight, "sensor_lost")
        self.assert_reported(flight, "/monitor", DiagnosticStatus.ERROR, "silent: camera, map")

    def test_transforms_that_grow_stale_end_at_rest(self):
        flight = self.fly("--onboard-overrides", "frames: {publish_extrinsics: false}")
        mount = TransformStamped()
        mount.header.frame_id, mount.child_frame_id = "base_link", "camera_optical"
        rotation = mount.transform.rotation
        rotation.x, rotation.y, rotation.z, rotation.w = -0.5, 0.5, -0.5, 0.5
        publisher = rospy.Publisher("/tf", TFMessage, queue_size=10)
        is_flying = False
        until = time.monotonic() + 40.0
        while not is_flying and time.monotonic() < until:
            # Ahead of time, so that every exposure finds one before and one after it.
            mount.header.stamp = rospy.Time.now() + rospy.Duration(0.2)
            publisher.publish(TFMessage([mount]))
            time.sleep(0.02)
            status = flight.status
            is_flying = status is not None and (
                (status.header.stamp - status.started_at).to_sec() > AIRBORNE_S
            )
        self.assertTrue(is_flying, "it did not fly with transforms of ours")

        self.assertEqual(flight.wait_end(), 1)

        self.assert_at_rest_with_results(flight, "sensor_lost")
        self.assertGreater(flight.values["/mapper"]["frames_without_pose"], 10)
        self.assert_reported(flight, "/mapper", DiagnosticStatus.WARN, "extrapolation")

    def test_without_transforms_nothing_flies(self):
        flight = self.fly("--onboard-overrides", "frames: {publish_extrinsics: false}")

        skipped = wait_until(
            "frames are skipped",
            lambda: flight.values.get("/mapper", {}).get("frames_without_pose", 0) > 20,
            30.0,
        )

        self.assertTrue(skipped)
        self.assertIsNone(flight.status, "a mission began without a single known pose")
        self.assertEqual(flight.values["/mapper"].get("updates", 0), 0)

        flight.process.send_signal(signal.SIGINT)
        self.assertEqual(flight.wait_end(10.0), 1, "nothing flies that must come to rest first")

    def test_a_result_folder_that_vanishes_is_said_and_ends_the_flight(self):
        flight = self.fly()
        flight.wait_airborne()
        shutil.rmtree(flight.folder)

        flight.process.send_signal(signal.SIGINT)

        self.assertEqual(flight.wait_end(), 1)
        self.assertIn("results are lost", flight.said())

    def test_without_a_recorder_the_mission_itself_ends_the_flight(self):
        flight = self.fly("--without", "recorder")
        flight.wait_airborne()

        flight.process.send_signal(signal.SIGINT)

        self.assertEqual(flight.wait_end(15.0), 1)
        self.assertEqual(flight.status.stop_reason, MissionStatus.INTERRUPTED)

    def test_a_bag_of_bad_images_is_counted_and_survived(self):
        flight = self.fly("--without", "sim_camera", "--overrides", "mission: {auto_start: false}")
        wait_until("the camera's reader is there", lambda: "/depth_cloud" in flight.values, 30.0)
        bag = flight.folder / "bad.bag"
        write_bad_bag(bag)

        subprocess.run(["rosbag", "play", "--quiet", str(bag)], check=True, timeout=60)

        counts = wait_until(
            "the bad images are counted",
            lambda: flight.values["/depth_cloud"].get("bad_images", 0) >= 4
            and flight.values["/depth_cloud"],
            10.0,
        )
        self.assertGreaterEqual(counts["clouds"], 2)  # all NaN is an image, if one that says nothing
        wait_until("a map in spite of it", lambda: flight.statuses > 0, 10.0)
        self.assertEqual(counts["failures"], 0)
        self.assert_reported(flight, "/depth_cloud", DiagnosticStatus.WARN, "skipped: ")
        self.assertIsNone(flight.process.poll())

    def test_a_killed_master_does_not_stop_the_flight(self):
        port = "11399"
        uri = f"http://localhost:{port}"
        master = subprocess.Popen(["rosmaster", "--core", "-p", port], start_new_session=True)
        self.addCleanup(master.kill)
        time.sleep(2.0)
        flight = self.fly(uri=uri)
        ticks = flight.folder / "ticks.csv"
        wait_until("ticks are written", lambda: ticks.exists() and ticks.stat().st_size > 20000, 30)

        master.kill()
        master.wait()
        size = ticks.stat().st_size
        wait_until("it flies on", lambda: ticks.stat().st_size > size + 10000, 15.0)
        flight.process.send_signal(signal.SIGINT)

        self.assertEqual(flight.wait_end(), 1)
        self.assert_at_rest_with_results(flight, "interrupted")

    def test_an_interrupt_in_mid_flight_ends_at_rest(self):
        flight = self.fly()
        flight.wait_airborne()

        flight.process.send_signal(signal.SIGINT)

        self.assertEqual(flight.wait_end(), 1)
        self.assert_at_rest_with_results(flight, "interrupted")

    def test_an_interrupt_of_understory_fly_reaches_the_vehicle(self):
        folder = Path(tempfile.mkdtemp(prefix="understory_robustness_"))
        self.addCleanup(shutil.rmtree, folder, True)
        program = shutil.which("rosrun")
        self.assertIsNotNone(program)
        onboard = subprocess.run(
            ["catkin_find", "--first-only", "understory_nodelets", "onboard"],
            check=True, stdout=subprocess.PIPE, encoding="utf-8",
        ).stdout.strip()
        process = subprocess.Popen(
            [sys.executable, str(FLY), "--onboard", onboard, "--scenario", "clearing", "--quiet"]
            + ["--bus", "memory", "--no-report", "--out", str(folder)],
            start_new_session=True,
        )
        self.addCleanup(process.kill)
        ticks = folder / "ticks.csv"
        wait_until("ticks are written", lambda: ticks.exists() and ticks.stat().st_size > 20000, 40)

        os.killpg(process.pid, signal.SIGINT)

        self.assertEqual(process.wait(45), 1)
        result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
        self.assert_never(result["collisions"], "a collision")
        self.assertEqual(result["stop_reason"], "interrupted")

    def test_a_trajectory_that_jumps_is_held_by_the_gate(self):
        flight = self.fly()
        flight.wait_airborne()
        publisher = rospy.Publisher("/trajectory", Trajectory, queue_size=1)
        wait_until("the bridge listens", lambda: publisher.get_num_connections() > 0, 10.0)

        jump = Trajectory(id=1 << 40, position_knot_s=0.1, yaw_knot_s=0.1)
        jump.header.stamp = rospy.Time.now()
        jump.position_control_points = [Point(4.5, 4.5, 1.0)] * 4  # metres away, inside the box
        jump.yaw_control_points = [0.0] * 4
        publisher.publish(jump)

        self.assertEqual(flight.wait_end(), 1)
        self.assert_at_rest_with_results(flight, "stage_failed", is_gate_silent=False)
        self.assert_reported(flight, "/bridge", DiagnosticStatus.ERROR, "the gate refused")

    def test_a_wrong_configuration_starts_nothing(self):
        flight = self.fly("--overrides", "camera: {width_pixels: 640}")

        self.assertEqual(flight.wait_end(), 2)

        self.assertFalse((flight.folder / "result.json").exists())


def write_bad_bag(path):
    """Frames with NaN depths, too few bytes, an unknown encoding, and one that is good."""
    width, height = 160, 120
    info = CameraInfo(width=width, height=height)
    info.K = [96.8, 0, 79.5, 0, 96.8, 59.5, 0, 0, 1]
    info.P = [96.8, 0, 79.5, 0, 0, 96.8, 59.5, 0, 0, 0, 1, 0]
    nan, metres = b"\x00\x00\xc0\x7f", b"\x00\x00\x40\x40"  # float32 NaN and 3.0
    pixels = width * height
    kinds = [
        ("32FC1", nan * pixels),
        ("32FC1", metres * (pixels // 2)),
        ("rgb8", b"\x10" * 3 * pixels),
        ("32FC1", metres * pixels),
    ]
    begin = rospy.Time.now()
    with rosbag.Bag(str(path), "w") as bag:
        for i in range(12):
            stamp = begin + rospy.Duration(0.1 * i)
            encoding, data = kinds[i % len(kinds)]
            image = Image(width=width, height=height, encoding=encoding, data=data)
            image.step = width * (3 if encoding == "rgb8" else 4)
            for message in (info, image):
                message.header.stamp = stamp
                message.header.frame_id = "camera_optical"
            bag.write("/camera/depth/camera_info", info, stamp)
            bag.write("/camera/depth/image_rect", image, stamp)


if __name__ == "__main__":
    rospy.init_node("see_robustness", disable_signals=True)
    rostest.rosrun("understory_ros_test", "robustness", Robustness)
