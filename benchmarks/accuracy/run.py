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
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

import cases

PAGE = cases.ROOT / "docs/accuracy.md"
LIMIT = 180


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


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("names", nargs="*")
    parser.add_argument("--asked", nargs="+", default=["1e-2", "3e-3", "1e-3"])
    parser.add_argument("--program", default=str(cases.ROOT / "target/release/orthowear"))
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--json")
    options = parser.parse_args()
    rows = []
    for case in cases.every():
        if options.names and not any(case.name.startswith(name) for name in options.names):
            continue
        for asked in options.asked:
            with tempfile.TemporaryDirectory() as folder:
                rows.append(run(options.program, case, asked, Path(folder)))
            print(line(rows[-1]), flush=True)
    if options.json:
        Path(options.json).write_text(json.dumps(rows))


if __name__ == "__main__":
    main()
