# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""`understory hil` seen from outside: what passes through and what stays behind."""

import json
import os
import pty
import random
import select
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [str(ROOT / "understory"), "hil"]
PATIENCE_S = 120
ALL_BYTES = bytes(range(256))
LOTS = 10 << 20
MAX_CLOCK_ERROR_S = 1.0

TRAP = """
trap 'sleep 0.2; echo written >"$FOLDER/file"; exit 7' INT TERM
echo up
while :; do sleep 0.05; done
"""
COUNT = """
count=0
trap 'count=$((count + 1))' INT
echo up
for ((n = 0; n < 20; n++)); do sleep 0.1; done
echo got $count
exit 7
"""
STUBBORN = "trap '' INT TERM; echo up; while :; do sleep 0.05; done"
ABOUT = """
import json, os, sys, time
open("made_inside", "w").write("text")
print(json.dumps({"folder": os.getcwd(), "path": os.environ["PATH"], "extra": os.environ["EXTRA"],
    "ros": os.environ["ROS_MASTER_URI"], "can": os.environ["UNDERSTORY_CAN"],
    "terminals": [os.isatty(n) for n in (0, 1, 2)], "real": time.time(),
    "open": sorted(int(n) for n in os.listdir("/proc/self/fd"))[:-1]}))
"""


class FromHost(unittest.TestCase):
    """Each test has a folder for temporary files of its own, which must be empty afterwards."""

    def setUp(self):
        self._folder = tempfile.TemporaryDirectory(prefix="hil_test_")
        self.addCleanup(self._folder.cleanup)
        self.temporary = Path(self._folder.name) / "tmp"
        self.temporary.mkdir()
        self.folder = Path(self._folder.name)
        self.environment = {**os.environ, "TMPDIR": str(self.temporary), "FOLDER": str(self.folder)}

    def tearDown(self):
        self.assertEqual(os.listdir(self.temporary), [])
        self.assertEqual(self.processes(), [])

    def processes(self):
        """Of the kernels that this test booted."""
        found = []
        for path in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                words = path.read_bytes()
            except OSError:
                continue
            if f"{self.temporary}/understory-hil-".encode() in words:
                found.append(words)
        return found

    def run_hil(self, *words, **options):
        options.setdefault("env", self.environment)
        return subprocess.run(
            [*COMMAND, *words], capture_output=True, timeout=PATIENCE_S, check=False, **options
        )

    def start(self, *words):
        """Started and its command already at work: the first line it printed was read."""
        process = subprocess.Popen(
            [*COMMAND, *words],
            env=self.environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self.addCleanup(process.wait)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.kill)
        self.assertTrue(select.select([process.stdout], [], [], PATIENCE_S)[0])
        self.assertEqual(process.stdout.readline(), b"up\n")
        return process

    def wait_for_nothing_left(self):
        deadline = time.monotonic() + 20.0
        while (self.processes() or os.listdir(self.temporary)) and time.monotonic() < deadline:
            time.sleep(0.1)


