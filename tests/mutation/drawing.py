# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Which mutants are run: the candidates of the chosen files, and a sample of them by folder and kind."""

import hashlib
import re
import subprocess
from collections import Counter, defaultdict
from pathlib import Path

from cpp_mutants import mutants_of
from cpp_tokens import SourceError

FOLDERS = ("base", "broad", "comparison", "narrow", "mid", "plugin", "cuda")
# No test runs the sources of cuda/ without a GPU.
DEFAULT_FOLDERS = ("broad", "comparison", "narrow", "mid", "plugin")
SUFFIXES = (".h", ".inl", ".cpp")
# Only ThreadSanitizer sees these; --kinds has them too.
DEFAULT_KINDS = (
    "comparison", "arithmetic", "bits", "condition", "logic", "constant", "arguments", "order", "statement", "lock")
# Swapped arguments are seldom of one type, so many of these do not compile.
SPARES = {"arguments": 2.5, "constant": 1.3}
DEFAULT_SPARE = 1.15


def wildcard(pattern):
    """`*` stands for anything; nothing else is special, since code has brackets."""
    return re.compile(".*".join(re.escape(part) for part in pattern.split("*")) + r"\Z", re.DOTALL)


def source_files(root, globs):
    files = []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            name = path.relative_to(root).as_posix()
            is_chosen = any(wildcard(glob).match(name) for glob in globs) if globs else folder in DEFAULT_FOLDERS
            if path.suffix in SUFFIXES and is_chosen:
                files.append(name)
    return files


def changed_lines(root, revision):
    """{file: line numbers} of what differs from the revision."""
    output = subprocess.run(["git", "-C", str(root), "diff", "-U0", "--no-color", revision, "--", *FOLDERS],
                            check=True, capture_output=True, text=True).stdout
    changed, file = defaultdict(set), None
    for line in output.splitlines():
        if line.startswith("+++ "):
            file = line[6:] if line.startswith("+++ b/") else None
        match = re.match(r"@@ -\S+ \+(\d+)(?:,(\d+))? @@", line)
        if match and file:
            first, count = int(match.group(1)), int(match.group(2) or 1)
            changed[file].update(range(first, first + count))
    return changed


class Equivalents:
    """The list of mutants that change nothing a test could see: `file :: line :: original -> mutated :: reason`."""

    def __init__(self, path):
        self.patterns = []
        for line in path.read_text().splitlines() if path.exists() else []:
            if line.strip() and not line.startswith("#"):
                fields = line.split(" :: ")
                if len(fields) != 4:
                    raise SystemExit(f"{path}: not `file :: line :: original -> mutated :: reason`: {line}")
                self.patterns.append(tuple(wildcard(field.strip()) for field in fields[:3]))

    def has(self, mutant):
        parts = mutant.key.split(" :: ")
        return any(all(pattern.match(part) for pattern, part in zip(patterns, parts)) for patterns in self.patterns)


def candidates(root, files, equivalents, lines=None, kinds=DEFAULT_KINDS):
    found, problems = [], []
    for file in files:
        if lines is not None and file not in lines:
            continue
        try:
            mutants = mutants_of(file, (root / file).read_text())
        except SourceError as error:
            problems.append(f"{file}: {error}")
            continue
        found += [mutant for mutant in mutants
                  if mutant.kind in kinds and (lines is None or mutant.line in lines[file]) and not equivalents.has(mutant)]
    return found, problems


def stratum_of(mutant):
    return mutant.file.split("/")[0], mutant.kind


def shares(strata, size):
    """How many of each stratum: by the square root of its size, so that rare kinds are there too, and one if there is room."""
    total = sum(len(mutants) ** 0.5 for mutants in strata.values())
    exact = {key: min(len(mutants), size * len(mutants) ** 0.5 / total) for key, mutants in strata.items()}
    wanted = {key: max(1, int(value)) for key, value in exact.items()}
    by_rest = sorted(exact, key=lambda key: (int(exact[key]) - exact[key], key))
    while sum(wanted.values()) > size and max(wanted.values()) > 1:
        wanted[max(wanted, key=lambda key: (wanted[key], key))] -= 1
    for key in sorted(exact, key=lambda key: (exact[key], key))[:max(0, sum(wanted.values()) - size)]:
        wanted[key] = 0
    for key in by_rest:
        if sum(wanted.values()) < size and wanted[key] < len(strata[key]):
            wanted[key] += 1
    return wanted


def shuffled(mutants, seed):
    """In an order in which none depends on another, so that a sample stays while other code changes or is marked."""
    seen = Counter()
    ranked = []
    for mutant in mutants:
        seen[mutant.key] += 1
        rank = hashlib.sha256(f"{seed} {seen[mutant.key]} {mutant.key}".encode()).digest()
        ranked.append((rank, mutant))
    return [mutant for _, mutant in sorted(ranked, key=lambda entry: entry[0])]


def draw(mutants, size, seed):
    """Lists by stratum: those wanted first, then spare ones for what does not compile; and how many are wanted.

    Two drawn mutants never share a line, so that an error of the compiler names one.
    """
    strata = defaultdict(list)
    for mutant in shuffled(mutants, seed):
        strata[stratum_of(mutant)].append(mutant)
    wanted = shares(strata, min(size, len(mutants))) if strata else {}
    taken, drawn = defaultdict(list), {key: [] for key in strata}
    for key in sorted(strata, key=lambda key: (len(strata[key]), key)):
        goal = int(wanted[key] * SPARES.get(key[1], DEFAULT_SPARE) + 0.999)
        for mutant in strata[key]:
            if len(drawn[key]) >= goal:
                break
            first, last = lines_of(mutant)
            if all(last < begin or end < first for begin, end in taken[mutant.file]):
                taken[mutant.file].append((first, last))
                drawn[key].append(mutant)
    return drawn, wanted


def lines_of(mutant):
    """First and last line of what is replaced."""
    first = mutant.first_line
    return first, first + mutant.line_count - 1


def cut(drawn, wanted):
    """Those that are run, when what does not compile is gone."""
    return [mutant for key in sorted(drawn) for mutant in drawn[key][:wanted[key]]]


def default_root():
    return Path(__file__).resolve().parents[2]
