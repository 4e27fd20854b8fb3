#!/usr/bin/env bash
# Builds and tests under the sanitizers' presets: address and undefined behaviour (asan), data races (tsan).
#
#   deploy/run-sanitizers.sh [--only REGEX] [PRESET...]      default: asan tsan, every test
#
# --only REGEX runs the tests whose names match, e.g. --only 'Batcher|MeshIo'.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

presets=()
ctest_arguments=()
while (($# > 0)); do
  case "$1" in
    -h | --help)
      usage
      exit 0
      ;;
    --only)
      (($# > 1)) || die "--only needs a regular expression"
      ctest_arguments+=(--tests-regex "$2")
      shift
      ;;
    asan | tsan) presets+=("$1") ;;
    *) die "unknown argument $1" ;;
  esac
  shift
done
if ((${#presets[@]} == 0)); then presets=(asan tsan); fi

for preset in "${presets[@]}"; do
  say "$preset"
  cmake --preset "$preset"
  cmake --build --preset "$preset" --parallel "$(build_jobs)"
  ctest --preset "$preset" --no-tests=error --parallel "$(nproc)" "${ctest_arguments[@]}"
done
