#!/usr/bin/env bash
# What became of a Slurm job, in the words that Snakemake wants: running, success or failed. Jobs that the controller has
# forgotten are looked up in the accounts, where there are any.
set -euo pipefail
job=$1
state=$(scontrol --oneliner show job "$job" 2>/dev/null | grep -o 'JobState=[A-Z_]*' | cut -d= -f2) || true
[ -n "$state" ] || state=$(sacct --jobs "$job" --format State --noheader --parsable2 2>/dev/null | head -n 1 | cut -d' ' -f1) || true
case $state in
  COMPLETED) echo success ;;
  PENDING | CONFIGURING | RUNNING | COMPLETING | SUSPENDED | REQUEUED | RESIZING | SIGNALING | STAGE_OUT) echo running ;;
  # Without an answer the controller may be busy; it is asked again.
  "") scontrol ping >/dev/null 2>&1 && echo failed || echo running ;;
  *) echo failed ;;
esac
