#!/usr/bin/env bash
# Prints the state of a Slurm job in Snakemake's terms: running, success or failed. Jobs that the controller
# no longer knows are looked up in the accounting data, if there is any.
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
