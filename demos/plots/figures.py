# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""What `cullet figure` measures, drawn; one function per figure, each from the rows of its CSV file to a matplotlib figure."""
import csv
import os

import matplotlib.pyplot as plt
import numpy as np

COMMITTED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "results", "nvidia-h200")


def time_of(row):
    """ms: CPU time of one thread, which is the steadier number on a shared machine, else wall time."""
    if row["threads"] == "1" and not row["backend"].startswith("cuda") and row.get("cpu_median_ms"):
        return float(row["cpu_median_ms"])
    return float(row["median_ms"])


def points(rows, x="bodies", y=time_of):
    """Sorted x and y of rows; y is a column or a function of a row."""
    value = y if callable(y) else lambda row: float(row[y])
    pairs = sorted((float(row[x]), value(row)) for row in rows)
    return [pair[0] for pair in pairs], [pair[1] for pair in pairs]


def chosen(rows, **columns):
    return [row for row in rows if all(row[name] == value for name, value in columns.items())]


def human(number):
    for limit, suffix in ((1e6, "M"), (1e3, "k")):
        if number >= limit:
            return f"{number / limit:.3g}{suffix}"
    return f"{number:.0f}"


def cubic_axis(axis, largest):
    """The thesis's x axis: proportional to the cube root of the number of bodies."""
    axis.set_xscale("function", functions=(np.cbrt, lambda x: x ** 3))
    ticks = [(i * np.cbrt(largest) / 6) ** 3 for i in range(1, 7)]
    axis.set_xlim(0, largest * 1.05)
    axis.set_xticks(ticks, [human(float(f"{tick:.2g}")) for tick in ticks])
    axis.set_xlabel("bodies (cubic axis)")
    axis.grid(True, alpha=0.3)


def machine(rows):
    cpu = rows[0]["cpu"].replace("(R)", "")
    return cpu + (", " + rows[0]["gpu"] if rows[0]["gpu"] else "")


FIGURE_10 = (("psap-thesis", "s--", "thesis: N/64000 cells"), ("psap-cells", "^--", "thesis: cells of edge 3"),
             ("psap-literal", "v-", "thesis's steps, our cells"), ("psap", "D-", "our rows, swept"),
             ("grid", "o-", "cullet's grid"), ("cuda-thesis", "s:", "GPU: N/64000 cells"),
             ("cuda-cells", "^:", "GPU: cells of edge 3"), ("cuda-literal", "v:", "GPU: thesis's steps, our cells"),
             ("cuda", "D:", "GPU: cullet"))


def figure10(rows):
    figure, axes = plt.subplots(1, 2, figsize=(12.5, 4.6))
    thesis = [float(row["bodies"]) for row in rows if row["backend"] == "psap-thesis" and float(row["bodies"]) <= 64000]
    for axis, largest in zip(axes, (max(thesis), max(float(row["bodies"]) for row in rows))):
        for backend, style, label in FIGURE_10:
            some = [row for row in rows if row["backend"].split(":")[0] == backend and float(row["bodies"]) <= largest]
            if some:
                axis.plot(*points(some), style, label=label, markersize=4)
        cubic_axis(axis, largest)
    axes[0].set_title("the thesis's range, linear")
    axes[0].set_ylabel("ms per frame, all pairs")
    axes[1].set_yscale("log")
    axes[1].set_title("today's range, logarithmic")
    axes[1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure, "Figure 10: time against bodies"


def figure11(rows):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.4), sharey=True)
    names = {"linear": "linear search", "climb": "hill climbing", "climb-artificial": "with artificial neighbours",
             "cubemap": "cube map and climb", "automatic": "automatic"}
    for axis, regime in zip(axes, ("separated", "overlapping")):
        for support, label in names.items():
            some = [row for row in chosen(rows, regime=regime, support=support) if row["scene"] != "regular"]
            axis.loglog(*points(some, "triangles", "ns_per_query"), "o-", label=label, markersize=4)
        axis.set_title({"separated": "not intersecting", "overlapping": "intersecting"}[regime])
        axis.set_xlabel("triangles")
        axis.grid(True, alpha=0.3)
    axes[0].set_ylabel("ns per query of a pair")
    axes[0].legend(fontsize=8)
    return figure, "Figure 11: ISA-GJK, cold"


