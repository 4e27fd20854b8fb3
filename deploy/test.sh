#!/usr/bin/env bash
# Installs what is needed, builds everything and runs the whole test suite. Fails if anything fails or no
# test was found.
#
#   deploy/test.sh [--no-install] [CTEST ARGUMENTS...]
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install=1
if [[ "${1:-}" == --help || "${1:-}" == -h ]]; then
  usage
  exit 0
fi
if [[ "${1:-}" == --no-install ]]; then
  install=0
  shift
fi

if ((install)); then deploy/install-deps.sh; fi
say "configure"
configure_release
say "build"
cmake --build --preset release --parallel "$(build_jobs)"
say "test"
# The preset turns "no tests were found" into an error.
ctest --preset release --parallel "$(nproc)" "$@"
