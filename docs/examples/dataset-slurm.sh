#!/bin/bash
# sbatch dataset-slurm.sh: 64 array tasks share the shards of a job; run it again to make what is missing.
#SBATCH --array=0-63
#SBATCH --cpus-per-task=8
#SBATCH --time=04:00:00
set -eu
sonard dataset mines.yaml --out "$SCRATCH/mines" --threads "$SLURM_CPUS_PER_TASK" --quiet \
  --shards "$SLURM_ARRAY_TASK_ID/64"
