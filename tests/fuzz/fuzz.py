"""Feed a target with bytes that explore its code: python tests/fuzz/fuzz.py TARGET SECONDS CORPUS.

Needs `pip install atheris`. The corpus is a folder that grows; what breaks the target is written there as crash-*, what
takes seconds as slow-*: keep those in tests/fuzz/found, where the tests feed them again.
"""

import hashlib
import sys
import tempfile
import time
import warnings
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["simgap", "tests"]):
    sys.path.insert(0, str(Path(__file__).parent))
    import targets


def main() -> None:
    name, seconds, corpus = sys.argv[1], float(sys.argv[2]), Path(sys.argv[3])
    target = targets.TARGETS[name]
    corpus.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")
    found: set[str] = set()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for seed in target.seeds(folder):
            (corpus / hashlib.sha256(seed).hexdigest()[:16]).write_bytes(seed)

        def once(data: bytes) -> None:
            start = time.monotonic()
            try:
                targets.try_it(target, data, folder)
            except Exception as error:
                frame = error.__traceback__
                while frame is not None and frame.tb_next is not None:
                    frame = frame.tb_next
                where = f"{type(error).__name__} {frame.tb_frame.f_code.co_filename}:{frame.tb_lineno}"
                if where not in found:  # go on for others
                    found.add(where)
                    (corpus / f"crash-{name}-{hashlib.sha256(data).hexdigest()[:12]}").write_bytes(data)
                    print(f"FOUND {name}: {where}: {str(error)[:200]}", flush=True)
            if time.monotonic() - start > 5:
                (corpus / f"slow-{name}-{hashlib.sha256(data).hexdigest()[:12]}").write_bytes(data)
                print(f"SLOW {name}: {time.monotonic() - start:.1f} s", flush=True)

        atheris.Setup([sys.argv[0], str(corpus), f"-max_total_time={int(seconds)}",
                       "-rss_limit_mb=4096", "-max_len=6000", "-print_final_stats=1"], once)  # fmt: skip
        atheris.Fuzz()


if __name__ == "__main__":
    main()
