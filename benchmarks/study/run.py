#!/usr/bin/env python3
"""Compares a study with separate runs of the same scenes.

    cargo build --release && python3 benchmarks/study/run.py [--repeats N] [STUDY]

The study on two threads alternates with its runs as separate processes, two at a time. Prints medians of wall-clock
time and processor time. Then prints the overhead per run, which is the time of the study on one thread minus the
time of the separate runs.
"""

import argparse
import concurrent.futures
import json
import pathlib
import re
import resource
import statistics
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = ROOT / "target" / "release" / "orthowear"


def timed(work):
    """Wall-clock time and processor time of the processes that `work` waits for, seconds."""
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    work()
    wall, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def run(*arguments):
    subprocess.run([PROGRAM, *map(str, arguments)], check=True, capture_output=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("study", nargs="?", type=pathlib.Path, default=ROOT / "scenes" / "contact-orientation.toml")
    parser.add_argument("--repeats", type=int, default=5)
    wanted = parser.parse_args()
    scene = wanted.study.parent / re.search(r'^scene = "(.*)"', wanted.study.read_text(), re.M)[1]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)

        def together():
            run("study", wanted.study, "--threads", 2, "--out", folder / "study", "--quiet")

        def one(values):
            number, keys = values
            sets = [part for key, value in keys.items() for part in ("--set", f"{key}={json.dumps(value)}")]
            run("run", scene, "--threads", 1, "--out", folder / f"run-{number}", "--quiet", *sets)

        def apart():
            with concurrent.futures.ThreadPoolExecutor(2) as pool:
                list(pool.map(one, enumerate(runs)))

        together()
        runs = [entry["values"] for entry in json.loads((folder / "study" / "study.json").read_text())["runs"]]
        pairs = [(timed(together), timed(apart)) for _ in range(wanted.repeats)]
        for name, k in (("wall clock", 0), ("processor", 1)):
            own, other = ([pair[which][k] for pair in pairs] for which in (0, 1))
            ratios = [b / a for a, b in zip(own, other, strict=True)]
            print(
                f"{name}: study {statistics.median(own):.2f} s, {len(runs)} processes {statistics.median(other):.2f} s, "
                f"ratio {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"
            )

        def costs():
            wall, _ = timed(lambda: run("study", wanted.study, "--threads", 1, "--out", folder / "cost", "--quiet"))
            alone = [timed(lambda n=n: one((n, runs[n])))[0] for n in range(len(runs))]
            return (wall - sum(alone)) / len(runs)

        cost = [costs() for _ in range(wanted.repeats)]
        print(f"a run in the study takes {1e3 * statistics.median(cost):.1f} ms more than as a process of its own (less: negative)")


if __name__ == "__main__":
    main()
