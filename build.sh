#!/usr/bin/env bash
# Everything from a fresh checkout: ./build.sh help
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

usage() {
  cat <<'TEXT'
./build.sh run [SCENE] [OPTION]…   set up, build, and simulate a scene (default: soft)
./build.sh test [PYTEST OPTION]…   set up, build, and run all tests (C++, then Python)
./build.sh kernels [OPTION]…        run the numeric tests as on other processors: with the linear algebra of three of them
./build.sh fmus                    set up and build all that is compiled: the FMUs and systems in fmus/, and what the master calls them by
./build.sh win64                   also cross-compile for 64-bit Windows; the FMUs then carry both
./build.sh interop                 install importers that others wrote into a cache folder and run the FMUs in them
./build.sh bench [GROUP]…          measure the speed and write the tables of docs/performance.md (minutes)
./build.sh campaign [OPTION]…      run random scenes beside a reference: what is wrong, and what of that is said (minutes)
./build.sh browser                 install playwright and Chromium and look at the report in it
./build.sh docs                    make the pages of docs/ into a site, build/site/index.html
./build.sh wheel                   build a source archive, and from that a wheel, into dist/, and test the wheel
./build.sh sanitize                run the C++ tests and some random calls with sanitizers (memory, undefined behaviour, threads)
./build.sh fuzz [SEED]             a million random calls of each FMU with sanitizers (about 10 minutes for each version of FMI)
./build.sh lint                    formatters, linters and type checker

Set-up makes .venv here and installs Python packages into it; as root it also installs the system packages that are
missing (Debian, Ubuntu), otherwise it names them. Variables:
  PYTHON             the Python to start from, 3.10 or later (default: python3)
  CXX                the C++17 compiler
  SPRINGBEAM_PREFIX  where Eigen, Spectra, SUNDIALS and GoogleTest are if not in the system (also: CMAKE_PREFIX_PATH)
  SPRINGBEAM_SUNDIALS_SOURCE  source of SUNDIALS 6.2 to 7 (default: Debian's source package, fetched once into the
                     cache); empty: take the installed SUNDIALS
  SPRINGBEAM_CACHE   where the source of SUNDIALS and the importers of `interop` are (default: ~/.cache/springbeam)
  CHROMIUM           the browser for `browser` (default: chromium, chromium-browser or google-chrome)
  JOBS               parallel compilations (default: all processors)
TEXT
}

say() { printf '== %s\n' "$*" >&2; }
die() {
  printf '\nbuild.sh: %s\n' "$*" >&2
  exit 1
}

readonly venv=.venv
readonly python=$venv/bin/python
readonly cache=${SPRINGBEAM_CACHE:-${XDG_CACHE_HOME:-$HOME/.cache}/springbeam}
readonly sundials=${SPRINGBEAM_SUNDIALS_SOURCE-fetched}

# install_packages WHAT PACKAGE… — with apt as root; otherwise say what is missing.
apt_updated=
install_packages() {
  local what=$1
  shift
  if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
    say "installing $*"
    [ -n "$apt_updated" ] || apt-get update -qq || true
    apt_updated=1
    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" >&2 ||
      die "$what missing, and apt-get could not install: $*"
  else
    die "$what missing. Debian/Ubuntu packages: $*
  sudo apt-get install $*
or name a prefix that has them: SPRINGBEAM_PREFIX=/path ./build.sh …"
  fi
}

python_is_recent() { "$1" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; }

make_environment() {
  local base=${PYTHON:-python3}
  if ! [ -x $python ] || ! $python -m pip --version >/dev/null 2>&1; then
    command -v "$base" >/dev/null || install_packages "Python is" python3 python3-venv
    python_is_recent "$base" || die "$base is older than 3.10; name a later one: PYTHON=… ./build.sh …"
    say "making $venv"
    rm -rf $venv
    # Debian's python3 comes without ensurepip.
    if ! "$base" -m venv $venv >/dev/null 2>&1; then
      rm -rf $venv
      install_packages "Python's venv module is" python3-venv
      "$base" -m venv $venv || die "$base -m venv failed"
    fi
  fi
}

