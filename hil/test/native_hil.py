# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The provider that uses the kernel's own CAN, tried where there is a kernel with CAN."""

import os
import signal
import subprocess
import time
import unittest

from can_tools import BUS, ROOT, Port, run, wait_until

HIL = ["/usr/bin/python3", "-B", str(ROOT / "hil" / "provider" / "hil.py")]
NATIVE = [*HIL, "--provider", "native"]
TRAP = "trap 'exit 7' TERM; echo up; while :; do sleep 0.05; done"


class Native(unittest.TestCase):
    def test_is_what_auto_takes(self):
        outcome = run(*HIL, "--", "sh", "-c", "echo $UNDERSTORY_HIL_PROVIDER")

        self.assertEqual((outcome.stdout, outcome.stderr), ("native\n", ""))

    def test_has_a_bus_of_its_own(self):
        with Port() as outer:
            outcome = run(*NATIVE, "--", "sh", "-c", "ip -br link show vcan0; cansend vcan0 123#")

            self.assertIn("NOARP,UP", outcome.stdout)
            self.assertIsNone(outer.receive(0.2))

    def test_makes_as_many_interfaces_as_wanted(self):
        outcome = run(*NATIVE, "--interfaces", 3, "--", "ls", "/sys/class/net")

        self.assertEqual(outcome.stdout.split(), ["lo", "vcan0", "vcan1", "vcan2"])

    def test_uses_an_interface_that_is_there(self):
        with Port() as outer:
            script = "cansend $UNDERSTORY_CAN 123#"
            outcome = run(*HIL, "--interface", BUS, "--", "sh", "-c", script)

            self.assertEqual(outcome.returncode, 0, outcome.stderr)
            self.assertEqual(outer.receive().id, 0x123)

    def test_refuses_an_interface_that_is_no_bus(self):
        outcome = run(*HIL, "--interface", "lo", "--", "true")

        self.assertEqual(outcome.returncode, 125)
        self.assertEqual(outcome.stderr, "understory hil: native: lo is not a CAN interface\n")

    def test_gives_the_exit_status_of_the_command(self):
        cases = (["sh", "-c", "exit 3"], 3), (["sh", "-c", "kill -TERM $$"], 143)
        cases += (["/etc/passwd"], 126), (["/no/such/thing"], 127)
        for command, status in cases:
            with self.subTest(command=command):
                self.assertEqual(run(*NATIVE, "--", *command).returncode, status)

    def test_passes_a_signal_on(self):
        process = subprocess.Popen([*NATIVE, "--", "bash", "-c", TRAP], stdout=subprocess.PIPE)
        self.addCleanup(process.stdout.close)
        self.assertEqual(process.stdout.readline(), b"up\n")

        process.send_signal(signal.SIGTERM)

        self.assertEqual(process.wait(10), 7)

    def test_ends_what_the_command_left_running(self):
        script = "sleep 1000 </dev/null >/dev/null 2>&1 & echo $!"
        began = time.monotonic()

        pid = int(run(*NATIVE, "--", "sh", "-c", script).stdout)

        self.assertLess(time.monotonic() - began, 10)
        wait_until(lambda: not os.path.exists(f"/proc/{pid}"), "the end of it")

    @unittest.skipUnless(os.geteuid() == 0, "all tests run without root already")
    def test_needs_no_root(self):
        command = [*NATIVE, "--", "sh", "-c", "id -u; cansend vcan0 123#"]
        outcome = subprocess.run(
            command, user=65534, group=65534, capture_output=True, timeout=30, check=False
        )

        self.assertEqual((outcome.returncode, outcome.stdout), (0, b"0\n"), outcome.stderr)

    def test_says_when_its_kernel_cannot_behave_like_a_wire(self):
        outcome = run(*NATIVE, "--wire", "--", "true")

        self.assertEqual(outcome.returncode, 125)
        self.assertIn("its vcan was loaded without echo=1", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
