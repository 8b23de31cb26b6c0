"""Downloads, with the downloader replaced: whole or not at all."""

import gzip
import io
import urllib.error

import numpy as np
import pytest
from scipy.io import savemat

from simgap.data import available, fetch, load
from simgap.records import UnusableInput

BEAM = np.random.default_rng(0).normal(size=(1000, 2))


def packed(table: np.ndarray) -> bytes:
    text = io.StringIO()
    np.savetxt(text, table)
    return gzip.compress(text.getvalue().encode(), mtime=0)


@pytest.fixture
def site(no_files, monkeypatch):
    """Answers of the DaISy site, by the end of the address; the addresses asked for stand in `asked`."""
    asked = []

    class Site:
        answer = packed(BEAM)

    def urlopen(address, timeout):
        asked.append(address)
        if isinstance(Site.answer, Exception):
            raise Site.answer
        return io.BytesIO(Site.answer)

    monkeypatch.setattr("urllib.request.urlopen", urlopen)
    Site.asked = asked
    return Site


def test_a_daisy_set_is_fetched_once_and_then_loads(site, no_files):
    assert fetch("daisy_ballbeam") == no_files / "daisy"
    assert site.asked == ["https://ftp.esat.kuleuven.be/pub/SISTA/data/mechanical/ballbeam.dat.gz"]
    assert np.array_equal(load("daisy_ballbeam").training.train[0].y[:, 0], BEAM[:600, 1])
    fetch("daisy_ballbeam")
    assert len(site.asked) == 1
    assert available()["daisy_ballbeam"] == ""


@pytest.mark.parametrize(
    "answer",
    [
        urllib.error.URLError("no\nroute"),
        TimeoutError(),
        b"<html>moved</html>",
        gzip.compress(b"<html>moved</html>", mtime=0),
        packed(BEAM)[:500],
        packed(BEAM[:, :1]),
        packed(BEAM * np.nan),
        gzip.compress(bytes((64 << 20) + 1), mtime=0),  # 65 kilobytes
    ],
)
def test_a_failed_download_leaves_nothing_and_says_where_to_get_it_by_hand(site, no_files, answer):
    site.answer = answer
    with pytest.raises(UnusableInput, match=r"daisy_ballbeam could not be downloaded .* by hand from") as caught:
        fetch("daisy_ballbeam")
    assert len(str(caught.value).splitlines()) == 1
    assert str(no_files / "daisy") in str(caught.value)
    assert not no_files.exists()


def emps_downloader(broken: bool = False):
    """What the package does for EMPS: a zip and its content in a folder of their own."""

    def download(dir_placement, data_file_locations=False, **options):
        print("dataset not found downloading")
        folder = dir_placement / "EMPS"
        if data_file_locations:
            folder.mkdir()
            (folder / "EMPS.zip").touch()
            for name in ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"):
                table = {key: BEAM[:, :1] for key in ("qm", "qg", "vir")} | {"t": np.arange(1000.0)[:, None]}
                savemat(folder / name, table)
                if broken:
                    raise ConnectionError("line went dead")
            return None
        return ORIGINAL(dir_placement=dir_placement, **options)

    import nonlinear_benchmarks

    ORIGINAL = nonlinear_benchmarks.EMPS
    return download


def test_a_set_of_the_package_is_fetched_over_the_remains_of_a_broken_one(no_files, monkeypatch, capsys):
    (no_files / "nonlinear_benchmarks" / "EMPS").mkdir(parents=True)
    (no_files / "nonlinear_benchmarks" / "EMPS" / "EMPS.zip").touch()
    monkeypatch.setattr("nonlinear_benchmarks.EMPS", emps_downloader())
    assert fetch("emps") == no_files / "nonlinear_benchmarks"
    assert capsys.readouterr().out == ""
    assert np.array_equal(load("emps").test[0].y[:, 0], BEAM[:, 0])


def test_a_package_download_that_breaks_off_leaves_nothing(no_files, monkeypatch):
    monkeypatch.setattr("nonlinear_benchmarks.EMPS", emps_downloader(broken=True))
    with pytest.raises(UnusableInput, match="line went dead"):
        fetch("emps")
    assert not no_files.exists()


def test_a_cache_that_cannot_be_written_is_one_sentence(no_files):
    no_files.write_text("a file where the cache should be")
    with pytest.raises(UnusableInput, match="could not be downloaded"):
        fetch("daisy_ballbeam")


def test_a_set_without_a_licence_is_not_downloaded_and_says_where_it_is(no_files):
    with pytest.raises(UnusableInput, match=r"state no licence, so clone .*sysid yourself and set SIMGAP_DATA"):
        fetch("sts3215")
    assert "simgap data fetch" not in available()["sts3215"]
    assert not no_files.exists()


def test_a_simulated_set_needs_no_download(no_files):
    with pytest.raises(UnusableInput, match="needs no download"):
        fetch("gimbal")


def test_an_unknown_set_lists_the_known_ones(no_files):
    with pytest.raises(UnusableInput, match="known are"):
        fetch("no_such_set")
