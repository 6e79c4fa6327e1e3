#!/usr/bin/env bash
# Checks that a sweep whose jobs are killed makes the rows of one run: experiments/sweep/prove_slurm.sh
# [FOLDER], a few minutes, on a Slurm cluster that SLURM_CONF or the system's configuration names
# (experiments/sweep/one_node_slurm.sh makes one of this machine). Runs the 24 cells of proof.toml undivided,
# then as three shards that are Slurm jobs of Snakemake, with the profile of slurm/. In the middle of one
# shard its job is cancelled, and in the middle of another the process is killed with signal 9; Snakemake
# submits both again. Exits with 0 if both were killed in the middle, what they had made was kept and not made
# again, and the merged rows are those of the undivided run, none lost or doubled.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
program=${HERMESH:-$root/build/release/hermesh}
out=${1:-$root/results/local/prove_slurm}
shards=3 cells=24 per_group=3

fail() {
  echo "NOT PROVEN: $*" >&2
  exit 1
}
rows() { cat "$out/sweep/shards/$1/rows.jsonl" 2>/dev/null | wc -l; }
# The number of cells that a shard has, from its manifest.
planned() {
  python3 -c 'import json, sys; m = json.load(open(sys.argv[1])); print(sum(c[2] == m["shard"] for c in m["cells"]))' \
    "$out/sweep/shards/$1/shard.json"
}
# Waits until a shard has rows of some of its cells, keeps these aside, and prints their number.
in_the_middle() {
  for _ in $(seq 1200); do
    [ "$(rows "$1")" -ge "$per_group" ] && break
    kill -0 "$snakemake" 2>/dev/null || { tail -n 30 "$out/snakemake.txt" >&2; fail "the workflow ended before shard $1 had rows"; }
    sleep 0.1
  done
  cp "$out/sweep/shards/$1/rows.jsonl" "$out/before-$1.jsonl"
  wc -l <"$out/before-$1.jsonl"
}
job_of() { squeue --noheader --format='%A %j' | awk -v name="hermesh-shard-$1" '$2 == name { print $1 }'; }

# What an earlier proof left is taken away; a folder with anything else in it was not meant.
if [ -n "$(ls -A "$out" 2>/dev/null)" ] && [ ! -e "$out/whole.txt" ]; then
  fail "'$out' has files that no proof made; name a folder that is not there, or an empty one"
fi
rm -rf "$out"
mkdir -p "$out"
out=$(cd "$out" && pwd)
echo "== undivided"
"$program" run "$here/proof.toml" --threads 1 --out "$out/whole" --quiet >"$out/whole.txt"
[ "$(wc -l <"$out/whole/rows.jsonl")" = $cells ] || fail "the undivided run has not $cells rows"

echo "== $shards shards as Slurm jobs"
# Snakemake locks the folder that it works in, which thus is one of this proof alone.
snakemake --directory "$out" --snakefile "$here/Snakefile" --profile "$here/slurm" --latency-wait 5 --config experiment="$here/proof.toml" \
  shards=$shards threads=1 memory=1000 minutes=30 out="$out/sweep" program="$program" >"$out/snakemake.txt" 2>&1 &
snakemake=$!
trap 'kill $snakemake 2>/dev/null || true' EXIT

had_1=$(in_the_middle 1)
job=$(job_of 1)
[ -n "$job" ] || fail "shard 1 has no job"
scancel "$job"
echo "cancelled job $job of shard 1 after $had_1 of $(planned 1) cells"
had_2=$(in_the_middle 2)
# The program itself, neither the shell above it nor its child for the cells.
process=$(pgrep -f -- "experiments.lab run .* --out $out/sweep/shards/2\$") || fail "shard 2 has no process"
kill -9 "$process"
echo "killed process $process of shard 2 (job $(job_of 2)) after $had_2 of $(planned 2) cells"
[ "$had_1" -lt "$(planned 1)" ] && [ "$had_2" -lt "$(planned 2)" ] || fail "a shard was done before it could be killed"

trap - EXIT
wait $snakemake || { tail -n 30 "$out/snakemake.txt" >&2; fail "the workflow did not end well"; }
grep -E 'restart|Trying to restart' "$out/snakemake.txt" || fail "no job was submitted again"
for i in 1 2; do
  cmp -n "$(stat -c %s "$out/before-$i.jsonl")" "$out/before-$i.jsonl" "$out/sweep/shards/$i/rows.jsonl" ||
    fail "rows of shard $i from before it was killed are lost"
  [ "$(rows $i)" = "$(planned $i)" ] || fail "shard $i has $(rows $i) rows for $(planned $i) cells"
  grep -h 'already, made by this program' "$out/sweep/log/$i.txt" || fail "shard $i was not taken up where it stopped"
done

echo "== merged against undivided"
merged=$out/sweep/merged/rows.jsonl
distinct=$(python3 -c 'import json, sys; print(len({json.loads(line)["cell"] for line in open(sys.argv[1])}))' "$merged")
echo "$(wc -l <"$merged") rows of $distinct distinct cells; undivided: $(wc -l <"$out/whole/rows.jsonl")"
[ "$(wc -l <"$merged")" = $cells ] && [ "$distinct" = $cells ] || fail "rows were lost or doubled"
"$program" compare "$out/whole" "$out/sweep/merged" --times no --tolerance 0 || fail "the rows differ"
"$program" compare "$out/sweep/merged" "$out/whole" --times no --tolerance 0 >/dev/null || fail "the rows differ"
echo "PROVEN: the rows of killed and resumed jobs are those of one run"
