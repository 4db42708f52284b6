#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Prints the tables of what was measured on a GPU, from cuda.csv, cuda_orders.csv and rivals_gpu.csv.

usage: device_tables.py FOLDER                a folder of demos/results: prints every table
       device_tables.py FOLDER --into FILE... puts them in place of those between `<!-- table NAME -->` and `<!-- end -->`
           e.g. device_tables.py demos/results/nvidia-h200 --into docs/gpu-verification.md docs/results.md
A table without data stays as it is.
"""

import csv
import os
import re
import sys

MILLION = 1 << 20
# Name, scene, bodies, goal in ms for the complete pair set.
CASES = [("16k", "W1", 1 << 14, 0.014), ("64k", "W1", 1 << 16, 0.016), ("1M", "W1", MILLION, 0.095),
         ("16M", "W1", 1 << 24, 1.5), ("W2 1M", "W2", MILLION, 0.22), ("W3 1M", "W3", MILLION, 0.17)]
WITH_FLAT = [*CASES, ("all at one x, 1M", "flat", MILLION, None)]
# Number of bodies of the rivals' measurements, 5 % fewer.
BODIES_OF_RIVALS = {MILLION: 1000000, 1 << 24: 16000000}
DELTA_CASES = [("1M", "W1", MILLION, 0.13), ("16M", "W1", 1 << 24, 2.3)]
CHANGES = [("boxes drift, means", "rows-deltas"), ("... every frame searched", "rows-deltas-searched"),
           ("other positions in every frame", "rows-deltas-fresh")]
UPDATES = [("all move", "all-move", 0.60), ("every tenth moves", "tenth-moves", 0.20)]
VARIANTS = [
    ("as the thesis has it: one cell for 64,000 boxes (rounded up), its shift in float", "shifted-thesis-cells"),
    ("thesis's steps, one cell for 64,000 boxes, 64-bit keys of cell and start", "literal-thesis-cells"),
    ("thesis's steps, 1,024 cells, shift in float", "shifted-1024-cells"),
    ("... 64-bit keys for the shift", "literal-1024-cells"),
    ("thesis's steps, 64-bit keys, automatic cells, axis of the largest variance", "literal"),
    ("... axis fixed: x", "literal-x"),
    ("... axis by a random number (seed 2: z)", "literal-random-2"),
    ("... along the principal component", "literal-principal"),
    ("... with bit strings", "literal-bits"),
    ("... with long sweeps split", "literal-split"),
    ("rows, counting", "rows-counting"),
    ("... each box alone", "rows-alone"),
    ("... in groups", "rows-grouped"),
    ("tiles", "rows-tiles"),
    ("**as chosen**", "rows"),
]
# Stages of updates that search, and of updates that use a neighbour list.
STAGES = [("upload", "searched-"), ("sort", "searched-"), ("settle", "searched-"), ("search", "searched-"), ("follow", ""),
          ("deltas", "searched-")]
EXTREMES = [("W1", "uniform"), ("flat", "all at one x"), ("flat-y", "all at one y"), ("flat-z", "all at one z"),
            ("line", "all on a line along x"), ("cover", "uniform, under one that covers all")]


def read(folder, name):
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class Results:
    """Rows by scene, bodies and variant."""

    def __init__(self, folder):
        self.rows = {(row["scene"], int(row["bodies"]), row["variant"]): row for row in read(folder, "cuda")}
        self.orders = read(folder, "cuda_orders")
        self.rivals = {}
        for row in read(folder, "rivals_gpu"):
            self.rivals.setdefault((row["scene"], int(row["bodies"])), []).append(float(row["gpu_ms"]))

    def number(self, scene, bodies, variant, column="gpu_ms"):
        """Nothing where it was not measured."""
        text = self.rows.get((scene, bodies, variant), {}).get(column, "")
        return float(text) if text and float(text) > 0 else None

    def best_rival(self, scene, bodies):
        return min(self.rivals.get((scene, BODIES_OF_RIVALS.get(bodies, bodies)), []), default=None)


def shown(value, digits=3):
    return "" if value is None else f"{value:#.{digits}g}".rstrip(".")


def table(head, lines):
    """Markdown; nothing where no line has a number."""
    if not any(cell for _, *cells in lines for cell in cells):
        return ""
    rows = [["", *head], ["---"] * (len(head) + 1), *lines]
    return "".join("| " + " | ".join(row) + " |\n" if row[1] != "---" else "|" + "|".join(row) + "|\n" for row in rows)


def goals(results):
    """Goals for the complete pair set, its changes, and updates of boxes in the CPU's memory."""
    columns = [(name, results.best_rival(scene, bodies), goal, results.number(scene, bodies, "rows"))
               for name, scene, bodies, goal in CASES]
    columns += [(f"{name}, with changes", None, goal, results.number(scene, bodies, "rows-deltas"))
                for name, scene, bodies, goal in DELTA_CASES if results.number(scene, bodies, "rows-deltas")]
    columns += [(f"1M, CPU to CPU, {name}", None, goal,
                 results.number("W1", MILLION, "rows-update-" + variant, "end_to_end_ms"))
                for name, variant, goal in UPDATES]
    lines = [["best rival, ms", *(shown(rival) for _, rival, _, _ in columns)],
             ["goal", *(f"{goal:g}" for _, _, goal, _ in columns)],
             ["**measured**", *(f"**{shown(ms)}**" if ms else "" for _, _, _, ms in columns)],
             ["rival takes as long, times", *(shown(rival / ms, 2) if rival and ms else ""
                                              for _, rival, _, ms in columns)]]
    return table([name for name, *_ in columns], lines)


