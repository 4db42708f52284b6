# SPDX-FileCopyrightText: the cullet authors
# SPDX-License-Identifier: Zlib
"""The report of a run, in Markdown."""

from collections import Counter, defaultdict

OUTCOMES = ("killed", "timeout", "survived", "unreached")


def score(counts):
    total = sum(counts.values())
    return f"{100 * (counts['killed'] + counts['timeout']) / total:.0f} %" if total else "-"


def table(title, results, key_of):
    counts = defaultdict(Counter)
    for mutant, result in results:
        counts[key_of(mutant)][result.outcome] += 1
        counts["all"][result.outcome] += 1
    lines = [f"| {title} | mutants | killed | by time limit | survived | not reached | score |", "|-|-|-|-|-|-|-|"]
    for key in sorted(counts, key=lambda key: (key == "all", key)):
        row = counts[key]
        cells = [sum(row.values()), *(row[outcome] for outcome in OUTCOMES), score(row)]
        lines.append(f"| {key} | " + " | ".join(map(str, cells)) + " |")
    return lines


def diff(mutant, source):
    """The lines that change, and what they change to."""
    begin = source.rfind("\n", 0, mutant.begin) + 1
    end = source.find("\n", mutant.end)
    end = len(source) if end < 0 else end
    old = source[begin:end].split("\n")
    new = (source[begin:mutant.begin] + mutant.shown + source[mutant.end:end]).split("\n")
    return ["```diff", *("-" + line for line in old), *("+" + line for line in new), "```"]


def section(number, mutant, result, root):
    lines = [f"### {number} {mutant.file}:{mutant.line} ({mutant.kind})", ""]
    if result.reaching:
        lines += [f"Reached by {', '.join(result.reaching)}; {result.ran} tests ran, {result.seconds} s.", ""]
    lines += diff(mutant, (root / mutant.file).read_text())
    return lines + ["", f"`{mutant.key}`", ""]


def report(settings, mutants, results, notes, root):
    """`results`: {id: Result} of those that have run."""
    paired = [(mutants[number], results[number]) for number in sorted(results)]
    lines = ["# Mutation testing", "", f"`{settings}`", "", *notes, ""]
    if len(results) < len(mutants):
        lines += [f"**{len(results)} of {len(mutants)} mutants have run: run the command again to go on.**", ""]
    for title, key_of in (("folder", lambda mutant: mutant.file.split("/")[0]), ("kind", lambda mutant: mutant.kind)):
        lines += [*table(title, paired, key_of), ""]
    for title, outcome in (("Survivors", "survived"), ("Not reached", "unreached")):
        numbers = [number for number in sorted(results) if results[number].outcome == outcome]
        lines += [f"## {title}: {len(numbers)}", ""]
        for number in numbers:
            lines += section(number, mutants[number], results[number], root)
    lines += ["## Killed", ""]
    lines += [f"- {number} {mutants[number].file}:{mutants[number].line} `{mutants[number].original[:80]}` -> "
              f"`{mutants[number].mutated[:80]}`: {result.test}" + (" (time limit)" if result.outcome == "timeout" else "")
              for number, result in sorted(results.items()) if result.test]
    return "\n".join(lines) + "\n"