def figure12(rows):
    figure, axis = plt.subplots(figsize=(7, 4.4))
    for scene, label in (("W1", "space grows with the bodies"), ("room", "in one room (64,000 as in the other)")):
        some = chosen(rows, scene=scene, backend="grid")
        if not some:
            continue
        found, = axis.plot(*points(some, "bodies", "pairs"), "o", label=label, markersize=5)
        axis.plot(*points(some, "bodies", "expected_pairs"), "-", color=found.get_color(), label="expected")
    checked = chosen(rows, backend="brute")
    axis.plot(*points(checked, "bodies", "pairs"), "kx", label="brute force", markersize=9)
    axis.set_yscale("log")
    cubic_axis(axis, max(float(row["bodies"]) for row in rows))
    axis.set_ylabel("overlapping pairs of boxes")
    axis.legend(fontsize=8)
    return figure, "Figure 12: pairs against bodies"


def figure13(rows):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.4), sharey=True)
    names = {"thesis": "as in the thesis", "cullet": "cullet", "cuda": "cullet, broad phase on GPU"}
    for axis, phase in zip(axes, ("broad", "narrow")):
        for system, label in names.items():
            some = chosen(rows, benchmark="figure13." + phase, system=system)
            if some:
                axis.plot(*points(some), "o--" if system == "thesis" else "o-", label=label, markersize=4)
        whole = chosen(rows, benchmark="figure13.whole", system="device")
        if whole:
            axis.plot(*points(whole), "o-", color="black", label="both phases on GPU", markersize=4)
        axis.set_yscale("log")
        cubic_axis(axis, max(float(row["bodies"]) for row in rows))
        axis.set_title({"broad": "broad phase", "narrow": "narrow phase (ISA-GJK)"}[phase])
    axes[0].set_ylabel("ms per frame, one CPU thread")
    axes[0].legend(fontsize=8)
    return figure, "Figure 13: the whole system, spheres of 80 triangles"


def cell_size(rows):
    figure, axes = plt.subplots(1, 3, figsize=(14, 4.4), width_ratios=(5, 4, 3))
    equal = chosen(rows, scene="W1")
    bodies = max(equal, key=lambda row: int(row["bodies"]))["bodies"]
    against_width(axes[0], chosen(equal, bodies=bodies),
                  (("psap-cells", "C0", "thesis's steps, cells as wide as this"),
                   ("grid-rows", "C1", "cullet's grid, rows as wide as this"),
                   ("uniform", "C2", "uniform grid, cells as wide as this")),
                  (("psap-thesis", "k", "the thesis's rule, N/64000 cells"), ("psap-literal", "C0", "thesis's steps, automatic"),
                   ("grid", "C1", "cullet's grid, automatic")))
    axes[0].set_title(f"{human(float(bodies))} equal spheres", fontsize=10)
    many_sizes = chosen(rows, scene="W2")
    against_width(axes[1], many_sizes, (("uniform", "C2", "uniform grid"),),
                  (("legrand", "C3", "Le Grand's, cells as large as the largest"),
                   ("grid-cells", "C4", "hierarchical cells"), ("grid", "C1", "cullet's grid, automatic")))
    axes[1].set_title(f"{human(float(many_sizes[0]['bodies']))} boxes, sizes over three decades", fontsize=10)
    uneven_cells(axes[2], chosen(rows, backend="legrand", bodies=many_sizes[0]["bodies"]))
    return figure, "Cell size"


def against_width(axis, rows, swept, fixed):
    """Time against the width of a cell; dotted where the backend chooses."""
    for name, colour, label in swept:
        some = [row for row in rows if row["backend"].startswith(name + ":")]
        axis.loglog(*points(some, "cell_edge"), "o-", color=colour, label=label, markersize=4)
    for backend, colour, label in fixed:
        axis.axhline(time_of(chosen(rows, backend=backend)[0]), color=colour, linestyle=":", label=label)
    axis.set_xlabel("width of a cell in sides of a (mean) box")
    axis.set_ylabel("ms per frame")
    widths = [width for width in (0.5, 1, 2, 4, 8, 20) if min(axis.dataLim.x0, 1) <= width <= axis.dataLim.x1]
    axis.set_xticks(widths, [f"{width:g}" for width in widths])
    axis.minorticks_off()
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=7)


