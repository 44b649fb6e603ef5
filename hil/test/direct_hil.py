# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Direct mode: the host commands the motors itself, and its silence stops them."""

import contextlib
import threading
import time
import unittest
from typing import Any, Tuple

from bench import PROTOCOL_HASH, VERSION, FlightTest, Listener, Said, arm_token, encode
from can_tools import Frame, Port

PERIOD_S = 0.0025
ZERO_S, DISARM_S = 0.1, 1.0
SESSION = 4711
IDLE = 800  # 20 %: the motors turn, and the launcher still holds it
BY_NUMBER = {"ARM_CMD": 0x20, "ESC_CMD": 0x30, "HOST_HB": 0x400}


def is_turning(said: Said) -> bool:
    return said["EscRpm0"] > 1000


class Sender:
    """Heartbeats, ARM_CMD and ESC_CMD from a thread, as a host in direct mode sends them."""

    def __init__(self, bus: Listener, token_error: int = 0) -> None:
        self._bus, self._token_error = bus, token_error
        self.throttle = 0
        self.is_arming = self.is_commanding = True
        self._is_ending = False
        self._port = Port()
        self._counter = 0
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._is_ending = True
        self._thread.join()
        self._port.socket.close()

    def _send(self, name: str, **raws: int) -> None:
        self._port.send(Frame(BY_NUMBER[name], encode(name, self._counter % 16, **raws)))

    def _run(self) -> None:
        due_s = time.monotonic()
        slow = 0
        while not self._is_ending:
            due_s = max(due_s + PERIOD_S, time.monotonic() - 0.02)
            time.sleep(max(0.0, due_s - time.monotonic()))
            if self.is_commanding:
                shares = {f"EscCmd{i}": self.throttle for i in range(4)}
                self._counter += 1
                self._send("ESC_CMD", EscCmdMode=1, **shares)
            slow += 1
            if slow % 40 == 0:
                self._send_slow(slow // 40)

    def _send_slow(self, number: int) -> None:
        """Every 100 ms, with a counter of its own."""
        fast, self._counter = self._counter, number
        major, minor = (int(word) for word in VERSION.split(".")[:2])
        self._send("HOST_HB", HostProtoMajor=major, HostProtoMinor=minor, HostDbcHash=PROTOCOL_HASH)
        states = self._bus.of("VEH_STATE")
        if self.is_arming and states:
            token = arm_token(states[-1]["StateNonce"], SESSION) ^ self._token_error
            self._send("ARM_CMD", ArmRequest=1, ArmToken=token, ArmSession=SESSION)
        self._counter = fast


class DirectMode(FlightTest):
    def sender(self, **words: Any) -> Sender:
        started = Sender(self.bus, **words)
        self.addCleanup(started.close)
        return started

    def arm(self) -> Tuple[Sender, float]:
        """The motors turn."""
        self.start_vehicle("--direct")
        sender = self.sender()
        armed = self.bus.wait_for_state("ARMED")
        self.assertEqual(armed["FlagDirect"], 1)
        self.spin_up(sender)
        return sender, armed.stamp_s

    def spin_up(self, sender: Sender) -> None:
        """Where the sender was late, that was a silence, after which motors start from zero only."""
        for _ in range(2):
            sender.throttle = IDLE
            with contextlib.suppress(AssertionError):
                self.bus.wait_for("ESC_RPM", is_turning, 2.0)
                return
            sender.throttle = 0
            time.sleep(2 * ZERO_S)
        sender.throttle = IDLE
        self.bus.wait_for("ESC_RPM", is_turning)

    def setUp(self) -> None:
        super().setUp()
        self.bus = self.listen(self.host_bus, ("VEH_STATE", "ESC_CMD", "ESC_RPM", "ODO_RATE"))

    def test_silence_stops_the_motors_and_then_disarms(self) -> None:
        sender, _ = self.arm()

        sender.is_commanding = False
        disarmed = self.bus.wait_for_state("DISARMED", since_s=time.time())

        last = self.bus.of("ESC_CMD")[-1]
        speeds = self.bus.of("ESC_RPM", last.stamp_s)
        # A motor that is off slows down from then on, and only from then on.
        slower = next(said for said in speeds if said["EscRpm0"] < 0.95 * speeds[0]["EscRpm0"])
        self.assert_after(ZERO_S, last.stamp_s, slower, "motors slower")
        self.assert_after(DISARM_S, last.stamp_s, disarmed, "DISARMED")
        self.assertEqual(disarmed["StateReason"], "ESC_CMD_SILENCE")

    def test_after_a_silence_the_motors_start_from_a_standstill_only(self) -> None:
        sender, _ = self.arm()

        sender.is_commanding = False
        time.sleep(0.3)
        sender.is_commanding = True  # with the throttle where it was
        time.sleep(0.4)
        still = self.bus.of("ESC_RPM")[-1]["EscRpm0"]
        sender.throttle = 0
        time.sleep(0.1)
        sender.throttle = IDLE

        self.assertLess(still, 500)
        self.bus.wait_for("ESC_RPM", is_turning, 2.0, time.time())

    def test_throttle_that_is_not_zero_arms_nothing(self) -> None:
        self.start_vehicle("--direct")
        sender = self.sender()
        sender.throttle = IDLE

        time.sleep(2.0)

        self.assert_never_armed()
        self.assertIn(("ARMING", "ARM_THROTTLE"), self.bus.states())

    def test_a_wrong_token_arms_nothing(self) -> None:
        self.start_vehicle("--direct")
        self.sender(token_error=1)

        time.sleep(2.0)

        self.assert_never_armed()
        self.assertIn(("ARMING", "ARM_TOKEN"), self.bus.states())


if __name__ == "__main__":
    unittest.main()
