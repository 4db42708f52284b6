#!/usr/bin/env python3
# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""Draws figures from measured data (needs python3-matplotlib).

usage: plot.py --figures FOLDER [NAME...] [--to OUT_FOLDER]
           what `cullet figure` has measured: NAME.svg and NAME.png for every NAME.csv in FOLDER
       plot.py RESULTS_FOLDER OUT_FOLDER
           the figures of other measurements, those whose data are in the folder: scaling, threads, settling, device,
           rivals, steps; e.g. plot.py demos/results/nvidia-h200 docs/figures
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
matplotlib.rcParams["svg.hashsalt"] = "cullet"  # reproducible bytes in every run
import matplotlib.pyplot as plt

import figures


def read(folder, pattern):
    """Rows of all CSV files of that name pattern."""
    names = sorted(glob.glob(os.path.join(folder, pattern + ".csv")))
    rows = []
    for name in names:
        with open(name, newline="") as file:
            rows += [{**row, "file": os.path.basename(name)} for row in csv.DictReader(file)]
    return rows


def save(figure, folder, name):
    figure.tight_layout()
    figure.savefig(os.path.join(folder, name + ".svg"), metadata={"Date": None})
    plt.close(figure)


def series(rows, x, y="median_ms"):
    points = sorted((float(row[x]), float(row[y])) for row in rows)
    return [point[0] for point in points], [point[1] for point in points]


def draw_scaling(rows, target):
    """Time of a frame through Bullet against the number of bodies, cullet's grid and DBVT."""
    rows = [row for row in rows if row["ids"] == "random"]
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


def draw_threads(rows, target):
    """Speed-up of the grid by threads."""
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


