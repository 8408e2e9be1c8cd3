"""The table of README.md in this folder, made by running every case.

python -m tests.hard_cases               print it
python -m tests.hard_cases --write       put it into the README
python -m tests.hard_cases --check       compare it with the README in all but the times; exit code 1 where they differ
... --family flat                        run one family alone; lines of others stay as they are
... --fast                               leave out the slow ones, in the same way
"""

from __future__ import annotations

import argparse
import sys

from .registry import cases, outcome
from .table import README, differences, replaced, row, table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.hard_cases")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--family")
    parser.add_argument("--fast", action="store_true")
    options = parser.parse_args()
    chosen = [case for case in cases() if options.family in (None, case.family.name) and not (options.fast and case.slow)]
    outcomes = {}
    for case in chosen:
        outcomes[case] = outcome(case)
        if not (options.write or options.check):
            sys.stdout.write(row(case, outcomes[case]) + "\n")
            sys.stdout.flush()
    failed = [f"{case.id}: {outcomes[case].fault}" for case in chosen if outcomes[case].fault]
    if failed:
        sys.stderr.write("\n".join(["failed:", *failed, ""]))
        return 1
    text = README.read_text(encoding="utf-8")
    if options.write:
        README.write_text(replaced(text, table(cases(), outcomes, text)), encoding="utf-8")
    if options.check and (found := differences(text, cases(), outcomes)):
        sys.stderr.write("\n".join([*found, ""]))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
