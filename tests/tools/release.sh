#!/usr/bin/env bash
# Builds the files of a release, each from a clone of the last commit in a bare Debian system, and checks them there.
# usage: tests/tools/release.sh [STEP...]
#   debian12, debian13  packages for amd64: installed in a bare system, demo checked
#   arm64               packages of Debian 12 for arm64, cross-built (tests/tools/arm64.sh): demo checked under qemu-user
#   tarball             for x86_64 without installation (tests/tools/tarball.sh): demo checked in bare Debian 12 and 13
#   source              the sources with the page already bundled: that page checked
#   sums                SHA256SUMS of all files in the folder
# Without STEP it runs all steps. The files go to out/release; SONARD_RELEASE_ROOTS names a folder for the systems (default
# ~/.cache/sonard-release, about 10 GB). Needs root, mmdebstrap and a tree without changes. See docs/releasing.md.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh
# shellcheck source=tests/tools/bare_root.sh
. tests/tools/bare_root.sh
roots=${SONARD_RELEASE_ROOTS:-${XDG_CACHE_HOME:-$HOME/.cache}/sonard-release}
out=$PWD/out/release
version=$(sed -n 's/^project(sonard VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)

case "${1:-}" in -h | --help) sed -n '2,10s/^# //p' "$0"; exit 0 ;; esac
[ $# -gt 0 ] || set -- debian12 debian13 arm64 tarball source sums
for step in "$@"; do
  case $step in debian12 | debian13 | arm64 | tarball | source | sums) ;; *) sed -n '2,10s/^# //p' "$0" >&2; exit 64 ;; esac
done
if [ -n "$(git status --porcelain)" ]; then
  printf 'a release is made of a commit, and this tree has changes: commit or remove them\n%s\n' "$(git status --short)" >&2
  exit 65
fi
tag=$(git describe --exact-match --tags --match 'v*' 2>/dev/null)
if [ -n "$tag" ] && [ "$tag" != "v$version" ]; then
  echo "the commit has the tag $tag, but CMakeLists.txt says version $version: change one of them" >&2
  exit 65
fi
mkdir -p "$roots" "$out" || exit

# system SUITE: sets root to the root of that system, with a clone of the last commit. All steps of this run share
# the clone and its builds.
declare -A cloned=()
system() {
  root=$roots/$1
  make_bare_root "$1" "$root" || return
  [ -n "${cloned[$1]:-}" ] || clone_into "$root" || return
  cloned[$1]=1
}

# fresh SUITE: sets root to the root of a bare system in which nothing was built, with a clone of the tree for its tools.
fresh() {
  root=$roots/check-$1
  rm -rf --one-file-system "$root" && make_bare_root "$1" "$root" && clone_into "$root"
}

# check_programs FOLDER: checks sonard and sonarctl in that folder of the root.
check_programs() {
  in_root "$root" bash -c 'set -e; cd /srv/sonard; mkdir -p /srv/check/daemon /srv/check/clients
    ln -sf "$0/sonard" /srv/check/daemon/sonard; ln -sf "$0/sonarctl" /srv/check/clients/sonarctl
    "$0/sonard" --version; tests/tools/check_demo.sh /srv/check /srv/check/demo.png' "$1"
}

packages() {  # packages SUITE NUMBER
  system "$1" || return
  in_root "$root" bash -c 'cd /srv/sonard && . tests/tools/setup.sh && setup_and_build installed && need_packages dpkg-dev file &&
    cd build/release && rm -f ./*.deb && cpack -G DEB -D CPACK_DEBIAN_PACKAGE_VERSION="$0"' "$version+deb$2" || return
  cp "$root"/srv/sonard/build/release/*.deb "$out" || return
  fresh "$1" && cp "$out"/*"+deb$2_amd64.deb" "$root/srv" || return
  in_root "$root" bash -c 'apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends \
    -o Dpkg::Use-Pty=0 install /srv/*.deb </dev/null' && check_programs /usr/bin
}
debian12() { packages bookworm 12; }
debian13() { packages trixie 13; }

arm64() {
  tests/tools/arm64.sh --root "$roots/arm64" setup build demo || return
  in_root "$roots/arm64" bash -c 'cd /srv/sonard/build/arm64 && rm -f ./*.deb &&
    cpack -G DEB -D CPACK_DEBIAN_PACKAGE_VERSION="$0"' "$version+deb12" || return
  cp "$roots"/arm64/srv/sonard/build/arm64/*_arm64.deb "$out"
}

tarball() {
  local suite name=sonard-$version-linux-x86_64
  system bookworm && in_root "$root" /srv/sonard/tests/tools/tarball.sh || return
  cp "$root/srv/sonard/build/tarball/$name.tar.gz" "$out" || return
  for suite in bookworm trixie; do
    fresh "$suite" && tar -C "$root/opt" -xf "$out/$name.tar.gz" && check_programs "/opt/$name/bin" || return
  done
}

source_archive() {
  local name=sonard-$version page=build/release/clients/web/page/page_files.cpp
  system bookworm || return
  in_root "$root" bash -c 'cd /srv/sonard && . tests/tools/setup.sh && setup_and_build sonar_page_files' || return
  git archive --prefix="$name/clients/web/" --add-file="$root/srv/sonard/$page" --prefix="$name/" HEAD | gzip -9n \
    >"$out/$name.tar.gz" || return
  # Checks that a daemon built without a bundler has the same page.
  rm -rf "${root:?}/srv/$name" && tar -C "$root/srv" -xf "$out/$name.tar.gz" || return
  in_root "$root" bash -c 'cd "/srv/$0" && cmake --preset release -DSONARD_THREE_DIR=/none | grep "page of the live view as the release" &&
    cmake --build build/release --target sonar_page_files >/dev/null && cmp clients/web/page_files.cpp "/srv/sonard/$1"' "$name" "$page"
}

sums() { (cd "$out" && rm -f SHA256SUMS && sha256sum -- * >SHA256SUMS && sha256sum --check --quiet SHA256SUMS && cat SHA256SUMS); }

for step in "$@"; do
  say "release $version: $step"
  case $step in
    source) source_archive ;;
    *) "$step" ;;
  esac || { echo "release $version FAILED: $step; results of earlier steps are in $out" >&2; exit 1; }
done
