#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Prints the tables of docs/results.md that hold measurements against goals.

usage: goals.py FOLDER        a folder of demos/results with goals_1.csv, goals_2.csv, goals_exact_1.csv, goals_exact_2.csv,
                              goals_16.csv; files that are missing leave a dash
"""

import csv
import os
import sys

# Label, scene, bodies, file, best rival, goals for one and two threads, ms.
GOALS = [
    ("W1, 4k", "W1", 4000, "goals", ".33", ".24", "-"),
    ("W1, 16k", "W1", 16000, "goals", "1.76", ".95", ".75"),
    ("W1, 64k", "W1", 64000, "goals", "9.8", "4.2", "2.6"),
    ("W1, 256k", "W1", 256000, "goals", "73", "19", "12"),
    ("W1, 1M", "W1", 1000000, "goals", "450", "95", "58"),
    ("W2, 64k, sizes over three decades", "W2", 64000, "goals", "19.7", "9", "5"),
    ("W3, 128k, 5 % move", "W3", 128000, "goals", "3.5", "2.5", "1.6"),
    ("W4, 32k, exact", "W4", 32000, "goals_exact", "7.8", "4.2", "-"),
    ("W4, 32k, with margin", "W4", 32000, "goals", ".73", ".3", "-"),
    ("W5, 64k, teleport", "W5", 64000, "goals", "13.7", "4.8", "3"),
]
SIZES = [16000, 64000, 256000, 1000000]


def read(folder, name):
    """Median ms of the grid by scene and bodies."""
    path = os.path.join(folder, name + ".csv")
    if not os.path.exists(path):
        return {}
    with open(path, newline="", encoding="utf-8") as file:
        return {(row["scene"], int(row["bodies"])): float(row["median_ms"]) for row in csv.DictReader(file)
                if row["backend"] == "grid" and row["ids"] == "random"}


def shown(milliseconds):
    if milliseconds is None:
        return "-"
    if milliseconds >= 10:
        return f"{milliseconds:.1f}"
    return f"{milliseconds:.2f}".lstrip("0")


def print_goals(folder):
    print("| | best rival | goal, 1 thread / 2 | measured, 1 thread / 2 |")
    print("|---|---|---|---|")
    for what, scene, bodies, file, rival, one, two in GOALS:
        measured = [read(folder, f"{file}_{threads}").get((scene, bodies)) for threads in (1, 2)]
        print(f"| {what} | {rival} | {one} / {two} | {shown(measured[0])} / {shown(measured[1])} |")
    sixteen = read(folder, "goals_16").get(("W1", 1000000))
    print(f"| W1, 1M, 16 threads | | 15 | {shown(sixteen)} |")


def print_cost_per_box(folder):
    data = read(folder, "goals_1")
    print("| ns a box | " + " | ".join(f"{size // 1000}k" for size in SIZES) + " | most / at 16k |")
    print("|---" * (len(SIZES) + 2) + "|")
    for scene in ("W1", "W2", "W3", "W4", "W5"):
        cost = [data[scene, size] * 1e6 / size for size in SIZES if (scene, size) in data]
        if len(cost) == len(SIZES):
            cells = " | ".join(f"{each:.0f}" if each >= 20 else f"{each:.1f}" for each in cost)
            print(f"| {scene} | {cells} | {max(cost) / cost[0]:.2f} |")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    print_goals(sys.argv[1])
    print()
    print_cost_per_box(sys.argv[1])


if __name__ == "__main__":
    main()
