"""Files of strangers: what fuzzing has found stays found, and whatever is done to a good file gives one sentence."""

import runpy
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

FUZZ = Path(__file__).parent / "fuzz"
TARGETS, try_it = map(runpy.run_path(str(FUZZ / "targets.py")).get, ("TARGETS", "try_it"))
FOUND = sorted((FUZZ / "found").glob("*-*"))
PIECES = st.sampled_from([
    b"[" * 900, b"{" * 900, b'{"a":' * 900, b"1e999", b"9" * 5000, b"-1", b"NaN", b"null", b"true", b'"\\ud800"',
    b"\xff", b"\0", b"</script><script>", b"../../../etc/passwd", b"{}", b"[]", b'""', b"inf", b"1e308", b"\n", b",",
    b"[[models]]\n",
])  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@pytest.mark.parametrize("file", FOUND, ids=lambda file: file.name)
def test_what_fuzzing_has_found_is_refused_or_read(file, folder):
    try_it(TARGETS[file.name.split("-")[1]], file.read_bytes(), folder)


@pytest.mark.parametrize("name", TARGETS)
def test_good_files_are_read(name, folder):
    target = TARGETS[name]
    accepted = [try_it(target, seed, folder) for seed in target.seeds(folder)]
    assert any(accepted)


@pytest.mark.parametrize("name", TARGETS)
def test_whatever_is_done_to_a_good_file_it_is_read_or_refused_with_a_sentence(name, folder):
    target = TARGETS[name]
    seeds = target.seeds(folder)

    @settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow], database=None)
    @given(st.sampled_from(seeds), st.floats(0, 1), st.floats(0, 0.2), PIECES | st.binary(max_size=30))
    def mutated(seed, at, share, piece):
        start = int(at * len(seed))
        try_it(target, seed[:start] + piece + seed[start + int(share * len(seed)) :], folder)

    mutated()
