# shellcheck shell=bash
# SPDX-License-Identifier: BSD-3-Clause
# Sourced by examples/demo.sh, tests/run.sh, tests/bench/run.sh, tests/fuzz/run.sh and .ci/run: sees that the tools are there.
#   need_tools TOOL...    tools: build eigen doctest benchmark clang pkg-config
# On Debian and Ubuntu what is missing is installed by apt (with sudo when not root); elsewhere the list is printed and the script exits 1.

have_command() { command -v "$1" >/dev/null 2>&1; }

have_include() {
  local folder
  for folder in /usr/include /usr/local/include /opt/homebrew/include "${CMAKE_PREFIX_PATH:-/nowhere}/include"; do
    [ ! -e "$folder/$1" ] || return 0
  done
  return 1
}

# Prints the Debian packages that would supply what a tool lacks, one a line; nothing when it is all there.
missing_packages_of() {
  case $1 in
    build)
      have_command cmake || echo cmake
      have_command ninja || echo ninja-build
      have_command "${CXX:-c++}" || echo g++
      ;;
    eigen) have_include eigen3/Eigen/Core || have_include Eigen/Core || echo libeigen3-dev ;;
    doctest) have_include doctest/doctest.h || echo doctest-dev ;;
    benchmark) have_include benchmark/benchmark.h || echo libbenchmark-dev ;;
    pkg-config) have_command pkg-config || echo pkg-config ;;
    clang)
      have_command clang++ || echo clang
      clang_has_sanitizers || apt_packages_of_clang_runtime
      ;;
    *) echo "install_packages.sh knows no tool '$1'" >&2 && return 1 ;;
  esac
}

clang_has_sanitizers() {
  local runtime
  have_command clang++ || return 1
  runtime=$(clang++ -fsanitize=fuzzer,address '-###' -x c++ /dev/null 2>&1 | grep -oE '[^" ]*libclang_rt\.fuzzer[^" ]*\.a' | head -n 1) || true
  [ -n "$runtime" ] && [ -e "$runtime" ]
}

# Debian 12 and later have a package for the sanitizer runtime; before, clang itself brought it.
apt_packages_of_clang_runtime() {
  if have_command apt-cache && [ -n "$(apt-cache search --names-only '^libclang-rt-dev$' 2>/dev/null)" ]; then echo libclang-rt-dev; fi
}

apt_install() {
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    have_command sudo || { printf 'Missing, and there is neither root nor sudo to install it. Run as root:\n  apt-get install %s\n' "$*" >&2; exit 1; }
    as_root=(sudo)
  fi
  echo "Installing: $*"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

check_cmake_version() {
  local version
  version=$(cmake --version | sed -nE '1s/[^0-9]*([0-9]+\.[0-9]+).*/\1/p')
  if [ "${version%%.*}" -lt 3 ] || { [ "${version%%.*}" -eq 3 ] && [ "${version#*.}" -lt 23 ]; }; then
    echo "CMake $version is too old: 3.23 or later is needed (for example: pip install 'cmake>=3.23')" >&2
    exit 1
  fi
}

need_tools() {
  local tool missing=()
  for tool in "$@"; do
    mapfile -t -O "${#missing[@]}" missing < <(missing_packages_of "$tool")
  done
  if [ "${#missing[@]}" -gt 0 ]; then
    if have_command apt-get; then
      apt_install "${missing[@]}"
    else
      printf 'Please install these first (Debian package names; any C++20 compiler, CMake >= 3.23 and Eigen >= 3.4 will do):\n' >&2
      printf '  %s\n' "${missing[@]}" >&2
      exit 1
    fi
  fi
  check_cmake_version
}

# Parallel compilers: one a processor, and at most one a 1.5 GB of memory (Eigen under sanitizers is large).
build_jobs() {
  local processors memory_kb jobs
  processors=$(nproc 2>/dev/null || echo 2)
  memory_kb=$(sed -nE 's/^MemAvailable: *([0-9]+).*/\1/p' /proc/meminfo 2>/dev/null || true)
  jobs=$(( ${memory_kb:-6000000} / 1500000 ))
  [ "$jobs" -ge 1 ] || jobs=1
  [ "$jobs" -le "$processors" ] || jobs=$processors
  echo "$jobs"
}
