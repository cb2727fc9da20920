"""Plant faults in a copy of the checkout, one at a time, and count those that the tests find.

    python tests/bench/planted_faults.py [--faults 60] [--seed 1] [--only python|c++] [--list]

Half of them are drawn over the functions of the package (but for pictures, which people look at), half over the C++ of
beam, spring and FMUs: another comparison, the opposite sign, a product for a quotient, an "or" for an "and", a negation
left out, another number. Tests that pass the mutated line run first, the most specific ones at once, those known from
one run of all tests with coverage, which is made where there is none; of C++ the kernels, then the FMUs through C, then
the systems. Takes about a minute a fault. Prints a line each and what was not found.
"""

import argparse
import ast
import copy
import os
import random
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
from collections import Counter
from pathlib import Path

import coverage

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = "master/springbeam"
NATIVE = ("src_beam", "src_spring", "fmus/adapter", "fmus/beam", "fmus/spring")
#: What another operator takes the place of each.
PYTHON = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
}
CPP = {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "==", "+": "-", "-": "+", "*": "/", "/": "*"}
CPP |= {"&&": "||", "||": "&&"}
#: Operators between blanks (those of templates and pointers have none), and numbers.
CPP_SITE = re.compile(r"(?<= )(?:[<>]=?|[=!]=|[-+*/]|&&|\|\|)(?= )|(?<![\w.\"])\d+\.\d*(?:e[-+]?\d+)?(?![\w.\"])")
TIMEOUT = 900.0


def another_number(value):
    return value + 1 if isinstance(value, int) else 1.5 * value or 1.0


def mutated(node):
    """Return the source of a node with a fault, or ``None`` if there is none to plant."""
    node = copy.copy(node)
    operators = {"op": getattr(node, "op", None), "ops": getattr(node, "ops", [None])[0]}
    for field, operator in operators.items():
        if type(operator) in PYTHON:
            other = PYTHON[type(operator)]()
            setattr(node, field, [other, *node.ops[1:]] if field == "ops" else other)
            return ast.unparse(node)
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
        return f"({ast.unparse(node.operand)})"
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return repr(another_number(node.value))
    return None


