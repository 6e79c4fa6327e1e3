#!/usr/bin/env bash
# Fuzzes the readers (README.md): experiments/fuzzing/fuzz.sh [--seconds N] [--coverage] [TARGET…]
#   --seconds N   time of each target (default: 60)
#   --coverage    only measures the coverage of the corpora that earlier calls have collected
#   TARGET        ply obj off stl gltf three_mf nifti raw vdb command_line job experiment benchmark result
#                 (default: all)
# Builds the programs with clang in build/fuzz. Begins with corpus/, findings/ and the corpora of earlier
# calls, which are kept in build/fuzz/corpus. Prints the executions and the coverage of each source. Exits
# with 1 at the first finding, and prints its file.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=60 targets=() only_coverage=
while [ $# -gt 0 ]; do
  case $1 in
    --seconds) seconds=$2; shift 2 ;;
    --coverage) only_coverage=1; shift ;;
    -*) sed -n '2,9s/^# \{0,1\}//p' "$0"; [ "$1" = --help ] && exit 0 || exit 2 ;;
    *) targets+=("$1"); shift ;;
  esac
done
[ ${#targets[@]} -gt 0 ] ||
  targets=(ply obj off stl gltf three_mf nifti raw vdb command_line job experiment benchmark result)

here=experiments/fuzzing out=build/fuzz
# Sources whose coverage is printed.
declare -A sources=(
  [ply]='io/mesh_file_ply.cpp' [obj]='io/mesh_file_obj.cpp' [off]='io/mesh_file_off.cpp'
  [stl]='io/mesh_file_stl.cpp'
  [gltf]='io/scenes/gltf_read.cpp io/scenes/gltf_document.cpp io/scenes/scene_files.cpp'
  [three_mf]='io/scenes/three_mf_read.cpp io/scenes/xml_reader.h io/scenes/zip_archive.cpp'
  [nifti]='io/import/import_volume.cpp'
  [raw]='io/import/import_volume.cpp'
  [vdb]='io/vdb_structure.cpp io/vdb_archive.cpp io/vdb_file.cpp io/grid_frame.cpp'
  [command_line]='cli/command_line.cpp cli/files.cpp cli/session.cpp' [job]='harness/read_job.cpp')
for format in ply obj off stl gltf three_mf; do
  sources[$format]+=' io/mesh_file.cpp io/mesh_file_bytes.cpp io/mesh_file_text.cpp'
  sources[$format]+=' io/mesh_file_attributes.cpp'
done

is_python() { [[ $1 =~ ^(experiment|benchmark|result)$ ]]; }
programs=()
for target in "${targets[@]}"; do is_python "$target" || programs+=("fuzz_$target"); done
if [ ${#programs[@]} -gt 0 ]; then
  cmake --preset fuzz >/dev/null
  cmake --build "$out" --target "${programs[@]}" -j 1 >"$out/build.log" ||
    { tail -n 30 "$out/build.log"; exit 1; }
fi

# Files that readers open by their path are written into memory.
TMPDIR=$(mktemp -d -p "$([ -d /dev/shm ] && echo /dev/shm || echo /tmp)")
export TMPDIR
trap 'rm -rf "$TMPDIR"' EXIT

fuzz() {  # fuzz TARGET: runs libFuzzer
  local leaks=1 log=$out/$1.log
  # OpenVDB loses a node if it finds a damaged block of values while it reads it.
  [ "$1" != vdb ] || leaks=0
  if ! ASAN_OPTIONS=detect_leaks=$leaks LLVM_PROFILE_FILE=/dev/null \
      "$out/$here/fuzz_$1" "$out/corpus/$1" "${seeds[@]}" -max_len=16384 -max_total_time="$seconds" \
      -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
      -artifact_prefix="$here/findings/$1/" >"$log" 2>&1; then
    grep -a -E 'ERROR|runtime error|what\(\)|Test unit written' "$log" || tail -n 20 "$log"
    echo "$1: finding; $log has the report"
    exit 1
  fi
  echo "$1: $(sed -n 's/^Done //p' "$log"), no finding"
}

coverage() {  # coverage TARGET: prints the coverage of lines by all files
  local profile=$TMPDIR/$1.profraw paths=() source
  ASAN_OPTIONS=detect_leaks=0 LLVM_PROFILE_FILE=$profile \
    "$out/$here/fuzz_$1" -runs=0 "$out/corpus/$1" "${seeds[@]}" >/dev/null 2>&1
  llvm-profdata-14 merge -sparse "$profile" -o "$profile.merged"
  for source in ${sources[$1]}; do
    case $source in io/*) paths+=("algorithms/$source") ;; *) paths+=("experiments/$source") ;; esac
  done
  llvm-cov-14 export -summary-only "$out/$here/fuzz_$1" -instr-profile "$profile.merged" "${paths[@]}" |
    python3 -c '
import json, sys
for file in json.load(sys.stdin)["data"][0]["files"]:
    lines = file["summary"]["lines"]
    name, count, percent = file["filename"].split("/")[-1], lines["count"], lines["percent"]
    print(f"  {name}: {percent:.0f}% of {count} lines")'
}

for target in "${targets[@]}"; do
  mkdir -p "$out/corpus/$target" "$here/findings/$target"
  if is_python "$target"; then
    /usr/bin/python3 -m experiments.fuzzing.fuzz_lab "$target" --seconds "$seconds"
  else
    seeds=("$here/corpus/$target" "$here/findings/$target")
    [ -n "$only_coverage" ] || fuzz "$target"
    coverage "$target"
  fi
  rmdir --ignore-fail-on-non-empty "$here/findings/$target"
done
