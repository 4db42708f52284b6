# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Which tests reach which mutant, and whether they notice it."""

import os
import re
import resource
import shlex
import signal
import subprocess
import tempfile
import time
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

WHOLE = "*"  # the one "test" of a program without GoogleTest
ROUNDS = (1.0, 10.0)  # seconds of tests, fastest first, before the next ones start
ALLOWED_FACTOR, ALLOWED_EXTRA = 3.0, 5.0
MEMORY = 8 << 30
TESTS_OF_SHARD = 40


def programs_of(files, table, most=None):
    """Command lines of the programs for these files, by the longest folder in the table that a file is in."""
    chosen = []
    for file in files:
        folders = [folder for folder in table if file.startswith(folder)]
        if folders:
            chosen += table[max(folders, key=len)][:most]
    return list(dict.fromkeys(chosen))


def read_table(path):
    table = {}
    for line in path.read_text().splitlines():
        if line.strip() and not line.startswith("#"):
            folder, programs = line.split(":", 1)
            table.setdefault(folder.strip(), []).extend(program.strip() for program in programs.split(";"))
    return table


@dataclass
class Reach:
    """What the tests of a program reach."""

    command: str
    seconds: dict = field(default_factory=dict)  # by test
    mutants: dict = field(default_factory=lambda: defaultdict(set))  # ids by test
    failed: list = field(default_factory=list)  # without a mutant: their verdict means nothing

    def tests_of(self, mutant):
        """[(seconds, test)]; what runs outside of tests runs for each of them."""
        is_shared = self.is_gtest and mutant in self.mutants[WHOLE]
        return [(seconds, test) for test, seconds in self.seconds.items()
                if test not in self.failed and (is_shared or mutant in self.mutants[test])]

    @property
    def is_gtest(self):
        return " " not in self.command

    def add(self, other):
        """Another part of the same program."""
        self.seconds.update(other.seconds)
        self.failed += other.failed
        for test, mutants in other.mutants.items():
            self.mutants[test] |= mutants


def limit_process(pid):
    """A mutant may ask for all memory there is, or crash a hundred times."""
    try:
        resource.prlimit(pid, resource.RLIMIT_CORE, (0, 0))
        resource.prlimit(pid, resource.RLIMIT_AS, (MEMORY, MEMORY))
    except ProcessLookupError:
        pass


def execute(arguments, environment, limit):
    """(exit status, or None after `limit` seconds; output)"""
    with tempfile.TemporaryDirectory(prefix="cullet-mutant-") as folder, tempfile.TemporaryFile() as log:
        # TMPDIR: tests that write files run beside each other.
        process = subprocess.Popen(arguments, stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, cwd=folder,
                                   env=dict(os.environ, TMPDIR=folder, **environment), start_new_session=True)
        limit_process(process.pid)
        try:
            status = process.wait(timeout=limit)
        except subprocess.TimeoutExpired:
            status = None
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()
        log.seek(0)
        return status, log.read()[-200000:].decode(errors="replace")


