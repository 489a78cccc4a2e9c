"""Prepare a release: ``make release``. It changes nothing and publishes nothing.

The version in `pyproject.toml`, in `CITATION.cff` and at the top of `CHANGELOG.md` must be the
same, and nothing may be uncommitted. Then the wheel is built, installed into an empty environment
and used (`build/package.py`), and kept in `build/out/release`. Exit code 1 if anything is wrong;
every finding is printed, not the first one only.
"""

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OUT = ROOT / "build" / "out" / "release"


def findings(pyproject: str, citation: str, changelog: str) -> Iterator[str]:
    """Yield where the three files do not name one version, and a heading without a date."""
    version = tomllib.loads(pyproject)["project"]["version"]
    cited = re.search(r"^version: (\S+)$", citation, re.MULTILINE)
    named = cited[1] if cited else "none"
    if named != version:
        yield (f"CITATION.cff names version {named}, pyproject.toml {version}; write one into both")
    top = re.search(r"^## (.+)$", changelog, re.MULTILINE)
    heading = top[1] if top else "none"
    if re.fullmatch(rf"\[?{re.escape(version)}\]? - \d{{4}}-\d\d-\d\d", heading) is None:
        yield (
            f"the top heading of CHANGELOG.md is '{heading}'; a release needs "
            f"'## {version} - YEAR-MONTH-DAY' there; rename 'Unreleased'"
        )


def main() -> None:
    """Check, build, install, use."""
    names = ("pyproject.toml", "CITATION.cff", "CHANGELOG.md")
    wrong = list(findings(*((ROOT / name).read_text(encoding="utf-8") for name in names)))
    changed = subprocess.run(
        ["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    if changed:
        wrong.append(f"files are not committed; commit or remove them:\n{changed.rstrip()}")
    for finding in wrong:
        sys.stdout.write(f"WRONG  {finding}\n")
    if wrong:
        sys.exit(1)
    package = [sys.executable, str(ROOT / "build" / "package.py"), "--keep", str(OUT)]
    sys.exit(subprocess.run(package, check=False).returncode)


if __name__ == "__main__":
    main()