def uneven_cells(axis, rows):
    """Le Grand gives each cell to one thread: all wait for the one with the fullest."""
    names = {"W1": "equal, uniform", "pile": "equal, a heap", "W2": "many sizes"}
    rows = [row for scene in names for row in chosen(rows, scene=scene)]
    shares = [float(row["most_tests"]) * float(row["bodies"]) / float(row["tests"]) for row in rows]
    axis.bar([names[row["scene"]] for row in rows], shares, color="C3")
    axis.set_yscale("log")
    axis.set_ylim(bottom=1)
    axis.set_ylabel("tests in the fullest cell / tests of a body")
    axis.set_title("Le Grand's cells", fontsize=10)
    axis.tick_params(axis="x", labelsize=8)
    axis.grid(True, axis="y", alpha=0.3)


def scaling(rows):
    figure, axis = plt.subplots(figsize=(7, 4.8))
    names = {("dbvt", "bullet"): ("s--", "DBVT"), ("dbvt-deferred", "bullet"): ("^--", "DBVT, deferred"),
             ("grid", "bullet"): ("o-", "cullet's grid through Bullet"), ("grid", "backend"): ("o:", "the grid alone"),
             ("cuda", "backend"): ("D:", "CUDA, from and to CPU memory")}
    for (backend, through), (style, label) in names.items():
        some = chosen(rows, backend=backend, through=through)
        if not some:
            continue
        if some[0]["exponent"] not in ("", "null"):
            label += f", N^{float(some[0]['exponent']):.2f}"
        axis.loglog(*points(some), style, label=label, markersize=4)
    axis.set_xlabel("bodies")
    axis.set_ylabel("ms per frame, all move")
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=8)
    return figure, "Scaling and fitted exponents (W1)"


PHASES = ("updateAabbs", "calculateOverlappingPairs", "dispatch", "islands", "solver", "integrate", "rest")


def phases(rows):
    figure, axes = plt.subplots(2, 2, figsize=(11, 5.6))
    worlds = (("dbvt", "bullet"), ("grid", "bullet"), ("dbvt", "dispatcher"), ("grid", "dispatcher"))
    for axis, (scene, window) in zip(axes.flat, ((s, w) for s in ("boxes", "hulls") for w in ("falling", "settled"))):
        for place, (backend, narrow) in enumerate(worlds):
            some = chosen(rows, scene=scene, backend=backend, narrow=narrow)
            left = 0.0
            for colour, phase in enumerate(PHASES):
                hit = chosen(some, benchmark=f"world.{phase}.{window}")
                width = float(hit[0]["min_ms"]) if hit else 0.0
                axis.barh(3 - place, width, left=left, color=f"C{colour}", label=phase if place == 0 else None)
                left += width
        axis.set_yticks(range(4), ["cullet, both", "DBVT + cullet's narrow", "cullet's broad + Bullet's", "Bullet as shipped"])
        axis.set_title(f"{scene}, {window}")
        axis.grid(True, axis="x", alpha=0.3)
    figure.legend(*axes[0][0].get_legend_handles_labels(), loc="lower center", ncol=7, fontsize=8)
    for axis in axes[1]:
        axis.set_xlabel("ms, the least of the steps")
    bodies = human(float(rows[0]["bodies"])) if rows else ""
    return figure, f"Phases of Bullet's step, {bodies} bodies, one thread"


def committed_crossover():
    """Rows of the committed run on an H200."""
    with open(os.path.join(COMMITTED, "figures", "crossover.csv"), newline="") as file:
        return list(csv.DictReader(file))


def crossover(rows):
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharey=True)
    own_gpu = any(row["backend"] == "cuda" for row in rows)
    groups = [(rows, "here" if not own_gpu else rows[0]["gpu"], "-")]
    if not own_gpu:
        groups.append((committed_crossover(), "host of an H200, committed data", "--"))
    for axis, scene in zip(axes, ("W1", "W3fresh")):
        for data, where, line in groups:
            for backend, label in (("grid", "grid"), ("cuda", "CUDA")):
                some = chosen(data, scene=scene, backend=backend)
                if some:
                    axis.loglog(*points(some), "o" + line, label=f"{label}, {where}", markersize=4)
        axis.set_title({"W1": "all move", "W3fresh": "a fresh tenth moves"}[scene])
        axis.set_xlabel("bodies")
        axis.grid(True, alpha=0.3)
    axes[0].set_ylabel("ms per update, boxes and changes in CPU memory")
    axes[0].legend(fontsize=8)
    note = "" if own_gpu else ": no GPU answers here, CUDA from committed data"
    return figure, "Where a GPU begins to pay" + note


