"""The native engine's build: the wheel of core-native, where a cargo that works is on the PATH.

With the argument ``check``: format, clippy and tests of its sources instead, unless they have
passed already.
With ``reference``: the wheel with bare faer in it, which `tomoskin bench forward` compares with.

Without one nothing is built and nothing fails: scipy does the same job more slowly. Standard
library only; run by the virtual environment's Python, which has maturin and pip.
"""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CORE = ROOT / "core-native"
STAMP = Path(sys.prefix) / ".native.sha256"
CHECKED = Path(sys.prefix) / ".native-checked.sha256"
LEFT_OUT = ROOT / "build" / "left-out.txt"
CHECKS = (
    ("fmt", "--check"),
    ("clippy", "--quiet", "--release", "--all-targets", "--", "-D", "warnings"),
    ("test", "--quiet", "--release", "--no-default-features"),
)


def why_not() -> str:
    """Return why the engine cannot be built here; empty where it can."""
    cargo = shutil.which("cargo")
    if cargo is None:
        return "there is no cargo"
    tried = subprocess.run([cargo, "--version"], capture_output=True, text=True, check=False)
    if tried.returncode:
        said = (tried.stderr or tried.stdout).strip().splitlines()
        return f"cargo does not work: {said[0] if said else 'it says nothing'}"
    return ""


def sources(*more: str) -> str:
    """Return the hash of all that the wheel is built from, and of ``more``."""
    digest = hashlib.sha256()
    patterns = ("*.toml", "*.pyi", "src/**/*.rs", *more)
    for file in sorted(file for pattern in patterns for file in CORE.glob(pattern)):
        digest.update(file.relative_to(CORE).as_posix().encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()


def is_fresh() -> bool:
    """Whether the installed engine is that of the sources."""
    if importlib.util.find_spec("tomoskin_core") is None or not STAMP.is_file():
        return False
    return STAMP.read_text(encoding="ascii").strip() == sources()


def has_reference() -> bool:
    """Whether the engine that is installed has bare faer in it."""
    return hasattr(importlib.import_module("tomoskin_core"), "Reference")


def build(*features: str) -> None:
    """Build the wheel, with these features of the crate, and install it beside tomoskin.

    Raises
    ------
    subprocess.CalledProcessError
        When cargo or pip fails; both have said why.
    """
    python = sys.executable
    with tempfile.TemporaryDirectory() as folder:
        manifest = str(CORE / "Cargo.toml")
        maturin = (python, "-m", "maturin", "build", "--release", "--quiet")
        chosen = ("--features", ",".join(features)) if features else ()
        words = (*maturin, *chosen, "--manifest-path", manifest, "--out", folder)
        subprocess.run(words, check=True)
        (wheel,) = Path(folder).glob("*.whl")
        pip = (python, "-m", "pip", "--disable-pip-version-check", "--quiet", "install")
        subprocess.run(
            [*pip, "--no-deps", "--no-index", "--force-reinstall", str(wheel)], check=True
        )
    STAMP.write_text(sources(), encoding="ascii")


def leave_out(what: str) -> None:
    """Say what cannot be done here, now and in the last line of ``make test``."""
    print(what)
    LEFT_OUT.parent.mkdir(exist_ok=True)
    with LEFT_OUT.open("a", encoding="utf-8") as file:
        file.write(f"{what}\n")


def check() -> int:
    """Check format, clippy and tests where cargo has them; nothing when nothing has changed."""
    found = sources("tests/**/*.rs")
    if CHECKED.is_file() and CHECKED.read_text(encoding="ascii") == found:
        return 0
    if reason := why_not():
        leave_out(f"the native engine's own checks: {reason} (install Rust, then: make lint)")
        return 0
    for name, *options in CHECKS:
        asked = subprocess.run(["cargo", name, "--help"], capture_output=True, check=False)
        if asked.returncode:
            leave_out(f"core-native: cargo {name} (install it: rustup component add {name})")
        elif subprocess.run(["cargo", name, *options], cwd=CORE, check=False).returncode:
            return 1
    CHECKED.write_text(found, encoding="ascii")
    return 0


def install(*features: str) -> int:
    """Build unless fresh or impossible; a build that fails is said, and scipy goes on."""
    if is_fresh() and (not features or has_reference()):
        return 0
    reason = why_not()
    if reason:
        print(f"set-up: no native engine, scipy does its job: {reason}")
        return 0
    print("set-up: the native engine (a minute or two the first time)", flush=True)
    try:
        build(*features)
    except subprocess.CalledProcessError as error:
        print(f"set-up: the native engine was not built: {error}", file=sys.stderr)
        return 1
    return 0


def main(words: list[str]) -> int:
    """Do what the words ask for."""
    match words:
        case ["check"]:
            return check()
        case ["reference"]:
            return install("reference")
        case []:
            return install()
    print(f"native.py: expected nothing, check or reference, got {words}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
