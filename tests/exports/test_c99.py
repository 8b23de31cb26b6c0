"""Step forms in C: what the subset of Python means, and what it does not have."""

import math
import shutil
import subprocess

import pytest

from simgap.exports.c99 import PREAMBLE, translate

NEEDS_A_COMPILER = pytest.mark.skipif(shutil.which("cc") is None, reason="there is no C compiler")
SOURCE = '''
def law(x: float, n: int, p: list):
    """A bit of everything."""
    total, side = 0.0, 1.0 if x > 0.0 else -1.0
    for i in range(1, n + 1):
        total += p[i % 2] / i
    if 0.0 < x <= 3.0 and not n == 7:
        return side * min(total, max(abs(x), 2.5)) + math.copysign(round(x), -1.0)
    kept = [0.0] * 3
    kept[n // 3] = int(x) + math.sqrt(n / 2)
    return kept[0] + kept[1] + kept[2] - (n - 1) / 2
'''


@NEEDS_A_COMPILER
def test_c_computes_what_python_does(tmp_path):
    names = {"math": math}
    exec(SOURCE, names)
    arguments = [(x, n) for x in (-2.7, 0.0, 0.5, 1.5, 2.5, 3.5) for n in (1, 4, 7)]
    p = [1.25, -0.5]
    calls = "".join(f'    printf("%.17g\\n", law({x!r}, {n}, P));\n' for x, n in arguments)
    text = f"#include <math.h>\n#include <stdio.h>\n{PREAMBLE}\nstatic const double P[] = {{1.25, -0.5}};\n"
    text += f"{translate(SOURCE, ['P'])}\nint main(void) {{\n{calls}    return 0;\n}}\n"
    (tmp_path / "law.c").write_text(text)
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", tmp_path / "law.c", "-o", tmp_path / "law", "-lm"]
    subprocess.run(command, check=True)
    done = subprocess.run([tmp_path / "law"], check=True, capture_output=True, text=True)
    assert [float(line) for line in done.stdout.split()] == [names["law"](x, n, p) for x, n in arguments]


def test_a_count_of_samples_may_be_larger_than_an_int():
    assert "long long n" in translate(SOURCE, ["P"])


@pytest.mark.parametrize(
    "line", ["while x > 0.0: x = x - 1.0", "y = [v for v in p]", "y = open('f')", "y = x ** 2.0", "import os", "y = z"]
)
def test_what_the_subset_does_not_have_is_named_with_its_line(line):
    with pytest.raises((ValueError, KeyError)) as caught:
        translate(f"def law(x: float, p: list):\n    {line}\n    return x\n", [])
    assert isinstance(caught.value, KeyError) or "line 2" in str(caught.value)