def shards_of(command, path, most):
    """In how many processes to measure a program: one of thousands of tests would take longest of all."""
    if not Reach(command).is_gtest:
        return 1
    _, output = execute([str(path), "--gtest_list_tests"], {}, 60)
    return max(1, min(most, output.count("\n  ") // TESTS_OF_SHARD))


def measure_reach(command, path, file, limit, shard):
    """Runs a part of the program without a mutant; None if that takes too long. `shard`: (index, count)"""
    file.unlink(missing_ok=True)
    arguments = [str(path), *shlex.split(command)[1:]]
    started = time.monotonic()
    environment = {"GTEST_SHARD_INDEX": str(shard[0]), "GTEST_TOTAL_SHARDS": str(shard[1]), "GTEST_COLOR": "no"}
    status, output = execute(arguments, {"CULLET_MUTANT": "reach", "CULLET_MUTANT_REACH": str(file), **environment}, limit)
    if status is None:
        return None
    reach = read_reach(command, file)
    if not reach.is_gtest:
        reach.seconds[WHOLE] = time.monotonic() - started
        reach.failed = [WHOLE] if status != 0 else []
    elif status != 0 and not reach.failed:
        # It ended in a test, which is in no line then.
        reach.failed.append(killing_test(output))
    return reach


def read_reach(command, file):
    reach = Reach(command)
    for line in file.read_text().splitlines() if file.exists() else []:
        name, milliseconds, ids = line.split("\t")
        if name.startswith("!"):
            name = name[1:]
            reach.failed.append(name)
        reach.mutants[name].update(map(int, ids.split()))
        if name != WHOLE:
            reach.seconds[name] = reach.seconds.get(name, 0) + int(milliseconds) / 1000
    return reach


def killing_test(output):
    failed = re.findall(r"^\[  FAILED  \] (\S+?\.\S+?)(?:,| \(|$)", output, re.MULTILINE)
    begun = re.findall(r"^\[ RUN      \] (\S+)", output, re.MULTILINE)
    return failed[0] if failed else begun[-1] if begun else WHOLE


@dataclass
class Result:
    outcome: str  # killed, timeout, survived, unreached
    test: str = ""  # that noticed it
    ran: int = 0  # tests
    reaching: list = field(default_factory=list)  # programs, with the number of tests
    seconds: float = 0.0


class Runner:
    """Runs the tests that reach a mutant."""

    def __init__(self, reaches, paths, most_seconds, folder):
        self.reaches, self.paths, self.most_seconds, self.folder = reaches, paths, most_seconds, folder

    def chosen(self, mutant):
        """[(seconds, command, test)] that there is time for, fastest first; and how many reach the mutant.

        Each program has a share of the time, so that thousands of fast tests of one leave out none of another.
        """
        by_program = [sorted((seconds, reach.command, test) for seconds, test in reach.tests_of(mutant)) for reach in self.reaches]
        by_program = [tests for tests in by_program if tests]
        chosen, others, left = [], [], self.most_seconds
        for tests in by_program:
            share = self.most_seconds / len(by_program)
            for entry in tests:
                (chosen if entry[0] <= share else others).append(entry)
                if entry[0] <= share:
                    share -= entry[0]
                    left -= entry[0]
        for entry in sorted(others):
            if entry[0] > left and chosen:
                break
            chosen.append(entry)
            left -= entry[0]
        return sorted(chosen), sum(len(tests) for tests in by_program)

    def rounds(self, mutant):
        """Lists of (command, tests, their seconds): the fastest tests of all programs, and then the slower ones."""
        chosen, count = self.chosen(mutant)
        rounds, total = [], 0.0
        for seconds, command, test in chosen:
            total += seconds
            step = sum(total > edge for edge in ROUNDS)
            while len(rounds) <= step:
                rounds.append({})
            entry = rounds[step].setdefault(command, [command, [], 0.0])
            entry[1].append(test)
            entry[2] += seconds
        return [sorted(programs.values(), key=lambda entry: entry[2]) for programs in rounds], count

    def run(self, mutant):
        rounds, _ = self.rounds(mutant)
        started = time.monotonic()
        result = Result("survived", reaching=self.reaching(mutant))
        if not result.reaching:
            result.outcome = "unreached"
        for command, tests, seconds in (entry for programs in rounds for entry in programs):
            result.ran += len(tests)
            limit = ALLOWED_FACTOR * seconds + ALLOWED_EXTRA
            status, output = self.execute(mutant, command, tests, limit)
            if status is None and self.execute(0, command, tests, limit)[0] is None:
                # The machine is busier than it was: that says nothing of the mutant.
                status, output = self.execute(mutant, command, tests, 6 * limit)
            if status != 0:
                result.outcome = "timeout" if status is None else "killed"
                result.test = f"{shlex.split(command)[0]} {killing_test(output)}"
                break
        result.seconds = round(time.monotonic() - started, 2)
        return result

    def reaching(self, mutant):
        counts = [(reach.command, len(reach.tests_of(mutant))) for reach in self.reaches]
        return [f"{shlex.split(command)[0]} ({count})" for command, count in counts if count]

    def execute(self, mutant, command, tests, limit):
        name, *arguments = shlex.split(command)
        environment = {"CULLET_MUTANT": str(mutant), "GTEST_FAIL_FAST": "1", "GTEST_COLOR": "no"}
        if tests == [WHOLE]:
            return execute([str(self.paths[name]), *arguments], environment, limit)
        # A file: the list may be longer than an argument.
        with tempfile.NamedTemporaryFile("w", suffix=".flags", dir=self.folder) as flags:
            flags.write("--gtest_filter=" + ":".join(tests) + "\n")
            flags.flush()
            return execute([str(self.paths[name]), f"--gtest_flagfile={Path(flags.name)}"], environment, limit)
