#!/usr/bin/env bash
# sundials_source.sh OUT — puts the source of SUNDIALS, Debian's source package, into OUT/sundials… once and prints that
# folder.
set -euo pipefail
mkdir -p "$1/lists/partial" "$1/parts"
out=$(cd "$1" && pwd)

die() {
  printf '\nsundials_source: %s\n' "$*" >&2
  exit 1
}
found() { find "$out" -mindepth 1 -maxdepth 1 -name 'sundials*' -type d | sort | head -n 1; }

if [ -z "$(found)" ]; then
  command -v apt-get >/dev/null || die "there is no apt-get to fetch the source of SUNDIALS with"
  printf "== fetching Debian's source package of SUNDIALS\n" >&2
  # The machine's own package sources, asked for sources: most systems have only the binaries enabled.
  sed -n 's/^deb /deb-src /p' /etc/apt/sources.list >"$out/sources.list" 2>/dev/null || true
  for list in debian ubuntu; do
    [ ! -f "/etc/apt/sources.list.d/$list.sources" ] ||
      sed 's/^Types:.*/Types: deb-src/' "/etc/apt/sources.list.d/$list.sources" >"$out/parts/$list.sources"
  done
  apt=(apt-get -qq -o "Dir::Etc::sourcelist=$out/sources.list" -o "Dir::Etc::sourceparts=$out/parts"
    -o "Dir::State::lists=$out/lists" -o APT::Sandbox::User=root)
  (cd "$out" && "${apt[@]}" update && "${apt[@]}" source --download-only sundials &&
    tar xf sundials_*.orig.tar.*) >"$out/fetch.log" 2>&1 ||
    die "could not fetch it, see $out/fetch.log"
fi
found
