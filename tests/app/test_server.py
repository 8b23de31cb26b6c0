"""What `simgap open` answers, to whom, and what it leaves behind; without a browser."""

import asyncio
import http.client
import json
import pickle
import signal
import socket
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest
from app.cart_record import write_cart
from app.commands import Served, end, simgap, start

from simgap.app.orders import Order, Settings
from simgap.app.pages import answer_bar


def ask(served: Served, path: str, method: str = "GET", body: bytes = b"", **headers: str) -> tuple[int, str]:
    """Send one request below the address of the server, or to `path` as it stands where it begins with a slash."""
    address = urlsplit(served.address)
    connection = http.client.HTTPConnection(address.hostname or "", address.port or 0, timeout=60)
    target = path if path.startswith("/") else address.path + path
    connection.request(method, target, body or None, headers)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text


def upload(served: Served, files: dict[str, bytes]) -> str:
    """Open a record of these files and give the path of its page."""
    key = json.loads(ask(served, "records", "POST")[1])["key"]
    for path, content in files.items():
        assert ask(served, f"records/{key}/files/{quote(path)}", "PUT", content) == (200, "{}")
    return f"records/{key}/"


def test_it_listens_on_this_machine_alone(served):
    port = urlsplit(served.address).port
    assert urlsplit(served.address).hostname == "127.0.0.1"
    with pytest.raises(OSError):  # another address of the same machine
        socket.create_connection(("127.0.0.2", port), timeout=5)


def test_another_name_of_the_host_another_origin_and_an_address_without_the_secret_are_refused(served):
    assert ask(served, "")[0] == 200
    assert ask(served, "", Host="evil.example")[0] == 400  # a name that was made to point here
    for origin in ("http://evil.example", "null", "http://127.0.0.1:1"):
        assert ask(served, "records", "POST", Origin=origin)[0] == 403
    assert ask(served, "/")[0] == ask(served, "/records")[0] == 404


@pytest.mark.parametrize("path", ["../evil", "a/../../evil", "..", "a//b", "/etc/evil", "a\\b", "a/\x01", "a" * 300])
def test_a_file_cannot_be_written_outside_its_record(served, path):
    before = set(served.folder.rglob("*"))
    key = json.loads(ask(served, "records", "POST")[1])["key"]
    status, text = ask(served, f"records/{key}/files/{quote(path, safe='')}", "PUT", b"1")
    assert (status, "is no name for a file of a record" in text) == (400, True)
    assert set(served.folder.rglob("*")) == before


class Evil:
    def __init__(self, marker: Path) -> None:
        self.marker = marker

    def __reduce__(self):
        return Path.touch, (self.marker,)


@pytest.mark.parametrize("name", ["evil.mat", "evil.parquet", "evil.npz"])
def test_a_pickle_under_any_ending_is_not_loaded(served, tmp_path, name):
    page = upload(served, {name: pickle.dumps(Evil(tmp_path / "executed"))})
    status, text = ask(served, page)
    assert (status, "cannot be used" in text) == (200, True)
    assert not (tmp_path / "executed").exists()


def test_modules_beside_a_record_are_not_imported(served, tmp_path):
    code = f"import pathlib; pathlib.Path({str(tmp_path / 'executed')!r}).touch()".encode()
    names = ("numpy", "msgspec", "simgap", "sitecustomize", "encodings")
    page = upload(served, {f"record/{name}.py": code for name in names} | {"record/dataset.toml": b"name = 1"})
    assert "sampling_time is missing; add it" in ask(served, page)[1]
    page = upload(served, {"numpy.py": code})
    assert "cannot be used" in ask(served, page)[1]
    assert not (tmp_path / "executed").exists()


def test_names_in_a_record_are_text_on_its_page(served):
    text = '<script>alert(1)</script>,"y</script><b>"\n1,2\n2,1\n'
    _, page = ask(served, upload(served, {"<img src=x>.csv": text.encode()}))
    assert "<script>alert" not in page
    assert "<img src=x>" not in page
    assert "y</script><b>" not in page


def test_headings_suggest_what_columns_are(served):
    text = b"t,u,y,y_sim,T1\n0,1,2,3,4\n1,2,1,3,5\n2,2,1,3,5\n"
    _, page = ask(served, upload(served, {"a.csv": text}))
    rows = [row.partition("</tr>")[0] for row in page.split("<tr data-column=")[1:]]
    chosen = [row.partition(" selected>")[0].rpartition("value=")[2] for row in rows]
    assert chosen == ['"input"', '"output"', '"simulated"', '""']


def test_a_column_with_missing_cells_can_be_chosen(served):
    _, page = ask(served, upload(served, {"a.csv": b"t,u,y,note\n0,1,2,\n1,,1,\n2,2,1,\n"}))
    rows = [row.partition("</tr>")[0] for row in page.split("<tr data-column=")[1:]]
    assert ["value=" in row for row in rows] == [True, True]  # a column without numbers has no row to choose in
    assert "after missing cells" in page


