#!/usr/bin/env bash
# Runs and checks the demo as a user would: the daemon at a separate address, our client over TCP, 20 pings, a picture.
# usage: check_demo.sh BUILD_FOLDER [PICTURE]     exit code 0, or a sentence about the failure
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
folder=${1:?usage: check_demo.sh BUILD_FOLDER [PICTURE]}
picture=${2:-out/demo.png}
# The region of bare sand, 5.5 to 7.8 m, 12 degrees to port. tests/acceptance/picture_test.py checks these figures with 256 beams.
sand=250:350,150:250
pings=20 memory_limit_mb=300 first_ping_goal_s=1 first_ping_limit_s=20 stop_goal_ms=2000 stop_limit_ms=20000 wait_s=100
# An emulated processor is slower by this factor, so fewer pings are made; the emulator needs additional memory.
if [ -n "${SONARD_DEMO_SLOWNESS:-}" ]; then
  first_ping_limit_s=$((first_ping_limit_s * SONARD_DEMO_SLOWNESS)) stop_limit_ms=$((stop_limit_ms * SONARD_DEMO_SLOWNESS))
  wait_s=$((wait_s * SONARD_DEMO_SLOWNESS)) memory_limit_mb=$((2 * memory_limit_mb)) pings=5
fi

scratch=$(mktemp -d)
daemon=
finish() {
  [ -z "$daemon" ] || kill -KILL "$daemon" 2>/dev/null
  rm -rf "$scratch"
}
trap finish EXIT
fail() {
  echo "FAILED: $*" >&2
  [ ! -s "$scratch/log" ] || { echo "the daemon said:" >&2; cat "$scratch/log" >&2; }
  exit 1
}

# The demo, poses included, uses one address of this machine's own network, so that it disturbs no other program here.
write_config() {
  cat >"$scratch/sonard.yaml" <<YAML
world: {scene: $PWD/scenes/demo.yaml, seed: 1}
vehicles:
  - {name: rov, initial_pose: {frame: ENU_FLU, xyz_m: [-7, 0, -3]}, trajectory: orbit}
sonars:
  - name: front
    profile: oculus-m1200d
    mount: {frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}
    bind_ip: $1
    status_to: [$1]
poses: {protobuf: "$1:14770", json: "$1:14771"}
control: {stream: "$1:14770", http: "$1:8088"}
YAML
}

# The daemon ends with exit code 69 if an address is in use; then the next address is tried.
for attempt in 1 2 3 4 5; do
  address=127.$((64 + RANDOM % 64)).$((RANDOM % 256)).$((1 + RANDOM % 254))
  write_config "$address"
  started_at=$(date +%s.%N)
  "$folder/daemon/sonard" run "$scratch/sonard.yaml" >"$scratch/log" 2>&1 </dev/null &
  daemon=$!
  "$folder/clients/sonarctl" listen "$address" --wait $wait_s --pings $pings --quiet --started-at "$started_at" \
    --png "$picture" --record "$scratch/raw" >"$scratch/figures" 2>"$scratch/complaint"
  client=$?
  kill -0 "$daemon" 2>/dev/null && break
  wait "$daemon"
  [ $? = 69 ] && [ "$attempt" != 5 ] || { daemon=; fail "the daemon ended by itself"; }
  daemon=
done
[ $client = 0 ] || fail "$(cat "$scratch/figures" "$scratch/complaint")"

memory_mb=$(awk '/^VmHWM:/ {printf "%.0f", $2 / 1024}' "/proc/$daemon/status")
first_ping_s=$(sed -n 's/^first ping after \([0-9.]*\) s.*/\1/p' "$scratch/figures")
stop_from=$(date +%s%N)
kill -TERM "$daemon"
wait "$daemon"
ended=$?
stopped_ms=$((($(date +%s%N) - stop_from) / 1000000))
daemon=

cat "$scratch/figures"
"$folder/clients/sonarctl" stats --from-raw "$scratch/raw" --ping $((pings - 1)) --rows $sand | sed 's/^/  /'
echo "resident memory $memory_mb MB at most (limit $memory_limit_mb)"
echo "from start to first ping $first_ping_s s (goal $first_ping_goal_s)"
echo "stopped in $stopped_ms ms (goal $stop_goal_ms)"

exceeds() { awk -v a="$1" -v b="$2" 'BEGIN {exit !(a > b)}'; }
[ $ended = 0 ] || fail "the daemon ended with code $ended after SIGTERM"
[ -s "$picture" ] || fail "no picture in $picture"
exceeds "$memory_mb" "$memory_limit_mb" && fail "resident memory above $memory_limit_mb MB"
exceeds "$stopped_ms" "$stop_limit_ms" && fail "stopped only after $stopped_ms ms"
exceeds "$stopped_ms" "$stop_goal_ms" && echo "note: slower than $stop_goal_ms ms to stop; is the machine busy?"
exceeds "$first_ping_s" "$first_ping_limit_s" && fail "first ping only after $first_ping_s s"
exceeds "$first_ping_s" "$first_ping_goal_s" && echo "note: slower than $first_ping_goal_s s to the first ping; is the machine busy?"
echo "demo ok: $picture"
