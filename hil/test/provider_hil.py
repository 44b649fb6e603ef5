# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The bus that the provider makes: it is a real one, as the standard tools see it."""

import os
import re
import signal
import socket
import subprocess
import time
import unittest
import xmlrpc.client

import can_tools
from can_tools import BUS, Candump, Frame, Port, frame_of, link, must_run, wait_until

HIL_OPTIONS = ["--interfaces", "2"]
OTHER = "vcan1"
POLYNOMIAL = 0x2F  # CRC8H2F
PAGE = can_tools.ROOT / "docs" / "can_protocol.md"


class TheBus(unittest.TestCase):
    def test_is_a_vcan_and_up(self):
        found = link(BUS)

        self.assertEqual(found["linkinfo"]["info_kind"], "vcan")
        self.assertIn("UP", found["flags"])

    def test_carries_what_cansend_sends_to_candump(self):
        candump = Candump("-L", "-n", "1", BUS)

        must_run("cansend", BUS, "123#DEADBEEF")

        self.assertEqual(candump.lines()[0].split()[1:], [BUS, "123#DEADBEEF"])

    def test_stamps_frames_in_the_kernel(self):
        with Port() as sender, Port() as receiver:
            before = time.time()
            sender.send(Frame(0x100, b"\x01"))
            time.sleep(0.2)  # a stamp of user space would be this late
            frame = receiver.receive()

        self.assertGreaterEqual(frame.stamp_s, before - 0.001)
        self.assertLess(frame.stamp_s, before + 0.15)

    def test_confirms_an_own_frame_once_it_is_sent(self):
        with Port(own_frames=True) as port:
            port.send(Frame(0x100, b"\x01\x02"))
            frame = port.receive()

        self.assertEqual(frame.data, b"\x01\x02")
        self.assertTrue(frame.is_own)

    def test_has_a_neighbour_that_hears_nothing_of_it(self):
        with Port() as sender, Port(OTHER) as neighbour:
            sender.send(Frame(0x100, b"\x01"))

            self.assertIsNone(neighbour.receive(0.2))


class TheChecksumOfTheKernel(unittest.TestCase):
    """can-gw computes AUTOSAR's CRC8 by itself: an oracle for the codec.

    By hand, for SP_COMMIT (0x104, data identifier 0x49):
      cangw -A -s vcan0 -d vcan1 -e -f 104:7FF -m OR:D:0.0.0000000000000000 \\
            -c 1:7:0:FF:FF:TABLE -p 1:49
    TABLE: 256 bytes in hexadecimal, the CRC of each byte for polynomial 0x2F. -c: over bytes 1 to
    7, into byte 0, initial and final XOR 0xFF; -p 1: then over one byte more. The kernel computes
    only for frames that it modifies, hence the OR with nothing.
    """

    def setUp(self):
        self.addCleanup(must_run, "cangw", "-F")

    @staticmethod
    def table():
        def entry(value):
            for _ in range(8):
                value = (value << 1) ^ (POLYNOMIAL if value & 0x80 else 0)
                value &= 0xFF
            return value

        return "".join(f"{entry(value):02X}" for value in range(256))

    @staticmethod
    def examples():
        """[(frame, data identifier)] of every message of the protocol."""
        found = re.findall(
            r"data identifier 0x([0-9A-F]{2})\.$[^`]*(?:^\|.*\n)+\nExample.*`(\w+#\w+)`",
            PAGE.read_text(encoding="utf-8"),
            re.MULTILINE,
        )
        return [(frame_of(text), int(data_id, 16)) for data_id, text in found]

    def add_rule(self, frame, data_id):
        words = f"-A -s {BUS} -d {OTHER} -e -f {frame.id:X}:7FF -m OR:D:0.0.0000000000000000"
        checksum = ["-c", f"1:7:0:FF:FF:{self.table()}", "-p", f"1:{data_id:02X}"]
        must_run("cangw", *words.split(), *checksum)

    def test_is_that_of_every_example_of_the_protocol(self):
        examples = self.examples()
        self.assertGreater(len(examples), 10)
        for frame, data_id in examples:
            self.add_rule(frame, data_id)
        with Port() as sender, Port(OTHER) as receiver:
            for frame, _ in examples:
                sender.send(Frame(frame.id, b"\0" + frame.data[1:]))
                with self.subTest(frame=str(frame)):
                    self.assertEqual(str(receiver.receive()), str(frame))

    def test_differs_for_another_data_identifier(self):
        frame, data_id = self.examples()[0]
        self.add_rule(frame, data_id ^ 1)
        with Port() as sender, Port(OTHER) as receiver:
            sender.send(frame)

            self.assertNotEqual(receiver.receive().data[0], frame.data[0])


class ASerialAdapter(unittest.TestCase):
    """slcan on a pseudo terminal: a true CAN device, with states and bus-off."""

    def setUp(self):
        if os.environ.get("UNDERSTORY_HIL_PROVIDER") == "native":
            self.skipTest("its device would appear in the host's network, not in this one")
        self.adapter = can_tools.SerialAdapter()
        self.addCleanup(self.adapter.close)

    def test_passes_frames_both_ways(self):
        with Port(self.adapter.name) as port:
            self.adapter.write(b"t1232BEEF\r")
            self.assertEqual(str(port.receive()), "123#BEEF")

            port.send(Frame(0x321, b"\xca\xfe"))
            self.adapter.wait_for(b"t3212CAFE\r")

    def test_tells_of_bus_off(self):
        bus_off_error = 0x20000000 | 0x40
        with Port(self.adapter.name, errors=True) as port:
            self.adapter.write(b"sb000255\r")

            self.assertEqual(port.receive().id & bus_off_error, bus_off_error)
        state = link(self.adapter.name)["linkinfo"]["info_data"]["state"]
        self.assertEqual(state, "BUS-OFF")


class TheMachine(unittest.TestCase):
    def test_starts_a_ros_master_that_answers(self):
        with socket.socket() as probe:
            probe.bind(("localhost", 0))
            port = probe.getsockname()[1]
        master = subprocess.Popen(
            ["rosmaster", "--core", "-p", str(port)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.addCleanup(master.wait, 10)
        self.addCleanup(master.send_signal, signal.SIGINT)
        proxy = xmlrpc.client.ServerProxy(f"http://localhost:{port}")

        def answers():
            try:
                return proxy.getPid("/test")[0] == 1
            except OSError:
                return False

        wait_until(answers, "the ROS master", 60.0)

    def test_resolves_its_own_name(self):
        self.assertTrue(socket.gethostbyname(socket.gethostname()).startswith("127."))

    def test_has_shared_memory_and_terminals(self):
        with open(f"/dev/shm/hil_{os.getpid()}", "w", encoding="ascii") as file:
            os.unlink(file.name)
        for end in os.openpty():
            os.close(end)

    def test_schedules_real_time_threads(self):
        before = os.sched_getscheduler(0)
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(10))
        self.addCleanup(os.sched_setscheduler, 0, before, os.sched_param(0))

        self.assertEqual(os.sched_getscheduler(0), os.SCHED_FIFO)


if __name__ == "__main__":
    unittest.main()