def test_a_clock_that_gives_no_sampling_time_leaves_a_place_for_one(served):
    for stamps, asked in (("01234567", False), ("00001111", True)):
        text = "t,u,y\n" + "".join(f"{t},{k % 2},{k}\n" for k, t in enumerate(stamps))
        assert ('name="dt"' in ask(served, upload(served, {"a.csv": text.encode()}))[1]) == asked


def test_above_an_answer_stands_how_the_record_was_read():
    order = Order("diagnose", "log.csv", Settings(["u"], ["y"], []))
    assert "<p>Read: sampling time 0.1 s from column &lt;t&gt;.</p>" in answer_bar(
        order, "read: sampling time 0.1 s from column <t>"
    )
    assert "Read:" not in answer_bar(order, "")


def test_settings_that_are_none_are_refused_in_a_sentence(served):
    page = upload(served, {"a.csv": b"u,y\n1,2\n2,1\n"})
    for body in (b"", b"[]", b'{"dt": "x"}', b'{"outside": 1}', b"\xff"):
        status, text = ask(served, f"{page}diagnoses", "POST", body)
        assert (status, "no description of a record" in json.loads(text)["refused"]) == (400, True)
    assert ask(served, f"{page}1/")[0] == 400
    assert ask(served, "records/unknown/")[0] == 404


def test_a_record_that_is_closed_is_deleted(served, tmp_path):
    page = upload(served, {"a.csv": b"u,y\n1,2\n2,1\n"})
    (file,) = served.folder.glob(f"simgap-open-*/{page.split('/')[1]}/files/a.csv")
    assert ask(served, page, "DELETE")[0] == 200
    assert not file.parents[1].exists()
    assert ask(served, page)[0] == 404


def test_more_than_the_largest_upload_is_refused(monkeypatch, tmp_path):
    from simgap.app import desk
    from simgap.records import UnusableInput

    async def chunks():
        for _ in range(3):
            yield b"12345"

    monkeypatch.setattr(desk, "LARGEST", 10)
    record = desk.OpenRecord("key", tmp_path)
    # In a thread of its own, because playwright keeps an event loop running in this one.
    with ThreadPoolExecutor(1) as thread, pytest.raises(UnusableInput, match=r"a.csv has more than .* command line"):
        thread.submit(lambda: asyncio.run(record.receive("a.csv", chunks()))).result()


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_its_end_stops_what_runs_and_deletes_what_was_uploaded(tmp_path, by):
    served = start(tmp_path)
    write_cart(tmp_path / "cart.csv", samples=60)
    page = upload(served, {"cart.csv": (tmp_path / "cart.csv").read_bytes()})
    order = json.dumps({"inputs": ["force"], "outputs": ["v"]}).encode()
    assert ask(served, f"{page}diagnoses", "POST", order) == (200, '{"number":1}')
    assert end(served, by) == (0 if by == signal.SIGINT else -by)
    assert [file.name for file in tmp_path.iterdir()] == ["cart.csv"]
    if sys.platform == "linux":  # nobody works in that folder any more
        assert not [one for one in Path("/proc").glob("[0-9]*/cwd") if str(tmp_path) in _target(one)]


def _target(link: Path) -> str:
    try:
        return str(link.readlink())
    except OSError:
        return ""


def test_a_record_is_opened_from_the_command_line_with_what_is_said_of_it(tmp_path):
    write_cart(tmp_path / "cart.csv", samples=60, heading="t [s],Motor force [N],Speed [m/s]")
    said = ("--input", "motor force", "--output", "Speed", "--kind", "velocity")
    (tmp_path / "temporary").mkdir()
    served = start(tmp_path / "temporary", "cart.csv", *said, cwd=tmp_path)
    status, text = ask(served, "")
    assert end(served) == 0
    assert status == 200
    for chosen in ('value="input" selected', 'value="output" selected', "<option selected>velocity"):
        assert text.count(chosen) == 1
    assert (tmp_path / "cart.csv").exists()


def test_what_cannot_be_opened_is_refused_in_a_sentence(tmp_path):
    write_cart(tmp_path / "cart.csv", samples=60)
    done = simgap("open", "cart.csv", "--input", "torque", "--no-browser", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "") and "'force'" in done.stderr
    for said, why in (
        (("--kind", "velocity"), "name the output, with --output"),
        (("--output", "v", "--kind", "speed"), "kind 'speed': use one of position, velocity"),
    ):
        done = simgap("open", "cart.csv", *said, "--no-browser", cwd=tmp_path)
        assert (done.returncode, done.stdout) == (2, "") and why in done.stderr
    done = simgap("open", "missing.csv", "--no-browser", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "missing.csv" in done.stderr


def test_without_its_packages_it_says_how_to_install_them(tmp_path, monkeypatch):
    (tmp_path / "starlette.py").write_text("raise ModuleNotFoundError('not installed', name='starlette')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = simgap("open", "--no-browser", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == ("simgap: simgap open needs starlette, which is not installed: pip install 'simgap[app]'\n")
