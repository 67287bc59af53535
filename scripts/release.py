"""What would be released: sdist, the wheel that it gives, and the native engine's, in ``dist/``.

``python scripts/release.py`` builds them, installs them into an empty environment, tries the
commands there and says what was made. Nothing is uploaded. The environment gets this one's
packages, but only those that the wheels ask for; nothing is downloaded.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.request
import zipfile
from collections.abc import Iterator, Sequence
from importlib.metadata import Distribution, distribution
from pathlib import Path

from packaging.requirements import Requirement

import native

ROOT = Path(__file__).resolve().parent.parent
PIP = ("-m", "pip", "--disable-pip-version-check", "--quiet")
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("--version",),
    ("skin", "list"),
    ("skin", "check", "textile-disc-8"),
    ("doctor",),
)
"""Commands that must end well where nothing but the wheels and what they ask for is installed."""


def pure(folder: Path) -> tuple[Path, Path]:
    """Build the sdist in ``folder``, and of it the wheel, as pip does for a user: both paths."""
    run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(folder), cwd=ROOT)
    (sdist,) = folder.glob("tomoskin-*.tar.gz")
    offline = ("--no-build-isolation", "--no-deps", "--no-index")
    run(sys.executable, *PIP, "wheel", *offline, "-w", str(folder), str(sdist), cwd=folder)
    (wheel,) = folder.glob("tomoskin-*.whl")
    return sdist, wheel


def firmware_in(wheel: Path) -> str:
    """A line that says which boards' firmware a wheel holds."""
    with zipfile.ZipFile(wheel) as archive:
        found = [Path(name).name for name in archive.namelist() if name.endswith((".hex", ".bin"))]
    return f"firmware inside: {', '.join(found) or 'NONE, for want of compilers'}"


def fast(folder: Path) -> Path:
    """Build the native engine's wheel; a minute or two the first time."""
    manifest = str(native.CORE / "Cargo.toml")
    words = ("-m", "maturin", "build", "--release", "--quiet", "--out", str(folder))
    run(sys.executable, *words, "--manifest-path", manifest)
    (wheel,) = folder.glob("tomoskin_core-*.whl")
    return wheel


class Environment:
    """A virtual environment with these wheels and, of ours, the packages that they ask for."""

    def __init__(self, folder: Path, wheels: Sequence[Path]) -> None:
        run(sys.executable, "-m", "venv", "--without-pip", str(folder))
        self.python = folder / "bin" / "python"
        offline = ("install", "--no-deps", "--no-index")
        run(sys.executable, *PIP, "--python", str(self.python), *offline, *map(str, wheels))
        (site,) = folder.glob("lib/python*/site-packages")
        for found in asked_for("tomoskin"):
            lend(found, site)

    def said(self, *words: str) -> str:
        """What a command of tomoskin says; CalledProcessError where it fails."""
        return run(str(self.python.with_name("tomoskin")), *words, cwd=self.python.parent)

    def serves(self) -> str:
        """Start the live twin, fetch its page, end it by Ctrl-C; the line with the address."""
        command = [self.python.with_name("tomoskin"), "live", "--port", "0", "--source", "twin"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
            try:
                assert process.stdout is not None
                line = process.stdout.readline()
                address = re.search(r"http://\S+", line)
                if address is None:
                    raise RuntimeError(f"expected the address of the page, got {line!r}")
                direct = urllib.request.build_opener(
                    urllib.request.ProxyHandler({}), urllib.request.HTTPCookieProcessor()
                )
                with direct.open(address[0], timeout=60) as answer:
                    if b"<script" not in answer.read():
                        raise RuntimeError("what was served is not the page")
            finally:
                process.send_signal(signal.SIGINT)
            if process.wait(60):
                raise RuntimeError(f"live ended with {process.returncode}")
        return line


def asked_for(name: str) -> Iterator[Distribution]:
    """Every installed distribution that ``name`` needs, directly or not; extras aside."""
    seen, todo = {name}, [distribution(name)]
    while todo:
        for text in todo.pop().requires or ():
            wanted = Requirement(text)
            if wanted.name in seen or (wanted.marker and not wanted.marker.evaluate({"extra": ""})):
                continue
            seen.add(wanted.name)
            found = distribution(wanted.name)
            todo.append(found)
            yield found


def lend(found: Distribution, site: Path) -> None:
    """Link the files of a distribution into another environment."""
    tops = {file.parts[0] for file in found.files or ()} - {"..", "__pycache__"}
    for top in tops:
        if not (site / top).exists():
            (site / top).symlink_to(Path(str(found.locate_file(top))))


def run(*words: str, cwd: Path | None = None) -> str:
    """Run a program to its end; what it says on stdout. Of one that fails stderr is shown."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "TOMOSKIN"))}
    done = subprocess.run(words, cwd=cwd, env=kept, stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout


def main() -> int:
    """Build, try and list."""
    out = ROOT / "dist"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    files = list(pure(out))
    if reason := native.why_not():
        print(f"no wheel of the native engine: {reason}")
    else:
        files.append(fast(out))
    with tempfile.TemporaryDirectory() as folder:
        empty = Environment(Path(folder), [file for file in files if file.suffix == ".whl"])
        for words in COMMANDS:
            empty.said(*words)
            print(f"ok  tomoskin {' '.join(words)}")
        empty.serves()
        print("ok  tomoskin live")
    print(firmware_in(files[1]))
    for file in files:
        size, digest = file.stat().st_size, hashlib.sha256(file.read_bytes()).hexdigest()
        print(f"{file.relative_to(ROOT)}  {size / 1e6:.2f} MB  sha256 {digest}")
    print("nothing was uploaded")
    return 0


if __name__ == "__main__":
    sys.exit(main())
