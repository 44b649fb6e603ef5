# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""What is wrong from the beginning: one clear line each, and nothing is armed."""

import time
import unittest
from typing import Any

from bench import HOST_BUS, PROTOCOL_HASH, FlightTest, Program, program
from wire_bench import WireTest
from can_tools import must_run

HIL_OPTIONS = ["--interfaces", "2"]
WATCHED_S = 2.0
VEHICLE, HOST = "understory_vehicle", "understory_host"


class AProgram(FlightTest):
    def check_refused(self, name: str, line: str, *words: Any) -> None:
        refused = self.run_program(program(name), *words)
        self.assertIn(refused.wait(10.0), (1, 2))
        self.assertEqual(len(refused.lines), 1, refused.lines)
        self.assertRegex(refused.lines[0], line)
        self.assertTrue(refused.lines[0].startswith(f"{name}: "), refused.lines)

    def test_says_which_interface_is_missing_and_which_there_are(self) -> None:
        for name in (VEHICLE, HOST):
            self.check_refused(name, "'vcan9'.* not exist.*vcan0, vcan1", "--interface", "vcan9")

    def test_says_that_an_interface_is_none_of_can(self) -> None:
        for name in (VEHICLE, HOST):
            self.check_refused(name, "'lo'.* not a CAN interface", "--interface", "lo")

    def test_refuses_options_it_does_not_know(self) -> None:
        for name in (VEHICLE, HOST):
            refused = self.run_program(program(name), "--no-such-option")
            self.assertEqual(refused.wait(10.0), 2)

    def test_waits_for_an_interface_that_is_down(self) -> None:
        must_run("ip", "link", "set", HOST_BUS, "down")
        self.addCleanup(must_run, "ip", "link", "set", HOST_BUS, "up")
        self.start_vehicle()
        host = self.start_host("--duration", 60)
        host.wait_for_line("FAULT .*the bus is down")

        began_s = time.time()
        must_run("ip", "link", "set", HOST_BUS, "up")

        self.bus.wait_for_state("ARMED", since_s=began_s)


class AnotherProtocol(WireTest):
    def check(self, line_of_host: str, reason: str, **faults: Any) -> None:
        self.wire.become(**faults)
        vehicle = self.start_vehicle()
        host = self.start_host("--duration", 60)
        if line_of_host:
            host.wait_for_line(line_of_host)
        if reason:
            vehicle.wait_for_line(reason)
        time.sleep(0.5 * WATCHED_S)
        self.assert_never_armed()

    def test_of_the_vehicle_is_said_and_not_armed(self) -> None:
        other = {"VEH_HB": {"VehDbcHash": PROTOCOL_HASH ^ 1}}
        self.check("FAULT .*another version of the protocol", "", **{"set": other})

    def test_of_the_host_is_said_and_not_armed(self) -> None:
        other = {"HOST_HB": {"HostDbcHash": PROTOCOL_HASH ^ 1}}
        self.check("", "ARMING ARM_DBC_HASH", **{"set": other})

    def test_version_of_the_host_is_said_and_not_armed(self) -> None:
        self.check("", "ARMING ARM_VERSION", **{"set": {"HOST_HB": {"HostProtoMajor": 9}}})


class TwoOnOneBus(FlightTest):
    def assert_none_armed(self, *vehicles: Program) -> None:
        time.sleep(WATCHED_S)
        for vehicle in vehicles:
            self.assert_never(" ARMED " in " ".join(vehicle.lines), "armed all the same")

    def test_hosts_are_said_and_nothing_is_armed(self) -> None:
        hosts = [self.start_host("--duration", 60) for _ in range(2)]
        for host in hosts:
            host.wait_for_line("WAITING|FAULT")
        vehicle = self.start_vehicle()

        for host in hosts:
            host.wait_for_line("FAULT .*another host sends on this bus")
        self.assert_none_armed(vehicle)

    def test_hosts_end_a_flight(self) -> None:
        vehicle, host = self.fly()

        self.start_host("--duration", 60)

        host.wait_for_line("FAULT .*another host sends on this bus")
        vehicle.wait_for_line("LAND")
        vehicle.wait_for_line("DISARMED (LANDED|.*SILENCE|HOST_REQUEST)", 15.0)

    def test_vehicles_are_said_and_nothing_is_armed(self) -> None:
        vehicles = [self.start_vehicle() for _ in range(2)]

        host = self.start_host("--duration", 60)

        host.wait_for_line("FAULT .*two vehicles send on this bus")
        for vehicle in vehicles:
            vehicle.wait_for_line("FAULT ARM_FOREIGN_VEHICLE")
        self.assert_none_armed(*vehicles)

    def test_vehicles_end_a_flight(self) -> None:
        vehicle, _ = self.fly()

        self.start_vehicle()

        vehicle.wait_for_line("LAND FOREIGN_VEHICLE")


if __name__ == "__main__":
    unittest.main()
