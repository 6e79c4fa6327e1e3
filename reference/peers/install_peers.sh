#!/usr/bin/env bash
# Installs the packages that the peers need (README.md): Debian packages, and the npm packages of
# package-lock.json into node_modules in this directory. A package that cannot be installed is reported, and
# the others are installed; experiments note an absent peer. --small leaves out Blender (430 MB), MeshLab,
# Open3D and the peers that are linked with VTK and OpenMesh.
set -u
cd "$(dirname "$0")"

packages=(libcgal-dev python3-openvdb python3-vtk9 assimp-utils nodejs npm)
[ "${1:-}" = --small ] || packages+=(libopenmesh-dev libvtk9-dev python3-skimage python3-open3d blender meshlab xvfb xauth)
# One by one, because their availability differs between distributions.
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' && continue
  [ "$package" = npm ] && command -v npm >/dev/null && continue  # nodejs of other sources contains it
  echo "Installing $package"
  DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$package" >/dev/null 2>&1 ||
    echo "absent: $package could not be installed; run apt-get install $package for the reason" >&2
done

if command -v npm >/dev/null; then
  npm ci --omit=optional --no-audit --no-fund --silent || echo "absent: the npm packages could not be installed" >&2
else
  echo "absent: npm is not installed, so meshoptimizer and manifold-3d are not available" >&2
fi
[ "${1:-}" = --small ] || echo "Next: cmake --preset release && ninja -C build/release peers"
