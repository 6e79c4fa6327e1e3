#!/usr/bin/env bash
# The first stage of packages/Containerfile, at work in /src: builds the program into /usr/local/bin, and
# lists the distribution's packages whose libraries it loads in /usr/local/share/hermesh-packages.
set -euo pipefail
cd "$(dirname "$0")/.."
# The build directory is the preset's, so that a mounted ccache cache that the preset filled elsewhere can be
# reused.
cmake --preset release -DHERMESH_BUILD_TESTS=OFF -DHERMESH_BUILD_BENCHMARKS=OFF -DHERMESH_BUILD_PYTHON=OFF
ninja -C build/release hermesh hermesh-lab
for program in hermesh hermesh-lab; do strip -o /usr/local/bin/$program build/release/$program; done
# Packages list their files as they were before /lib became /usr/lib.
ldd /usr/local/bin/hermesh /usr/local/bin/hermesh-lab | awk '$3 ~ /^\// { print $3 }' | xargs -r -n 1 readlink -f | sort -u |
  while read -r library; do dpkg-query -S "$library" 2> /dev/null || dpkg-query -S "${library#/usr}"; done |
  cut -d: -f1 | sort -u > /usr/local/share/hermesh-packages
