#!/bin/sh
# Installs the Debian or Ubuntu packages that are missing.  Usage: system_packages.sh demo|test|bench|bench-arm|embedded|lint|abi|fuzz|trust|windows, one or several
set -eu
wanted=" $* "
for_any() { # for_any NAME...: is one of them wanted
  for name; do case $wanted in *" $name "*) return 0 ;; esac; done
  return 1
}

missing=
need() { # need PACKAGE COMMAND...: the package, unless the command succeeds
  package=$1
  shift
  "$@" >/dev/null 2>&1 || missing="$missing $package"
}
python=${PYTHON:-python3}
has_specs() { "$1" -v --specs="$2"; }
has_header() { echo "#include <$1>" | c++ -x c++ -E -; }

has_browser() { command -v chromium || command -v chromium-browser || command -v google-chrome; }

need g++ command -v c++
need clang command -v clang++ # its kernels are faster, and faster to compile; cmake/compiler.cmake
need cmake command -v cmake
need make command -v make
need python3-venv "$python" -c 'import ensurepip, venv'
need python3-dev "$python" -c 'import os, sysconfig; assert os.path.exists(os.path.join(sysconfig.get_paths()["include"], "Python.h"))'
need libpugixml-dev has_header pugixml.hpp
if for_any test; then
  # it only saves time; where there is no apt-get, the Makefile takes the one of PyPI
  ! command -v apt-get >/dev/null || need ccache command -v ccache
  need pkg-config command -v pkg-config
  need doctest-dev has_header doctest/doctest.h
  need qemu-user command -v qemu-x86_64
  need binutils command -v nm
  need chromium has_browser
fi
if for_any bench bench-arm; then
  need libeigen3-dev test -e /usr/include/eigen3/Eigen/Core
fi
if for_any bench-arm; then
  need g++-aarch64-linux-gnu command -v aarch64-linux-gnu-g++
  need qemu-user command -v qemu-aarch64
fi
if for_any embedded; then
  need gcc-arm-none-eabi command -v arm-none-eabi-gcc
  need libnewlib-arm-none-eabi has_specs arm-none-eabi-gcc rdimon.specs
  need qemu-system-arm command -v qemu-system-arm
  need gcc-riscv64-unknown-elf command -v riscv64-unknown-elf-gcc
  need picolibc-riscv64-unknown-elf has_specs riscv64-unknown-elf-gcc picolibc.specs
  need qemu-system-misc command -v qemu-system-riscv32
  need cppcheck command -v cppcheck
fi
if for_any bench; then
  need liborocos-kdl-dev has_header kdl/chain.hpp
  need binutils command -v nm
fi
sanitizes() { echo 'int main() {}' | clang++ -fsanitize=fuzzer-no-link,address -x c++ - -o /dev/null; }
if for_any lint trust; then
  need clang-tidy command -v clang-tidy
  need cppcheck command -v cppcheck
fi
if for_any fuzz trust; then
  need doctest-dev has_header doctest/doctest.h
  need libclang-rt-dev sanitizes
fi
if for_any abi trust; then
  need abigail-tools command -v abidiff
fi
if for_any windows; then
  need doctest-dev has_header doctest/doctest.h
  need wine command -v wine
  need wine64 test -e /usr/lib/wine/wine64
fi
if for_any trust; then
  need valgrind command -v valgrind
  need llvm command -v llvm-profdata
  need g++-aarch64-linux-gnu command -v aarch64-linux-gnu-g++
  need qemu-user command -v qemu-x86_64
fi
[ -n "$missing" ] || exit 0

if ! command -v apt-get >/dev/null; then
  echo "KSL needs what Debian calls$missing; install it with your package manager" >&2
  exit 1
fi
sudo=
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "run as root, or install:$missing" >&2; exit 1; }
  sudo=sudo
fi
echo "installing$missing"
$sudo apt-get update -qq
DEBIAN_FRONTEND=noninteractive $sudo apt-get install -y -qq --no-install-recommends $missing >/dev/null
