#!/bin/sh
# Sees to it that the firmware's tests find compilers, simavr and GoogleTest: on Debian, as root, it
# installs them. Without them those tests are skipped, loudly; under CI=true that is a failure.
set -eu
packages="make gcc g++ libc6-dev gcc-avr avr-libc simavr libsimavr-dev libelf-dev libgtest-dev gcovr cppcheck clang"

ready() {
    for program in cc c++ avr-gcc avr-size simavr gcovr cppcheck; do
        command -v $program >/dev/null || return 1
    done
    found=""
    for clang in clang clang-19 clang-16 clang-14; do # as firmware/Makefile
        command -v $clang >/dev/null && found=$clang && break
    done
    [ -n "$found" ] || return 1
    echo 'int LLVMFuzzerTestOneInput(const char *at, long size) { return at == (char *)size; }' |
        $found -fsanitize=fuzzer -x c - -o /dev/null 2>/dev/null || return 1
    for header in simavr/sim_avr.h gtest/gtest.h libelf.h; do
        echo "#include <$header>" | c++ -isystem /usr/include/simavr -E -x c++ - >/dev/null 2>&1 || return 1
    done
}

# libFuzzer is a package of its own, named after the version that clang is.
fuzzer() {
    apt-cache depends clang | sed -n 's/.*Depends: clang-\([0-9]*\)$/libclang-rt-\1-dev/p'
}

if ready; then exit 0; fi
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    echo "set-up: installing compiler, emulator and test tools for the firmware with apt-get"
    # shellcheck disable=SC2086 - a list
    { apt-get update && apt-get install -y --no-install-recommends $packages $(fuzzer); } >/dev/null || true
    if ready; then exit 0; fi
fi
echo "set-up: no tools for the firmware, so its tests cannot run." >&2
echo "  On Debian: sudo apt-get install $packages" >&2
if [ "${CI:-}" = true ]; then exit 1; fi
