# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""The configuration with which stock Wireshark and tshark decode the bus: its Signal-PDU dissector
and four tables, in a folder that WIRESHARK_CONFIG_DIR names.

Fields are called signal_pdu.<signal of the DBC>, codes have their names. Its tables know neither
"not available" nor the checksum: both are shown as numbers.
"""

from pathlib import Path
from typing import Dict, List

from dbc import LayoutError, Message, Signal

MARK = "# Understory: generated from the DBC; do not edit."
# Unlike the tables, Wireshark rewrites this file when somebody changes a setting in its window.
PREFERENCES = f"""{MARK}
signal_pdu.payload_dissector_activated: TRUE
signal_pdu.payload_dissector_hide_raw_values: FALSE
"""
ANY_BUS = 0


def base_bits(signal: Signal) -> int:
    """Of the type that the dissector reads the signal into."""
    return next(bits for bits in (8, 16, 32, 64) if bits >= signal.size)


def row(*fields: object) -> str:
    return ",".join(f'"{field}"' for field in fields)


def boolean(value: bool) -> str:
    return "TRUE" if value else "FALSE"


def signal_row(message: Message, position: int, signal: Signal) -> str:
    count = len(message.header) + len(message.signals)
    never = [boolean(False)] * 4  # hidden, sum, average, integral
    return row(
        f"{message.id:x}",
        count,
        position,
        signal.dbc_name,
        signal.dbc_name,  # the filter string
        "int" if signal.is_signed else "uint",
        boolean(False),  # big endian
        base_bits(signal),
        signal.size,
        repr(signal.factor),
        repr(signal.offset),
        boolean(False),  # a multiplexer
        -1,
        *never,
    )


def value_rows(message: Message, position: int, signal: Signal) -> List[str]:
    return [
        row(f"{message.id:x}", position, len(signal.values), f"{value:x}", f"{value:x}", name)
        for value, name in sorted(signal.values.items())
    ]


def tables(messages: List[Message]) -> Dict[str, List[str]]:
    """Rows by file name."""
    signals = [
        (message, position, signal)
        for message in messages
        for position, signal in enumerate(message.header + message.signals)
    ]
    return {
        "Signal_PDU_identifiers": [row(f"{m.id:x}", m.dbc_name) for m in messages],
        "Signal_PDU_Binding_CAN": [row(f"{m.id:x}", ANY_BUS, f"{m.id:x}") for m in messages],
        "Signal_PDU_signal_list": [signal_row(*each) for each in signals],
        "Signal_PDU_signal_values": [line for each in signals for line in value_rows(*each)],
    }


def write_wireshark(messages: List[Message], folder: Path) -> None:
    """Never over preferences that are somebody's own."""
    preferences = folder / "preferences"
    if preferences.exists() and MARK not in preferences.read_text(errors="replace"):
        raise LayoutError(f"{preferences}: is somebody's own configuration; name another folder")
    folder.mkdir(parents=True, exist_ok=True)
    preferences.write_text(PREFERENCES, encoding="utf-8")
    for name, rows in tables(messages).items():
        (folder / name).write_text("\n".join([MARK, *rows, ""]), encoding="utf-8")
