# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The `understory` command as its user meets it: help, wrong use, any working directory."""

import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMAND = ROOT / "understory"
SUBCOMMANDS = ["setup", "build", "simulate", "fly", "latency", "log", "bench", "hil"]
SUBCOMMANDS += ["test"]


def run(*arguments, command=COMMAND, cwd="/"):
    return subprocess.run(
        [str(command), *arguments],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=60,
        check=False,
    )


class HelpTest(unittest.TestCase):
    def test_help_names_every_subcommand(self):
        outcome = run("--help")

        self.assertEqual(outcome.returncode, 0)
        self.assertEqual(outcome.stderr, "")
        for name in SUBCOMMANDS:
            self.assertIn(f"\n  {name} ", outcome.stdout)

    def test_every_subcommand_explains_itself_and_does_nothing_else(self):
        for name in SUBCOMMANDS:
            with self.subTest(name):
                outcome = run(name, "--help")

                self.assertEqual(outcome.returncode, 0)
                self.assertEqual(outcome.stdout.split(" [")[0], f"usage: understory {name}")
                self.assertNotIn("Configuring", outcome.stdout)


class WrongUseTest(unittest.TestCase):
    def assert_refused(self, outcome, word):
        self.assertEqual(outcome.returncode, 2)
        self.assertEqual(outcome.stdout, "")
        self.assertEqual(len(outcome.stderr.splitlines()), 1, outcome.stderr)
        self.assertTrue(outcome.stderr.startswith("understory: "), outcome.stderr)
        self.assertIn(word, outcome.stderr)

    def test_unknown_subcommand_is_one_line_that_names_it(self):
        self.assert_refused(run("simulat"), "simulat")

    def test_unknown_option_is_one_line_that_names_it(self):
        for name in ["setup", "build", "test"]:
            with self.subTest(name):
                self.assert_refused(run(name, "--nonsense"), "--nonsense")

    def test_number_of_jobs_must_be_a_number(self):
        self.assert_refused(run("build", "--jobs", "many"), "--jobs")
        self.assert_refused(run("build", "--jobs"), "--jobs")

    def test_no_subcommand_shows_the_help_as_an_error(self):
        outcome = run()

        self.assertEqual(outcome.returncode, 2)
        self.assertEqual(outcome.stdout, "")
        self.assertIn("usage: understory COMMAND", outcome.stderr)


class PlaceTest(unittest.TestCase):
    def test_works_through_a_link_from_any_directory(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "a link"
            link.symlink_to(COMMAND)
            second = pathlib.Path(folder) / "second"
            second.symlink_to("a link")

            outcome = run("setup", "--dry-run", command=second, cwd=folder)

        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        self.assertEqual(outcome.stderr, "")


class MissingPackageTest(unittest.TestCase):
    """A copy of the command whose list names a package that no system has."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        (self.root / "config").mkdir()
        shutil.copy(COMMAND, self.root)
        self.list = self.root / "config" / "debian_packages.txt"

    def write_list(self, text):
        self.list.write_text(text, encoding="utf-8")

    def test_setup_says_what_it_would_install(self):
        self.write_list("# list\n[build]\nbash # there\nno-such-package-a\n[test]\nno-such-package-b\n")

        outcome = run("setup", "--dry-run", command=self.root / "understory")

        self.assertEqual(outcome.returncode, 0)
        self.assertEqual(
            outcome.stdout, "Would install with apt-get: no-such-package-a no-such-package-b\n"
        )

    def test_setup_does_nothing_when_all_is_there(self):
        self.write_list("[build]\nbash\n[test]\ncoreutils\n")

        outcome = run("setup", command=self.root / "understory")

        self.assertEqual(outcome.returncode, 0)
        self.assertEqual(outcome.stdout, "All 2 packages are installed: nothing to do.\n")

    def test_build_names_the_missing_package_and_suggests_setup(self):
        self.write_list("[build]\nno-such-package-a\n[test]\nno-such-package-b\n")

        outcome = run("build", command=self.root / "understory")

        self.assertEqual(outcome.returncode, 1)
        self.assertEqual(
            outcome.stderr,
            "understory: not installed: no-such-package-a"
            " (./understory setup installs what is missing)\n",
        )
        self.assertFalse((self.root / "build").exists())


class FileTest(unittest.TestCase):
    def test_continuous_integration_runs_the_test_command_of_the_readme(self):
        readme = (ROOT / "README.md").read_text(encoding="utf-8")
        script = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()

        commands = [line for line in script if line and not line.startswith("#")]
        self.assertIn("./understory test", readme)
        self.assertEqual(len(commands), 1)
        self.assertTrue(commands[0].endswith('/../understory" test'), commands[0])
        self.assertTrue(os.access(ROOT / ".ci" / "run", os.X_OK))

    def test_every_package_has_its_link_in_the_catkin_workspace(self):
        packages = {path.parent for path in ROOT.glob("*/package.xml")}
        packages |= {path.parent for path in ROOT.glob("src/*/package.xml")}
        packages |= {path.parent for path in ROOT.glob("test/*/package.xml")}

        links = {link: os.readlink(link) for link in (ROOT / "catkin_ws/src").iterdir()}
        links = {link: to for link, to in links.items() if link.name != "CMakeLists.txt"}

        self.assertGreater(len(packages), 0)
        self.assertEqual({link.resolve() for link in links}, packages)
        self.assertFalse([to for to in links.values() if os.path.isabs(to)])
        for link in links:
            name = f"<name>{link.name}</name>"
            self.assertIn(name, (link / "package.xml").read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
