#!/usr/bin/env bash
# Shows the first five minutes of a new user: prints each command and its real output, which the README quotes.
# usage: first_minutes.sh [BUILD_FOLDER]     programs of a build, build/release by default
#        first_minutes.sh --package          builds the Debian package, installs it (as root) and uses that
# It uses the usual addresses: 127.0.0.2 and the ports of poses, control and status. Run it where no other program uses them, or
# with build/release/tests/own_network/in_own_network. Exit code 0 when all went well.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70

scratch=$(mktemp -d)
daemon=
finish() {
  [ -z "$daemon" ] || kill -KILL "$daemon" 2>/dev/null
  rm -rf "$scratch"
}
trap finish EXIT
failed=0
show() {  # show COMMAND...: prints the command, then runs it
  printf '$ %s\n' "$*"
  eval "$*" 2>&1 || { printf '(exit code %s)\n' $?; failed=1; }
  echo
}

if [ "${1:-}" = --package ]; then
  ./run.sh --package >"$scratch/build" 2>&1 </dev/null || { tail -n 40 "$scratch/build" >&2; exit 1; }
  show "apt-get install -y -qq ./build/release/sonard_0.1.0_amd64.deb >/dev/null && which sonard sonarctl"
else
  folder=$(cd "${1:-build/release}" && pwd) || exit 66
  PATH="$folder/daemon:$folder/clients:$PATH"
fi

cp scenes/sonard.yaml "$scratch/my.yaml"
root=$PWD
cd "$scratch" || exit 70
printf '$ sonard\n'
HOME=$scratch sonard >"$scratch/out" 2>"$scratch/log" &
daemon=$!
for ((i = 0; i < 1200; i++)); do grep -q '^ready in' "$scratch/log" && break; kill -0 $daemon 2>/dev/null || break; sleep 0.05; done
cat "$scratch/log"
grep -q '^ready in' "$scratch/log" || exit 1
echo
sonarctl listen --wait 100 --pings 1 --quiet >/dev/null 2>&1  # the first ping takes longest, maybe too long for doctor
said=$(wc -l <"$scratch/log")

show sonarctl doctor
show sonarctl view --png ping.png
show sonarctl listen --pings 20 --quiet
pose='{"timestamp":1.0,"position":[0,0,3],"attitude":[0,0.1,0.5],"velocity":[0,0,0]}'
if command -v nc >/dev/null; then
  show "echo '$pose' | nc -u -w0 127.0.0.1 14771"
else
  show "echo '$pose' > /dev/udp/127.0.0.1/14771"
fi
show "sonarctl status | head -n 6"
show "sonarctl set sonar front --range 5"
if command -v curl >/dev/null; then show curl -s http://127.0.0.1:8088/healthz; fi
show sonard check my.yaml
sleep 0.2
kill -TERM $daemon
wait $daemon
code=$?
daemon=
printf '# the log of sonard meanwhile\n'
tail -n +$((said + 1)) "$scratch/log"
[ $code = 0 ] || { echo "sonard ended with code $code" >&2; failed=1; }
[ -s ping.png ] || { echo "no picture" >&2; failed=1; }
cd "$root" || exit 70
exit $failed
