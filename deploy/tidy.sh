#!/usr/bin/env bash
# Checks the C++ sources with the tools that keep the house rules.
#
#   deploy/tidy.sh format          clang-format finds nothing to change
#   deploy/tidy.sh fix             clang-format changes what it finds
#   deploy/tidy.sh headers         every header compiles alone (slow: about 15 s per header that has LibTorch)
#   deploy/tidy.sh tidy [FILE...]  clang-tidy finds nothing (slow; default: every .cc file without LibTorch, whose
#                                  1.13 headers Debian 12's Clang can't read as C++20)
#   deploy/tidy.sh proto           buf lint finds nothing in proto/ (npm's @bufbuild/buf, fetched if it is not there)
#
# headers and tidy need a configured build/release (deploy/test.sh, or cmake --preset release).
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

cpp_files() { find client core proto server tests -name '*.cc' -o -name '*.h' | LC_ALL=C sort; }
need() { command -v "$1" >/dev/null || die "needs $1: apt-get install $1"; }
need_build() { [[ -f build/release/compile_commands.json ]] || die "no build/release: run cmake --preset release"; }

case "${1:-}" in
  format)
    need clang-format
    cpp_files | xargs clang-format --dry-run --Werror
    ;;
  fix)
    need clang-format
    cpp_files | xargs clang-format -i
    ;;
  headers)
    need_build
    cmake --build --preset release --parallel "$(build_jobs)" --target all_verify_interface_header_sets
    ;;
  proto)
    need npx
    cd proto
    npx --yes @bufbuild/buf lint
    ;;
  tidy)
    need clang-tidy
    need_build
    shift
    # Generated headers must exist; precompiled ones are GCC's and of no use to clang-tidy.
    if cmake --build build/release --target help | grep -q '^stance_proto:'; then
      cmake --build build/release --target stance_proto
    fi
    database="$(mktemp -d)"
    trap 'rm -rf "$database"' EXIT
    sed -E 's/ -Winvalid-pch| -include [^ ]*cmake_pch\.hxx//g' build/release/compile_commands.json \
      > "$database/compile_commands.json"
    files=("$@")
    if ((${#files[@]} == 0)); then
      mapfile -t files < <(cpp_files | grep '\.cc$' | grep -vxFf <(python3 tests/layering_test.py --torch .))
    fi
    printf '%s\0' "${files[@]}" |
      xargs -0 -n 1 -P "$(build_jobs)" clang-tidy --quiet -p "$database" --warnings-as-errors='*'
    ;;
  *)
    usage >&2
    exit 2
    ;;
esac
