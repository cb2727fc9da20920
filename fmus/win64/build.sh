#!/usr/bin/env bash
# build.sh OUT PYTHON — cross-compiles the libraries of the FMUs, beam.dll to spring3.dll, for 64-bit Windows into OUT,
# with zig from PyPI, self-contained but for what Windows 10 has. SUNDIALS is compiled from SPRINGBEAM_SUNDIALS_SOURCE;
# Eigen and Spectra are the system's or those of SPRINGBEAM_PREFIX.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
python=$(cd "$(dirname "$2")" && pwd)/$(basename "$2")
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
tools=$(dirname "$python")
readonly zig_version=0.17.0

say() { printf '== %s\n' "$*" >&2; }
die() {
  printf '\nwin64: %s\n' "$*" >&2
  exit 1
}
quietly() { # LOG COMMAND…
  local log=$out/$1.log
  shift
  "$@" >"$log" 2>&1 || { tail -n 30 "$log" >&2; die "stopped; the whole log is in $log"; }
}

if ! [ -x "$out/zig/bin/python" ]; then
  say "installing ziglang $zig_version"
  "$python" -m venv "$out/zig"
  quietly zig "$out/zig/bin/pip" install -q "ziglang==$zig_version"
fi

for tool in cc c++ ar ranlib; do
  target=
  case $tool in cc | c++) target="-target x86_64-windows-gnu" ;; esac
  printf '#!/bin/sh\nexec "%s" -m ziglang %s %s "$@"\n' "$out/zig/bin/python" "$tool" "$target" >"$out/zig-$tool"
  chmod +x "$out/zig-$tool"
done
cat >"$out/toolchain.cmake" <<TEXT
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER "$out/zig-cc")
set(CMAKE_CXX_COMPILER "$out/zig-c++")
set(CMAKE_AR "$out/zig-ar" CACHE FILEPATH "")
set(CMAKE_RANLIB "$out/zig-ranlib" CACHE FILEPATH "")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
TEXT
cross=(-G Ninja "-DCMAKE_MAKE_PROGRAM=$tools/ninja" "-DCMAKE_TOOLCHAIN_FILE=$out/toolchain.cmake"
  -DCMAKE_BUILD_TYPE=Release)

[ -n "${SPRINGBEAM_SUNDIALS_SOURCE:-}" ] || die "the source of SUNDIALS is missing: SPRINGBEAM_SUNDIALS_SOURCE=…"
# The headers alone: the system's include folder would bring Linux' own with them.
mkdir -p "$out/include"
for prefix in "${SPRINGBEAM_PREFIX:-}" /usr /usr/local; do
  [ -d "$prefix/include/Spectra" ] && ln -sfn "$prefix/include/Spectra" "$out/include/Spectra" && break
done
if ! [ -f "$out/project/build.ninja" ]; then
  quietly configure "$tools/cmake" -S "$root" -B "$out/project" "${cross[@]}" "-DPython3_EXECUTABLE=$python" \
    -DSPRINGBEAM_TESTS=OFF "-DCMAKE_PREFIX_PATH=${SPRINGBEAM_PREFIX:-}" \
    "-DSPECTRA_INCLUDE_DIR=$out/include" -DEigen3_ROOT=/usr -DEigen3_DIR="${Eigen3_DIR:-/usr/share/eigen3/cmake}"
fi
say "building for win64"
quietly build "$tools/ninja" -C "$out/project" beam spring beam3 spring3
for name in beam spring beam3 spring3; do
  cmp -s "$out/project/fmus/$name.dll" "$out/$name.dll" || cp "$out/project/fmus/$name.dll" "$out/"
done