# install NAME PACKAGE… — with pip, once for each state of pyproject.toml.
install() {
  local installed=$venv/.installed-$1 stamp
  stamp=$(cksum <pyproject.toml)" $*"
  [ "$(cat "$installed" 2>/dev/null)" != "$stamp" ] || return 0
  say "installing Python packages ($1)"
  shift
  # Python compiles what it imports: to compile all that there is would take as long as to install it.
  $python -m pip install --quiet --no-compile --disable-pip-version-check "$@" ||
    die "pip could not install $* (is there a network, or PIP_INDEX_URL to set?)"
  printf '%s' "$stamp" >"$installed"
}

# install_rest run|dev — to use it, or to test it, too; by a pip that is not as slow as those of older versions of Python.
install_rest() {
  install pip "pip>=25"
  if [ "$1" = run ]; then install run -e .; else install "$1" -e ".[$1]"; fi
}

set_up_python() {
  make_environment
  install "$1" -e ".[$1]"
}

# has_header HEADER — where CMake would look for it.
has_header() {
  local flags=(-I/usr/include/eigen3) dir
  local IFS=':;'
  for dir in ${SPRINGBEAM_PREFIX:-} ${CMAKE_PREFIX_PATH:-}; do
    flags+=(-I"$dir/include" -I"$dir/include/eigen3")
  done
  echo "#include <$1>" | "${CXX:-c++}" -std=c++17 -E "${flags[@]}" -x c++ - >/dev/null 2>&1
}

# get_sundials — names the source of SUNDIALS in SPRINGBEAM_SUNDIALS_SOURCE, unless that is set.
get_sundials() {
  if [ -z "${SPRINGBEAM_SUNDIALS_SOURCE+set}" ]; then
    SPRINGBEAM_SUNDIALS_SOURCE=$(fmus/sundials_source.sh "$cache/sundials") || say "the installed SUNDIALS is used instead"
  fi
  export SPRINGBEAM_SUNDIALS_SOURCE
  [ -n "$SPRINGBEAM_SUNDIALS_SOURCE" ]
}

