#!/usr/bin/env bash
# Builds sonard on Debian 12 as an archive whose programs run in any folder: build/tarball/sonard-VERSION-linux-x86_64.tar.gz.
# Libraries are linked statically if Debian has static archives of them; other libraries are stored beside the programs. The
# system must have glibc 2.35 and libstdc++ of GCC 12 or newer: Debian 12, Ubuntu 22.04. tests/tools/release.sh runs this script
# in a bare system.
set -u -o pipefail
cd "$(dirname "$0")/../.." || exit 70
# shellcheck source=tests/tools/setup.sh
. tests/tools/setup.sh
need_packages "${build_packages[@]}" "${page_packages[@]}" || exit
version=$(sed -n 's/^project(sonard VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
name=sonard-$version-linux-$(uname -m)
folder=build/tarball stage=build/tarball/$name
archives=/usr/lib/$(g++ -dumpmachine)

# FFTW is left out, because its licence, the GPL, would apply to the programs. The farm is left out, because it needs OpenSSL,
# whose updates this archive would miss. GeoTIFF is left out, because its libtiff needs libjbig, which has the GPL. A run path of
# the old kind also applies when the libraries beside the programs load each other.
# shellcheck disable=SC2016
cmake -S . -B $folder -G Ninja -DCMAKE_BUILD_TYPE=Release -DBUILD_TESTING=OFF -DSONAR_FFTW=OFF -DSONAR_FARM=OFF -DSONAR_GEOTIFF=OFF -DSONAR_CUDA=OFF \
  -DCMAKE_INSTALL_RPATH='$ORIGIN/../lib/sonard;$ORIGIN/../../lib/sonard' -DCMAKE_EXE_LINKER_FLAGS=-Wl,--disable-new-dtags \
  -DZLIB_LIBRARY="$archives/libz.a" -DPNG_LIBRARY="$archives/libpng.a" -DSNAPPY_LIBRARY="$archives/libsnappy.a" \
  -DProtobuf_LIBRARY="$archives/libprotobuf.a" -DSONAR_WERROR="${SONAR_WERROR:-OFF}" \
  -DCMAKE_CXX_COMPILER_LAUNCHER="$(command -v ccache || true)" </dev/null >/dev/null || exit
NINJA_STATUS="[%f/%t] " cmake --build $folder --parallel "$(build_jobs)" --target installed </dev/null | tests/tools/build_progress.py
[ "${PIPESTATUS[0]}" = 0 ] || exit 1
rm -rf "$stage"
cmake --install $folder --prefix "$PWD/$stage" --strip >/dev/null || exit
rm -rf "$stage/lib/systemd"  # the unit is for /usr/bin

of_the_system='^(libc|libm|libdl|libpthread|librt|libstdc\+\+|libgcc_s|ld-linux[^.]*)\.so'
libraries() { ldd "$stage"/bin/* "$stage"/libexec/sonard/* | sed -n 's/^\t\([^ ]*\) => \([^ ]*\) .*/\1 \2/p' | sort -u | grep -vE "$of_the_system"; }
mapfile -t bundled < <(libraries)
for library in "${bundled[@]}"; do
  install -m 644 "${library#* }" "$stage/lib/sonard/${library% *}" || exit
  strip --strip-unneeded "$stage/lib/sonard/${library% *}"
done

# Lists the packages of all contents (libraries, and code that was compiled or linked in), whose licences the archive needs.
packages() {
  local package library
  for library in "${bundled[@]}"; do dpkg-query -S "*/$(basename "$(readlink -f "${library#* }")")"; done | sed 's/:.*//'
  for package in "${build_packages[@]}" libjs-three; do
    case $package in
      libfftw3-dev | libnats-dev | libtiff-dev | libgtest-dev | libgmock-dev | libeigen3-dev) ;;  # not in the archive
      *-dev | libjs-*) dpkg-query -W -f '${Package} ${Depends}\n' "$package" | sed 's/([^)]*)//g; s/[,|]/ /g' | tr -s ' ' '\n' ;;
    esac
  done | grep -E -- '-dev$|^libjs-' | grep -vE '^libc6?-dev$'
}
licences=$stage/share/doc/sonard/licences
mkdir -p "$licences/common" || exit
while read -r package; do
  [ ! -e "/usr/share/doc/$package/copyright" ] || cp "/usr/share/doc/$package/copyright" "$licences/$package"
done < <(packages | sort -u)
grep -rhoE '/usr/share/common-licenses/[A-Za-z0-9.-]*[A-Za-z0-9]' "$licences" "$stage/share/doc" | sort -u | while read -r text; do
  [ ! -e "$text" ] || cp -L "$text" "$licences/common"
done
cat >"$stage/README" <<TEXT
sonard $version for Linux on $(uname -m): bin/sonard and bin/sonarctl run from here, wherever this folder is.

It needs glibc 2.35 and libstdc++ of GCC 12, or newer: Debian 12, Ubuntu 22.04. Built without FFTW, the farm and GeoTIFF, so
measured and exact pulses and the paper mode are refused. Packages for Debian have all three.

Documents: share/doc/sonard. Licence: share/doc/sonard/copyright; of the libraries inside: share/doc/sonard/licences, where
"common" has the texts that Debian keeps in /usr/share/common-licenses.
TEXT

mapfile -t programs < <(find "$stage" -type f -exec sh -c 'case $(head -c 4 "$1") in *ELF) ;; *) exit 1 ;; esac' sh {} \; -print)
tests/architecture/check_symbol_versions.py GLIBC=2.35 GLIBCXX=3.4.30 CXXABI=1.3.13 "${programs[@]}" || {
  echo "the archive would not start on Ubuntu 22.04: see the symbols above" >&2
  exit 1
}
left=$(libraries | grep -v " $PWD/")
[ -z "$left" ] || { printf 'the programs take these libraries from the system:\n%s\n' "$left" >&2; exit 1; }
tar -C $folder --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$(git log -1 --format=%ct)" -cf - "$name" | gzip -9n \
  >"$stage.tar.gz" || exit
printf '%s, %s libraries beside %s programs, checked for glibc 2.35\n' "$(du -h "$stage.tar.gz" | cut -f 1)" ${#bundled[@]} "${#programs[@]}"
