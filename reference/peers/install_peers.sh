#!/usr/bin/env bash
# Installs what the peers need (README.md): Debian's packages, and the npm packages of package-lock.json into node_modules here.
# What cannot be installed is named, and the others go on; experiments/questions/meshes/peers.toml notes an absent peer.
set -u
cd "$(dirname "$0")"

# One by one, because what a distribution has of these differs. Blender is the largest, with 430 MB on disk.
for package in libcgal-dev libopenmesh-dev libvtk9-dev python3-skimage python3-openvdb python3-open3d blender nodejs \
  assimp-utils python3-vtk9 meshlab xvfb xauth; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' && continue
  echo "Installing $package"
  DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "$package" >/dev/null 2>&1 ||
    echo "absent: $package could not be installed; apt-get install $package says why" >&2
done

if command -v npm >/dev/null; then
  npm ci --omit=optional --no-audit --no-fund --silent || echo "absent: the npm packages could not be installed" >&2
else
  echo "absent: there is no npm, and so no meshoptimizer and manifold-3d" >&2
fi
echo "Then: cmake --preset release && ninja -C build/release peers"
