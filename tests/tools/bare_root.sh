# Bare Debian systems in folders, for builds that must not use this machine's packages. Sourced by arm64.sh and release.sh.
# shellcheck shell=bash

# make_bare_root SUITE DIR: unpacks a new system into DIR, unless DIR has one. Its archive is kept in ~/.cache/sonard-roots;
# remove that folder to make it again.
make_bare_root() {
  local suite=$1 dir=$2 cache=${XDG_CACHE_HOME:-$HOME/.cache}/sonard-roots
  [ ! -e "$dir/etc/bare-$suite" ] || return 0
  [ "$(id -u)" = 0 ] || { echo "$dir: only root can make a Debian system there" >&2; return 77; }
  [ -z "$(ls -A "$dir" 2>/dev/null)" ] || { echo "$dir is neither empty nor a bare $suite of this script: name another folder" >&2; return 73; }
  mkdir -p "$cache" "$dir"
  if [ ! -s "$cache/$suite.tar" ]; then
    command -v mmdebstrap >/dev/null || { echo "mmdebstrap not found: apt-get install mmdebstrap" >&2; return 69; }
    say "making a bare Debian $suite"
    # shellcheck disable=SC2054
    local options=(--quiet --variant=apt --include=git,ca-certificates) here sources=/etc/apt/sources.list.d/debian.sources
    # shellcheck source=/dev/null
    here=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
    if [ -e "$sources" ]; then  # this machine's mirror
      sed "s/\b$here\b/$suite/g" "$sources" | mmdebstrap "${options[@]}" "$suite" "$cache/part.tar" -
    else
      mmdebstrap "${options[@]}" --keyring=/usr/share/keyrings/debian-archive-keyring.gpg "$suite" "$cache/part.tar" </dev/null
    fi && mv "$cache/part.tar" "$cache/$suite.tar" || { echo "mmdebstrap could not make a bare $suite: see above" >&2; return 69; }
  fi
  tar -C "$dir" -xf "$cache/$suite.tar" && touch "$dir/etc/bare-$suite"
}

# in_root DIR COMMAND...: runs a command as root of that system, with separate mounts, which end with the command, and with this
# machine's network.
in_root() {
  local dir=$1
  shift
  cp -L /etc/resolv.conf "$dir/etc/resolv.conf" 2>/dev/null
  # shellcheck disable=SC2016
  unshare --mount --propagation private bash -c '
    root=$1; shift
    mount -t proc proc "$root/proc" && mount --rbind /sys "$root/sys" && mount --rbind /dev "$root/dev" || exit 71
    exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 TERM=dumb ${http_proxy:+http_proxy="$http_proxy"} \
      ${https_proxy:+https_proxy="$https_proxy"} chroot "$root" "$@"' in_root "$dir" "$@"
}

# clone_into DIR: clones the last commit of this tree into /srv/sonard of that system; earlier builds there are removed.
clone_into() { rm -rf "$1/srv/sonard" && git clone -q --depth 1 "file://$PWD" "$1/srv/sonard"; }
