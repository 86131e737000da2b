#!/usr/bin/env python3
"""What is asked for, what is estimated and what is true: `accuracy` on the cases of the catalogue.

    cargo build --release --locked
    python3 benchmarks/accuracy/run.py [--asked 1e-2 3e-3 1e-3] [--program FILE] [--write] [BEGINNINGS OF NAMES ...]

Runs each case at each accuracy, one after the other, on one thread; prints a row for each, and with --write puts the table into
docs/accuracy.md. Of a run's results the one with the largest true error stands in the row. Takes some minutes.
"""

import argparse
import json
import os
import subprocess
import tempfile
import time
from datetime import date
from pathlib import Path

import cases

PAGE = cases.ROOT / "docs/accuracy.md"
BEGIN, END = "<!-- table: begin -->", "<!-- table: end -->"
# Seconds after which a run is given up.
LIMIT = 120


def run(program, case, asked, folder):
    """The row of one run: a dict."""
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


def cells(row):
    """Rows of the table of one run."""
    what = ", ".join(row["of"]).replace("_", " ") or "all"
    if not row["results"]:
        ended = "given up" if row["code"] == "time" else f"exit code {row['code']}"
        return [row["case"], what, row["asked"], "", "", "", f"{row['seconds']:.1f}", ended]
    worst = max(row["results"], key=lambda result: result["error"])
    last = row["record"]["runs"][-1]
    times = f", {last['increments']} x increments" if last["increments"] > 1 else ""
    fine = " x ".join(str(n) for n in last["cells"]) + times
    error = f"{worst['error']:.1e}" if worst["error"] > row["known"] else f"below {row['known']:.0e}"
    if worst["error"] > float(row["asked"]):
        error = f"**{error}**"
    ended = "" if row["met"] else ", not reached"
    return [row["case"], what, row["asked"], f"{worst['estimate']:.1e}", error, worst["name"].replace("_", " "), f"{row['seconds']:.1f}", fine + ended]


def page(rows, load):
    """The table, and what it adds up to."""
    version = subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=False).stdout.strip()
    memory = int(first_value("/proc/meminfo", "MemTotal").split()[0]) / (1 << 20)
    head = (f"date: {date.today()}  \nmachine: {first_value('/proc/cpuinfo', 'model name')}, {os.cpu_count()} cores, {memory:.0f} GiB, "
            f"load {load:.0f} to {os.getloadavg()[1]:.0f}; one thread  \nversions: {version}\n")
    titles = ["case", "of", "asked", "estimate", "true error", "of which result", "seconds", "last run"]
    lines = [titles, ["---"] * len(titles)] + [cells(row) for row in rows]
    reached = [row for row in rows if row["results"] and row["met"]]
    results = [(result["error"], row) for row in reached for result in row["results"]]
    above = sum(error > float(row["asked"]) for error, row in results)
    worst = [max(result["error"] for result in row["results"]) / float(row["asked"]) for row in reached]
    near = sum(share >= 0.1 for share in worst)
    words = (f"{len(rows)} runs, of which {len(reached)} say that they have reached what was asked for: of their {len(results)} results with a truth {above} "
             f"are off by more (the largest {max(worst):.2f} times of it). The worst result of a run is off by more than a tenth of what was asked for in "
             f"{near} of {len(reached)} runs.")
    sources = sorted({f"{row['case'].split(',')[0]}: {row['source']}" for row in rows})
    return "\n".join([BEGIN, "", head, *("| " + " | ".join(line) + " |" for line in lines), "", words, "", "Truths: " + "; ".join(sources) + ".", "", END])


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
    text = page(rows, load)
    print(text.split("\n\n")[-3])
    if options.write:
        before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
        PAGE.write_text(before + text + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
