#!/usr/bin/env bash
# Builds the Debian packages and the wheel: packages/make_packages.sh [BUILD], build/packages by default;
# takes as long as building the program, less with ccache. Writes them to BUILD/debian; lintian, if installed,
# must find no error in the packages. packages/check_clean_debian.sh tests them on a clean system, and
# packages/check_reproducible.sh that two builds have the same bytes.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${1:-build/packages}
# The same bytes of the same commit: the date in the packages is that of the commit.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || echo 0)}
export SOURCE_DATE_EPOCH
cmake --preset release -B "$build" -DCMAKE_INSTALL_PREFIX=/usr -DBUILD_SHARED_LIBS=ON \
  -DHERMESH_DEBIAN_PACKAGES=ON -DHERMESH_BUILD_PYTHON=ON -DHERMESH_BUILD_TESTS=OFF -DHERMESH_BUILD_BENCHMARKS=OFF
cmake --build "$build" -j "${JOBS:-$(nproc)}"
rm -rf "$build/debian"
# Packages hold what root owns and may not be written by the group, whoever builds them.
(umask 022 && cd "$build" && cpack -G DEB -B debian)
rm -rf "$build/debian/_CPack_Packages"
cmake --build "$build" --target hermesh_wheel
cp "$build"/packages/python/wheel/*.whl "$build/debian"
ls -l "$build/debian"
if command -v lintian > /dev/null; then
  lintian --allow-root --fail-on error "$build"/debian/*.deb
  echo "lintian: no error"
else
  echo "lintian is not installed; nobody looked for errors in the packages"
fi