def draw_settling(rows, target):
    """Sweep and prune on a heap that settles: swaps per frame on each axis."""
    rows = [row for row in rows
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


def draw_device(rows, target):
    """The complete pair set on a GPU, boxes and pairs in its memory: the thesis's cells, ours, and rows."""
    figure, axis = plt.subplots(figsize=(7, 4.6))
    names = {"literal-thesis-cells": ("s--", "thesis's steps, N/64000 cells"),
             "literal": ("v-", "thesis's steps, our cells"), "rows": ("D-", "cullet, boxes and pairs on the device"),
             "rows-update-all-move": ("o:", "cullet, boxes and changes in CPU memory")}
    for variant, (style, label) in names.items():
        chosen = [row for row in rows if row["scene"] == "W1" and row["variant"] == variant]
        column = "end_to_end_ms" if "update" in variant else "gpu_ms"
        axis.plot(*series(chosen, "bodies", column), style, label=label, markersize=5)
    figures.cubic_axis(axis, max(float(row["bodies"]) for row in rows))
    axis.set_yscale("log")
    axis.set_ylabel("ms per frame")
    axis.legend(fontsize=8)
    figure.suptitle(f"W1 on an {rows[0]['gpu']}", fontsize=10)
    save(figure, target, "device")


BULLETS_OWN = ("dbvt", "dbvt-deferred", "axissweep")


def ratios_to_grid(rows):
    """Of each row but the grid's: scene, bodies, backend, time over that of the grid in the same run, wrong pairs or not.

    Bullet's own broad phases have proxies and a pair cache; so has the grid that they are compared with, "auto"."""
    grid = {}
    for row in rows:
        case = (row["scene"], row["bodies"])
        if row["backend"] in ("grid", "auto"):  # the first two backends of each case
            grid[(*case, row["backend"] == "auto")] = figures.time_of(row)
        if row["backend"] != "grid":
            of = grid[(*case, row["backend"] in BULLETS_OWN)]
            yield (*case, row["backend"], figures.time_of(row) / of, row.get("wrong_checks", "0") not in ("", "0"))


def label_of(backend):
    if backend == "auto":
        return "grid through Bullet"
    return f"{backend} / grid through Bullet" if backend in BULLETS_OWN else backend


def draw_rivals(rows, target):
    """How many times longer than cullet's grid other broad phases take on the same boxes in the same run; Bullet's own than
    the grid through Bullet."""
    figure, axes = plt.subplots(1, 5, figsize=(13, 4.8), sharex=True, sharey=True)
    ratios = list(ratios_to_grid([row for row in rows if row["benchmark"] == "broad.update"]))
    names = list(dict.fromkeys(backend for _, _, backend, _, _ in ratios))[::-1]
    for axis, scene in zip(axes, ("W1", "W2", "W3", "W4", "W5")):
        for bodies, marker in (("4000", "o"), ("16000", "s"), ("64000", "D")):
            for wrong in (False, True):
                some = [(ratio, names.index(backend)) for place, count, backend, ratio, is_wrong in ratios
                        if (place, count, is_wrong) == (scene, bodies, wrong)]
                axis.plot([x for x, _ in some], [y for _, y in some], "x" if wrong else marker, markersize=5,
                          color="red" if wrong else None, label=None if wrong else figures.human(float(bodies)))
        axis.axvline(1.0, color="k", linewidth=0.8)
        axis.set_xscale("log")
        axis.set_title(scene)
        axis.set_yticks(range(len(names)), [label_of(name) for name in names])
        axis.grid(True, alpha=0.3)
    axes[0].legend(fontsize=8, title="bodies")
    figure.supxlabel("times as long as cullet's grid, one thread (left of 1: faster; red cross: wrong pairs)", fontsize=9)
    save(figure, target, "rivals")


STEPS = (("stock", "stock Bullet"), ("broadphase", "+ Broadphase"), ("broadphase+dispatcher", "+ Dispatcher"),
         ("all", "+ World"))


def bars_of_steps(rows):
    """Label and rows of each bar of a scene: more and more of cullet on one thread, and all of it on all threads. Stock
    Bullet was measured once more in the runs of several threads."""
    alone = [row for row in rows if "threads" not in row["file"]]
    for parts, label in STEPS:
        yield label, figures.chosen(alone, parts=parts, threads="1")
    most = max(int(row["threads"]) for row in rows)
    if most > 1:
        yield f"{most} threads", figures.chosen(rows, parts="all", threads=str(most))


def draw_steps(rows, target):
    """Phases of Bullet's step, stock and with more and more of cullet, for each scene of whole steps once it has settled."""
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    height = (len(scenes) + 2) // 3
    figure, axes = plt.subplots(height, 3, figsize=(11, 1.9 * height + 0.9), squeeze=False)
    for axis, scene in zip(axes.flat, scenes):
        some = figures.chosen(rows, scene=scene)
        windows = {row["benchmark"].rsplit(".", 1)[1] for row in some}
        window = "settled" if "settled" in windows else "all"
        bars = list(bars_of_steps(some))
        for place, (_, bar) in enumerate(bars):
            left = 0.0
            for colour, phase in enumerate(figures.PHASES):
                hit = figures.chosen(bar, benchmark=f"world.{phase}.{window}")
                width = float(hit[0]["median_ms"]) if hit else 0.0
                axis.barh(-place, width, left=left, color=f"C{colour}", label=phase if place == 0 else None)
                left += width
        axis.set_yticks([-place for place in range(len(bars))], [label for label, _ in bars], fontsize=8)
        axis.set_title(f"{scene}, {int(some[0]['bodies']):,} bodies", fontsize=9)
        axis.tick_params(axis="x", labelsize=8)
        axis.grid(True, axis="x", alpha=0.3)
    for axis in axes.flat[len(scenes):]:
        axis.axis("off")
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="lower center", ncol=len(figures.PHASES), fontsize=8)
    figure.suptitle("ms of a step by phase, medians; one thread unless it says more\n" + rows[0]["machine"], fontsize=9)
    figure.tight_layout(rect=(0, 0.5 / (1.9 * height + 0.9), 1, 1))
    figure.savefig(os.path.join(target, "steps.svg"), metadata={"Date": None})
    plt.close(figure)


def draw_results(source, target):
    """Every figure whose data are in the folder of a machine."""
    drawn = (("broad_bullet*", draw_scaling), ("broad_threads_*", draw_threads), ("sap_settling", draw_settling),
             ("cuda", draw_device), ("rivals*", draw_rivals), ("world_steps*", draw_steps))
    os.makedirs(target, exist_ok=True)
    for pattern, draw in drawn:
        rows = read(source, pattern)
        if rows:
            draw(rows, target)
        else:
            print(f"plot.py: no {pattern}.csv in {source}", file=sys.stderr)


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
        if all(row.get("frames") == "0" for row in rows):
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
    draw_results(*sys.argv[1:])


if __name__ == "__main__":
    main()
