"""Inserts deliberate defects, and lists the tests that find them. Called by scripts/mutants."""

import csv
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
COPY = ROOT / "target" / "mutants"
DATA = ROOT / "docs" / "data" / "mutants.csv"

# Code that is added to the copy. It returns whether a defect is active.
SWITCH = '''
/// Whether the mistake `name` is being made.
pub fn mistake(name: &str) -> bool {
    static MADE: std::sync::LazyLock<String> =
        std::sync::LazyLock::new(|| std::env::var("ORTHOWEAR_MISTAKE").unwrap_or_default());
    *MADE == name
}
'''


def with_mistakes(mutants):
    """Texts of the sources with all defects, by file name. An environment variable activates one defect."""
    changed = {"src/lib.rs": (ROOT / "src/lib.rs").read_text() + SWITCH}
    for mutant in mutants:
        text = changed.get(mutant["file"]) or (ROOT / mutant["file"]).read_text()
        if text.count(mutant["from"]) != 1:
            sys.exit(f"{mutant['name']}: `from` must stand once in {mutant['file']}, not {text.count(mutant['from'])} times")
        made = mutant["to"].replace("MISTAKE", f"crate::mistake({mutant['name']!r})".replace("'", '"'))
        changed[mutant["file"]] = text.replace(mutant["from"], made)
    return changed


def copied(changed):
    """Writes a copy of the files under version control, with the `changed` sources. Unchanged files of an earlier copy
    keep their modification times.
    """
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True).stdout
    for name in filter(None, names.decode().split("\0")):
        source, target = ROOT / name, COPY / name
        if not source.is_file():
            continue
        content = changed[name].encode() if name in changed else source.read_bytes()
        if not target.exists() or target.read_bytes() != content:
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
            shutil.copymode(source, target)


def verification(arguments, mistake=""):
    """Builds and runs the verification tests of the copy. The copy has its own build folder. Otherwise, scripts/test
    would take these tests for its own tests.
    """
    environment = dict(os.environ, CARGO_TARGET_DIR=str(ROOT / "target" / "mutants-build"), ORTHOWEAR_MISTAKE=mistake)
    command = ["cargo", "test", "--release", "--locked", "--test", "verification", *arguments]
    return subprocess.run(command, cwd=COPY, env=environment, capture_output=True, text=True)


def failures(words, mistake=""):
    """Runs the tests whose names contain one of the words. Returns their number, and the names of the failed tests."""
    ran = verification(["--no-fail-fast", "--", *words], mistake)
    failed = sorted(set(re.findall(r"^test (\S+) \.\.\. FAILED", ran.stdout, re.M)))
    passed = sum(int(number) for number in re.findall(r"test result: .*?(\d+) passed", ran.stdout))
    if passed + len(failed) == 0:
        sys.exit(f"no test ran of {', '.join(words)}:\n{ran.stdout[-2000:]}{ran.stderr[-2000:]}")
    return passed + len(failed), failed


def write(rows):
    """Writes the results to DATA, and their summary to docs/mutants.md."""
    with open(DATA, "w", newline="", encoding="utf-8") as out:
        out.write(f"# date: {datetime.date.today().isoformat()}\n# command: scripts/mutants\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(["mistake", "file", "tests_run", "tests_failed", "found_by"])
        writer.writerows([mutant["name"], mutant["file"], ran, len(failed), "; ".join(failed)] for mutant, ran, failed in rows)
    subprocess.run([sys.executable, ROOT / "benchmarks" / "summaries.py", "mutants"], check=True)


def main():
    mutants = tomllib.loads((ROOT / "tests" / "mutants.toml").read_text())["mutant"]
    wanted = [m for m in mutants if not sys.argv[1:] or any(word in m["name"] for word in sys.argv[1:])]
    if not wanted:
        sys.exit("no mistake has such a name: " + ", ".join(m["name"] for m in mutants))
    copied(with_mistakes(mutants))
    built = verification(["--no-run"])
    if built.returncode != 0:
        sys.exit("the copy does not compile:\n" + built.stderr[-6000:])
    words = sorted({word for mutant in wanted for word in mutant["tests"]})
    ran, failed = failures(words)
    if failed:
        sys.exit("these must pass before a mistake is made: " + ", ".join(failed))
    print(f"without a mistake all {ran} tests pass", flush=True)
    rows, missed = [], []
    for mutant in wanted:
        started = time.monotonic()
        ran, failed = failures(mutant["tests"], mutant["name"])
        rows.append((mutant, ran, failed))
        if not failed:
            missed.append(mutant["name"])
        seconds = time.monotonic() - started
        print(f"{mutant['name']}: {', '.join(failed) or 'NOT FOUND'} ({seconds:.0f} s)", flush=True)
    if missed:
        sys.exit("not found by any test: " + "; ".join(missed))
    if not sys.argv[1:]:
        write(rows)
    print(f"all {len(rows)} mistakes are found")


if __name__ == "__main__":
    main()
