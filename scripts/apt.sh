# Sourced: provide WHAT TESTS PACKAGE… installs packages with apt-get on Debian, as root, unless the
# caller's function `ready` says that all is there. Packages whose names only apt knows are printed
# by the caller's function `more`, after apt has looked. Without them the tests that need them are
# skipped, loudly; under CI=true that is a failure.

more() { :; }

provide() {
    what=$1 tests=$2
    shift 2
    if ready; then return 0; fi
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "set-up: installing $what with apt-get"
        # shellcheck disable=SC2046 - a list
        { apt-get update && apt-get install -y --no-install-recommends "$@" $(more); } >/dev/null || true
        if ready; then return 0; fi
    fi
    echo "set-up: no $what, so $tests." >&2
    echo "  On Debian: sudo apt-get install $*" >&2
    if [ "${CI:-}" = true ]; then return 1; fi
}