set_up_system() {
  local missing=()
  command -v "${CXX:-c++}" >/dev/null || install_packages "a C++ compiler is" g++
  has_header Eigen/SparseCore || missing+=(libeigen3-dev)
  has_header Spectra/SymGEigsShiftSolver.h || missing+=(libspectra-dev)
  get_sundials || has_header ida/ida.h || missing+=(libsundials-dev)
  has_header gtest/gtest.h || missing+=(libgtest-dev)
  [ ${#missing[@]} = 0 ] || install_packages "libraries are" "${missing[@]}"
}

# progress — says every ten seconds what was done last.
progress() {
  local last
  while sleep 10 >/dev/null 2>&1 9<&-; do
    last=$(tail -n 1 build/ninja.log 2>/dev/null | cut -c 1-100) || true
    say "$SECONDS s: ${last:-before compiling}"
  done
}

# build PACKAGES TARGET… — with the Python packages to use it (run) or to test it, too (dev).
build() {
  local packages=$1
  shift
  # One at a time: two would build into the same folder.
  exec 9<.
  command -v flock >/dev/null && { flock -n 9 || { say "waiting for another build"; flock 9; }; }
  rm -f build/ninja.log
  progress &
  local reporting=$!
  trap 'kill '$reporting' 2>/dev/null || true' EXIT
  make_environment
  # What the build takes comes first, FMPy for its headers.
  install build --no-deps cmake ninja fmpy &
  local configured installing=$!
  configured="$PWD ${SPRINGBEAM_PREFIX:-} ${CMAKE_PREFIX_PATH:-} ${CXX:-} $sundials"
  if [ "$(cat build/.configured 2>/dev/null)" != "$configured" ]; then
    rm -rf build
    set_up_system
  fi
  wait $installing
  # All else is installed while the compiler works.
  install_rest "$packages" &
  installing=$!
  if [ ! -f build/.configured ]; then
    say "configuring"
    $venv/bin/cmake -S . -B build -G Ninja -DCMAKE_MAKE_PROGRAM="$PWD/$venv/bin/ninja" \
      -DPython3_EXECUTABLE="$PWD/$python" >build.log 2>&1 || {
      cat build.log >&2
      rm -f build.log
      die "CMake stopped, see above"
    }
    mv build.log build/configure.log
    say "$(grep -o 'SUNDIALS [0-9].*' build/configure.log)"
    printf '%s' "$configured" >build/.configured
  fi
  # Once asked for, Windows is kept up to date with the rest.
  [ ! -f build/win64/beam.dll ] || { get_sundials && fmus/win64/build.sh build/win64 $python; }
  say "building"
  $venv/bin/ninja -C build ${JOBS:+-j "$JOBS"} "$@" >build/ninja.log 2>&1 || {
    cat build/ninja.log >&2
    die "the build stopped, see above"
  }
  echo "all is compiled; Python packages are being installed" >>build/ninja.log
  wait $installing
  kill $reporting
  exec 9<&-
}

# Pages and texts of the package have none of the words of docs/words.txt.
no_words_to_avoid() {
  ! grep -rnE --include='*.md' --include='*.py' -f <(sed -n '/^#/!s/ -> .*//p' docs/words.txt) README.md docs src_* master/springbeam
}

readonly fuzzers=(fuzz_beam fuzz_spring fuzz_beam3 fuzz_spring3)
# build_sanitized NAME SANITIZERS TARGET… — in build/NAME.
build_sanitized() {
  local folder=build/$1 sanitizers=$2
  shift 2
  say "building with sanitizers: $sanitizers"
  $venv/bin/cmake -S . -B "$folder" -G Ninja -DCMAKE_MAKE_PROGRAM="$PWD/$venv/bin/ninja" \
    -DPython3_EXECUTABLE="$PWD/$python" -DSPRINGBEAM_SANITIZE="$sanitizers" >/dev/null || die "CMake stopped, see above"
  $venv/bin/ninja -C "$folder" ${JOBS:+-j "$JOBS"} --quiet "$@" >&2 || die "the build stopped, see above"
}
readonly memory_sanitizers=address,undefined,float-cast-overflow

command=${1:-help}
[ $# = 0 ] || shift
case $command in
  run)
    build run beam_fmu spring_fmu advance # no more than a run takes
    [ $# -gt 0 ] || set -- soft
    exec $venv/bin/springbeam run "$@"
    ;;
  test)
    build dev
    failed=
    say "C++ tests"
    $venv/bin/ctest --test-dir build --output-on-failure --parallel "${JOBS:-$(nproc)}" || failed="C++ tests"
    say "Python tests"
    # What Python compiles is kept, even where the environment says to write no bytecode.
    env -u PYTHONDONTWRITEBYTECODE PYTHONPYCACHEPREFIX="$PWD/build/bytecode" \
      $python -m pytest -n auto --dist worksteal "$@" || failed="${failed:+$failed and }Python tests"
    [ -z "$failed" ] || die "failed: $failed"
    ;;
  kernels)
    build dev
    # What numpy uses of this processor beyond what it needs.
    features=$($python -c 'from numpy._core._multiarray_umath import __cpu_dispatch__ as extra, __cpu_features__ as has
print(*(name for name in extra if has[name]))')
    failed=
    numeric_tests() { # KERNEL [PYTEST OPTION]…
      local kernel=$1
      shift
      say "numeric tests with OpenBLAS for $kernel"
      OPENBLAS_CORETYPE=$kernel $python -m pytest -n auto --dist worksteal \
        tests/contract tests/master tests/system tests/verdicts "$@" || failed="$failed $kernel"
    }
    grep -qw avx512bw /proc/cpuinfo && numeric_tests SkylakeX "$@" || say "this processor has no AVX-512: no SkylakeX"
    grep -qw avx2 /proc/cpuinfo && numeric_tests Haswell "$@" || say "this processor has no AVX2: no Haswell"
    # The oldest: also libm (names of glibc before 2.33, and since) and numpy without AVX2 and FMA.
    export GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-FMA4_Usable,-AVX2,-FMA,-FMA4
    export NPY_DISABLE_CPU_FEATURES=$features
    numeric_tests Prescott "$@"
    [ -z "$failed" ] || die "failed with:$failed"
    ;;
  win64)
    build run fmus
    get_sundials || true
    fmus/win64/build.sh build/win64 $python
    if ! command -v wine64 wine >/dev/null && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
      say "installing wine64, to test them"
      DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends wine64 wine >/dev/null 2>&1 ||
        say "Wine could not be installed: the Windows binaries will not be tested"
    fi
    build dev fmus
    ls -l fmus/*.fmu
    ;;
  interop)
    build dev fmus
    tests/interop/install.sh "$cache" "$python"
    SPRINGBEAM_CACHE=$cache exec $python -m pytest tests/interop "$@"
    ;;
  bench)
    build dev fmus beam_bench spring_bench
    exec $python tests/bench "$@"
    ;;
  campaign)
    build dev fmus
    exec $python tests/campaign "$@"
    ;;
  browser)
    build dev fmus
    set_up_python browser
    command -v "${CHROMIUM:-chromium}" chromium-browser google-chrome >/dev/null || install_packages "Chromium is" chromium
    exec $python -m pytest tests/browser "$@"
    ;;
  wheel)
    build dev fmus
    get_sundials || true
    install wheel build wheel
    rm -rf dist
    $python -m build --outdir dist .
    # What is compiled in it loads with glibc 2.14, see fmus/adapter/old_glibc.cpp.
    [ "$(uname -sm)" != "Linux x86_64" ] || $python -m wheel tags --remove --platform-tag manylinux_2_17_x86_64 dist/*.whl
    SPRINGBEAM_WHEEL=$(echo "$PWD"/dist/*.whl) exec $python -m pytest tests/system/test_installation.py "$@"
    ;;
  fmus)
    build run fmus
    ls -l fmus/*.fmu fmus/*.ssp
    ;;
  fuzz)
    build dev fmu_describe
    seed=${1:-$(date +%s)}
    failed=
    get_sundials || true
    build_sanitized memory $memory_sanitizers "${fuzzers[@]}"
    build_sanitized thread thread "${fuzzers[@]}"
    for body in beam spring beam3 spring3; do
      say "$body: 8 threads (seed $seed)"
      build/thread/tests/fuzz/fuzz_$body threads "$seed" || failed=1
      say "$body: a million calls (seed $seed)"
      build/memory/tests/fuzz/fuzz_$body calls "$seed" 1000000 || failed=1
    done
    [ -z "$failed" ] || die "a promise is broken, see above; the same again: ./build.sh fuzz $seed"
    ;;
  sanitize)
    build dev fmu_describe
    get_sundials || true
    build_sanitized memory $memory_sanitizers beam_tests spring_tests "${fuzzers[@]}"
    build_sanitized thread thread "${fuzzers[@]}"
    failed=
    say "C++ tests and random calls"
    $venv/bin/ctest --test-dir build/memory --output-on-failure --parallel "${JOBS:-$(nproc)}" || failed=memory
    say "random calls in threads"
    $venv/bin/ctest --test-dir build/thread --output-on-failure -R threads || failed="$failed threads"
    [ -z "$failed" ] || die "failed with sanitizers:$failed"
    ;;
  docs)
    set_up_python docs
    $venv/bin/sphinx-build -q -E -W --keep-going docs build/site
    cp build/site/README.html build/site/index.html
    say "build/site/index.html"
    ;;
  lint)
    set_up_python lint
    build dev beam spring
    failed=
    run() { "$@" || failed=1; }
    run $venv/bin/ruff check .
    run $venv/bin/ruff format --check .
    run $venv/bin/mypy
    run no_words_to_avoid
    mapfile -t sources < <(find src_beam src_spring fmus master tests/cpp tests/fuzz -name '*.cpp' -o -name '*.hpp')
    run $venv/bin/clang-format --dry-run -Werror "${sources[@]}"
    mapfile -t units < <(find src_beam src_spring fmus master -name '*.cpp')
    # It reads no headers that another compiler has read before.
    run $venv/bin/clang-tidy --quiet -p build --extra-arg=-Wno-ignored-gch "${units[@]}"
    [ -z "$failed" ] || die "lint found something"
    ;;
  help | -h | --help) usage ;;
  *)
    usage >&2
    exit 2
    ;;
esac
