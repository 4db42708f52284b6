#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Draws figures from measured data (needs python3-matplotlib).

usage: plot.py --figures FOLDER [NAME...] [--to OUT_FOLDER]
           what `cullet figure` has measured: NAME.svg and NAME.png for every NAME.csv in FOLDER
       plot.py RESULTS_FOLDER OUT_FOLDER
           scaling, threads and settling of docs/figures, e.g. plot.py demos/results/nvidia-h200 docs/figures
"""
import csv
import glob
import os
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("plot.py: no matplotlib for this Python (Debian: apt install python3-matplotlib, then /usr/bin/python3)")

matplotlib.use("Agg")
matplotlib.rcParams["svg.hashsalt"] = "cullet"  # the same bytes in every run
import matplotlib.pyplot as plt

import figures


def read(folder, pattern):
    """Rows of all CSV files of that name pattern; an error when there is none."""
    names = sorted(glob.glob(os.path.join(folder, pattern + ".csv")))
    if not names:
        sys.exit(f"plot.py: no {pattern}.csv in {folder}")
    rows = []
    for name in names:
        with open(name, newline="") as file:
            rows += list(csv.DictReader(file))
    return rows


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(os.path.join(folder, name + ".svg"), metadata={"Date": None})
    plt.close(figure)


def series(rows, x, y="median_ms"):
    points = sorted((float(row[x]), float(row[y])) for row in rows)
    return [point[0] for point in points], [point[1] for point in points]


def draw_scaling(source, target):
    """Time of a frame through Bullet against the number of bodies, cullet's grid and DBVT."""
    rows = [row for row in read(source, "broad_bullet*") if row["ids"] == "random"]
    scenes = ["W1", "W2", "W3", "W4", "W5", "pile"]
    figure, axes = plt.subplots(2, 3, figsize=(11, 6.5), sharex=True, sharey=True)
    for scene, axis in zip(scenes, axes.flat):
        for backend, style in (("dbvt", "s--"), ("grid", "o-")):
            chosen = [row for row in rows if row["scene"] == scene and row["backend"] == backend]
            axis.loglog(*series(chosen, "bodies"), style, label={"grid": "cullet", "dbvt": "DBVT"}[backend])
        axis.set_title(scene)
        axis.grid(True, which="major", alpha=0.3)
    axes[0][0].legend()
    figure.supxlabel("bodies")
    figure.supylabel("ms per frame, through Bullet, one thread")
    save(figure, target, "scaling")


def draw_threads(source, target):
    """Speed-up of the grid by threads."""
    rows = read(source, "broad_threads_*")
    figure, axis = plt.subplots(figsize=(6, 4.2))
    for scene in ("W1", "W2", "W5"):
        for bodies, style in (("65536", "o--"), ("1000000", "o-")):
            chosen = [row for row in rows if row["scene"] == scene and row["bodies"] == bodies]
            threads, times = series(chosen, "threads")
            label = f"{scene}, {int(bodies) // 1000}k"
            axis.plot(threads, [times[0] / time for time in times], style, label=label)
    axis.set_xscale("log", base=2)
    axis.set_xticks(threads, [str(int(count)) for count in threads])
    axis.set_xlabel("threads")
    axis.set_ylabel("times as fast as one thread")
    axis.grid(True, alpha=0.3)
    axis.legend()
    save(figure, target, "threads")


def draw_settling(source, target):
    """Sweep and prune on a heap that settles: swaps per frame on each axis."""
    rows = [row for row in read(source, "sap_settling")
            if row["benchmark"] == "broad.frame" and row["backend"] == "sap"]
    figure, axis = plt.subplots(figsize=(6, 4.2))
    for name in ("x", "y", "z"):
        label = f"along {name}" + (", where it settles" if name == "y" else "")
        axis.semilogy(*series(rows, "frame", f"swaps_{name}"), label=label)
    axis.set_xlabel("frame")
    axis.set_ylabel("swaps of neighbouring limits")
    axis.grid(True, alpha=0.3)
    axis.legend()
    save(figure, target, "settling")


def draw_figures(source, target, names):
    """SVG and PNG of `cullet figure`'s CSV files; a file without rows is left out."""
    names = names or [name for name in figures.DRAWN if os.path.exists(os.path.join(source, name + ".csv"))]
    if not names:
        sys.exit(f"plot.py: no CSV file of `cullet figure` in {source}")
    os.makedirs(target, exist_ok=True)
    for name in names:
        if name not in figures.DRAWN:
            sys.exit(f"plot.py: unknown figure {name}; known: {', '.join(figures.DRAWN)}")
        rows = read(source, name)
        if not rows:
            print(f"plot.py: {name}.csv has no rows", file=sys.stderr)
            continue
        figure = figures.draw(name, rows)
        figure.savefig(os.path.join(target, name + ".svg"), metadata={"Date": None})
        figure.savefig(os.path.join(target, name + ".png"), dpi=100, metadata={"Software": None})
        plt.close(figure)


def main():
    if len(sys.argv) > 2 and sys.argv[1] == "--figures":
        source, *names = sys.argv[2:]
        target = source
        if "--to" in names[:-1]:
            place = names.index("--to")
            target = names[place + 1]
            del names[place:place + 2]
        draw_figures(source, target, names)
        return
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source, target = sys.argv[1:]
    os.makedirs(target, exist_ok=True)
    for draw in (draw_scaling, draw_threads, draw_settling):
        draw(source, target)


if __name__ == "__main__":
    main()
