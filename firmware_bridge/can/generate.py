#!/usr/bin/python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""From the DBC, the single source of the bus: C++ codec, golden frames, docs/can_protocol.md, and
the tables with which Wireshark decodes the bus.

usage: generate.py cpp DBC FOLDER | golden DBC FOLDER | wireshark DBC FOLDER | docs DBC
The frames of `golden` and `docs` are encoded in dbc.py and not by the C++ code, so that a test can
hold the two against each other. Any violation of the protocol's layout rules ends with 1 and one
line.
"""

import math
import sys
from pathlib import Path

from corners import corner_frames, physical_value
from dbc import LayoutError, camel, enums, examples, physical, protocol_hash, read_messages
from wireshark import write_wireshark

ORACLE_RANDOM_FRAMES = 20  # of each message
LICENCE = "// Copyright 2026 the Understory authors\n// SPDX-License-Identifier: BSD-3-Clause\n"

# --- C++ -----------------------------------------------------------------------------------------


def whole_type(signal):
    if signal.enum:
        return signal.enum
    return "bool" if signal.size == 1 else "std::uint32_t"


def field_line(signal):
    if signal.is_whole:
        return f"  {whole_type(signal)} {signal.name}{{}};"
    return f"  double {signal.name} = kNotAvailable;"


def enum_text(name, values):
    lines = [f"enum class {name} : std::uint32_t {{"]
    lines += [f"  k{camel(word)} = {value}," for value, word in sorted(values.items())]
    return "\n".join(lines + ["};", f"[[nodiscard]] const char* to_string({name} value);", ""])


def enum_names_text(name, values):
    lines = [f"const char* to_string({name} value) {{", "  switch (value) {"]
    for value, word in sorted(values.items()):
        lines += [f"    case {name}::k{camel(word)}:", f'      return "{word}";']
    return "\n".join(lines + ["  }", '  return "unknown code";', "}\n"])


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


def values_text(message):
    """A function that gathers what the structure holds, in the order of the DBC."""
    fields = ", ".join(f"static_cast<double>(message.{s.name})" for s in message.signals)
    return f"inline std::vector<double> values_of(const {message.name}& message) {{\n  return {{{fields}}};\n}}"


def oracle_row(corner):
    values = [physical_value(*pair) for pair in zip(corner.message.signals, corner.raws)]
    cells = ", ".join("kNotAvailable" if math.isnan(value) else repr(value) for value in values)
    legal = "true" if corner.is_legal else "false"
    return f'    {{"{corner.candump}", {corner.counter}, {legal}, {{{cells}}}}},'


def write_oracle(messages, folder):
    """Codes at all borders and random ones, with what they mean."""
    corners = list(corner_frames(messages, ORACLE_RANDOM_FRAMES))
    most = max(len(message.signals) for message in messages)
    text = [LICENCE + "// Generated from the DBC; do not edit. What frames mean, said in another language."]
    text += ["#pragma once\n", "#include <array>", "#include <cstdint>", "#include <vector>\n"]
    text += ['#include "understory/can/messages.hpp"\n', "namespace understory::can {\n"]
    text += ["struct OracleFrame {\n  const char* candump;\n  std::uint8_t counter;"]
    text += ["  bool is_legal;  // else it has a code that the protocol forbids"]
    text += [f"  std::array<double, {most}> values;  // by signal, then zeros\n}};\n"]
    text += [values_text(message) for message in messages]
    text += [f"\ninline constexpr std::array<OracleFrame, {len(corners)}> kOracleFrames{{{{"]
    text += [oracle_row(corner) for corner in corners]
    text += ["}};\n", "}  // namespace understory::can", ""]
    (folder / "oracle_frames.hpp").write_text("\n".join(text), encoding="utf-8")


def write_golden(messages, folder):
    folder.mkdir(parents=True, exist_ok=True)
    write_oracle(messages, folder)
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


def docs_text(version, messages):
    text = [
        "# The CAN protocol\n",
        "Generated from `firmware_bridge/can/understory.dbc` by `firmware_bridge/can/generate.py docs`.\n",
        "Classic CAN, 11-bit identifiers, 8 bytes, little endian. Byte 0 is the CRC (CRC8H2F: polynomial",
        "0x2F, initial and final XOR 0xFF) over bytes 1 to 7 and then the message's data identifier (in the",
        "DBC its attribute DataId); the low half of byte 1 counts 0 to 15 (AUTOSAR E2E profile 2). The code",
        "that means \"not available\" is all ones (unsigned) or the most negative one (signed). The example of",
        "each message is a test.\n",
        f"Version {version}, hash 0x{protocol_hash(messages):04X} (of HOST_HB and VEH_HB).\n",
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
    if len(words) < 2 or words[0] not in ("cpp", "golden", "wireshark", "docs"):
        print(__doc__, file=sys.stderr)
        return 2
    try:
        version, messages = read_messages(Path(words[1]))
        if words[0] == "docs":
            print(docs_text(version, messages))
        elif words[0] == "cpp":
            write_cpp(version, messages, Path(words[2]))
        elif words[0] == "golden":
            write_golden(messages, Path(words[2]))
        else:
            write_wireshark(messages, Path(words[2]))
    except (LayoutError, KeyError, IndexError, OSError) as error:
        print(f"generate.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
