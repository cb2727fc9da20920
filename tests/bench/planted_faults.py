"""Plant faults in a copy of the checkout, one at a time, and count those that the tests find.

    python tests/bench/planted_faults.py [--faults 60] [--seed 1] [--only python] [--only c++] [--list]

Half of them are drawn over the functions of the package (but for pictures, which people look at), half over the C++ of
beam, spring and FMUs: another comparison, the opposite sign, a quotient for a product, an "or" for an "and", a negation
left out, another number. Of Python the tests that pass the line run, the most specific ones first, as one run of all
tests with coverage knows them, which is made where there is none; of C++ the kernels, then the FMUs through C, then the
systems. All tests must pass before. Takes about a minute a fault on an idle machine; a busy one changes no verdict.
Prints a line each and what was not found.
"""

import argparse
import ast
import io
import os
import random
import re
import shutil
import subprocess
import sys
import sysconfig
import tokenize
import venv
from collections import Counter
from contextlib import suppress
from pathlib import Path

import coverage

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "master/springbeam"
NATIVE = ("src_beam", "src_spring", "fmus/adapter", "fmus/beam", "fmus/spring")
#: What takes the place of each operator.
OTHERS = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "/", "/": "*"}
OTHERS |= {"&&": "||", "||": "&&", "and": "or", "or": "and", "not": ""}
#: Operators between blanks (those of templates and pointers have none), and numbers.
CPP = re.compile(r"(?<= )(?:[<>]=?|[=!]=|[-+*/]|&&|\|\|)(?= )|(?<![\w.\"])\d+\.\d*(?:e[-+]?\d+)?(?![\w.\"])")
#: Tests of Python.
TESTS = ("tests/master", "tests/system", "tests/verdicts")
#: A program hangs that uses less than a second of the processors in so long, or more of them than so long [s].
IDLE = 600.0
MOST = 7200.0


def other_than(token):
    """Return what takes the place of an operator or a number; ``None`` if nothing does."""
    if token in OTHERS:
        return OTHERS[token]
    if re.fullmatch(r"\d+", token):
        return str(int(token) + 1)
    return repr(1.5 * float(token) or 1.0) if re.fullmatch(r"\d+\.\d*(e[-+]?\d+)?|\d+e-?\d+", token) else None


def python_sites(text):
    """Yield line, column and text of each operator and number inside a function."""
    inside = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef)]
    lines = {line for function in inside for line in range(function.body[0].lineno, function.end_lineno + 1)}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.OP, tokenize.NUMBER, tokenize.NAME) and token.start[0] in lines:
            yield *token.start, token.string


def cpp_sites(text):
    for number, line in enumerate(text.splitlines(), 1):
        code = line.partition("//")[0]
        if not code.lstrip().startswith(("#", "*", "/*", "static_assert")) and '"' not in code:
            for found in CPP.finditer(code):
                yield number, found.start(), found[0]


def with_fault(text, line, column, token):
    lines = text.splitlines(keepends=True)
    old = lines[line - 1]
    lines[line - 1] = old[:column] + other_than(token) + old[column + len(token) :]
    return "".join(lines)


def parses(text):
    try:
        return ast.parse(text) is not None
    except SyntaxError:
        return False


def drawn(native, count, seed):
    """Return ``count`` faults ``(file, line, column, token)``, drawn evenly over all that there are."""
    if native:
        files = [path for folder in NATIVE for path in sorted((ROOT / folder).glob("*.[ch]pp"))]
    else:
        files = [path for path in sorted(PACKAGE.rglob("*.py")) if "pictures" not in path.parts]
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    sites = [(path, *site) for path, text in texts.items() for site in (cpp_sites if native else python_sites)(text)]
    sites = [site for site in sites if other_than(site[3]) is not None]
    random.Random(seed).shuffle(sites)
    found = (site for site in sites if native or parses(with_fault(texts[site[0]], *site[1:])))
    return [(path.relative_to(ROOT), *site) for (path, *site), _ in zip(found, range(count), strict=False)]


