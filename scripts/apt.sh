# Sourced: provide WHAT TESTS PACKAGE… installs packages with apt-get on Debian, as root, unless the
# caller's function `ready` says that all is there. Without them the tests that need them are
# skipped, loudly; under CI=true that is a failure.

provide() {
    what=$1 tests=$2
    shift 2
    if ready; then return 0; fi
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
        echo "set-up: installing $what with apt-get"
        { apt-get update && apt-get install -y --no-install-recommends "$@"; } >/dev/null || true
        if ready; then return 0; fi
    fi
    echo "set-up: no $what, so $tests." >&2
    echo "  On Debian: sudo apt-get install $*" >&2
    if [ "${CI:-}" = true ]; then return 1; fi
}
