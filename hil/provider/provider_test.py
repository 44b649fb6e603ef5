# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The bus provider without a bus: command line, choice, frames, relay, processes."""

import contextlib
import io
import os
import socket
import subprocess
import sys
import unittest
import unittest.mock
from pathlib import Path
from types import SimpleNamespace

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import frames  # noqa: E402
import hil  # noqa: E402
import processes  # noqa: E402
import registers  # noqa: E402
import uml  # noqa: E402
from endings import EndingSignals  # noqa: E402
from job import HilError, Job  # noqa: E402
from relay import Relay  # noqa: E402


class FramesTest(unittest.TestCase):
    def test_are_found_whatever_pieces_they_come_in(self):
        sent = [(frames.OUTPUT, b"a\n\0\xff"), (frames.INPUT, b""), (frames.ERRORS, bytes(1000))]
        stream = b"".join(frames.encode(kind, payload) for kind, payload in sent)
        for size in (1, 2, 7, len(stream)):
            decoder, found = frames.Decoder(), []
            for at in range(0, len(stream), size):
                found += decoder.feed(stream[at : at + size])

            self.assertEqual(found, sent)

    def test_carry_numbers_of_either_sign(self):
        for number in (0, 768, -1):
            [(_, payload)] = frames.Decoder().feed(frames.encode_number(frames.EXIT, number))

            self.assertEqual(frames.number_of(payload), number)


class CommandLineTest(unittest.TestCase):
    def refused(self, *words):
        errors = io.StringIO()
        with contextlib.redirect_stderr(errors), self.assertRaises(SystemExit) as caught:
            hil.parse(words)
        self.assertEqual(caught.exception.code, 2)
        [line] = errors.getvalue().splitlines()
        self.assertTrue(line.startswith("understory hil: "), line)
        return line

    def test_what_follows_the_first_two_dashes_is_the_command(self):
        _, job = hil.parse(["--interfaces", "2", "--", "git", "log", "--", "--wire"])

        self.assertEqual(job.command, ["git", "log", "--", "--wire"])
        self.assertEqual((job.interfaces, job.is_echo, job.bitrate), (2, False, None))

    def test_a_wire_echoes_too(self):
        _, job = hil.parse(["--wire", "--", "true"])

        self.assertEqual((job.is_echo, job.bitrate), (True, 1_000_000))

    def test_wrong_use_is_told_in_a_line(self):
        self.assertIn("name a command", self.refused())
        self.assertIn("name a command", self.refused("--"))
        self.assertIn("name a command", self.refused("candump", "vcan0"))
        self.assertIn("must follow", self.refused("candump", "--", "vcan0"))
        self.assertIn("--nonsense", self.refused("--nonsense", "--", "true"))
        self.assertIn("--interfaces", self.refused("--interfaces", "17", "--", "true"))
        self.assertIn("--memory", self.refused("--memory", "1", "--", "true"))
        self.assertIn("no command", self.refused("--shell", "--", "true"))

    def test_a_signal_becomes_the_exit_status_of_a_shell(self):
        for wait_status, code in ((0, 0), (3 << 8, 3), (15, 143), (9, 137)):
            self.assertEqual(hil.exit_status(wait_status), code)


class ChoiceTest(unittest.TestCase):
    def providers(self, **reasons):
        found = {
            name: SimpleNamespace(name=name, missing=lambda _, reason=reason: reason)
            for name, reason in reasons.items()
        }
        return unittest.mock.patch.object(hil, "PROVIDERS", found)

    def test_is_the_first_that_works(self):
        with self.providers(native="no vcan", uml=None, qemu=None):
            self.assertEqual(hil.choose("auto", Job(["true"])).name, "uml")

    def test_tells_what_each_one_lacks(self):
        with self.providers(native="no vcan", uml="no kernel"):
            with self.assertRaisesRegex(HilError, "native: no vcan; uml: no kernel"):
                hil.choose("auto", Job(["true"]))

    def test_of_an_existing_interface_is_the_host_itself(self):
        with self.providers(native="no can0", uml=None):
            with self.assertRaisesRegex(HilError, "^native: no can0$"):
                hil.choose("auto", Job(["true"], existing_interface="can0"))

    def test_the_list_says_whether_any_works(self):
        for reason, status in ((None, 0), ("no vcan", 125)):
            output = io.StringIO()
            with self.providers(native=reason), contextlib.redirect_stdout(output):
                self.assertEqual(hil.list_providers(Job([])), status)
            self.assertIn(reason or "works", output.getvalue())


