#!/usr/bin/env bash
# Sets up, builds and runs sonard. usage: ./run.sh [sonard arguments...]   without arguments: the demo, until Ctrl-C
#        ./run.sh --check   runs the demo by itself: 20 pings over TCP, a picture in out/demo.png, the figures; exit code 0 or not
set -u -o pipefail
cd "$(dirname "$0")" || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

case "${1:-}" in
  -h | --help)
    sed -n '2,3s/^# //p' "$0"
    exit 0
    ;;
  --check)
    setup_and_build sonard sonarctl || exit
    say "checking the demo"
    exec tests/tools/check_demo.sh build/release
    ;;
esac

setup_and_build sonard sonarctl || exit
say "starting sonard"
[ $# -gt 0 ] || set -- --demo
exec build/release/daemon/sonard "$@"
