#!/usr/bin/env bash
# install.sh CACHE PYTHON — puts the importers that tests/interop runs into CACHE, each at a pinned version. What cannot
# be installed is named and left out; its tests are then skipped.
set -uo pipefail
cache=$1
python=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "$cache"

say() { printf '== %s\n' "$*" >&2; }
# attempt NAME STAMP FUNCTION — once per version.
attempt() {
  [ "$(cat "$cache/$1/.installed" 2>/dev/null)" = "$2" ] && return
  say "installing $1 $2 into $cache"
  rm -rf "${cache:?}/$1"
  mkdir -p "$cache/$1"
  if "$3" "$2" "$cache/$1" >"$cache/$1/install.log" 2>&1; then
    printf '%s' "$2" >"$cache/$1/.installed"
  else
    say "$1 $2 could not be installed (see $cache/$1/install.log): its tests are skipped"
  fi
}

libcosim() { "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q "libcosimpy==$1"; }

maven() { mvn -q -B -Dmaven.repo.local="$cache/maven" "$@"; }
vdmcheck() {
  command -v mvn && command -v java || return 1
  local kind
  for kind in static rules; do
    maven org.apache.maven.plugins:maven-dependency-plugin:3.6.1:copy \
      -Dartifact="org.into-cps.vdmcheck.fmi2:vdmcheck2:$1:zip:distribution-$kind" -DoutputDirectory="$2" || return 1
    "$python" -m zipfile -e "$2/vdmcheck2-$1-distribution-$kind.zip" "$2/$kind" || return 1
  done
}
maestro() {
  command -v mvn && command -v java || return 1
  cp "$here/maestro.xml" "$2/pom.xml" &&
    maven -f "$2/pom.xml" org.apache.maven.plugins:maven-dependency-plugin:3.6.1:build-classpath \
      -Dmdep.outputFile="$2/classpath"
}
# Its build reads C headers with libclang, which is on PyPI too; GCC's own headers go with it. To optimise it would take
# longer than it runs.
fmi_sim() {
  command -v cargo || return 1
  "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q libclang==18.1.1 || return 1
  LIBCLANG_PATH=$(dirname "$(find "$2/venv" -name 'libclang.so')") \
  BINDGEN_EXTRA_CLANG_ARGS="-I$(cc -print-file-name=include)" \
    cargo install --debug --locked --version "$1" --root "$2" fmi-sim && rm -rf "$2/venv"
}
# Its library needs TBB, which is on PyPI too.
ecos() { "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q "ecospy==$1" tbb==2023.2.0; }
pathsim() { "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q "pathsim==$1" pathsim-fmi==0.1.1 fmpy==0.3.32; }
sofirpy() { "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q "sofirpy==$1" fmpy==0.3.32; }
fmucontainer() { "$python" -m venv "$2/venv" && "$2/venv/bin/pip" install -q "fmu-manipulation-toolbox==$1"; }
# FMI4j and JavaFMI; the versions are in java.xml.
java_importers() {
  command -v mvn && command -v javac || return 1
  cp "$here/java.xml" "$2/pom.xml" &&
    maven -f "$2/pom.xml" org.apache.maven.plugins:maven-dependency-plugin:3.6.1:build-classpath \
      -Dmdep.outputFile="$2/classpath"
}

attempt libcosim 0.0.6 libcosim
attempt vdmcheck 1.1.3 vdmcheck
attempt maestro 3.1.1 maestro
attempt ecos 0.7.2 ecos
attempt fmucontainer 2.0 fmucontainer
attempt pathsim 0.27.1 pathsim
attempt sofirpy 1.0.2 sofirpy
attempt java "$(cksum <"$here/java.xml")" java_importers
attempt fmi-sim 0.7.0 fmi_sim
exit 0
