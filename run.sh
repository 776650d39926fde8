#!/usr/bin/env bash
# Sets up, builds and runs sonard. usage: ./run.sh [sonard arguments...]   without arguments: the demo, until Ctrl-C
#        ./run.sh --check   checks the demo: 20 pings over TCP, a picture in out/demo.png, figures; exit code 0 if all is well
#        ./run.sh --package makes Debian packages in build/release
set -u -o pipefail
cd "$(dirname "$0")" || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh

# shellcheck disable=SC2034  # read by setup_and_build
product_only=1
case "${1:-}" in
  -h | --help)
    sed -n '2,4s/^# //p' "$0"
    exit 0
    ;;
  --check)
    setup_and_build sonard sonarctl || exit
    say "checking the demo"
    exec tests/tools/check_demo.sh build/release
    ;;
  --package)
    # Tools of dpkg-dev and the command `file` read the packages' dependencies from the programs. Without these tools the
    # packages would state no dependencies.
    setup_and_build installed && need_packages dpkg-dev file && cd build/release && cpack -G DEB && say "packages" && ls -1 "$PWD"/*.deb
    exit
    ;;
esac

setup_and_build sonard sonarctl || exit
say "starting sonard: open the address that it prints first in a browser"
[ $# -gt 0 ] || set -- --demo
exec build/release/daemon/sonard "$@"
