#!/bin/bash
# Submits workers while tasks wait: one array element per PER_WORKER ready tasks, up to MOST. Run it from cron or a
# systemd timer, once a minute.  autoscale.sh METRICS_URL [MOST [PER_WORKER]]
set -euo pipefail
readonly url="$1" most="${2:-16}" per_worker="${3:-4}"
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
ready="$(curl -fsS "$url" | awk '$1 == "bakewell_tasks_ready" { print int($2) }')"
running="$(squeue -h -n bakewell-worker -r | wc -l)"
wanted=$(((ready + per_worker - 1) / per_worker))
[[ $wanted -gt $most ]] && wanted=$most
[[ $wanted -le $running ]] && exit 0
sbatch --array="1-$((wanted - running))" "$here/workers.sbatch"
