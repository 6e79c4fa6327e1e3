#!/usr/bin/env bash
# Whether every name has one definition: what the linker takes for granted and no compiler sees.
#   experiments/check_one_definition.sh names    classes of one name in two files: seconds, builds nothing
#   experiments/check_one_definition.sh odr      the program linked from its types with -Wodr: ten minutes without a cache
#   experiments/check_one_definition.sh plain    the program without optimisation, and what certified-octree then makes
#   experiments/check_one_definition.sh          all of them
# Says what is wrong and exits with 1; builds in build/odr and build/plain.
set -euo pipefail
cd "$(dirname "$0")/.."
jobs=${JOBS:-$(nproc)}

build() {  # folder, then options of CMake
  local folder=$1
  shift
  cmake -S . -B "$folder" -G Ninja -DHERMESH_BUILD_TESTS=OFF -DHERMESH_BUILD_BENCHMARKS=OFF \
    -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=12 "$@" > "$folder.log"
  cmake --build "$folder" --target hermesh hermesh-lab -j "$jobs" >> "$folder.log" 2>&1 || { tail -40 "$folder.log"; exit 1; }
}

# A class or an enumeration in a named namespace that is defined in two files. Files with a main() or with
# tests are separate programs.
check_names() {
  find algorithms reference validation experiments packages/cpp -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' ! -name '*_test.cpp' ! -name main.cpp \) -print |
    grep -v '^experiments/bench/' | sort | xargs awk '
      FNR == 1 { depth = 0; hidden = 0; space = "" }
      { line = $0; sub(/\/\/.*/, "", line) }
      line ~ /^namespace \{/ { hidden = 1; next }
      line ~ /^}  *\/\/ namespace$/ || $0 ~ /^}  \/\/ namespace$/ { hidden = 0; next }
      line ~ /^namespace [a-z_:]+ \{/ { split(line, words, " "); space = words[2]; next }
      !hidden && line ~ /^(class|struct|enum class|enum|union) [A-Za-z_0-9]+( final)?( :[^;]*)? \{/ {
        name = line
        sub(/^(enum class|class|struct|enum|union) /, "", name)
        sub(/[^A-Za-z_0-9].*/, "", name)
        key = space "::" name
        if (key in seen && seen[key] != FILENAME) { print key " is defined in " seen[key] " and in " FILENAME; bad = 1 }
        seen[key] = FILENAME
      }
      END { exit bad }'
  echo "names: each class is defined in one file"
}

# Types are compared when link-time optimisation joins the files, which needs no optimisation of any of them.
check_odr() {
  mkdir -p build
  # Two types of one name, which the linker must see before anything is made of its silence.
  local two
  two=$(mktemp -d)
  echo 'struct S { int a; int f() const { return a; } }; int g(const S& s) { return s.f(); }' > "$two/a.cpp"
  echo 'struct S { char a[9]; int f() const { return a[0]; } }; int h(const S& s) { return s.f(); } int main() {}' > "$two/b.cpp"
  "${CXX:-c++}" -O0 -flto=auto -Wodr "$two/a.cpp" "$two/b.cpp" -o "$two/both" 2> "$two/said"
  grep -q Wodr "$two/said" || { echo "odr: this compiler does not tell of two types of one name"; exit 1; }
  # The linker must speak anew: it would be silent where nothing has changed since it spoke last.
  rm -rf "$two" build/odr/hermesh
  build build/odr -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O0 -flto=auto -Wodr" -DHERMESH_BUILD_PYTHON=OFF
  if grep -E 'Wodr|Wlto-type-mismatch|violates the C\+\+ One Definition Rule' build/odr.log; then exit 1; fi
  echo "odr: the program links without a word on definitions"
}

check_plain() {
  mkdir -p build
  build build/plain -DCMAKE_BUILD_TYPE=Debug
  local out
  out=$(mktemp -d)
  trap 'rm -r "$out"' EXIT
  # An octahedron of radius 1, which must stay closed.
  cat > "$out/octahedron.off" << 'OFF'
OFF
6 8 0
1 0 0
-1 0 0
0 1 0
0 -1 0
0 0 1
0 0 -1
3 0 2 4
3 2 1 4
3 1 3 4
3 3 0 4
3 2 0 5
3 1 2 5
3 3 1 5
3 0 3 5
OFF
  timeout 600 build/plain/hermesh remesh "$out/octahedron.off" "$out/octahedron.ply" --resolution 24 \
    --extractor certified-octree -o tolerance=0.5
  timeout 600 build/plain/hermesh validate "$out/octahedron.ply" --reference "$out/octahedron.off" --require watertight
  echo "plain: certified-octree runs without optimisation"
}

case "${1:-all}" in
  names) check_names ;;
  odr) check_odr ;;
  plain) check_plain ;;
  all) check_names && check_odr && check_plain ;;
  *) sed -n '2,7s/^# \{0,1\}//p' "$0"; [ "$1" = --help ] && exit 0 || exit 2 ;;
esac
