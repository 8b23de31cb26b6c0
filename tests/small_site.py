"""A folder of results as a user has it after a run, a diagnosis and a recovery study, and the site made of it."""

import json
import runpy
from dataclasses import asdict
from pathlib import Path

import pytest

import simgap
from simgap.diagnosis.cases import Case, CaseResult
from simgap.diagnosis.recovery import FILE
from simgap.reports.diagnosis.page import diagnosis_page
from simgap.results import store

EXAMPLES = runpy.run_path(str(Path(__file__).parent / "reports" / "example_findings.py"))


@pytest.fixture(scope="session")
def results_on_disk(tmp_path_factory) -> Path:
    """Rows and artefacts of three models on the short gimbal, a diagnosis as page and JSON, eight hidden effects."""
    folder = tmp_path_factory.mktemp("results")
    simgap.run("smoke", models=["mean", "hold", "arx"], datasets=["gimbal_short"], out=folder)
    findings = EXAMPLES["named"].__wrapped__()
    (folder / "cart.html").write_text(diagnosis_page(findings), encoding="utf-8")
    (folder / "cart.json").write_text(json.dumps(findings.to_json()), encoding="utf-8")
    (folder / "only_json.json").write_text(json.dumps(findings.to_json()), encoding="utf-8")
    cases = [
        CaseResult(
            Case("cart", "dead_zone", 1.0, 0.05, 0.0, seed), named=(name,), confounded=((),), visible=True,
            verdict="named", reference_gain=0.5, reference_ratio=90.0, gain=0.4,
        )
        for seed, name in enumerate(["dead_zone"] * 7 + ["backlash"])
    ]  # fmt: skip
    (folder / FILE).parent.mkdir()
    (folder / FILE).write_text("".join(json.dumps(store.plain(asdict(case))) + "\n" for case in cases))
    return folder


@pytest.fixture(scope="session")
def site(results_on_disk) -> Path:
    """The folder of the site."""
    return simgap.write_site(results_on_disk).parent
