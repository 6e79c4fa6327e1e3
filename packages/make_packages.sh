#!/usr/bin/env bash
# Builds the Debian packages: packages/make_packages.sh [BUILD], build/packages unless said; an hour the first time, for the
# objects of shared libraries are compiled anew. They lie in BUILD/debian in the end, and lintian, where it is installed, must
# find no error in them.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/packages}
cmake -S . -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr -DBUILD_SHARED_LIBS=ON \
  -DHERMESH_DEBIAN_PACKAGES=ON -DHERMESH_BUILD_TESTS=OFF -DHERMESH_BUILD_BENCHMARKS=OFF
cmake --build "$build" -j "${JOBS:-$(nproc)}"
rm -rf "$build/debian"
# Packages hold what root owns and may not be written by the group, whoever builds them.
(umask 022 && cd "$build" && cpack -G DEB -B debian)
rm -rf "$build/debian/_CPack_Packages"
ls -l "$build"/debian/*.deb
if command -v lintian > /dev/null; then
  lintian --allow-root --fail-on error "$build"/debian/*.deb
  echo "lintian: no error"
else
  echo "lintian is not installed; nobody looked for errors in the packages"
fi