def variants(results):
    """What each step bought."""
    lines = [["best rival, ms", *(shown(results.best_rival(scene, bodies)) for _, scene, bodies, _ in WITH_FLAT)]]
    for label, variant in VARIANTS:
        lines.append([label, *(shown(results.number(scene, bodies, variant)) for _, scene, bodies, _ in WITH_FLAT)])
    lines.append(["goal", *("" if goal is None else f"{goal:g}" for *_, goal in WITH_FLAT)])
    return table([name for name, *_ in WITH_FLAT], [line for line in lines if any(line[1:])])


def spread(results):
    """Some frames make plans, which the median does not show."""
    cases = [("as chosen, " + name, scene, bodies, "rows", "gpu_ms") for name, scene, bodies, _ in WITH_FLAT]
    cases += [(f"update, {scene} 1M, {name}", scene, MILLION, "rows-update-" + variant, "end_to_end_ms")
              for scene in ("W1", "W2", "W3") for name, variant, _ in UPDATES]
    lines = []
    for label, scene, bodies, variant, column in cases:
        p90 = results.number(scene, bodies, variant, "p90_ms")
        if p90 is not None:
            lines.append([label, *(shown(results.number(scene, bodies, variant, each))
                                   for each in (column, "p90_ms", "max_ms"))])
    return table(["median (of updates the mean), ms", "p90", "most"], lines)


def updates(results):
    """From the CPU's boxes to the CPU's list of changes."""
    scenes = ["W1", "W2", "W3", "flat"]
    lines = []
    for name, variant, goal in UPDATES:
        lines.append([name + ", ms", *(shown(results.number(scene, MILLION, "rows-update-" + variant, "end_to_end_ms"))
                                       for scene in scenes), f"{goal:.2f} in W1"])
        lines.append([f"... the device goes on behind it, {name}",
                      *(shown(results.number(scene, MILLION, "rows-update-" + variant, "behind_ms"))
                        for scene in scenes), ""])
        lines.append([f"... every update searched, {name}",
                      *(shown(results.number(scene, MILLION, "rows-update-searched-" + variant, "end_to_end_ms"))
                        for scene in scenes), ""])
        lines.append([f"... grid on one thread, {name}",
                      *(shown(results.number(scene, MILLION, "grid-update-" + variant, "end_to_end_ms"))
                        for scene in scenes), ""])
    return table(["W1", "W2", "W3", "all at one x", "goal"], lines)