class UmlTest(unittest.TestCase):
    def memory_folder(self, **states):
        """Where 1000 MiB go when folders have (free MiB, flags)."""

        def statvfs(folder):
            free_mib, flags = states[folder.replace("/", "_")]
            return SimpleNamespace(f_bavail=free_mib, f_frsize=1 << 20, f_flag=flags)

        with unittest.mock.patch.object(uml.os, "statvfs", statvfs):
            with unittest.mock.patch.object(uml.os, "access", lambda *_: True):
                with unittest.mock.patch.dict(os.environ, {"TMPDIR": "/own"}):
                    return uml.memory_folder(1000)

    def test_memory_goes_where_there_is_room_and_code_may_run(self):
        plenty, little, noexec = (4000, 0), (900, 0), (4000, os.ST_NOEXEC)

        self.assertEqual(self.memory_folder(_dev_shm=plenty), "/dev/shm")
        self.assertEqual(self.memory_folder(_dev_shm=noexec, _tmp=plenty), "/tmp")
        self.assertEqual(
            self.memory_folder(_dev_shm=little, _tmp=little, _var_tmp=little, _own=plenty), "/own"
        )
        self.assertIsNone(
            self.memory_folder(_dev_shm=noexec, _tmp=little, _var_tmp=little, _own=noexec)
        )

    def test_a_kernel_without_its_package_is_named(self):
        with unittest.mock.patch.object(uml, "KERNEL", Path("/no/linux.uml")):
            with unittest.mock.patch.dict(os.environ):
                os.environ.pop("UNDERSTORY_HIL_PROVIDER", None)
                self.assertIn("package user-mode-linux", uml.Uml().missing(Job(["true"])))

    def test_the_size_of_the_registers_is_known_or_tracing_forbidden(self):
        size = registers.traced_register_bytes()

        self.assertTrue(size is None or size == 0 or size >= 576, size)


class RelayTest(unittest.TestCase):
    """Against an agent that follows a script."""

    def relay(self, *sent, kernel_lives=True):
        ours, theirs = socket.socketpair()
        self.addCleanup(ours.close)
        self.addCleanup(theirs.close)
        theirs.sendall(b"".join(sent))
        relay = Relay(ours, Job(["true"]), lambda: kernel_lives)
        return relay.run("test")

    def test_ends_with_the_status_of_the_command(self):
        ready, end = frames.encode(frames.READY), frames.encode_number(frames.EXIT, 3 << 8)

        self.assertEqual(self.relay(ready, end), 3 << 8)

    def test_passes_on_why_there_is_no_bus(self):
        with self.assertRaisesRegex(HilError, "no module"):
            self.relay(frames.encode(frames.FAILED, b"no module"))

    def test_notices_that_the_kernel_died(self):
        with self.assertRaisesRegex(HilError, "ended before"):
            self.relay(frames.encode(frames.READY), kernel_lives=False)


class EndingSignalsTest(unittest.TestCase):
    def seconds(self, *sent):
        """Which of (time, signal) count as the second time."""
        times = iter([0.0])
        endings = EndingSignals(lambda: next(times))
        found = []
        for at_s, number in sent:
            times = iter([at_s] * 2)
            found.append(endings.is_second(number))
        return found

    def test_one_sent_twice_at_once_counts_once(self):
        self.assertEqual(self.seconds((5.0, 15), (5.01, 15), (5.02, 2)), [False] * 3)

    def test_a_later_one_is_the_second(self):
        self.assertEqual(self.seconds((5.0, 2), (6.0, 15)), [False, True])

    def test_others_do_not_count(self):
        self.assertEqual(self.seconds((5.0, 10), (6.0, 15), (7.0, 10)), [False] * 3)


class ProcessesTest(unittest.TestCase):
    def test_descendants_are_those_of_children_too(self):
        script = "sleep 100 & echo $!; wait"
        with subprocess.Popen(["sh", "-c", script], stdout=subprocess.PIPE) as process:
            grandchild = int(process.stdout.readline())

            found = processes.descendants()

            self.assertIn(process.pid, found)
            self.assertIn(grandchild, found)
            self.assertNotIn(os.getpid(), found)
            self.assertNotIn(os.getppid(), found)
            os.kill(grandchild, 9)

    def test_the_agent_refuses_to_run_beside_others(self):
        outcome = subprocess.run(
            [sys.executable, "-B", str(HERE / "agent.py"), "/dev/null"],
            capture_output=True,
            encoding="utf-8",
            timeout=60,
            check=False,
        )

        self.assertEqual(outcome.returncode, 1)
        self.assertIn("first process", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
