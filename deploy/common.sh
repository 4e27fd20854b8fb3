# shellcheck shell=bash
# Shared by the scripts in this folder; sourced, not run. Sets `root` and goes there; `called_from` is the folder
# that the script was called from.

set -euo pipefail
# shellcheck disable=SC2034
called_from="$PWD"
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"

say() { printf '==> %s\n' "$*"; }
die() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# The comment at the head of the script.
usage() { sed -n '2,/^[^#]/ { s/^# \{0,1\}//p; }' "$root/deploy/$(basename "$0")"; }

# Compilers to run at a time: one per CPU allowed, but a file that includes LibTorch takes about 1.5 GB.
build_jobs() {
  local cpus memory_gb
  cpus="$(nproc)"
  memory_gb="$(awk '/^MemAvailable:/ { print int($2 / 1048576) }' /proc/meminfo)"
  local by_memory=$((memory_gb / 2))
  if ((by_memory < 1)); then by_memory=1; fi
  echo "$((cpus < by_memory ? cpus : by_memory))"
}

# Configures build/release. Warnings are errors only for the compiler that Stance is developed with: what a newer
# one has to say should not stop a build.
configure_release() {
  local as_errors=OFF
  if [[ "$(${CXX:-c++} -dumpversion)" == 12* ]]; then as_errors=ON; fi
  cmake --preset release -DSTANCE_WARNINGS_AS_ERRORS="$as_errors"
}
