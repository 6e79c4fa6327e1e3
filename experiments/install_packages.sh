# Sourced by ./reproduce and ./test: install_packages NAME… installs the missing packages of the distribution,
# or, without root, lists them and stops.

# To build, run and test the program.
hermesh_packages=(
  g++ cmake ninja-build ccache pkg-config ca-certificates git
  libopenvdb-dev libtbb-dev libeigen3-dev libimath-dev libboost-dev libcgal-dev libopenmesh-dev libembree-dev
  libcairo2-dev libcli11-dev libtomlplusplus-dev nlohmann-json3-dev libssl-dev zlib1g-dev libminizip-dev
  libexpat1-dev libbenchmark-dev libgtest-dev
  libopenvdb-tools python3 pybind11-dev python3-dev python3-numpy python3-scipy python3-matplotlib python3-jinja2 python3-venv)

# To build the documentation site (docs/build.sh).
docs_packages=(python3-sphinx python3-myst-parser python3-numpydoc python3-breathe doxygen furo)

# To run sweeps on all cores of a machine, and to try them on a cluster of one node (experiments/sweep).
sweep_packages=(snakemake)
slurm_packages=(slurm-wlm munge)

install_packages() {
  local missing=() name
  if ! command -v dpkg-query >/dev/null; then
    echo "This is no Debian-like system: install what these Debian packages hold by hand: $*" >&2
    return 0
  fi
  for name in "$@"; do
    dpkg-query -W -f='${Status}' "$name" 2>/dev/null | grep -q 'ok installed' || missing+=("$name")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  if [ "$(id -u)" -ne 0 ]; then
    echo "These packages are missing: ${missing[*]}" >&2
    echo "Install them with: sudo apt-get install --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
  echo "Installing packages: ${missing[*]}"
  local log
  log=$(mktemp)
  if ! { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"; } \
      >"$log" 2>&1; then
    tail -n 20 "$log" >&2
    echo "The packages could not be installed; the lines above say why." >&2
    exit 1
  fi
  rm -f "$log"
}