def used(session):
    """Return the processor time of the processes of a session so far [s]."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended
            fields = stat.read_text().rpartition(")")[2].split()
            ticks += sum(map(int, fields[11:15])) if int(fields[3]) == session else 0
    return ticks / os.sysconf("SC_CLK_TCK")


class Copy:
    """A copy of the checkout with an environment of its own, which has the packages of this one."""

    def __init__(self, folder):
        self.root = folder
        self.python = folder / ".venv/bin/python"
        self.environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
        files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        built = [*(ROOT / "fmus").glob("*.fmu"), *(ROOT / "fmus").glob("*.ssp"), *PACKAGE.rglob("*.so")]
        for name in [*files.splitlines(), *(str(path.relative_to(ROOT)) for path in built)]:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
        venv.create(folder / ".venv", with_pip=False)
        (packages,) = (folder / ".venv").glob("lib/python*/site-packages")
        (packages / "here.pth").write_text(f"{folder / 'master'}\n{sysconfig.get_path('purelib')}\n")
        program = self.python.with_name("springbeam")
        program.write_text(f"#!{self.python}\nfrom springbeam.cli import main\n\nmain()\n")
        program.chmod(0o755)

    def run(self, *words):
        """Return whether a program ends well; one that hangs does not."""
        words = [str(word) for word in words]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
        done = subprocess.Popen(words, cwd=self.root, env=self.environment, **quiet)
        before = -1.0
        while before + 1.0 <= (now := used(done.pid)) < MOST:
            before = now
            with suppress(subprocess.TimeoutExpired):
                return done.wait(IDLE) == 0
        os.killpg(done.pid, 9)
        return False

    def pytest(self, *arguments):
        return self.run(self.python, "-m", "pytest", "-q", "-x", "-n", os.environ.get("JOBS", "2"), *arguments)

    def build(self):
        if not (self.root / "build/build.ninja").exists():
            source = [ROOT / "fmus/sundials_source.sh", Path.home() / ".cache/springbeam/sundials"]
            found = subprocess.run(source, capture_output=True, text=True).stdout.strip()
            self.environment.setdefault("SPRINGBEAM_SUNDIALS_SOURCE", found)
            if not self.run("cmake", "-S.", "-Bbuild", "-GNinja", f"-DPython3_EXECUTABLE={self.python}"):
                raise SystemExit("CMake does not configure the copy")
        return self.run("ninja", "-C", "build")


class Coverage:
    """Which tests pass a line, of those that there are."""

    def __init__(self, there, file):
        if not file.exists() and not there.pytest("--cov", "--cov-context=test", "--cov-report=", *TESTS):
            raise SystemExit("the tests fail without a fault as well: ./build.sh test")
        self.data = coverage.CoverageData(str(file))
        self.data.read()
        collect = [there.python, "-m", "pytest", "--collect-only", "-q", *TESTS]
        lines = subprocess.run(collect, cwd=there.root, capture_output=True, text=True).stdout.splitlines()
        self.there = {line for line in lines if "::" in line}  # an empty one would run all there are
        contexts = [self.data.contexts_by_lineno(file).values() for file in self.data.measured_files()]
        self.sizes = Counter(name for lines in contexts for names in lines for name in names)

    def passing(self, path, line):
        """Return the tests that pass a line, those that pass the fewest lines first."""
        files = [file for file in self.data.measured_files() if file.endswith(f"/{path}")]
        found = {name.partition("|")[0] for file in files for name in self.data.contexts_by_lineno(file).get(line, ())}
        return [name for name in sorted(found, key=lambda name: self.sizes[f"{name}|run"]) if name in self.there]


def finds_native(there):
    """Return what finds a fault in C++; "" if nothing does."""
    if not there.build():
        return "the compiler"
    if not there.run("ctest", "--test-dir", "build", "--stop-on-failure", "-j2", "-E", "fuzz"):
        return "kernels"
    return next((at for at in ("tests/contract", "tests/system", "tests/master") if not there.pytest(at)), "")


def finds(there, tests):
    """Return what finds a fault in a line that these tests pass; one that none passes may act in other processes."""
    if not tests:
        return "" if there.pytest(*TESTS) else "all tests"
    chosen = there.root / "tests.txt"
    for begin, end in ((0, 40), (40, 200), (200, None)):
        chosen.write_text("\n".join(tests[begin:end]))
        if tests[begin:end] and not there.pytest(f"@{chosen}"):
            return f"tests that pass the line ({len(tests)})"
    return ""


def main():
    parser = argparse.ArgumentParser(description="Plant faults and count those that the tests find.")
    parser.add_argument("--faults", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("python", "c++"))
    parser.add_argument("--folder", type=Path, default=ROOT / "build/planted", help="of the copy")
    parser.add_argument("--coverage", type=Path, help="data of a run of all tests with --cov --cov-context=test")
    parser.add_argument("--list", action="store_true", help="only show the faults")
    options = parser.parse_args()
    kinds = [kind for kind in ("python", "c++") if options.only in (None, kind)]
    faults = [
        (kind, *one) for kind in kinds for one in drawn(kind == "c++", options.faults // len(kinds), options.seed)
    ]
    there = None if options.list else Copy(options.folder)
    covered = Coverage(there, options.coverage or there.root / ".coverage") if there and "python" in kinds else None
    missed = []
    for kind, path, line, column, token in faults:
        what = f"{path}:{line}:{column + 1}: {token} -> {other_than(token) or 'nothing'}"
        if there is None:
            print(what)
            continue
        planted = there.root / path
        text = planted.read_text(encoding="utf-8")
        planted.write_text(with_fault(text, line, column, token), encoding="utf-8")
        found = finds_native(there) if kind == "c++" else finds(there, covered.passing(path, line))
        planted.write_text(text, encoding="utf-8")
        print(f"{found or 'NOT FOUND'}: {what}", flush=True)
        missed += [what] * (not found)
    if there is not None:
        print(f"{len(faults) - len(missed)} of {len(faults)} found", *missed, sep="\n    ")
    return len(missed) > 0.05 * len(faults)


if __name__ == "__main__":
    sys.exit(main())
