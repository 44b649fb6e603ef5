#!/usr/bin/env python3
# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""Mutation test of the safety code: changes one thing at a time and lists what no test notices.

    test/mutation/mutate.py --build build [--only supervisor] [--list]

The build folder must hold an up-to-date test_unit. Nothing in it or in the sources is changed: each
mutant is compiled in a scratch folder and linked with the objects of the tests that are to kill it.
Exit status 1 if a mutant survives that docs/mutation.md does not explain.
"""

import argparse
import collections
import json
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
TARGETS = {
    "supervisor": (
        "firmware_bridge/understory/link/supervisor.cpp",
        [
            "supervisor_arming_test",
            "supervisor_direct_test",
            "supervisor_flight_test",
            "supervisor_nonce_test",
            "supervisor_setpoint_test",
        ],
    ),
    "setpoint_gate": (
        "firmware_bridge/understory/bridge/setpoint_gate.cpp",
        ["setpoint_gate_test"],
    ),
    "flight_control": (
        "firmware_bridge/understory/bridge/flight_control.cpp",
        ["flight_control_test"],
    ),
}
TIMEOUT_S = 60

Mutant = collections.namedtuple("Mutant", "line column old new")

# (what, by what). clang-format puts spaces around operators, so templates do not match.
SWAPS = [
    (r" < ", " <= "),
    (r" <= ", " < "),
    (r" > ", " >= "),
    (r" >= ", " > "),
    (r" <= ", " > "),
    (r" >= ", " < "),
    (r" < ", " >= "),
    (r" > ", " <= "),
    (r" == ", " != "),
    (r" != ", " == "),
    (r" && ", " || "),
    (r" \|\| ", " && "),
    (r"&&$", "||"),
    (r"\|\|$", "&&"),
    (r" \+ ", " - "),
    (r" - ", " + "),
    (r"(?<=[ (])!(?=[\w(])", ""),
    (r"\btrue\b", "false"),
    (r"\bfalse\b", "true"),
    (r"std::min\b", "std::max"),
    (r"std::max\b", "std::min"),
]
NUMBER = re.compile(r"(?<![\w.])(\d+\.\d+|\d+)(U?)(?![\w.])")
STATEMENT = re.compile(
    r"^\s+(?:[\w.\->\[\]]+ [-+|&]?= .+;|\+\+[\w.]+;|[\w.\->]+\(.*\);|(?:return|break);)$"
)
CONDITION = re.compile(r"^(\s*(?:\} else )?if \()(.+)(\) \{)$")
RETURN = re.compile(r"^(\s*return )([^;]*(?:&&|\|\||==|!=|<=|>=|[<>] |is_\w+|!)[^;]*)(;)$")


def code_of(line):
    """The line without its comment; nothing for what is not code."""
    if line.lstrip().startswith(("//", "#", "namespace")):
        return ""
    return line.split("//")[0].rstrip()


def mutants_of(source):
    found = []
    for number, line in enumerate(source, 1):
        code = code_of(line)
        if not code:
            continue
        for pattern, new in SWAPS:
            for match in re.finditer(pattern, code):
                found.append(Mutant(number, match.start(), match[0], new))
        for match in NUMBER.finditer(code):
            old = match[0]
            is_whole = "." not in old
            new = f"{int(match[1]) + 1}{match[2]}" if is_whole else f"{float(match[1]) * 1.5 + 0.1}"
            found.append(Mutant(number, match.start(), old, new))
        if STATEMENT.match(code):
            start = len(code) - len(code.lstrip())
            found.append(Mutant(number, start, code.strip(), ";"))
        for whole in (CONDITION.match(code), RETURN.match(code)):
            if whole and "?" not in whole[2]:
                found.append(Mutant(number, whole.start(2), whole[2], f"!({whole[2]})"))
    return found


def place_of(source, number):
    """The line, and what goes before it until nobody takes it for another one."""
    place = source[number - 1].strip()
    while len(place) < 24 and number > 1:
        number -= 1
        place = f"{source[number - 1].strip()} {place}"
    return place


def mutated(source, mutant):
    lines = list(source)
    line = lines[mutant.line - 1]
    end = mutant.column + len(mutant.old)
    assert line[mutant.column : end] == mutant.old
    lines[mutant.line - 1] = line[: mutant.column] + mutant.new + line[end:]
    return "\n".join(lines) + "\n"


class Laboratory:
    """Compiles, links and runs what is made of one source."""

    def __init__(self, build, source, tests, folder):
        self.build, self.source, self.folder = build, ROOT / source, folder
        commands = json.loads((build / "compile_commands.json").read_text())
        command = next(c["command"] for c in commands if c["file"] == str(self.source))
        # Without optimisation it compiles in half the time.
        words = [w for w in shlex.split(command) if not re.fullmatch(r"-O\d|-Werror", w)]
        self.compile = words[: words.index("-o")] + ["-O0", "-w"]
        self.precompile_headers()
        listed = subprocess.run(
            ["ninja", "-C", build, "-t", "commands", "test_unit"],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        link = [line for line in listed.splitlines() if " -o test/test_unit " in line][-1]
        words = shlex.split(link.split("&&")[1] if "&&" in link else link)
        after = words[words.index("test/test_unit") + 1 :]
        self.libraries = [w for w in after if not w.endswith(".o")]
        self.objects = [f"test/CMakeFiles/test_unit.dir/unit/{test}.cpp.o" for test in tests]

    def precompile_headers(self):
        """They are what takes long to compile."""
        lines = self.source.read_text().splitlines()
        prefix = self.folder / f"{self.source.stem}_prefix.hpp"
        prefix.write_text("\n".join(line for line in lines if line.startswith("#include")) + "\n")
        compiled = prefix.with_name(prefix.name + ".gch")
        if self.run([*self.compile, "-x", "c++-header", "-o", compiled, prefix]) != 0:
            sys.exit(f"the headers of {self.source.name} do not compile")
        self.compile += ["-include", prefix]

    def fate(self, text):
        """`killed`, `survived`, or `invalid` if it does not compile."""
        changed = self.folder / self.source.name
        changed.write_text(text)
        built, program = self.folder / "mutant.o", self.folder / "mutant"
        if self.run([*self.compile, "-o", built, "-c", changed]) != 0:
            return "invalid"
        # Before the libraries, so that theirs is not taken.
        if self.run(["c++", built, *self.objects, *self.libraries, "-o", program]) != 0:
            return "invalid"
        status = self.run([program, "--gtest_brief=1", "--gtest_fail_fast"])
        return "survived" if status == 0 else "killed"

    def run(self, command):
        try:
            return subprocess.run(
                command,
                cwd=self.build,
                timeout=TIMEOUT_S,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                check=False,
            ).returncode
        except subprocess.TimeoutExpired:
            return -1


def explained():
    """(file name, line of code, change) that docs/mutation.md lists."""
    page = ROOT / "docs/mutation.md"
    text = page.read_text() if page.exists() else ""
    rows = re.findall(r"^\| `(\w+)` \| `(.+?)` \| `(.*?)` \|", text, re.M)
    return {tuple(cell.replace("\\|", "|") for cell in row) for row in rows}


def examine(name, build, folder):
    source, tests = TARGETS[name]
    text = (ROOT / source).read_text().splitlines()
    laboratory = Laboratory(build, source, tests, folder)
    if laboratory.fate("\n".join(text) + "\n") != "survived":
        sys.exit(f"{name}: its tests fail without any change")
    fates = collections.Counter()
    survivors = []
    for mutant in mutants_of(text):
        fate = laboratory.fate(mutated(text, mutant))
        fates[fate] += 1
        if fate == "survived":
            code = place_of(text, mutant.line)
            change = f"{mutant.old.strip()} -> {mutant.new.strip()}"
            survivors.append((name, code, change))
            print(f"{source}:{mutant.line}: {change}    {code}", flush=True)
    total = fates["killed"] + fates["survived"]
    rest = f"{fates['invalid']} did not compile"
    print(f"{name}: {fates['killed']} of {total} killed ({rest})", flush=True)
    return survivors


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=ROOT / "build")
    parser.add_argument("--only", choices=sorted(TARGETS), action="append")
    parser.add_argument("--list", action="store_true", help="show the changes, try none")
    options = parser.parse_args()
    names = options.only or sorted(TARGETS)
    if options.list:
        for name in names:
            for mutant in mutants_of((ROOT / TARGETS[name][0]).read_text().splitlines()):
                print(f"{name}:{mutant.line}: {mutant.old.strip()} -> {mutant.new.strip()}")
        return 0
    survivors = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            survivors += examine(name, options.build.resolve(), pathlib.Path(folder))
    unexplained = [survivor for survivor in survivors if survivor not in explained()]
    print(f"{len(survivors)} survive, {len(unexplained)} of them not explained in docs/mutation.md")
    return 1 if unexplained else 0


if __name__ == "__main__":
    sys.exit(main())