class TheCommand(FromHost):
    def test_gives_its_exit_status(self):
        for script, status in (("exit 3", 3), ("kill -TERM $$", 128 + signal.SIGTERM)):
            with self.subTest(script=script):
                self.assertEqual(self.run_hil("--", "sh", "-c", script).returncode, status)

    def test_that_cannot_be_started_gives_the_status_a_shell_would(self):
        for command, status in (("/etc/passwd", 126), ("/no/such/thing", 127)):
            outcome = self.run_hil("--", command)
            with self.subTest(command=command):
                self.assertEqual(outcome.returncode, status)
                self.assertIn(command.encode(), outcome.stderr)

    def test_writes_every_byte_to_the_right_output(self):
        (self.folder / "bytes").write_bytes(ALL_BYTES)
        data = random.Random(1).randbytes(LOTS)
        (self.folder / "lots").write_bytes(data)

        outcome = self.run_hil(
            "--", "sh", "-c", 'cd "$FOLDER"; cat bytes lots & cat bytes bytes >&2; wait'
        )

        self.assertEqual(outcome.returncode, 0)
        self.assertEqual(outcome.stderr, ALL_BYTES + ALL_BYTES)
        self.assertTrue(outcome.stdout == ALL_BYTES + data)

    def test_reads_every_byte_of_the_input_and_its_end(self):
        data = ALL_BYTES + random.Random(2).randbytes(LOTS // 8)

        outcome = self.run_hil("--", "cat", input=data)

        self.assertTrue(outcome.stdout == data)

    def test_need_not_read_its_input(self):
        outcome = self.run_hil("--", "echo", "done", input=bytes(LOTS))

        self.assertEqual(outcome.stdout, b"done\n")

    def test_notices_that_nobody_reads_its_output(self):
        outcome = subprocess.run(
            f"'{COMMAND[0]}' hil -- yes | head -n 1",
            shell=True,
            env=self.environment,
            capture_output=True,
            timeout=PATIENCE_S,
            check=False,
        )

        self.assertEqual(outcome.stdout, b"y\n")

    def test_runs_in_the_same_folder_and_environment_at_the_same_time(self):
        self.environment |= {"EXTRA": "a b\n\"'é", "ROS_MASTER_URI": "http://localhost:11999"}
        before = time.time()

        outcome = self.run_hil("--", "/usr/bin/python3", "-c", ABOUT, cwd=self.folder)

        found = json.loads(outcome.stdout)
        self.assertEqual(found["folder"], str(self.folder))
        self.assertEqual(found["path"], self.environment["PATH"])
        self.assertEqual(found["extra"], self.environment["EXTRA"])
        self.assertEqual(found["ros"], "http://localhost:11999")
        self.assertEqual(found["can"], "vcan0")
        self.assertEqual(found["terminals"], [False] * 3)
        self.assertEqual(found["open"], [0, 1, 2])
        self.assertGreater(found["real"], before - MAX_CLOCK_ERROR_S)
        self.assertLess(found["real"], time.time() + MAX_CLOCK_ERROR_S)
        self.assertEqual((self.folder / "made_inside").read_text(encoding="ascii"), "text")
        self.assertEqual((self.folder / "made_inside").stat().st_uid, os.geteuid())

    @unittest.skipUnless(os.geteuid() == 0, "all tests run without root already")
    def test_needs_no_root(self):
        os.chmod(self.folder, 0o755)
        os.chown(self.temporary, 65534, 65534)

        nobody = {"user": 65534, "group": 65534, "extra_groups": []}
        outcome = self.run_hil("--", "ip", "-brief", "link", **nobody)

        self.assertIn(b"vcan0", outcome.stdout)


class Signals(FromHost):
    def test_reach_the_command_which_may_end_cleanly(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            process = self.start("--", "bash", "-c", TRAP)

            process.send_signal(number)

            with self.subTest(number=number):
                self.assertEqual(process.wait(PATIENCE_S), 7)
                self.assertEqual((self.folder / "file").read_text(encoding="ascii"), "written\n")
            (self.folder / "file").unlink()

    def test_that_come_twice_at_once_are_one(self):
        process = self.start("--", "bash", "-c", TRAP)

        process.send_signal(signal.SIGTERM)
        time.sleep(0.05)
        process.send_signal(signal.SIGTERM)

        self.assertEqual(process.wait(PATIENCE_S), 7)

    def test_kill_a_command_that_ignores_them_at_the_second_time(self):
        process = self.start("--", "bash", "-c", STUBBORN)

        process.send_signal(signal.SIGINT)
        time.sleep(1.0)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGINT)

        self.assertEqual(process.wait(20.0), 128 + signal.SIGKILL)

    def test_that_kill_the_provider_itself_leave_nothing_behind(self):
        process = self.start("--", "bash", "-c", STUBBORN)

        process.kill()
        process.wait()

        self.wait_for_nothing_left()


class TwoAtOnce(FromHost):
    def test_have_a_bus_each(self):
        script = (
            "candump -L -n 1 vcan0 & sleep 1; echo up; sleep 3; cansend vcan0 $0#; wait; exit 0"
        )
        both = [self.start("--", "sh", "-c", script, number) for number in ("111", "222")]

        outputs = [process.communicate(timeout=PATIENCE_S)[0] for process in both]

        self.assertIn(b" 111#", outputs[0])
        self.assertIn(b" 222#", outputs[1])


class TheSlowProvider(FromHost):
    """QEMU without KVM: half a minute for each boot, so few of them."""

    def test_has_a_bus_and_passes_everything_through(self):
        data = ALL_BYTES + random.Random(3).randbytes(LOTS // 64)
        script = (
            'ip -details link show vcan0 >"$FOLDER/link";'
            'candump -L -n 1 vcan0 >"$FOLDER/log" & sleep 2; cansend vcan0 111#AABB; wait; cat; exit 3'
        )

        outcome = self.run_hil("--provider", "qemu", "--", "sh", "-c", script, input=data)

        self.assertEqual((outcome.returncode, outcome.stderr), (3, b""))
        self.assertTrue(outcome.stdout == data)
        self.assertIn("vcan numtxqueues", (self.folder / "link").read_text(encoding="ascii"))
        self.assertIn(" vcan0 111#AABB", (self.folder / "log").read_text(encoding="ascii"))

    def test_ends_cleanly_when_it_is_interrupted(self):
        process = self.start("--provider", "qemu", "--", "bash", "-c", TRAP)

        process.send_signal(signal.SIGINT)

        self.assertEqual(process.wait(PATIENCE_S), 7)
        self.assertEqual((self.folder / "file").read_text(encoding="ascii"), "written\n")


class OnATerminal(FromHost):
    def setUp(self):
        super().setUp()
        self.environment |= {"SHELL": "/bin/bash", "PS1": "$ ", "HOME": str(self.folder)}
        self.seen = b""

    def open(self, *words):
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.execve(COMMAND[0], [*COMMAND, *words], self.environment)

    def expect(self, text):
        deadline = time.monotonic() + PATIENCE_S
        while text not in self.seen:
            left_s = deadline - time.monotonic()
            if left_s < 0 or not select.select([self.terminal], [], [], left_s)[0]:
                self.fail(f"waited in vain for {text!r} after {self.seen!r}")
            self.seen += os.read(self.terminal, 4096)
        self.seen = self.seen.partition(text)[2]

    def type(self, text):
        os.write(self.terminal, text)

    def close(self):
        """The exit status, once it has ended."""
        while select.select([self.terminal], [], [], PATIENCE_S)[0]:
            try:
                self.seen += os.read(self.terminal, 4096)
            except OSError:
                break
        _, status = os.waitpid(self.pid, 0)
        os.close(self.terminal)
        return os.waitstatus_to_exitcode(status)

    def test_a_command_gets_ctrl_c_once(self):
        self.open("--", "bash", "-c", COUNT)
        self.expect(b"up\r\n")

        self.type(b"\x03")

        self.assertEqual(self.close(), 7)
        self.assertIn(b"got 1\r\n", self.seen)

    def test_a_shell_has_job_control_and_a_live_bus(self):
        self.open("--shell")
        self.expect(b"# ")
        self.type(b"ip -brief link show vcan0\n")
        self.expect(b"NOARP,UP")
        self.type(b"sleep 1000\n")
        time.sleep(0.5)
        self.type(b"\x03")
        self.expect(b"# ")
        self.type(b"sleep 1000\n")
        time.sleep(0.5)
        self.type(b"\x1a")
        self.expect(b"Stopped")
        self.type(b"exit 5\n")  # bash warns once of the stopped job
        self.type(b"exit 5\n")

        self.assertEqual(self.close(), 5)


class WrongUse(FromHost):
    def test_is_told_in_a_line(self):
        cases = [
            (("true",), "name a command after --"),
            (("--shell",), "--shell needs a terminal"),
            (("--interfaces", "0", "--", "true"), "--interfaces must be 1 to 16"),
        ]
        for words, reason in cases:
            outcome = self.run_hil(*words, stdin=subprocess.DEVNULL)
            with self.subTest(words=words):
                self.assertEqual(outcome.returncode, 2)
                self.assertIn(reason, outcome.stderr.decode())

    def test_of_an_interface_names_it(self):
        outcome = self.run_hil("--interface", "nosuch0", "--", "true")

        self.assertEqual(outcome.returncode, 125)
        self.assertEqual(
            outcome.stderr, b"understory hil: native: there is no interface nosuch0\n"
        )


if __name__ == "__main__":
    unittest.main()