def threads(rows):
    figure, axis = plt.subplots(figsize=(6.4, 4.2))
    for scene in ("W1", "W2", "W5"):
        for bodies, style in zip(sorted({row["bodies"] for row in rows}, key=int), ("o--", "o-")):
            counts, times = points(chosen(rows, scene=scene, bodies=bodies), "threads", "min_ms")
            if times:
                axis.plot(counts, [times[0] / time for time in times], style, label=f"{scene}, {human(float(bodies))}")
    counts = sorted({int(row["threads"]) for row in rows})
    axis.set_xscale("log", base=2)
    axis.set_xticks(counts, [str(count) for count in counts])
    axis.set_xlabel("threads")
    axis.set_ylabel("times as fast as one thread (least wall time)")
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=8)
    return figure, "Threads, cullet's grid"


LEAVES = (("triangles", "C0", "triangles, eight at once"), ("triangles-1", "C0", "triangles, one at a time"),
          ("faces", "C0", "faces near the triangle, eight at once"), ("triangle-distance", "C2", "distance of two triangles"),
          ("isa-gjk", "C1", "ISA-GJK"), ("isa-gjk-warm", "C1", "ISA-GJK, warm"), ("gjk", "C2", "GJK, distance"),
          ("gjk-warm", "C2", "GJK, distance, warm"), ("bullet", "C3", "Bullet's GJK, distance"))
MIDPHASE = {"hills": "hulls over hills", "bumps": "a ball through a ball", "cloth": "hulls under a cloth"}


def midphase_sizes(axis, rows):
    for name in dict.fromkeys(row["backend"] for row in rows):
        some = sorted((float(row["bodies"]), float(row["median_ms"])) for row in chosen(rows, backend=name))
        axis.plot(*zip(*some), marker="o", markersize=3, label=name)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_title("Two sheets that deform", fontsize=10)
    axis.set_xlabel("triangles")
    axis.set_ylabel("ms from vertices to pairs")
    axis.legend(fontsize=8)
    axis.grid(True, alpha=0.3)


def midphase(rows):
    sizes = chosen(rows, benchmark="midphase.size")
    figure, axes = plt.subplots(1, 4 if sizes else 3, figsize=(18 if sizes else 14, 4.4))
    if sizes:
        midphase_sizes(axes[3], sizes)
    for axis, (scene, title) in zip(axes, MIDPHASE.items()):
        some = {row["backend"]: row for row in chosen(rows, benchmark="midphase.leaf", scene=scene)}
        drawn = [leaf for leaf in reversed(LEAVES) if leaf[0] in some]
        times = [float(some[name]["ns_per_pair"]) for name, _, _ in drawn]
        bars = axis.barh([label for _, _, label in drawn], times, color=[colour for _, colour, _ in drawn])
        axis.bar_label(bars, [f"{time:.0f}" for time in times], fontsize=8, padding=2)
        axis.set_xscale("log")
        axis.set_xlim(10, 2e4)
        crossing = 100 * float(some["gjk"]["crossing_share"])
        axis.set_title(f"{title}: {crossing:.0f} % cross", fontsize=10)
        axis.set_xlabel("ns for a pair of the tree")
        axis.tick_params(axis="y", labelsize=8)
        axis.grid(True, axis="x", alpha=0.3)
    return figure, "Tests at the leaves of a mesh's tree, one thread"


DRAWN = {"figure10": figure10, "figure11": figure11, "figure12": figure12, "figure13": figure13, "cell-size": cell_size,
         "scaling": scaling, "phases": phases, "crossover": crossover, "threads": threads,
         "midphase": midphase}


def draw(name, rows):
    """The figure of that name, with its title and the machine; an interrupted run has rows without a frame."""
    rows = [row for row in rows if row.get("frames") != "0"]
    figure, title = DRAWN[name](rows)
    figure.suptitle(f"{title}\n{machine(rows)}", fontsize=10)
    figure.tight_layout(rect=(0, 0.05, 1, 1) if name == "phases" else None)
    return figure
