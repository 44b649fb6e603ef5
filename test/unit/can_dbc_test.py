#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""A DBC that breaks a rule of the protocol's layout is refused with one line that says which."""

import sys
import tempfile
import unittest
from pathlib import Path

CAN = Path(__file__).parents[2] / "firmware_bridge" / "can"
sys.path.insert(0, str(CAN))

from dbc import LayoutError, read_messages  # noqa: E402  pylint: disable=wrong-import-position

DBC = CAN / "understory.dbc"


class ADbc(unittest.TestCase):
    def refusal(self, old: str, new: str) -> str:
        """What is said of the DBC in which `old` is `new`."""
        text = DBC.read_text(encoding="utf-8")
        self.assertTrue(old in text, f"{old} is not in the DBC any more")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "changed.dbc"
            path.write_text(text.replace(old, new, 1), encoding="utf-8")
            with self.assertRaises(LayoutError) as raised:
                read_messages(path)
        self.assertNotIn("\n", str(raised.exception))
        return str(raised.exception)

    def test_is_read_as_it_is(self):
        version, messages = read_messages(DBC)

        self.assertRegex(version, r"^\d+\.\d+\.\d+$")
        self.assertEqual([m.data_id for m in messages if m.name == "SpCommit"], [0x49])

    def test_needs_a_data_identifier_for_each_message(self):
        self.assertIn("DataId", self.refusal('BA_ "DataId" BO_ 32 24;\n', ""))

    def test_needs_data_identifiers_that_differ(self):
        self.assertIn("DataId", self.refusal('"DataId" BO_ 32 24;', '"DataId" BO_ 32 17;'))

    def test_may_not_leave_bits_undescribed(self):
        self.assertIn("PingT1", self.refusal("PingT1 : 24|24@1+", "PingT1 : 25|23@1+"))

    def test_may_not_be_big_endian(self):
        self.assertIn("big endian", self.refusal("KillSeq : 48|8@1+", "KillSeq : 55|8@0+"))

    def test_begins_each_message_with_crc_and_counter(self):
        self.assertIn("counter", self.refusal("KILL_CTR : 8|4", "KILL_COUNT : 8|4"))

    def test_has_no_two_signals_of_one_name(self):
        self.assertIn("PingSeq", self.refusal("PongSeq", "PingSeq"))

    def test_needs_a_version(self):
        self.assertIn("VERSION", self.refusal('VERSION "1.0.0"', 'VERSION ""'))

    def test_that_is_not_there_is_named(self):
        with self.assertRaisesRegex(LayoutError, "/nowhere.dbc: No such file"):
            read_messages(Path("/nowhere.dbc"))


if __name__ == "__main__":
    unittest.main()
