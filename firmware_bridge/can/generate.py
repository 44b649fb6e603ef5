#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""From the DBC, the single source of the bus: C++ codec, golden frames, docs/can_protocol.md.

usage: generate.py cpp DBC FOLDER | golden DBC FOLDER | docs DBC
The frames of `golden` and `docs` are encoded here and not by the C++ code, so that a test can hold
the two against each other. Any violation of the protocol's layout rules ends with 1 and one line.
"""

import contextlib
import io
import re
import sys
import zlib
from pathlib import Path

quiet = io.StringIO()  # it talks about formats it does not know
with contextlib.redirect_stdout(quiet), contextlib.redirect_stderr(quiet):
    import canmatrix.formats

FIRST_DATA_ID, DATA_ID_STEP = 0x11, 7
CRC_POLYNOMIAL, CRC_INITIAL, CRC_FINAL = 0x2F, 0xFF, 0xFF
HEADER_BITS = 12  # CRC and counter
LICENCE = "// Copyright 2026 the Understory authors\n// SPDX-License-Identifier: BSD-3-Clause\n"
UNITS = {
    "m": "m",
    "m/s": "mps",
    "m/s2": "mps2",
    "rad": "rad",
    "rad/s": "radps",
    "us": "us",
    "s": "s",
    "V": "v",
    "A": "a",
    "%": "percent",
    "rpm": "rpm",
    "degC": "celsius",
}


class LayoutError(Exception):
    pass


class Signal:
    """One signal with what the C++ code needs to know of it."""

    def __init__(self, signal):
        self.dbc_name = signal.name
        self.start, self.size, self.is_signed = signal.start_bit, signal.size, signal.is_signed
        self.factor, self.offset = float(signal.factor), float(signal.offset)
        self.low, self.high = float(signal.min), float(signal.max)
        self.unit = signal.unit
        self.values = {int(value): name for value, name in signal.values.items()}
        self.comment = signal.comment or ""
        words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", signal.name).lower()
        suffix = UNITS[signal.unit] if signal.unit else ""
        self.name = f"{words}_{suffix}" if suffix else words
        # Codes have an enumeration of the signal's name; EscErr0 to EscErr3 share one.
        self.enum = re.sub(r"\d$", "", signal.name) if signal.values else ""
        # Counts, codes and wrapping clocks are whole numbers; everything else is measured.
        self.is_whole = self.factor == 1.0 and self.offset == 0.0 and self.unit in ("", "us", "s")

    @property
    def not_available(self):
        return -(1 << (self.size - 1)) if self.is_signed else (1 << self.size) - 1

    @property
    def raw_range(self):
        """The legal codes, without the one for "not available"."""
        low = round((self.low - self.offset) / self.factor)
        high = round((self.high - self.offset) / self.factor)
        if self.is_signed:
            return max(low, self.not_available + 1), high
        return low, min(high, self.not_available - 1)


class Message:
    def __init__(self, frame, position):
        self.dbc_name = frame.name
        self.name = camel(frame.name)
        self.id = frame.arbitration_id.id
        self.data_id = FIRST_DATA_ID + DATA_ID_STEP * position
        self.sender = frame.transmitters[0]
        self.period_ms = frame.cycle_time
        self.comment = frame.comment or ""
        signals = sorted(frame.signals, key=lambda signal: signal.start_bit)
        check_layout(frame, signals)
        self.signals = [Signal(signal) for signal in signals[2:]]


def check_layout(frame, signals):
    """What decoders of the DBC rely on: see docs/can_protocol.md."""
    where = f"message {frame.name}"
    if frame.size != 8 or frame.arbitration_id.extended:
        raise LayoutError(f"{where}: must be 8 bytes with an 11-bit identifier")
    header = [(signal.name, signal.start_bit, signal.size) for signal in signals[:2]]
    if header != [(f"{frame.name}_CRC", 0, 8), (f"{frame.name}_CTR", 8, 4)]:
        raise LayoutError(f"{where}: must begin with its CRC and counter")
    bit = 0
    for signal in signals:
        if signal.start_bit != bit:
            raise LayoutError(f"{where}: gap or overlap before signal {signal.name}")
        if not signal.is_little_endian or (signal.is_signed and signal.size not in (8, 16, 32)):
            raise LayoutError(f"{where}: signal {signal.name}: big endian, or an odd signed size")
        bit += signal.size
    if bit != 64:
        raise LayoutError(f"{where}: {bit} bits are described, not 64")


def read_messages(path):
    try:
        matrix = canmatrix.formats.loadp_flat(str(path))
    except OSError as error:
        raise LayoutError(f"{path}: {error.strerror}") from error
    messages = [Message(frame, position) for position, frame in enumerate(matrix.frames)]
    names = [signal.dbc_name for message in messages for signal in message.signals]
    twice = sorted({name for name in names if names.count(name) > 1})
    if not messages or twice:
        raise LayoutError(f"{path}: no messages, or signals named twice: {' '.join(twice)}")
    if max(message.data_id for message in messages) > 0xFF:
        raise LayoutError(f"{path}: more messages than data identifiers")
    return version_of(path), messages


def version_of(path):
    match = re.search(r'^VERSION "(\d+\.\d+[^"]*)"', path.read_text(encoding="utf-8"), re.M)
    if not match:
        raise LayoutError(f"{path}: no VERSION such as 1.0.0")
    return match[1]


# --- frames, independently of the C++ code -------------------------------------------------------


def crc8(data):
    crc = CRC_INITIAL
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = ((crc << 1) ^ CRC_POLYNOMIAL if crc & 0x80 else crc << 1) & 0xFF
    return crc ^ CRC_FINAL


def frame_bytes(message, raws, counter):
    word = counter << 8
    for signal, raw in zip(message.signals, raws):
        word |= (raw & ((1 << signal.size) - 1)) << signal.start
    data = word.to_bytes(8, "little")
    return bytes([crc8(data[1:] + bytes([message.data_id]))]) + data[1:]


def example_raw(signal, number):
    """Some legal code, another one for each signal."""
    low, high = signal.raw_range
    return low + (high - low) * (7 * number % 10 + 1) // 12


def physical(signal, raw):
    if signal.is_whole:
        return str(raw)
    decimals = max(0, len(f"{signal.factor:.6f}".rstrip("0").split(".")[1]))
    return f"{raw * signal.factor + signal.offset:.{decimals}f}"


def examples(messages):
    """(message, counter, raw codes, bytes) for each."""
    number = 0
    for message in messages:
        raws = []
        for signal in message.signals:
            raws.append(example_raw(signal, number))
            number += 1
        counter = message.id % 16
        yield message, counter, raws, frame_bytes(message, raws, counter)


# --- C++ -----------------------------------------------------------------------------------------


def camel(name):
    return "".join(word.capitalize() for word in name.split("_"))


def whole_type(signal):
    if signal.enum:
        return signal.enum
    return "bool" if signal.size == 1 else "std::uint32_t"


def field_line(signal):
    if signal.is_whole:
        return f"  {whole_type(signal)} {signal.name}{{}};"
    return f"  double {signal.name} = kNotAvailable;"


def enums(messages):
    """{name: {code: name}} of all signals with named codes."""
    found = {}
    for message in messages:
        for signal in message.signals:
            if signal.enum and found.setdefault(signal.enum, signal.values) != signal.values:
                raise LayoutError(f"signal {signal.dbc_name}: codes differ from its namesakes'")
    return found


def enum_text(name, values):
    lines = [f"enum class {name} : std::uint32_t {{"]
    lines += [f"  k{camel(word)} = {value}," for value, word in sorted(values.items())]
    return "\n".join(lines + ["};", f"[[nodiscard]] const char* to_string({name} value);", ""])


def enum_names_text(name, values):
    lines = [f"const char* to_string({name} value) {{", "  switch (value) {"]
    for value, word in sorted(values.items()):
        lines += [f"    case {name}::k{camel(word)}:", f'      return "{word}";']
    return "\n".join(lines + ["  }", '  return "unknown code";', "}\n"])


def protocol_hash(messages):
    """Of all that two stations must agree on."""
    agreed = [
        (message.id, message.data_id)
        + tuple(
            (signal.dbc_name, signal.start, signal.size, signal.factor, signal.offset)
            + tuple(sorted(signal.values.items()))
            for signal in message.signals
        )
        for message in messages
    ]
    return zlib.crc32(repr(agreed).encode()) & 0xFFFF


def constants_text(version, messages):
    major, minor = version.split(".")[:2]
    rows = ",\n    ".join(
        f'{{"{message.dbc_name}", 0x{message.id:03X}, {message.period_ms}, '
        f'{"true" if message.sender == "HOST" else "false"}}}'
        for message in messages
    )
    return "\n".join(
        [
            f"inline constexpr std::uint32_t kProtocolMajor = {major};",
            f"inline constexpr std::uint32_t kProtocolMinor = {minor};",
            "// Of the messages, their signals and codes: what two stations must agree on.",
            f"inline constexpr std::uint32_t kDbcHash = 0x{protocol_hash(messages):04X};\n",
            "struct MessageInfo {",
            "  const char* name;",
            "  std::uint16_t id;",
            "  std::uint16_t period_ms;  // at the highest rate; 0: on event",
            "  bool is_from_host;",
            "};",
            f"inline constexpr std::array<MessageInfo, {len(messages)}> kMessages{{{{\n    {rows},\n}}}};\n",
        ]
    )


def layout(signal):
    low, high = signal.raw_range
    signed = "true" if signal.is_signed else "false"
    return (
        f"{{{signal.start}, {signal.size}, {signed}, {signal.factor!r}, {signal.offset!r}, "
        f"{low}, {high}, {signal.not_available}}}"
    )


def struct_text(message):
    lines = [
        f"struct {message.name} {{",
        f'  static constexpr const char* kName = "{message.dbc_name}";',
        f"  static constexpr std::uint16_t kId = 0x{message.id:03X};",
        f"  static constexpr std::uint8_t kDataId = 0x{message.data_id:02X};",
        *(field_line(signal) for signal in message.signals),
        "};",
        f"[[nodiscard]] std::optional<Payload> to_payload(const {message.name}& message);",
        f"[[nodiscard]] bool from_payload(Payload payload, {message.name}& message);",
        "",
    ]
    return "\n".join(lines)


def codec_text(message):
    puts, gets = [], []
    for signal in message.signals:
        if signal.is_whole:
            place, kind = f"{signal.start}, {signal.size}", whole_type(signal)
            value = f"message.{signal.name}"
            is_plain = kind == "std::uint32_t"
            code = value if is_plain else f"static_cast<std::uint32_t>({value})"
            puts.append(f"  writer.put_whole({place}, {code});")
            got = f"get_whole(payload, {place})"
            gets.append(f"  {value} = {got if is_plain else f'static_cast<{kind}>({got})'};")
        else:
            constant = f"k{message.name}{signal.dbc_name}"
            puts.append(f"  writer.put({constant}, message.{signal.name});")
            gets.append(f"  good = get({constant}, payload, message.{signal.name}) && good;")
    constants = [
        f"constexpr SignalLayout k{message.name}{signal.dbc_name}{layout(signal)};"
        for signal in message.signals
        if not signal.is_whole
    ]
    return "\n".join(
        constants
        + [f"\nstd::optional<Payload> to_payload(const {message.name}& message) {{"]
        + ["  PayloadWriter writer;", *puts, "  return writer.payload();", "}\n"]
        + [f"bool from_payload(Payload payload, {message.name}& message) {{", "  bool good = true;"]
        + [*gets, "  return good;", "}\n"]
    )


def write_cpp(version, messages, folder):
    folder.mkdir(parents=True, exist_ok=True)
    header = [LICENCE + "//\n// Generated from the DBC; do not edit. Every message of the bus, in SI"]
    header += ["// units. A value that is not available is NaN. to_payload: nothing for a value that is"]
    header += ["// infinite or out of range. from_payload: false for a code that the protocol forbids."]
    header += ["#pragma once\n", "#include <array>", "#include <cstdint>", "#include <optional>\n"]
    header += ['#include "understory/can/payload.hpp"\n', "namespace understory::can {\n"]
    header += [constants_text(version, messages)]
    header += [enum_text(name, values) for name, values in enums(messages).items()]
    header += [struct_text(message) for message in messages]
    header += ["}  // namespace understory::can", ""]
    (folder / "messages.hpp").write_text("\n".join(header), encoding="utf-8")
    source = [LICENCE + "// Generated from the DBC; do not edit."]
    source += ['#include "understory/can/messages.hpp"\n', "namespace understory::can {\n"]
    source += [enum_names_text(name, values) for name, values in enums(messages).items()]
    source += [codec_text(message) for message in messages]
    source += ["}  // namespace understory::can", ""]
    (folder / "messages.cpp").write_text("\n".join(source), encoding="utf-8")


def golden_text(message, counter, raws, data):
    lines = [f"inline GoldenFrame<{message.name}> golden_{message.dbc_name.lower()}() {{"]
    lines += [f"  {message.name} message;"]
    for signal, raw in zip(message.signals, raws):
        value = f"{physical(signal, raw)}U" if signal.is_whole else physical(signal, raw)
        if signal.is_whole and whole_type(signal) != "std::uint32_t":
            value = f"static_cast<{whole_type(signal)}>({value})"
        lines.append(f"  message.{signal.name} = {value};")
    lines += [f'  return {{message, {counter}, "{message.id:03X}#{data.hex().upper()}"}};', "}"]
    return "\n".join(lines)


def write_golden(messages, folder):
    folder.mkdir(parents=True, exist_ok=True)
    text = [LICENCE + "// Generated from the DBC; do not edit. Frames that were encoded in another language."]
    text += ["#pragma once\n", "#include <cstdint>", "#include <string>", "#include <tuple>\n"]
    text += ['#include "understory/can/messages.hpp"\n', "namespace understory::can {\n"]
    text += ["template <class Message>\nstruct GoldenFrame {\n  Message message;"]
    text += ["  std::uint8_t counter = 0;\n  std::string candump;\n};\n"]
    text += [golden_text(*example) for example in examples(messages)]
    calls = ", ".join(f"golden_{message.dbc_name.lower()}()" for message in messages)
    text += [f"\ninline auto all_golden_frames() {{\n  return std::make_tuple({calls});\n}}\n"]
    text += ["}  // namespace understory::can", ""]
    (folder / "golden_frames.hpp").write_text("\n".join(text), encoding="utf-8")


# --- documentation -------------------------------------------------------------------------------


def signal_row(signal, raw):
    low, high = signal.raw_range
    codes = ", ".join(f"{value} {name}" for value, name in sorted(signal.values.items()))
    if signal.is_whole:
        scale, bounds, missing = "1", f"0 .. {(1 << signal.size) - 1}", ""
    else:
        scale = f"{signal.factor:g}" + (f", from {signal.offset:g}" if signal.offset else "")
        bounds = f"{physical(signal, low)} .. {physical(signal, high)}"
        missing = f"0x{signal.not_available & ((1 << signal.size) - 1):X}"
    kind = ("i" if signal.is_signed else "u") + str(signal.size)
    return (
        f"| `{signal.dbc_name}` | {signal.start} | {kind} | {scale} | {signal.unit} | {bounds} "
        f"| {missing} | {codes} | {physical(signal, raw)} |"
    )


def docs_text(messages):
    text = [
        "# The CAN protocol\n",
        "Generated from `firmware_bridge/can/understory.dbc` by `firmware_bridge/can/generate.py docs`.\n",
        "Classic CAN, 11-bit identifiers, 8 bytes, little endian. Byte 0 is the CRC (CRC8H2F: polynomial",
        "0x2F, initial and final XOR 0xFF) over bytes 1 to 7 and then the message's data identifier; the low",
        "half of byte 1 counts 0 to 15 (AUTOSAR E2E profile 2). The code that means \"not available\" is",
        "all ones (unsigned) or the most negative one (signed). The example of each message is a test.\n",
    ]
    for message, counter, raws, data in examples(messages):
        period = f"every {message.period_ms} ms at most" if message.period_ms else "on event"
        text += [f"## {message.dbc_name}"]
        text += [
            f"`0x{message.id:03X}`, from {message.sender}, {period}, data identifier "
            f"0x{message.data_id:02X}.\n"
        ]
        text += [message.comment + "\n"] if message.comment else []
        text += ["| signal | bit | type | scale | unit | range | not available | codes | example |"]
        text += ["|---|---|---|---|---|---|---|---|---|"]
        text += [signal_row(signal, raw) for signal, raw in zip(message.signals, raws)]
        notes = [f"- `{s.dbc_name}`: {s.comment}" for s in message.signals if s.comment]
        text += ["", *notes] if notes else []
        text += [f"\nExample, counter {counter}: `{message.id:03X}#{data.hex().upper()}`\n"]
    return "\n".join(text).rstrip()


def main(words):
    if len(words) < 2 or words[0] not in ("cpp", "golden", "docs"):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        version, messages = read_messages(Path(words[1]))
        if words[0] == "docs":
            print(docs_text(messages))
        elif words[0] == "cpp":
            write_cpp(version, messages, Path(words[2]))
        else:
            write_golden(messages, Path(words[2]))
    except (LayoutError, KeyError, IndexError, OSError) as error:
        print(f"generate.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
