#!/bin/sh
# Sees to it that the firmware's tests find compilers, simavr and GoogleTest.
set -eu
. "$(dirname "$0")/apt.sh"

ready() {
    for program in cc c++ avr-gcc avr-size arm-none-eabi-gcc avrdude simavr gcovr cppcheck; do
        command -v $program >/dev/null || return 1
    done
    found=""
    for clang in clang clang-19 clang-16 clang-14; do # as firmware/Makefile
        command -v $clang >/dev/null && found=$clang && break
    done
    [ -n "$found" ] || return 1
    echo 'int LLVMFuzzerTestOneInput(const char *at, long size) { return at == (char *)size; }' |
        $found -fsanitize=fuzzer -x c - -o /dev/null 2>/dev/null || return 1
    echo '#include <string.h>' | arm-none-eabi-gcc -E -x c - >/dev/null 2>&1 || return 1
    for header in simavr/sim_avr.h gtest/gtest.h libelf.h; do
        echo "#include <$header>" | c++ -isystem /usr/include/simavr -E -x c++ - >/dev/null 2>&1 || return 1
    done
}

# libFuzzer is a package of its own, named after the version that clang is.
more() {
    apt-cache depends clang | sed -n 's/.*Depends: clang-\([0-9]*\)$/libclang-rt-\1-dev/p'
}

provide "compilers, emulator and test tools for the firmware" "its tests cannot run" \
    make gcc g++ libc6-dev gcc-avr avr-libc gcc-arm-none-eabi libnewlib-arm-none-eabi avrdude simavr \
    libsimavr-dev libelf-dev libgtest-dev gcovr cppcheck clang

# The Pico's emulator is a package of Node, which set-up has brought where there is none.
python=$(dirname "$0")/../.venv/bin/python
"$python" "$(dirname "$0")/pico.py" >/dev/null || [ "${CI:-}" != true ]