def python_sites(path):
    """Yield the line, the span and the replacement of each fault in the functions of a module."""
    text = path.read_text(encoding="utf-8")
    starts = [0]
    for line in text.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    inside = [n for n in ast.walk(ast.parse(text)) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    for node in (node for function in inside for statement in function.body for node in ast.walk(statement)):
        if isinstance(node, ast.expr) and (other := mutated(node)) is not None:
            span = (starts[node.lineno - 1] + node.col_offset, starts[node.end_lineno - 1] + node.end_col_offset)
            yield node.lineno, span, f"({other})"


def cpp_sites(path):
    text = path.read_text(encoding="utf-8")
    at = 0
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        code = line.partition("//")[0]
        if not code.lstrip().startswith(("#", "*", "/*", "static_assert")) and '"' not in code:
            for found in CPP_SITE.finditer(code):
                other = CPP.get(found[0]) or repr(another_number(float(found[0])))
                begin = len(text[: at + found.start()].encode())
                yield number, (begin, begin + len(found[0])), other
        at += len(line)


def drawn(native, count, random_numbers):
    """Return files with a fault each: ``(file, line, span, replacement)``, drawn evenly over all that there are."""
    if native:
        files = [path for folder in NATIVE for path in sorted((ROOT / folder).glob("*.[ch]pp"))]
    else:
        files = [p for p in sorted((ROOT / PACKAGE).rglob("*.py")) if "pictures" not in p.parts]
    sites = [
        (path.relative_to(ROOT), *site) for path in files for site in (cpp_sites if native else python_sites)(path)
    ]
    return random_numbers.sample(sorted(set(sites)), count)


class Copy:
    """A copy of the checkout with an environment of its own, which has the packages of this one."""

    def __init__(self, folder):
        self.root = folder
        self.python = folder / ".venv" / "bin" / "python"
        files = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for name in [*files.splitlines(), *(str(p.relative_to(ROOT)) for p in (ROOT / PACKAGE).rglob("*.so"))]:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
        for built in (*(ROOT / "fmus").glob("*.fmu"), *(ROOT / "fmus").glob("*.ssp")):
            shutil.copy2(built, folder / "fmus")
        venv.create(folder / ".venv", with_pip=False)
        (packages,) = (folder / ".venv").glob("lib/python*/site-packages")
        (packages / "here.pth").write_text(f"{folder / 'master'}\n{sysconfig.get_path('purelib')}\n")
        self.environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}

    def run(self, *words):
        """Return whether a program ends well; one that hangs does not."""
        done = subprocess.Popen(
            [str(word) for word in words],
            cwd=self.root,
            env=self.environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
        try:
            return done.wait(TIMEOUT) == 0
        except subprocess.TimeoutExpired:
            os.killpg(done.pid, 9)
            return False

    def tests(self, *arguments):
        return self.run(self.python, "-m", "pytest", "-q", "-x", "-n", os.environ.get("JOBS", "2"), *arguments)

    def build(self):
        if not (self.root / "build/build.ninja").exists():
            script = ROOT / "fmus/sundials_source.sh"
            cache = Path.home() / ".cache/springbeam/sundials"
            if "SPRINGBEAM_SUNDIALS_SOURCE" not in self.environment:
                found = subprocess.run([script, cache], capture_output=True, text=True).stdout.strip()
                self.environment["SPRINGBEAM_SUNDIALS_SOURCE"] = found
            configured = self.run(
                "cmake", "-S", ".", "-B", "build", "-G", "Ninja", f"-DPython3_EXECUTABLE={self.python}"
            )
            if not configured:
                raise SystemExit("CMake does not configure the copy")
        return self.run("ninja", "-C", "build")

    def planted(self, path, span, other):
        original = (ROOT / path).read_bytes()
        (self.root / path).write_bytes(original[: span[0]] + other.encode() + original[span[1] :])

    def mended(self, path):
        (self.root / path).write_bytes((ROOT / path).read_bytes())


class Coverage:
    """Which tests pass a line, of those that there are."""

    def __init__(self, there, file):
        if not file.exists():
            there.run(there.python, "-m", "pytest", "-q", "-n", "2", "--cov", "--cov-context=test", "--cov-report=")
        self.data = coverage.CoverageData(str(file))
        self.data.read()
        collect = [
            there.python,
            "-m",
            "pytest",
            "--collect-only",
            "-q",
            "tests/master",
            "tests/system",
            "tests/verdicts",
        ]
        self.there = set(subprocess.run(collect, cwd=there.root, capture_output=True, text=True).stdout.splitlines())
        contexts = [self.data.contexts_by_lineno(file).values() for file in self.data.measured_files()]
        self.sizes = Counter(name for lines in contexts for names in lines for name in names)

    def passing(self, path, line):
        """Return the tests that pass a line, those that pass the fewest lines first."""
        files = [file for file in self.data.measured_files() if file.endswith(f"/{path}")]
        found = {name.partition("|")[0] for file in files for name in self.data.contexts_by_lineno(file).get(line, ())}
        return [name for name in sorted(found, key=lambda name: self.sizes[f"{name}|run"]) if name in self.there]


def found_by(there, covered, path, line, native):
    """Return what finds the fault that is planted in the copy; "" if nothing does."""
    if native:
        if not there.build():
            return "the compiler"
        if not there.run("ctest", "--test-dir", "build", "--stop-on-failure", "-j2", "-E", "fuzz"):
            return "kernels"
        for folder in ("tests/contract", "tests/system", "tests/master"):
            if not there.tests(folder):
                return folder
        return ""
    tests = covered.passing(path, line)
    if not tests and not there.tests("tests/master", "tests/system"):  # run at import, or in other processes
        return "all tests"
    for begin, end in ((0, 40), (40, 200), (200, None)):
        arguments = there.root / "tests.txt"
        arguments.write_text("\n".join(tests[begin:end]))
        if tests[begin:end] and not there.tests(f"@{arguments}"):
            return f"tests that pass the line ({len(tests)})"
    return ""


def main():
    parser = argparse.ArgumentParser(description="Plant faults and count those that the tests find.")
    parser.add_argument("--faults", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", choices=("python", "c++"))
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "planted", help="of the copy")
    parser.add_argument("--coverage", type=Path, help="data of a run of all tests with --cov --cov-context=test")
    parser.add_argument("--list", action="store_true", help="only show the faults")
    options = parser.parse_args()
    kinds = [options.only == "c++"] if options.only else [False, True]
    faults = []
    for native in kinds:
        share = drawn(native, options.faults // len(kinds), random.Random(options.seed))
        faults += [(native, *fault) for fault in share]
    there = covered = None
    if not options.list:
        there = Copy(options.folder)
        covered = Coverage(there, options.coverage or there.root / ".coverage") if False in kinds else None
    missed = []
    for native, path, line, span, other in faults:
        text = (ROOT / path).read_bytes()
        what = f"{path}:{line}: {text[span[0] : span[1]].decode()} -> {other}"
        if options.list:
            print(what)
            continue
        there.planted(path, span, other)
        by = found_by(there, covered, path, line, native)
        there.mended(path)
        print(f"{by or 'NOT FOUND'}: {what}", flush=True)
        missed += [what] * (not by)
    if not options.list:
        print(f"{len(faults) - len(missed)} of {len(faults)} found", *missed, sep="\n    ")
    return len(missed) > 0.05 * len(faults)


if __name__ == "__main__":
    sys.exit(main())
