#!/bin/sh
# SPDX-License-Identifier: MIT
# content/slurm/cook.sh INPUT ASSET [options of rill cook...]: cooks on a Slurm cluster. SEGMENTS (default 8) tasks of one job
# array cook a share of the spans each, a last job links them; INPUT and ASSET lie on a file system that all nodes share.
#   RILL        the tool (default: rill)      SEGMENTS     tasks (more than `rill cook --dry-run` has spans do nothing)
#   SBATCH_...  sbatch's own variables: partition, account, time limit; CPUS  threads a task (default 4)
# Cooked again after a failure, it goes on from the segments and spans that are finished.
set -eu
if [ $# -lt 2 ]; then
    sed -n '3,8s/^# //p' "$0" >&2
    exit 1
fi
quoted() {  # words as the jobs' shell is to read them
    for word; do printf "'%s' " "$(printf %s "$word" | sed "s/'/'\\\\''/g")"; done
}
absolute() { case $1 in /*) echo "$1" ;; *) echo "$PWD/$1" ;; esac }
RILL=$(command -v "${RILL:-rill}") || { echo "cook.sh: no rill tool; set RILL" >&2; exit 1; }
INPUT=$(absolute "$1")
ASSET=$(absolute "$2")
shift 2
SEGMENTS=${SEGMENTS:-8}
CPUS=${CPUS:-$(nproc)}
PARTS=$ASSET.parts
mkdir -p "$PARTS"
export RILL INPUT ASSET SEGMENTS CPUS PARTS

# Looked at once, before all tasks do it.
survey=$(sbatch --parsable --job-name=rill-survey --cpus-per-task="$CPUS" --output="$PARTS/survey.log" <<END
#!/bin/sh
exec "\$RILL" cook "\$INPUT" --survey "\$PARTS/survey.json" --jobs "\$CPUS" $(quoted "$@")
END
)
cook=$(sbatch --parsable --job-name=rill-cook --dependency=afterok:"${survey%%;*}" --array=1-"$SEGMENTS" --cpus-per-task="$CPUS" \
    --output="$PARTS/segment_%a.log" <<END
#!/bin/sh
exec "\$RILL" cook "\$INPUT" -o "\$PARTS/\$SLURM_ARRAY_TASK_ID-of-\$SEGMENTS.part" --segment "\$SLURM_ARRAY_TASK_ID/\$SEGMENTS" \
    --survey "\$PARTS/survey.json" --jobs "\$CPUS" $(quoted "$@")
END
)
link=$(sbatch --parsable --job-name=rill-link --dependency=afterok:"${cook%%;*}" --output="$ASSET.log" <<END
#!/bin/sh
"\$RILL" link "\$PARTS"/*-of-"\$SEGMENTS".part -o "\$ASSET"
code=\$?
[ \$code -ne 0 ] && [ \$code -ne 3 ] || rm -rf "\$PARTS"
exit \$code
END
)
echo "survey is job ${survey%%;*}, the segments are job ${cook%%;*}, linking is job ${link%%;*}; watch with squeue, read $ASSET.log"
