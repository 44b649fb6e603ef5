# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""For tests that look at the onboard host from another process: waiting, always with a deadline."""

import collections
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

import numpy
import roslib.packages
import rospy
from nav_msgs.msg import Odometry
from understory_msgs.msg import MissionStatus

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from machine import PatientTest  # noqa: E402  pylint: disable=wrong-import-position

PATIENCE_S = 30.0
MOST_BYTES = 1 << 26  # of one message, so that large ones do not arrive in small pieces


class Topic:
    """Keeps the newest messages of a topic."""

    def __init__(self, name, kind, most=300):
        self.name = name
        self.messages = collections.deque(maxlen=most)
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(
            name, kind, self._on_message, buff_size=MOST_BYTES, tcp_nodelay=True
        )

    def _on_message(self, message):
        with self._changed:
            self.messages.append(message)
            self._changed.notify_all()

    def forget(self):
        with self._changed:
            self.messages.clear()

    def wait_for(self, find, patience_s=PATIENCE_S):
        """What `find` returns for the list of messages, once that is true; an error if never."""
        end = time.monotonic() + patience_s
        with self._changed:
            while True:
                found = find(list(self.messages))
                if found:
                    return found
                left_s = end - time.monotonic()
                if left_s <= 0:
                    raise AssertionError(
                        f"{self.name}: not seen within {patience_s:.0f} s; {len(self.messages)}"
                        f" messages, the last: {str(list(self.messages)[-1:])[:500]}"
                    )
                self._changed.wait(left_s)

    def wait_for_one(self, is_wanted, patience_s=PATIENCE_S):
        """The newest message of this kind."""
        return self.wait_for(
            lambda messages: next((one for one in reversed(messages) if is_wanted(one)), None),
            patience_s,
        )

    def wait_for_count(self, count, patience_s=PATIENCE_S):
        return self.wait_for(
            lambda messages: messages if len(messages) >= count else None, patience_s
        )


def speed_mps(odometry):
    twist = odometry.twist.twist.linear
    return float(numpy.linalg.norm((twist.x, twist.y, twist.z)))


def position_m(odometry):
    point = odometry.pose.pose.position
    return numpy.array((point.x, point.y, point.z))


class FlightTest(PatientTest):
    """Flies in real time, which a machine that stands still for 0.3 s ends."""

    failures = (Exception,)  # what waits for ROS raises is of many kinds


class Onboard:
    """An onboard process of its own in a namespace of its own, flying the scenario `clearing`."""

    def __init__(self, name):
        self.namespace = f"/{name}"
        program = roslib.packages.find_node("understory_nodelets", "onboard")
        self.log = tempfile.TemporaryFile("w+")  # pylint: disable=consider-using-with
        self.status = Topic(f"{self.namespace}/status", MissionStatus)
        self.odometry = Topic(f"{self.namespace}/odometry", Odometry, most=3000)
        self.process = subprocess.Popen(  # pylint: disable=consider-using-with
            [program[0], f"__ns:={self.namespace}", "--scenario", "clearing"],
            stdin=subprocess.DEVNULL,
            stdout=self.log,
            stderr=subprocess.STDOUT,
        )

    def wait_until_it_flies(self):
        self.odometry.wait_for_one(lambda odometry: speed_mps(odometry) > 0.3)

    def wait_for_state(self, *states, patience_s=PATIENCE_S):
        return self.status.wait_for_one(lambda status: status.state in states, patience_s)

    def call(self, service, kind, *arguments):
        name = f"{self.namespace}/{service}"
        rospy.wait_for_service(name, PATIENCE_S)
        return rospy.ServiceProxy(name, kind)(*arguments)

    def end(self):
        """Interrupts it twice, which ends it at once; returns what it said."""
        for number in (signal.SIGINT, signal.SIGINT, signal.SIGKILL):
            if self.process.poll() is None:
                self.process.send_signal(number)
                try:
                    self.process.wait(1.0 if number == signal.SIGINT else None)
                except subprocess.TimeoutExpired:
                    pass
        self.log.seek(0)
        said = self.log.read()
        self.log.close()
        return said
