"""Files as people have them: read for what they are, with one line that says what was inferred, or refused in one.

Every file here is the same record, 40 rows sampled every 10 ms, as some program or other writes it.
"""

from datetime import datetime, timedelta

import numpy as np
import pytest

from simgap.data import read

N = 40
T = [k / 100 for k in range(N)]
U = [(k * 7 % 5) / 4 - 0.5 for k in range(N)]
Y = [(k * 3 % 11) / 8 - 1.25 for k in range(N)]
START = datetime(2024, 5, 1, 12, 0, 0, 10_000)
ISO = [str(START + timedelta(seconds=t)) for t in T]


def text(header: str, times, mark=",", decimal=".", before="", units="", end="\n") -> str:
    """Write the record with a header, its times as they are given, cells apart by `mark`."""
    numbers = [[repr(value).replace(".", decimal) for value in column] for column in (U, Y)]
    shown = [time if isinstance(time, str) else repr(time).replace(".", decimal) for time in times]
    rows = [mark.join(cells) for cells in zip(shown, *numbers, strict=True)]
    return end.join([*filter(None, [before, header, units]), *rows, ""])


HEADER = "Time (s),Motor voltage [V],Speed [rad/s]"
BARE = "time,Motor voltage,Speed"
CLOCK = "from column"
GOOD = {
    "units in square brackets": (text(HEADER, T), "read: Speed as velocity (rad/s, by name and unit), sampling time "
                                 "0.01 s from column Time"),
    "units in round brackets": (text("t (s),Motor voltage (V),Speed (rad/s)", T), "velocity (rad/s"),
    "units after a slash": (text("t / s,Motor voltage / V,Speed / rad/s", T), "velocity (rad/s"),
    "milliseconds in the name": (text("t_ms,Motor voltage,Speed", [10 * k for k in range(N)]), "counts ms"),
    "milliseconds in brackets": (text("time [ms],Motor voltage,Speed", [10.0 * k for k in range(N)]), "counts ms"),
    "microseconds of a microcontroller": (
        text("micros,Motor voltage,Speed", [5_000_000 + 10_000 * k for k in range(N)]), "counts us"),
    "minutes": (text("Time [min],Motor voltage,Speed", [t / 60 for t in T]), "counts min"),
    "semicolons": (text(HEADER.replace(",", ";"), T, ";"), "semicolons between cells"),
    "semicolons and decimal commas": (text(HEADER.replace(",", ";"), T, ";", ","), "decimal commas"),
    "tabs": (text(HEADER.replace(",", "\t"), T, "\t"), "tabs between cells"),
    "tabs and decimal commas": (text(HEADER.replace(",", "\t"), T, "\t", ","), "decimal commas"),
    "a comma in a header of semicolons": (text("Time (s);Motor voltage;Speed;a, b", T, ";").replace(
        "\n", ";0\n").replace("a, b;0", "a, b"), "semicolons"),
    "the separator line of Excel": (text(HEADER.replace(",", ";"), T, ";", ",", before="sep=;"), "semicolons"),
    "a byte order mark and quoted headers": (
        "\ufeff" + text('"Time (s)","Motor voltage [V]","Speed [rad/s]"', T), CLOCK),
    "blanks around quoted headers": (text('"Time (s)" , "Motor voltage [V]" ,"Speed [rad/s]" ', T), CLOCK),
    "a separator in a quoted header with blanks around": (
        text('"Time (s)" ;"Motor voltage [V]"; "Speed [rad/s]" ; "a;""b"" "', T, ";").replace("\n", ";0\n").replace(
            '" ";0', '" " '), "semicolons"),
    "comments before the header": (text(HEADER, T, before="# rig 7\n# by hand, in May\n"), CLOCK),
    "a header that is a comment": (text("# t,Motor voltage,Speed", T), "the header from the comment in row 1"),
    "a line of units": (text(BARE, T, units="s,V,rad/s"), "units from row 2"),
    "a line of units in brackets": (text(BARE, T, units="[s],[V],[rad/s]"), "velocity (rad/s"),
    "a line of units below a time in ms": (text(BARE, [10 * k for k in range(N)], units="ms,V,rad/s"), "counts ms"),
    "a line of units without one for the date": (text(BARE, ISO, units=",V,rad/s"), "holds dates"),
    "dates with a blank": (text(BARE, ISO), "holds dates"),
    "dates with a T and a time zone": (text(BARE, [iso.replace(" ", "T") + "+02:00" for iso in ISO]), "holds dates"),
    "dates with a Z": (text(BARE, [iso.replace(" ", "T") + "Z" for iso in ISO]), "holds dates"),
    "dates with the year first and slashes": (text(BARE, [iso.replace("-", "/") for iso in ISO]), "holds dates"),
    "German dates and decimal commas": (
        text(BARE.replace(",", ";"), [f"1.5.2024 {iso[11:].replace('.', ',')}" for iso in ISO], ";", ","),
        "holds dates"),
    "times of day": (text(BARE, [iso[11:] for iso in ISO]), "holds times of day"),
    "times of day with one digit of hours": (text(BARE, ["9" + iso[13:] for iso in ISO]), "holds times of day"),
    "seconds since 1970": (text("Timestamp,Motor voltage,Speed", [1714557600 + t for t in T]), "column Timestamp"),
    "milliseconds since 1970": (text("time,Motor voltage,Speed", [1714557600000 + 10 * k for k in range(N)]),
                                "milliseconds since 1970"),
    "line ends of Windows": (text(HEADER, T, end="\r\n"), CLOCK),
    "line ends of old Macs": (text(HEADER, T, end="\r", units="s,V,rad/s"), CLOCK),
    "a column of text that nobody uses": (text("t,Motor voltage,Speed,note", T).replace("\n", ",ok\n").replace(
        "note,ok", "note"), "read: Speed as velocity (by name), sampling time 0.01 s from column t"),
}  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("long", [False, True])
def test_the_record_is_read_from_any_of_these_files_by_either_reader(name, long, tmp_path, monkeypatch):
    content, said = GOOD[name]
    if long:
        monkeypatch.setattr("simgap.data.formats.csv_files.LONG", 0)
    (tmp_path / "log.csv").write_bytes(content.encode())
    reading = read(tmp_path / "log.csv", ["motor voltage"], ["speed"])
    data = reading.dataset
    every = (*data.training.train, *data.training.valid, *data.test)
    np.testing.assert_array_equal(np.concatenate([part.u[:, 0] for part in every]), U)
    np.testing.assert_array_equal(np.concatenate([part.y[:, 0] for part in every]), Y)
    assert data.training.dt == 0.01
    assert (data.channels.inputs[0].name, data.channels.outputs[0].name) == ("Motor voltage", "Speed")
    assert data.channels.outputs[0].kind == "velocity"
    assert said in str(reading)
    assert len(str(reading).splitlines()) == 1


