#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The services of an onboard process: each answers and acts. Every test flies its own."""

import pathlib
import sys
import tempfile
import time

import rospy
import rostest
from std_srvs.srv import Trigger
from understory_msgs.msg import FlightStatus, MissionStatus
from understory_msgs.srv import SaveMap

from watching import PATIENCE_S, FlightTest, Onboard, Topic, position_m, speed_mps

STILL_MPS = 0.05
REST_PATIENCE_S = 4.0
WATCHED_S = 2.0


class CallServices(FlightTest):
    def setUp(self):
        self.onboard = Onboard(self.id().rsplit(".", 1)[-1])
        self.addCleanup(lambda: print(self.onboard.end(), file=sys.stderr))

    def ask_for(self, service):
        answer = self.onboard.call(service, Trigger)
        self.assertTrue(answer.success, f"{service}: {answer.message}")
        return answer

    def ask_for_rest(self, service):
        """It comes to rest soon after."""
        self.onboard.odometry.forget()  # before it took off it was at rest too
        self.ask_for(service)
        self.onboard.odometry.wait_for(
            lambda all: len(all) > 1 and speed_mps(all[-1]) < STILL_MPS, REST_PATIENCE_S
        )

    def expect_to_stay(self):
        self.onboard.odometry.forget()
        seen = self.onboard.odometry.wait_for(
            lambda all: all
            if all and (all[-1].header.stamp - all[0].header.stamp).to_sec() > WATCHED_S
            else None
        )
        self.assertLess(max(speed_mps(one) for one in seen), 2.0 * STILL_MPS)

    def test_pause_brings_to_rest_and_start_goes_on(self):
        self.onboard.wait_until_it_flies()

        self.ask_for_rest("pause")
        self.onboard.wait_for_state(MissionStatus.PAUSED)
        self.expect_to_stay()
        self.onboard.odometry.forget()
        self.ask_for("start")

        self.onboard.wait_until_it_flies()
        self.onboard.wait_for_state(MissionStatus.TAKE_OFF, MissionStatus.EXPLORE)
        self.assertFalse(self.onboard.call("start", Trigger).success, "it flies already")

    def test_stop_ends_the_mission_at_rest(self):
        self.onboard.wait_until_it_flies()

        self.ask_for_rest("stop")

        status = self.onboard.wait_for_state(MissionStatus.STOPPED)
        self.assertEqual(status.stop_reason, MissionStatus.INTERRUPTED)
        self.assertEqual(self.onboard.process.wait(PATIENCE_S), 1)  # not completed

    def test_return_home_flies_back_and_lands(self):
        home_m = position_m(self.onboard.odometry.wait_for_one(lambda one: True))
        self.onboard.wait_for_state(MissionStatus.EXPLORE)
        self.onboard.odometry.wait_for_one(
            lambda one: abs(position_m(one) - home_m)[:2].max() > 0.7
        )

        self.ask_for("return_home")

        self.onboard.wait_for_state(MissionStatus.RETURN_HOME)
        status = self.onboard.wait_for_state(MissionStatus.LAND, patience_s=60.0)
        self.assertEqual(status.stop_reason, MissionStatus.RETURN_REQUESTED)
        last_m = position_m(self.onboard.odometry.wait_for_one(lambda one: True))
        self.assertLess(abs(last_m - home_m)[:2].max(), 0.5)

    def test_land_sets_down_where_it_is(self):
        flight = Topic(f"{self.onboard.namespace}/flight_status", FlightStatus)
        self.onboard.wait_for_state(MissionStatus.EXPLORE)
        self.onboard.wait_until_it_flies()

        self.ask_for("land")

        status = self.onboard.wait_for_state(MissionStatus.LAND)
        self.assertEqual(status.stop_reason, MissionStatus.LAND_REQUESTED)
        flight.wait_for_one(lambda one: one.down)
        self.assertFalse(self.onboard.call("pause", Trigger).success, "it is over")

    def test_save_map_writes_a_file_or_says_why_not(self):
        self.onboard.wait_for_state(MissionStatus.EXPLORE)
        with tempfile.TemporaryDirectory() as name:
            path = pathlib.Path(name) / "map.ot"
            answer = self.onboard.call("save_map", SaveMap, str(path))

            self.assertTrue(answer.success, answer.message)
            self.assertEqual(path.read_bytes().split(b"\n")[0], b"# Octomap OcTree file")
            self.assertGreater(path.stat().st_size, 1000)

            nowhere = str(path.parent / "not" / "there" / "map.ot")
            answer = self.onboard.call("save_map", SaveMap, nowhere)

            self.assertFalse(answer.success)
            self.assertIn(nowhere, answer.message)
            self.assertGreater(len(answer.message), len(nowhere))
        self.onboard.status.forget()
        self.onboard.wait_for_state(MissionStatus.EXPLORE)

    def test_services_without_a_map_answer_too(self):
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:  # the services are there before the first map
            answer = self.onboard.call("return_home", Trigger)
            if answer.success:
                break
            self.assertIn(answer.message, ("no map yet", "waiting"))  # for the first map, for arming
        self.assertTrue(answer.success)


if __name__ == "__main__":
    rospy.init_node("call_services")
    rostest.rosrun("understory_ros_test", "services", CallServices)
