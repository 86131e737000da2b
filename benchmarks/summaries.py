#!/usr/bin/env python3
"""Writes the summary tables of docs/*.md from the files in docs/data.

    python3 benchmarks/summaries.py [--check] [accuracy stability memory skips mutants verification]

Replaces the text between two marks of each page. With --check, nothing is written, and the program fails if a page
is not current.
"""

import csv
import sys
from pathlib import Path
from statistics import median

DOCS = Path(__file__).resolve().parent.parent / "docs"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"


def stored(name):
    """Date and rows of a file in docs/data. Comment lines start with #."""
    lines = (DOCS / "data" / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    comments = [line for line in lines if line.startswith("# ")]
    dates = [line.removeprefix("# date: ") for line in comments if line.startswith("# date: ")]
    return (dates or [""])[0], list(csv.DictReader(line for line in lines if not line.startswith("# ")))


def grouped(rows, key):
    """Groups rows by the value of a column. The groups have the order of their first appearance."""
    groups = {}
    for row in rows:
        groups.setdefault(row[key], []).append(row)
    return groups


def table(titles, rows):
    lines = [titles, ["---"] * len(titles), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def accuracy():
    date, rows = stored("accuracy")
    reached = [row for row in rows if row["status"] == "reached"]
    share = lambda row: float(row["true_error"]) / float(row["requested"])
    numbers = lambda rows: [f"{max(map(share, rows)):.2f}", f"{median(map(share, rows)):.2f}"]
    by_request = [[requested, len(group), *numbers(group), sum(row["above_requested"] == "true" for row in group), sum(share(row) < 0.1 for row in group)]
                  for requested, group in grouped(reached, "requested").items()]
    by_source = [[source, len(group), *numbers(group)] for source, group in sorted(grouped(reached, "source").items())]
    return (f"Measured on {date}: {len(rows)} runs, of which {len(reached)} reach the requested accuracy.\n\n"
            + table(["requested", "runs", "largest", "median", "above 1", "below 0.1"], by_request) + "\n\n"
            + table(["known answer", "runs", "largest", "median"], by_source))


def stability():
    date, rows = stored("stability")
    lines = []
    for group, runs in [*grouped(rows, "group").items(), ("all", rows)]:
        ends = [sum(row["end"].startswith(end) for row in runs) for end in ("certified", "not converged", "refused")]
        certified = [row for row in runs if row["end"] == "certified"]
        residuals = sorted((row["residual"] for row in certified), key=float)
        iterations = [int(n) for row in certified for n in row["iterations"].split(", ")]
        lines.append([group, *ends, residuals[-1], max(iterations)])
    titles = ["sweep", "certified", "not converged", "refused", "largest residual", "most iterations"]
    return f"Measured on {date}: {len(rows)} runs.\n\n" + table(titles, lines)


def memory():
    date, rows = stored("memory")
    rows = [row for row in rows if row["ratio"] != "failed"]
    lines = []
    for group, runs in [*grouped(rows, "group").items(), ("all", rows)]:
        ratios = sorted((row["ratio"] for row in runs), key=float)
        outside = sum(not 0.8 <= float(ratio) <= 1.2 for ratio in ratios)
        lines.append([group, len(runs), ratios[0], f"{median(map(float, ratios)):.2f}", ratios[-1], outside])
    return f"Measured on {date}.\n\n" + table(["scenes", "runs", "smallest", "median", "largest", "outside 0.8 to 1.2"], lines)


def skips():
    date, rows = stored("skips")
    lines = []
    for omitted, runs in sorted(grouped(rows, "omitted").items(), key=lambda group: (group[0] == "all of these", group[0])):
        factors = sorted((row["run_factor"] for row in runs), key=float)
        name = omitted if omitted == "all of these" else f"`{omitted}`"
        contact = f"{median(float(row['contact_factor']) for row in runs):.2f}"
        lines.append([name, len(runs), factors[0], f"{median(map(float, factors)):.2f}", factors[-1], contact,
                      max((row["difference"] for row in runs), key=float)])
    titles = ["omitted", "scenes", "smallest", "median", "largest", "median, contact only", "largest difference"]
    return f"Measured on {date}.\n\n" + table(titles, lines)


def mutants():
    date, rows = stored("mutants")
    lines = [[row["mistake"], row["tests_failed"], row["tests_run"]] for row in rows]
    return f"Measured on {date}.\n\n" + table(["mistake", "tests failed", "tests run"], lines)


def verification():
    _, rows = stored("verification")
    parts = [f"### {area}\n\n" + table(["case", "source", "tests"], [[row["case"], row["source"], row["tests"]] for row in cases])
             for area, cases in grouped(rows, "area").items()]
    return "\n\n".join(parts)


PAGES = {function.__name__: function for function in (accuracy, stability, memory, skips, mutants, verification)}


def write(name, check=False):
    """Writes a page if it changes. Returns whether the page was current."""
    page = DOCS / f"{name}.md"
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    wanted = f"{before}{BEGIN}\n\n{PAGES[name]()}\n\n{END}{rest.split(END)[1]}"
    if text != wanted and not check:
        page.write_text(wanted, encoding="utf-8")
    return text == wanted


def main():
    names = [word for word in sys.argv[1:] if word != "--check"]
    if unknown := [name for name in names if name not in PAGES]:
        sys.exit(f"unknown: {', '.join(unknown)}; allowed: --check, {', '.join(PAGES)}")
    check = "--check" in sys.argv[1:]
    old = [name for name in names or PAGES if not write(name, check) and check]
    if old:
        sys.exit("not current: " + ", ".join(f"docs/{name}.md" for name in old) + "; run `python3 benchmarks/summaries.py`")


if __name__ == "__main__":
    main()
