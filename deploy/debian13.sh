#!/usr/bin/env bash
# Builds and tests the tree in a bare Debian 13, set up by debootstrap in a folder. Needs root, debootstrap,
# about 8 GB and, the first time, the network.
#
#   deploy/debian13.sh [FOLDER]        default: build/debian13; reused where it exists
#
# DEBIAN_MIRROR names the mirror; unset, the one that this machine's own apt uses, or debootstrap's default.
# DEBIAN_SUITE names another release (default: trixie).
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

case "${1:-}" in
  -h | --help)
    usage
    exit 0
    ;;
  -*) die "unknown option $1" ;;
esac
suite="${DEBIAN_SUITE:-trixie}"
folder="$(realpath -m "${1:-$root/build/debian13}")"
((EUID == 0)) || die "needs root"
command -v debootstrap >/dev/null || die "needs debootstrap: apt-get install debootstrap"
[[ "$folder" != / ]] || die "FOLDER is /"

mirror="${DEBIAN_MIRROR:-}"
if [[ -z "$mirror" ]]; then
  mirror="$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Component: main' 2>/dev/null |
    grep -m 1 -E '/debian/?$' || true)"
fi

if [[ ! -e "$folder/.stance-ready" ]]; then
  say "debootstrap $suite into $folder"
  mkdir -p "$folder"
  debootstrap --variant=minbase "$suite" "$folder" ${mirror:+"$mirror"}
  touch "$folder/.stance-ready"
fi
cp /etc/resolv.conf "$folder/etc/resolv.conf"

say "copy the tree"
rm -rf "$folder/stance"
mkdir -p "$folder/stance"
tar --create --exclude=./build --exclude=./out --exclude=./.git . | tar --extract --directory "$folder/stance"

say "build and test in $suite"
# A mount namespace of its own, so that nothing stays mounted however this ends.
unshare --mount -- bash -euc '
  mount -t proc proc "$1/proc"
  mkdir -p "$1/dev/shm"
  mount -t tmpfs tmpfs "$1/dev/shm"
  exec chroot "$1" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 \
    /stance/deploy/test.sh
' bash "$folder"