def test_nothing_is_said_of_a_plain_file(tmp_path):
    (tmp_path / "log.csv").write_text(text("t,u,y", T))
    assert str(read(tmp_path / "log.csv", ["u"], ["y"])) == ""


BAD = {
    "days of Excel": (text("time,u,phi", [45413 + t / 86400 for t in T]), 2, "time", "may count days"),
    "a point in a file of decimal commas": (
        text("t;u;phi", T, ";", ",").replace("0,02;", "0.02;"), 4, "t", "this file has decimal commas"),
    "a comma in a file of decimal points": (text("t;u;phi", T, ";").replace("0.02;", "0,02;"), 4, "t", "like -1.25"),
    "points between thousands": (text("t;u;phi", T, ";", ",").replace("0,02;", "1.000,02;"), 4, "t", "decimal commas"),
    "decimal commas between commas": (text("t,u,phi", T, ",", ","), 2, "phi", "more cells"),
    "a date that may be two": (
        text("t,u,phi", [f"05/01/2024 {iso[11:]}" for iso in ISO]), 2, "t", "the day or the month"),
    "a day that is none": (text("t,u,phi", ISO).replace("2024-05-01 12:00:00.03", "2024-05-41 12:00:00.03"), 4, "t",
                           "write it like 2024-05-01 12:00:00.010"),
    "one date without its time zone": (text("t,u,phi", [iso + "Z" for iso in ISO]).replace("030000Z", "030000"), 4, "t",
                                       "some have none"),
    "hours and minutes, or minutes and seconds": (
        text("t,u,phi", [f"00:{k:02d}" for k in range(N)]), 2, "t", "no date"),
    "a number among dates": (text("t,u,phi", [*ISO[:2], "0.02", *ISO[3:]]), 4, "t", "no date and time"),
    "dates that jump": (text("t,u,phi", [*ISO[:3], *[iso.replace("12:", "13:") for iso in ISO[3:]]]), 5, "t",
                        "from 2024-05-01 12:00:00.030000 to 2024-05-01 13:00:00.040000 where a step of 0.01 s is due; "
                        "--split-gaps"),
    "nanoseconds that say nothing of it": (text("t,u,phi", [1714557600 * 10**9 + 10**7 * k for k in range(N)]), 2, "t",
                                           "'time [us]'"),
    "a line of words": (text("t,u,phi", T, units="s,V,very far"), 2, "t", "not a number"),
    "two lines of units": (text("t,u,phi", T, units="s,V,deg\ns,V,deg"), 3, "t", "not a number"),
    "a comment between samples": (text("t,u,phi", T).replace("\n0.02", "\n# stopped\n0.02"), 4, "u", "ends before"),
    "an empty line before the header": (text("t,u,phi", T, before="\n"), 1, None, "must name the columns"),
    "a bad cell after comments": (text("t,u,phi", ["x", *T[1:]], before="# a\n# b"), 4, "t", "not a number"),
    "a capital T in degrees": (text("T,u,phi", T), None, None, "the sampling time is not known"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_what_may_mean_two_things_is_refused_with_row_column_and_remedy(name, refused_cell):
    content, row, column, said = BAD[name]
    assert said in refused_cell(content, row, column)
