"""What every test may rely on: the public recordings, Chromium, a repeatable seed, no network."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import ipaddress
import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

import one_thread  # noqa: F401 - before numpy is loaded
from tomoskin.core import registered

pytest_plugins = ["rig"]

ROOT = Path(__file__).resolve().parent.parent
DEFAULT_DATA = ROOT.parent / "shared" / "data"
NOTED = ROOT / "build" / "left-out.txt"
"""What set-up could not bring, a line each, with the command that would."""
PACKAGE = ROOT / "src" / "tomoskin"
KEPT = ROOT / "build" / "tests"
"""What tests need again and again: meshes, and tables of touches."""

NO_ENGINE = "the native engine: it has not been built (install Rust, then: make native)"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")

# How long an example takes says more of the machine's other load than of the code.
settings.register_profile("tomoskin", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tomoskin")


class BlockedConnectionError(RuntimeError):
    """A test tried to leave this machine."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--data",
        type=Path,
        default=DEFAULT_DATA,
        help="folder of the public recordings (default: ../shared/data beside the repository)",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Hear Ctrl-C, which a shell ignores in what it starts in the background; keep tables of
    touches in one folder for all processes and runs, and in no user's."""
    del config
    if "TOMOSKIN_CACHE" not in os.environ:
        os.environ["TOMOSKIN_CACHE"] = str(kept_tables())
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def kept_tables() -> Path:
    """The folder of what is kept from run to run, by the sources that make it; older ones go."""
    sources = hashlib.sha256()
    rooms = ("core", "model", "sensing/fit")
    for file in sorted(file for room in rooms for file in (PACKAGE / room).rglob("*.py")):
        sources.update(file.read_bytes())
    engine = importlib.util.find_spec("tomoskin_core")
    for part in (engine.submodule_search_locations or ()) if engine else ():
        sources.update(
            "".join(sorted(f"{f.name}{f.stat().st_size}" for f in Path(part).glob("*.so"))).encode()
        )
    folder = KEPT / sources.hexdigest()[:16]
    for older in KEPT.glob("*"):
        if older != folder:
            shutil.rmtree(older, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("data"):
        require_data(item.config)
    if item.get_closest_marker("page"):
        require_chromium()


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    seed = config.getoption("randomly_seed", None)
    if seed is not None:
        terminalreporter.write_line(f"to repeat this order: --randomly-seed={seed}")
    things = left_out(terminalreporter.stats.get("skipped", ()))
    if things:
        terminalreporter.write_line(f"left out: {'; '.join(things)}", yellow=True, bold=True)
    else:
        terminalreporter.write_line("nothing was left out")


def left_out(skipped: Iterable[Any]) -> list[str]:
    """What is missing here, of the reports of skipped tests and of what set-up wrote down."""
    reasons = {str(report.longrepr[2]).removeprefix("Skipped: ") for report in skipped}
    noted = NOTED.read_text(encoding="utf-8").splitlines() if NOTED.is_file() else []
    return sorted(reasons | set(noted))


@pytest.fixture(scope="session")
def data_dir(pytestconfig: pytest.Config) -> Path:
    """Return the folder of the public recordings; skip without it (under CI=true: fail)."""
    return require_data(pytestconfig)


@pytest.fixture(scope="session")
def chromium() -> Path:
    """Return the system's Chromium; skip without it (under CI=true: fail)."""
    return require_chromium()


@pytest.fixture(scope="session")
def built_page() -> None:
    """The page has been built; skip where it has not (under CI=true: fail)."""
    from tomoskin.server.server import STATIC

    if not (STATIC / "index.html").is_file():
        missing("the page: it has not been built (make page)")


@pytest.fixture(scope="session", autouse=True)
def no_network() -> Iterator[None]:
    """Let sockets reach this machine only."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("connect", "connect_ex", "sendto"):
            patch.setattr(socket.socket, name, guarded(name))
        yield


def guarded(name: str) -> Any:
    """Return socket method `name`, which first refuses an address beyond loopback."""
    original = getattr(socket.socket, name)

    def method(self: socket.socket, *args: Any) -> Any:
        if self.family in (socket.AF_INET, socket.AF_INET6) and not is_loopback(args[-1]):
            raise BlockedConnectionError(f"a test may reach loopback only, got {args[-1]!r}")
        return original(self, *args)

    return method


def is_loopback(address: Any) -> bool:
    """Whether the (host, port, ...) `address` is this machine's own."""
    host = address[0]
    if host in ("", "localhost"):
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def require_data(config: pytest.Config) -> Path:
    folder: Path = config.getoption("--data")
    if not folder.is_dir():
        missing(f"the public recordings: no folder {folder} (see --data)")
    if not registered("readers"):
        pytest.skip("the public recordings: nothing is here that reads them")
    return folder


def require_chromium() -> Path:
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None or not driver_runs():
        advice = "Debian: apt-get install chromium libatomic1"
        missing(f"the page in Chromium: none that Playwright can drive ({advice})")
    return Path(str(found))


@functools.cache
def driver_runs() -> bool:
    """Whether Playwright's own program starts: it needs a library that Chromium does not."""
    spec = importlib.util.find_spec("playwright")
    if spec is None or not spec.submodule_search_locations:
        return False
    node = Path(spec.submodule_search_locations[0]) / "driver" / "node"
    try:
        return subprocess.run([node, "--version"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


def missing(thing: str) -> None:
    """Skip the test, which is said at the end; where everything must be there, fail it."""
    if os.environ.get("CI") == "true":
        pytest.fail(f"CI must test {thing}", pytrace=False)
    pytest.skip(thing)
