"""One order in a process of its own: `python -P -m simgap.app.worker`, the order on standard input.

With -P nothing that lies in the folder of a record can stand in the place of a module.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import msgspec

from simgap.app.orders import Order, Report
from simgap.records import UnusableInput
from simgap.stages import told_to

PAGE, ANSWER, TEXT, MODEL, SHOWN = "diagnosis.html", "diagnosis.json", "diagnosis.txt", "model.simgap", "shown.html"


def main() -> None:
    """Carry out one order and write what happens as lines of JSON on standard output."""
    order = msgspec.json.decode(sys.stdin.buffer.read(), type=Order)
    lines = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever else is printed is no report

    def report(line: Report) -> None:
        lines.write(msgspec.json.encode(line) + b"\n")

    with told_to(lambda words: report(Report(stage=words))):
        try:
            report(_look(order) if order.do == "look" else _diagnose(order))
        except UnusableInput as refusal:
            report(Report(refused=str(refusal)))
        except OSError as error:
            report(Report(refused=f"{error.filename or 'a file'} cannot be read: {error.strerror or error}"))


def _look(order: Order) -> Report:
    from simgap.app.reading import look

    return Report(look=look(order.source))


def _diagnose(order: Order) -> Report:
    from simgap.app.pages import answer_bar
    from simgap.app.reading import dataset_of
    from simgap.diagnosis.diagnose import diagnose
    from simgap.reports.diagnosis import words
    from simgap.reports.diagnosis.page import diagnosis_page
    from simgap.saved.archive import save_model
    from simgap.stages import stage

    stage("Reading the record")
    reading = dataset_of(order.source, order.settings)
    answer = diagnose(reading.dataset, profiles=True, simulated=reading.simulated)
    stage("Writing the answer")
    out, findings = Path(order.out), answer.findings
    (out / PAGE).write_text(diagnosis_page(findings), encoding="utf-8")
    (out / SHOWN).write_text(diagnosis_page(findings, answer_bar(order, str(reading))), encoding="utf-8")
    (out / TEXT).write_text(f"{answer}\n", encoding="utf-8")
    text = json.dumps(answer.to_json(), indent=1, allow_nan=False, ensure_ascii=False)
    (out / ANSWER).write_text(text + "\n", encoding="utf-8")
    save_model(answer.model, out / MODEL, reading.dataset)
    return Report(headline=words.headline(findings))


if __name__ == "__main__":
    main()
