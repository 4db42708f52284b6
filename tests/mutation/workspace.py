# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""The copy of the tree that has the mutants in it, and its build."""

import json
import os
import re
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from drawing import lines_of

LEFT_OUT = {"build", "install", "shared"}  # of the top folder; narrow/build/ is no build
INCLUDE = re.compile(r'^\s*#\s*include\s+"cullet/([^"]+)"', re.MULTILINE)
PLACE = re.compile(r"^(/[^:\n]+):(\d+):(?:\d+:)?\s+(.*)$")


class Workspace:
    """`folder` has the copy in tree/ and its build in cmake/."""

    def __init__(self, root, folder, jobs, cmake_arguments=()):
        self.root, self.folder, self.jobs = root, folder, jobs
        self.tree, self.build = folder / "tree", folder / "cmake"
        self.cmake_arguments = list(cmake_arguments)
        self.environment = dict(os.environ, CCACHE_BASEDIR=str(folder), CCACHE_NOHASHDIR="1", CCACHE_DEPEND="1")
        self.mutants = {}

    def files(self):
        listed = subprocess.run(["git", "-C", str(self.root), "ls-files", "-co", "--exclude-standard"], capture_output=True,
                                text=True, check=False)
        if listed.returncode == 0 and listed.stdout:
            return [name for name in listed.stdout.splitlines() if (self.root / name).is_file()]
        names = []
        for folder, folders, files in os.walk(self.root):
            is_top = Path(folder) == self.root
            folders[:] = [name for name in folders if name[0] not in "._" and not (is_top and name in LEFT_OUT)]
            names += [os.path.relpath(os.path.join(folder, name), self.root) for name in files]
        return names

    def copy(self, mutants):
        """Makes the copy, with these mutants by their id. A file that does not change keeps its time, and so its object."""
        self.mutants = mutants
        by_file = {}
        for number, mutant in mutants.items():
            by_file.setdefault(mutant.file, []).append((number, mutant))
        names = set(self.files())
        for name in names:
            source = self.root / name
            if name in by_file:
                write_if_changed(self.tree / name, insert(source.read_text(), by_file[name]).encode())
            else:
                write_if_changed(self.tree / name, source.read_bytes(), source.stat().st_mode)
        for path in [path for path in self.tree.rglob("*") if path.is_file()]:
            if path.relative_to(self.tree).as_posix() not in names:
                path.unlink()

    def configure(self):
        runtime = self.tree / "tests/mutation/runtime"
        arguments = [
            "cmake", "-S", str(self.tree), "-B", str(self.build), "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG",
            f"-DCMAKE_CXX_FLAGS=-include {runtime}/mutants.h -Werror=vla", f"-DCMAKE_PROJECT_cullet_INCLUDE={runtime}/mutation.cmake",
            f"-DCULLET_MUTATION_RUNTIME={runtime}", "-DCULLET_CUDA=OFF", "-DCULLET_INSTALL=OFF", "-DCULLET_PRELOAD=OFF",
            "-DCULLET_DEMOS=OFF", *self.cmake_arguments]
        if shutil.which("ninja"):
            arguments[1:1] = ["-G", "Ninja"]
        stamp = self.build / "mutation-arguments"
        if stamp.exists() and stamp.read_text() == "\n".join(arguments):
            return
        done = subprocess.run(arguments, capture_output=True, text=True, env=self.environment, check=False)
        if done.returncode != 0:
            raise SystemExit(f"the copy cannot be configured:\n{done.stdout[-3000:]}{done.stderr[-6000:]}")
        stamp.write_text("\n".join(arguments))

    # Compiling

    def commands(self):
        """{target: [(source, command)]} of the build."""
        by_target = {}
        for entry in json.loads((self.build / "compile_commands.json").read_text()):
            match = re.search(r"CMakeFiles/([^/]+)\.dir/", entry.get("output") or entry["command"])
            if match:
                by_target.setdefault(match.group(1), []).append((entry["file"], entry["command"]))
        return by_target

    def includes_of(self, name, known):
        """The files of the tree that `name` includes, and it."""
        if name in known:
            return known[name]
        known[name] = {name}
        path = self.tree / name
        if path.exists():
            for included in INCLUDE.findall(path.read_text(errors="replace")):
                included = "abi/cullet.h" if included == "cullet.h" else included
                known[name] = known[name] | self.includes_of(included, known)
        return known[name]

    def probes(self, targets):
        """Sources that together have each mutated file, and headers twice: what to compile first."""
        commands, known, units = self.commands(), {}, {}
        for target in targets:
            for source, command in commands.get(target, []):
                name = os.path.relpath(source, self.tree)
                units[name] = (command, self.includes_of(name, known))
        missing = {file: 1 if file.endswith(".cpp") else 2 for file in {mutant.file for mutant in self.mutants.values()}}
        chosen = []
        while units:
            name = max(sorted(units), key=lambda unit: sum(1 for file in units[unit][1] if missing.get(file, 0) > 0) /
                       (20 + len(units[unit][1])))
            covered = [file for file in units[name][1] if missing.get(file, 0) > 0]
            if not covered:
                break
            for file in covered:
                missing[file] -= 1
            chosen.append(units.pop(name)[0])
        return chosen

    def probe(self, targets, until):
        """Mutants that do not compile, by the sources that are quick to compile."""
        def check(command):
            command = re.sub(r"^\S*ccache\s+", "", command)
            command = re.sub(r" -o \S+ -c ", " -fsyntax-only ", command)
            return run_until(command, until, cwd=self.build, shell=True)[1]

        with ThreadPoolExecutor(self.jobs) as pool:
            outputs = list(pool.map(check, self.probes(targets)))
        return set().union(*(self.culprits(output) for output in outputs)) if outputs else set()

    def culprits(self, output):
        """Ids of the mutants that errors in a compiler's output come from."""
        by_file = {}
        for number, mutant in self.mutants.items():
            first, last = lines_of(mutant)
            by_file.setdefault(mutant.file, []).append((first, last, number))
        found, context, is_after_error = set(), [], False
        for line in output.splitlines():
            match = PLACE.match(line)
            if not match:
                continue
            path, number, message = os.path.realpath(match.group(1)), int(match.group(2)), match.group(3)
            try:
                name = os.path.relpath(path, os.path.realpath(self.tree))
            except ValueError:
                name = path
            at = {mutant for first, last, mutant in by_file.get(name, ()) if first <= number <= last}
            is_error = message.startswith(("error:", "fatal error:"))
            if is_after_error and not message.startswith("note:"):
                context, is_after_error = [], is_error
            context.append(at)
            if is_error:
                is_after_error = True
                # The place itself, else the instantiation that led there.
                found |= at or next((places for places in reversed(context) if places), set())
        return found

    def make(self, targets, until):
        """Builds targets. (whether all are built, ids of mutants that do not compile, output)"""
        command = ["cmake", "--build", str(self.build), "-j", str(self.jobs), "--target", *targets]
        if (self.build / "build.ninja").exists():
            command += ["--", "-k", "0"]
        status, output = run_until(command, until, env=self.environment)
        return status, self.culprits(output) if status not in (0, None) else set(), output

    def programs(self):
        """{name: path} of the programs that are built."""
        found = {}
        for folder, folders, files in os.walk(self.build / "tests"):
            folders[:] = [name for name in folders if name != "CMakeFiles"]
            for name in files:
                path = Path(folder) / name
                if os.access(path, os.X_OK) and path.suffix == "":
                    found[name] = path
        return found


def write_if_changed(path, content, mode=None):
    if path.exists() and path.read_bytes() == content:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    if mode is not None:
        path.chmod(mode)


def insert(source, mutants):
    """The source with a choice in place of what each mutant replaces; lines keep their numbers."""
    for number, mutant in sorted(mutants, key=lambda entry: -entry[1].begin):
        source = source[:mutant.begin] + mutant.replacement.replace("@ID@", str(number)) + source[mutant.end:]
    return source


def run_until(command, until, **options):
    """(exit status, or None where the time was up; output)"""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                               start_new_session=True, **options)
    try:
        output, _ = process.communicate(timeout=max(1, until - time.monotonic()))
        return process.returncode, output
    except subprocess.TimeoutExpired:
        interrupt(process)
        return None, ""
    except BaseException:
        interrupt(process)
        raise


def interrupt(process):
    """ninja ends its compilers itself when interrupted, and removes what they have half written."""
    os.killpg(process.pid, signal.SIGINT)
    try:
        process.communicate(timeout=20)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
