#!/usr/bin/env bash
# Judges drivers one after another and writes a page that compares them.
# usage: tests/judge/judge_drivers.sh PAGE FOLDER NAME VERSION TAP COMMAND [NAME VERSION TAP COMMAND]...
#   FOLDER gets a report for each driver and the matrix; it must be new. TAP: json, ros1:TOPIC, ros2:TOPIC or
#   none. COMMAND starts the driver (docs/judge.md).
#   SONARCTL=PROGRAM  instead of build/release/clients/sonarctl
set -u -o pipefail
if [ $# -lt 6 ] || [ $((($# - 2) % 4)) -ne 0 ]; then
  sed -n '2,6s/^# //p' "$0" >&2
  exit 64
fi
sonarctl=${SONARCTL:-$(dirname "$0")/../../build/release/clients/sonarctl}
page=$1 folder=$2
shift 2
reports=()
while [ $# -gt 0 ]; do
  report="$folder/$((${#reports[@]} + 1))-$1"
  printf '\n== %s %s\n' "$1" "$2"
  "$sonarctl" judge --jobs 2 --name "$1" --driver-version "$2" --tap "$3" --driver "$4" --out "$report"
  status=$?
  [ $status -le 1 ] || exit $status  # 1: the driver does not pass every MUST
  reports+=("$report")
  shift 4
done
"$sonarctl" judge merge "${reports[@]}" --out "$folder/matrix" --page "$page"
