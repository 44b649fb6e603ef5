# Copyright 2026 the Understory authors
# SPDX-License-Identifier: BSD-3-Clause
"""clang-tidy over everything we compile, remembering what came out clean.

A file is looked at again when its own text, that of any header it includes, its compile command,
a .clang-tidy or clang-tidy itself changed: the cache key is a hash of all of these.
"""

import concurrent.futures
import functools
import hashlib
import json
import os
import pathlib
import re
import shlex
import subprocess
import time

from commands import ROOT, cpp_files, our_files, output_of, say
from results import SuiteResult

COMMANDS = ROOT / "build-test" / "tidy"  # compile_commands.json of all folders in one
# Clones share it, as they share what is compiled (ccache).
CACHE = (
    pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache")
    / "understory"
    / "clang-tidy"
)
CLANG_TIDY = "clang-tidy-22"  # leaves out system headers
# Headers that GCC has precompiled: clang cannot read them, and a file must include what it needs.
GCC_HEADERS = re.compile(r"-fpch-preprocess|-Winvalid-pch -include \S+/cmake_pch\.hxx")
# Boost 1.74, which PCL includes, has enumerations that newer compilers refuse; where they do, an older
# clang-tidy has to do.
REFUSED, OLDER = "/boost/mpl/aux_/integral_wrapper.hpp", "clang-tidy-14"
# GCC's own warnings; what Google Benchmark's macros and the standard library use.
LET_PASS = [
    "-Wno-unknown-warning-option",
    "-Wno-c2y-extensions",
    "-Wno-deprecated-declarations",
]


@functools.lru_cache(maxsize=None)
def _content_hash(path):
    return hashlib.sha256(pathlib.Path(path).read_bytes()).hexdigest()


def _included_files(folder):
    """{object file: the files it was made from}, as Ninja recorded them."""
    included, current = {}, None
    for line in output_of(["ninja", "-C", folder, "-t", "deps"]).splitlines():
        if line.startswith("    "):
            current.append(os.path.normpath(folder / line.strip()))
        elif line.endswith("(VALID)"):
            current = included.setdefault(line.split(": #deps")[0], [])
        elif line:
            current = []  # stale: belongs to nothing we build now
    return included


def _object_file(entry):
    words = shlex.split(entry["command"])
    return words[words.index("-o") + 1]


def _key(entry, files, version_and_rules):
    digest = hashlib.sha256(version_and_rules.encode())
    digest.update(entry["command"].replace(str(ROOT), "").encode())
    for path in sorted(name for name in set(files) if not name.endswith(".gch")):
        digest.update(f"{path.replace(str(ROOT), '')} {_content_hash(path)}\n".encode())
    return digest.hexdigest()


def _say_of(tool, entry):
    """What it says of one file, empty if clean."""
    outcome = subprocess.run(
        [tool, "-p", COMMANDS, "--quiet"]
        + [*(f"--extra-arg={option}" for option in LET_PASS), entry["file"]],
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    is_clean = outcome.returncode == 0 and not outcome.stdout.strip()
    return "" if is_clean else outcome.stdout + outcome.stderr


def _look_at(entry, key):
    """What is found in one file; remembered if it is nothing."""
    found = _say_of(CLANG_TIDY, entry)
    if REFUSED in found:
        found = _say_of(OLDER, entry)
    if not found:
        (CACHE / key).touch()
    return found


def entries_of(folders):
    """{path: compile command and folder}: each of our files once, of the first folder that has it.

    The catkin workspace names files by its links to packages; theirs are the real paths here, so
    that the rules of the folder they lie in hold for them.
    """
    generated = tuple(f"{os.path.realpath(folder)}/" for folder in folders)
    found = {}
    for folder in folders:
        listed = json.loads((folder / "compile_commands.json").read_text(encoding="utf-8"))
        for entry in listed:
            path = os.path.realpath(entry["file"])
            is_ours = path.startswith(f"{ROOT}/") and not path.startswith(generated)
            if is_ours and path not in found:
                command = entry["command"].replace(entry["file"], path)
                command = GCC_HEADERS.sub("", command)
                found[path] = {**entry, "file": path, "command": command, "folder": folder}
    return found


def check_tidy(folders):
    """One SuiteResult; `folders` hold finished builds with compile_commands.json."""
    say("\n== clang-tidy: static analysis of all C++ files")
    began = time.monotonic()
    result = SuiteResult("clang-tidy")
    entries = list(entries_of(folders).values())
    COMMANDS.mkdir(parents=True, exist_ok=True)
    wanted = ("directory", "command", "file")
    (COMMANDS / "compile_commands.json").write_text(
        json.dumps([{key: entry[key] for key in wanted} for entry in entries]), encoding="utf-8"
    )
    compiled = {os.path.relpath(entry["file"], ROOT) for entry in entries}
    left_out = [name for name in cpp_files() if name.endswith(".cpp") and name not in compiled]
    result.failed += [f"{name} is compiled by no target" for name in left_out]

    rules = [name for name in our_files() if os.path.basename(name) == ".clang-tidy"]
    versions = "".join(output_of([tool, "--version"]) for tool in (CLANG_TIDY, OLDER))
    version_and_rules = versions + "".join(name + _content_hash(ROOT / name) for name in rules)
    CACHE.mkdir(parents=True, exist_ok=True)
    included = {folder: _included_files(folder) for folder in folders}
    keys = {
        entry["file"]: _key(
            entry, included[entry["folder"]][_object_file(entry)], version_and_rules
        )
        for entry in entries
    }
    todo = [entry for entry in entries if not (CACHE / keys[entry["file"]]).exists()]
    say(f"  {len(entries) - len(todo)} files are as they were when found clean, {len(todo)} to do")
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        runs = {
            pool.submit(_look_at, entry, keys[entry["file"]]): entry for entry in todo
        }
        for done, run in enumerate(concurrent.futures.as_completed(runs), 1):
            name = os.path.relpath(runs[run]["file"], ROOT)
            findings = run.result()
            if findings:
                result.failed.append(name)
                say(f"\n-- FAILED: {name}\n{findings}")
            if done % 10 == 0 or done == len(todo):
                say(f"  {done} of {len(todo)}")
    result.passed = len(entries) - len(result.failed) + len(left_out)
    result.duration_s = time.monotonic() - began
    return result
