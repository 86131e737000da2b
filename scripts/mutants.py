"""Mistakes made on purpose: which tests find them. Called by scripts/mutants."""

import datetime
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
COPY = ROOT / "target" / "mutants" / "sources"
PAGE = """# Mistakes made on purpose

Would the tests notice? `./scripts/mutants` makes the classical mistakes of contact programs, one at a time, in a copy of the sources
(`tests/mutants.toml`: file, what is replaced by what, the tests that are run), builds it, and shows which tests fail. It ends with an error if one of
the mistakes is found by none, and begins by showing that all of these tests pass without them. Most of its time is compilation;
`./scripts/mutants wear` makes those only whose names contain the word.
"""


def copied():
    """The files under version control, as they are now, in a folder of their own; those that are the same keep their times."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout
    for name in filter(None, names.decode().split("\0")):
        source, target = ROOT / name, COPY / name
        if not source.is_file():
            continue
        if not target.exists() or target.read_bytes() != source.read_bytes():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)


def cargo(arguments):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(ROOT / "target" / "mutants" / "built"), CARGO_INCREMENTAL="1")
    command = ["cargo", "test", "--locked", *arguments]
    return subprocess.run(command, cwd=COPY, env=environment, capture_output=True, text=True)


def failures(words):
    """The tests that fail among those whose names contain one of the words; None if the sources do not compile."""
    built = cargo(["--no-run", "--lib", "--test", "verification"])
    if built.returncode != 0:
        return None, built.stderr
    ran = cargo(["--no-fail-fast", "--lib", "--test", "verification", "--", *words])
    counted = sum(int(number) for number in re.findall(r"test result: .*?(\d+) passed", ran.stdout))
    failed = sorted(set(re.findall(r"^test (\S+) \.\.\. FAILED", ran.stdout, re.M)))
    counted += len(failed)
    if counted == 0:
        return None, "no test has such a name: " + ", ".join(words)
    return failed, ran.stdout


def table(rows):
    lines = ["| mistake | where | found by |", "|---|---|---|"]
    for mutant, failed in rows:
        found = ", ".join(f"`{name}`" for name in failed[:4])
        more = f" and {len(failed) - 4} more" if len(failed) > 4 else ""
        lines.append(f"| {mutant['name']} | `{mutant['file']}` | {found}{more} |")
    return "\n".join(lines)


def main():
    mutants = tomllib.loads((ROOT / "tests" / "mutants.toml").read_text())["mutant"]
    wanted = [m for m in mutants if not sys.argv[1:] or any(word in m["name"] for word in sys.argv[1:])]
    if not wanted:
        sys.exit("no mistake has such a name: " + ", ".join(m["name"] for m in mutants))
    copied()
    words = sorted({word for mutant in wanted for word in mutant["tests"]})
    print(f"the sources as they are: {len(words)} groups of tests", flush=True)
    failed, said = failures(words)
    if failed is None or failed:
        sys.exit("these must pass before a mistake is made:\n" + (said[-4000:] if failed is None else ", ".join(failed)))
    rows, missed = [], []
    for mutant in wanted:
        started = time.monotonic()
        path = COPY / mutant["file"]
        sound = path.read_text()
        if sound.count(mutant["from"]) != 1:
            sys.exit(f"{mutant['name']}: `from` must stand once in {mutant['file']}, not {sound.count(mutant['from'])} times")
        path.write_text(sound.replace(mutant["from"], mutant["to"]))
        try:
            failed, said = failures(mutant["tests"])
        finally:
            path.write_text(sound)
        if failed is None:
            sys.exit(f"{mutant['name']} does not compile, or has no tests:\n{said[-4000:]}")
        rows.append((mutant, failed))
        if not failed:
            missed.append(mutant["name"])
        seconds = time.monotonic() - started
        print(f"{mutant['name']}: {', '.join(failed) or 'NOT FOUND'} ({seconds:.0f} s)", flush=True)
    if missed:
        sys.exit("not found by any test: " + "; ".join(missed))
    if not sys.argv[1:]:
        date = datetime.date.today().isoformat()
        (ROOT / "docs" / "mutants.md").write_text(f"{PAGE}\nMade on {date}.\n\n{table(rows)}\n")
    print(f"all {len(rows)} mistakes are found")


if __name__ == "__main__":
    main()
