#!/usr/bin/env python3
"""Compares requested, estimated and true errors of runs with `accuracy`, for the cases of the catalogue.

    cargo build --release --locked
    python3 benchmarks/accuracy/run.py [--asked 1e-2 3e-3 1e-3] [--program FILE] [--write] [BEGINNINGS OF NAMES ...]

Runs each case with each requested error on one thread, one run after the other, and prints a row for each run. A
row shows the result with the largest true error. With --write, the rows are written to docs/data/accuracy.csv, and
their summary to docs/accuracy.md. All runs together take some minutes.
"""

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

import cases

sys.path.insert(0, str(cases.ROOT / "benchmarks"))
import summaries  # noqa: E402

DATA = cases.ROOT / "docs/data/accuracy.csv"
TITLES = ["case", "source", "results", "requested", "estimate", "true_error", "true_error_is_bound", "above_requested", "worst_result", "seconds",
          "cells_x", "cells_y", "increments_factor", "status"]
# Time limit of a run, seconds.
LIMIT = 120


def run(program, case, asked, folder):
    """Runs a case with the requested error `asked`, and returns its results as a dict."""
    more = "".join(f", {key} = {json.dumps(names)}" for key, names in (("of", case.of), ("keep", case.keep)) if names)
    (folder / "scene.toml").write_text(f"accuracy = {{ relative = {asked}{more} }}\n{case.text}", encoding="utf-8")
    if case.prepare:
        case.prepare(folder)
    started = time.monotonic()
    row = {"case": case.name, "source": case.source, "asked": asked, "known": case.known, "of": case.of}
    try:
        done = subprocess.run([program, "run", "scene.toml", "--threads", "1"], cwd=folder, capture_output=True, text=True,
                              timeout=LIMIT, env={**os.environ, "ORTHOWEAR_CACHE_LIMIT": "0"})
    except subprocess.TimeoutExpired:
        return {**row, "code": "time", "seconds": LIMIT, "runs": 0, "results": []}
    row.update(code=done.returncode, seconds=time.monotonic() - started)
    summary = folder / "scene.out/summary.json"
    record = json.loads(summary.read_text(encoding="utf-8")).get("accuracy") if summary.exists() else None
    if record is None or not record["results"]:
        return {**row, "runs": 0, "results": [], "said": (done.stdout + done.stderr)[-2000:]}
    found = {(result["step"], result["name"]): result for result in record["results"]}
    results = []
    for step, name, truth, scale in case.truths:
        result = found[step, name]
        error = abs(result["value"] - truth) / scale
        results.append({"name": f"{step} {name}", "error": error, "estimate": result["relative"], "value": result["value"], "truth": truth})
    return {**row, "runs": len(record["runs"]), "results": results, "met": record["met"], "record": record}


def line(row):
    if not row["results"]:
        return f"{row['case']:<40} {row['asked']:>5}  code {row['code']} {row['seconds']:6.1f} s {row.get('said', '')}"
    worst = max(row["results"], key=lambda result: result["error"])
    last = row["record"]["runs"][-1]
    flag = " ABOVE" if worst["error"] > float(row["asked"]) else " low" if worst["error"] < 0.1 * float(row["asked"]) else ""
    estimate = worst["estimate"] if worst["estimate"] is not None else float("nan")
    return (f"{row['case']:<40} {row['asked']:>5} est {estimate:8.1e} err {worst['error']:8.1e} {row['seconds']:6.2f} s {row['runs']:2} runs"
            f" {last['cells']} x{last['increments']} code {row['code']} {worst['name']}{flag}")


def first_value(path, key):
    for text in Path(path).read_text(encoding="utf-8").splitlines():
        if text.startswith(key):
            return text.split(":", 1)[1].strip()
    return "unknown"


def fields(row):
    """Fields of accuracy.csv for one run."""
    what = ", ".join(row["of"]).replace("_", " ") or "all"
    begin, seconds = [row["case"], row["source"], what, row["asked"]], f"{row['seconds']:.1f}"
    if not row["results"]:
        return [*begin, "", "", "", "", "", seconds, "", "", "", "time limit" if row["code"] == "time" else f"exit code {row['code']}"]
    worst = max(row["results"], key=lambda result: result["error"])
    last = row["record"]["runs"][-1]
    error, above = max(worst["error"], row["known"]), worst["error"] > float(row["asked"])
    flags = [str(flag).lower() for flag in (worst["error"] <= row["known"], above)]
    estimate = "" if worst["estimate"] is None else f"{worst['estimate']:.1e}"
    return [*begin, estimate, f"{error:.1e}", *flags, worst["name"].replace("_", " "), seconds, *last["cells"], last["increments"],
            "reached" if row["met"] else "not reached"]


def head(rows, load):
    """Comment lines of accuracy.csv."""
    version = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=False).stdout.strip()
    memory = int(first_value("/proc/meminfo", "MemTotal").split()[0]) / (1 << 20)
    shares = [result["error"] / float(row["asked"]) for row in rows if row["results"] and row["met"] for result in row["results"]]
    return [
        f"date: {date.today()}",
        f"machine: {first_value('/proc/cpuinfo', 'model name')}, {os.cpu_count()} cores, {memory:.0f} GiB, load {load:.0f} to {os.getloadavg()[1]:.0f}; one thread",
        f"versions: {version}",
        "command: python3 benchmarks/accuracy/run.py --write",
        "Errors are relative. Each row shows the result with the largest true error.",
        f"results with a known answer: {len(shares)} in the reached runs; above the requested error: {sum(share > 1 for share in shares)}; "
        f"largest true error over requested error: {max(shares, default=0.0):.2f}",
    ]


def write(rows, load):
    with open(DATA, "w", newline="", encoding="utf-8") as out:
        out.writelines(f"# {line}\n" for line in head(rows, load))
        csv.writer(out, lineterminator="\n").writerows([TITLES, *map(fields, rows)])
    summaries.write("accuracy")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--asked", nargs="+", default=["1e-2", "3e-3", "1e-3"])
    parser.add_argument("--program", default=str(cases.ROOT / "target/release/orthowear"))
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    rows, load = [], os.getloadavg()[0]
    for case in cases.every():
        if options.names and not any(case.name.startswith(name) for name in options.names):
            continue
        for asked in options.asked:
            with tempfile.TemporaryDirectory() as folder:
                rows.append(run(options.program, case, asked, Path(folder)))
            print(line(rows[-1]), flush=True)
    print(head(rows, load)[-1])
    if options.write:
        write(rows, load)


if __name__ == "__main__":
    main()
