#!/usr/bin/env bash
# Installs the Debian packages that building and testing Stance needs (Debian 12 or 13).
# Does nothing, and needs no network, when all are there. Run as root, or as a user who may sudo.
set -euo pipefail

packages=(
  # Tools.
  cmake g++ ninja-build pkg-config python3
  # core: the networks on LibTorch, the rest on Eigen and Abseil. LibTorch takes whatever BLAS the system
  # has; without OpenBLAS that is the reference one, many times slower. The OpenMP build shares
  # LibTorch's threads; the pthread one would bring its own.
  libopenblas0-openmp libtorch-dev
  libabsl-dev libcli11-dev libeigen3-dev libfmt-dev libnanoflann-dev libopenmesh-dev libstb-dev
  nlohmann-json3-dev zlib1g-dev
  # server and client.
  libgrpc++-dev libprotobuf-dev libspdlog-dev libssl-dev libtomlplusplus-dev prometheus-cpp-dev
  protobuf-compiler protobuf-compiler-grpc
  # training, to read rigged characters; optional.
  libassimp-dev
  # tests. They run openssl for certificates and a real prometheus; as a package it also starts a daemon.
  libbenchmark-dev libgmock-dev libgtest-dev openssl prometheus
)

missing=()
for package in "${packages[@]}"; do
  state="$(dpkg-query --show --showformat='${db:Status-Status}' "$package" 2>/dev/null || true)"
  if [[ "$state" != installed ]]; then missing+=("$package"); fi
done

if ((${#missing[@]} > 0)); then
  as_root=()
  if ((EUID != 0)); then
    command -v sudo >/dev/null || {
      echo "install-deps.sh: not root and no sudo; as root run: apt-get install ${missing[*]}" >&2
      exit 1
    }
    as_root=(sudo)
  fi
  echo "installing: ${missing[*]}"
  # A package list that can't be renewed need not stop us: the old one may do.
  "${as_root[@]}" apt-get update -q || echo "install-deps.sh: apt-get update failed; trying all the same" >&2
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q --yes --no-install-recommends "${missing[@]}"
fi

multiarch="$(g++ -print-multiarch)"
blas="$(readlink -f "/usr/lib/$multiarch/libblas.so.3")"
case "$blas" in
  *openblas-openmp*) ;;
  *) echo "install-deps.sh: libblas.so.3 is $blas; Stance is fastest with OpenBLAS (OpenMP):" \
    "update-alternatives --config libblas.so.3-$multiarch" >&2 ;;
esac