def changes(results):
    """Pairs and their changes, in device memory."""
    lines = [[label, *(shown(results.number(scene, bodies, variant)) for _, scene, bodies, _ in WITH_FLAT)]
             for label, variant in CHANGES]
    goals_of = {name: goal for name, _, _, goal in DELTA_CASES}
    lines.append(["goal", *(f"{goals_of[name]:g}" if name in goals_of else "" for name, *_ in WITH_FLAT)])
    return table([name for name, *_ in WITH_FLAT], lines)


def floors(results):
    """Stages of update() beside what their bytes take to copy: us, MB, us for those, times."""
    lines = []
    cases = [(f"{stage}, {name}", f"rows-update-{searched}{variant}/{stage}")
             for name, variant, _ in UPDATES for stage, searched in STAGES]
    for label, variant in [*cases, ("pairs alone, boxes in and pairs out", "rows")]:
        cells = []
        for scene in ("W1", "W2", "W3"):
            ms, moved, floor = (results.number(scene, MILLION, variant, column)
                                for column in ("gpu_ms", "bytes_moved", "floor_ms"))
            cells.append(f"{ms * 1e3:.0f} / {moved / 1e6:.3g} MB / {floor * 1e3:.0f} = {ms / floor:.1f}"
                         if ms and floor else "")
        lines.append([label, *cells])
    return table(["W1", "W2", "W3"], lines)


def extremes(results):
    """Where sweep and prune is weak: ms, and times as long as in the uniform scene."""
    variants_of = [("as chosen", "rows"), ("swept along x", "rows-x"), ("along y", "rows-y"), ("along z", "rows-z"),
                   ("thesis's steps", "literal"), ("along x", "literal-x"), ("along y", "literal-y"),
                   ("along z", "literal-z")]
    lines = []
    for scene, label in EXTREMES:
        cells = []
        for _, variant in variants_of:
            ms, ratio = (results.number(scene, MILLION, variant, column) for column in ("gpu_ms", "over_uniform"))
            cells.append(f"{shown(ms)} ({ratio:.2f})" if ms and ratio else "")
        lines.append([label, *cells])
    return table([label for label, _ in variants_of], lines)


def orders(results):
    """Whether the order that is chosen is the best."""
    measured = {}
    for row in results.orders:
        if row["scene"] != "copy":
            measured.setdefault((row["scene"], int(row["bodies"])), {})[row["variant"]] = float(row["gpu_ms"])
    names = ["rows-bins", "rows-alone", "rows-grouped", "rows-tiles"]
    lines = []
    for (scene, bodies), times in measured.items():
        best = min(names, key=lambda name: times.get(name, float("inf")))
        cells = [f"**{shown(times[name])}**" if name == best else shown(times.get(name)) for name in names]
        size = "1M" if bodies == MILLION else f"{bodies >> 10}k"
        lines.append([f"{scene} {size}", *cells, shown(times["rows"]), f"{times['rows'] / times[best]:.2f}"])
    return table(["bins", "counting, alone", "counting, grouped", "tiles", "as chosen", "over the best"], lines)


TABLES = {"goals": goals, "variants": variants, "spread": spread, "changes": changes, "updates": updates, "floors": floors,
          "extremes": extremes, "orders": orders}


def put_into(path, tables):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    for name, lines in tables.items():
        if lines:
            text = re.sub(rf"(<!-- table {name} -->\n).*?(<!-- end -->)",
                          lambda found, lines=lines: f"{found[1]}\n{lines}\n{found[2]}", text, flags=re.DOTALL)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def main():
    if len(sys.argv) < 2 or (len(sys.argv) > 2 and sys.argv[2] != "--into"):
        sys.exit(__doc__.strip())
    results = Results(sys.argv[1])
    tables = {name: make(results) for name, make in TABLES.items()}
    if len(sys.argv) == 2:
        for name, lines in tables.items():
            print(f"{name}:\n{lines}")
    for path in sys.argv[3:]:
        put_into(path, tables)


if __name__ == "__main__":
    main()
