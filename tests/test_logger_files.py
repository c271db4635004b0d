"""Files as loggers write them: each is read right, or refused at once by its true cause, and each remedy leads to the
goal."""

from __future__ import annotations

import gzip
import json
import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from chainunit import InputError
from chainunit.drives.dc_motor import DcMotor
from chainunit.drives.induction_motor import InductionMotor
from chainunit.recordings import logger_table
from chainunit.recordings.recording import read_recording, with_rms

DATA = Path(__file__).parent / "data" / "recordings"
CASES = json.loads((DATA / "expected.json").read_text())
"""The first rows of recordings, as loggers write them, and their numbers: time, torque, speed and mark."""


def written(folder, text, encoding="utf-8", name="run.csv"):
    file = folder / name
    file.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return file


@pytest.fixture
def few(monkeypatch):
    """Files of a few rows are enough."""
    monkeypatch.setattr(logger_table, "FEWEST", 10)


@pytest.mark.parametrize("name", CASES)
def test_recordings_are_read_right_or_refused_by_their_cause(name, few):
    case = CASES[name]
    if "refused" in case:
        with pytest.raises(InputError) as refusal:
            read_recording(DATA / f"{name}.csv", case["columns"])
        assert case["refused"] in str(refusal.value)
        return
    recording = read_recording(DATA / f"{name}.csv", case["columns"])
    time, tau, w, mark = np.array(case["rows"]).T
    exact = not name.startswith(("R-09", "R-49"))
    np.testing.assert_allclose(np.ptp(recording.time), np.ptp(time), atol=1e-6 if exact else 2e-2)
    np.testing.assert_allclose(
        recording.time - recording.time[0], time - time[0], atol=1e-6 if exact else 2e-2
    )
    np.testing.assert_allclose(recording.columns["crank.tau"], tau, atol=5.0 if "R-38" in name else 0.01)
    np.testing.assert_allclose(recording.columns["crank.w"], w, atol=1e-5)
    np.testing.assert_array_equal(recording.columns["mark"], mark)
    assert f"{len(time):,} rows" in recording.understood and " Hz" in recording.understood


PIVOTED = "time [s],crank.tau [N m]\n"
FOLLOWED = {
    "R-30": lambda text: (
        PIVOTED + re.sub(r"^Torque,.*?(\d\d\.?\d*),(.*)$", r"\1,\2", text, flags=re.MULTILINE)
    ),
    "R-42": lambda text: re.sub(r";(\d+)\.(\d{3});", r";\1\2;", text),
    "R-44": lambda text: text.replace("ok, fine", '"ok, fine"'),
    "R-52": lambda text: re.sub(
        r"^1687212032\.000", lambda m: f"{m.start() / 1e3}", text, flags=re.MULTILINE
    ),
    "R-57": lambda text: re.sub(r"^(\d+),(\d+),", r"\1;\2,", text.replace("],", "];"), flags=re.MULTILINE),
}
"""By recording that is refused, what its remedy says."""


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if "refused" in case])
def test_refused_recordings_are_read_after_their_remedy(name, few, tmp_path):
    text = FOLLOWED[name[:4]]((DATA / f"{name}.csv").read_text())
    recording = read_recording(written(tmp_path, text))
    time, tau, *_ = np.array(CASES[name]["rows"]).T
    np.testing.assert_allclose(
        recording.columns["crank.tau"], tau, atol=0.5 if name[:4] in ("R-42", "R-57") else 0.0
    )
    if "R-52" not in name:
        np.testing.assert_allclose(recording.time - recording.time[0], time - time[0], atol=1e-9)


COUNT = 120
T = 0.02 * np.arange(COUNT)
TAU = np.round(7000.0 + 6500.0 * np.sin(3.0 * T) + np.random.default_rng(1).normal(0, 50, COUNT), 2)
W = np.round(1.05 + 0.03 * np.cos(3.0 * T), 5)
MARK = (np.arange(COUNT) % 30 == 7).astype(int)
START = datetime(2023, 6, 19, 23, 59, 59)
HEADS = "time [s]", "crank.tau [N m]", "crank.w [rad/s]", "mark [1]"


def moment(k):
    return START + timedelta(milliseconds=20 * k)


def comma(x):
    return str(x).replace(".", ",")


def table(cells, heads=HEADS, mark=",", before="", units=(), after="", end="\n"):
    """The text of a file: `cells` gives the first cells of row k as texts; the others are as they are."""
    lines = [*([before] if before else []), mark.join(heads), *([mark.join(units)] if units else [])]
    for k in range(COUNT):
        row, rest = [*cells(k)], [f"{TAU[k]:.2f}", f"{W[k]:.5f}", str(MARK[k])]
        lines.append(mark.join([*row, *rest[len(rest) - len(heads) + len(row) :]]))
    return end.join(lines) + end + after


def plain(k):
    return [f"{T[k]:.3f}"]


def german(k, mark=";"):
    return [comma(f"{T[k]:.3f}"), comma(f"{TAU[k]:.2f}"), comma(f"{W[k]:.5f}"), str(MARK[k])]


def grouped(x, thousands, decimal):
    return f"{x:,.2f}".replace(",", "T").replace(".", decimal).replace("T", thousands)


GRAPHTEC = """"Vendor","GRAPHTEC Corporation"
Model,GL840
Sampling interval,20ms
Total data points,120
AMP settings
CH,Signal name,Input
CH1,"CH1",DC"""
HIOKI = """"File name","MEM0001.CSV","V 2.31"
"Title comment",""
"Trigger Time","23-06-19 23:59:59"
"CH1","U1-1"
"""
TOA5 = '"TOA5","CR1000","CR1000","1234","CR1000.Std.32","CPU:drive.CR1","5","Table1"'
FORMATS = {
    "TOA5 of Campbell loggers": (
        table(
            lambda k: [f'"{moment(k):%Y-%m-%d %H:%M:%S.%f}"'[:-4] + '"'],
            ("TIMESTAMP", "crank.tau", "crank.w", "mark"),
            before=TOA5,
            units=("TS", "N m", "rad/s", ""),
        ).replace("rad/s,\n", 'rad/s,\n"","Smp","Smp","Smp"\n'),
        {},
    ),
    "GL of Graphtec, with ms in a column and signs apart": (
        table(
            lambda k: [
                str(k + 1),
                f"{moment(k):%Y/%m/%d %H:%M:%S}",
                f"{moment(k).microsecond // 1000:03d}",
                f"+ {TAU[k]:.2f}",
            ],
            ("Number", "Date&Time", "ms", "crank.tau", "crank.w", "mark"),
            before=GRAPHTEC,
            units=("NO.", "Time", "ms", "Nm", "rad/s", ""),
        ),
        {},
    ),
    "memory recorder of Hioki": (
        table(
            lambda k: [f'" {T[k]:.6E}"'], ['"Time"', '"U1-1[N.m]"', '"U1-2[rad/s]"', '"mark"'], before=HIOKI
        ).replace('"Time"', '"Time[s]"'),
        {"crank.tau": "U1-1", "crank.w": "U1-2"},
    ),
    "scope of Keysight, units below": (
        table(
            lambda k: [f"{T[k]:+.5E}", f"{TAU[k]:+.6E}"],
            ("x-axis", "1", "2", "mark"),
            units=("second", "N m", "rad/s", ""),
        ),
        {"time": "x-axis", "crank.tau": "1", "crank.w": "2"},
    ),
    "PicoScope, units in parentheses below and an empty line": (
        table(
            lambda k: [f"{1000 * T[k]:.5f}"],
            ("Time", "Channel A", "Channel B", "mark"),
            units=("(ms)", "(N m)", "(rad/s)", "(-)"),
        ).replace("(-)\n", "(-)\n\n"),
        {"crank.tau": "Channel A", "crank.w": "Channel B"},
    ),
    "HOBO, heads with commas and serial numbers": (
        '"Plot Title: pump"\n'
        + table(
            lambda k: [
                str(k + 1),
                f"{moment(k):%m/%d/%y %I:%M:%S}.{moment(k).microsecond // 1000:03d} {moment(k):%p}",
            ],
            (
                '"#"',
                '"Date Time, GMT+02:00"',
                '"crank.tau, N m (LGR S/N: 12, SEN S/N: 12)"',
                '"crank.w, rad/s"',
                "mark",
            ),
        ),
        {},
    ),
    "ETAS MDA, tabs and units below": (
        table(plain, ("time", "crank.tau", "crank.w", "mark"), "\t", units=("s", "Nm", "rad/s", "-")),
        {},
    ),
    "DewesoftX text": (
        table(
            plain,
            ("Time (s)", "crank.tau (Nm)", "crank.w (rad/s)", "mark (-)"),
            "\t",
            before="Data header\n\nfile name: Test_0001.dxd\nStart time: 19.06.2023 23:59:59\n",
        ),
        {},
    ),
    "numpy savetxt": (
        table(lambda k: [f"{T[k]:.18e}", f"{TAU[k]:.18e}"], HEADS, " ").replace("time [s]", "# time [s]"),
        {},
    ),
    "gnuplot, blanks and comments": (
        table(plain, ("#time_s", "crank.tau_Nm", "crank.w_rad/s", "mark"), "   ").replace(
            "\n0.400", "\n# oiled\n0.400"
        ),
        {},
    ),
    "pandas, an index and Timedelta": (
        table(lambda k: [str(k), f"0 days 00:00:{T[k]:09.6f}"], ("", "time", *HEADS[1:])),
        {},
    ),
    ".NET TimeSpan": (
        table(
            lambda k: [f"1.23:59:{58 + T[k]:010.7f}" if T[k] < 2 else f"2.00:00:{T[k] - 2:010.7f}"],
            ("time", *HEADS[1:]),
        ),
        {},
    ),
    "ibaAnalyzer, dates with points": (
        table(
            lambda k: [f"{moment(k):%d.%m.%Y %H:%M:%S.%f}"],
            ("clock", "crank.tau", "crank.w", "mark"),
            "\t",
            units=("", "Nm", "rad/s", ""),
        ),
        {},
    ),
    "RFC 3339 with a zone and as many digits as needed": (
        table(
            lambda k: [f"{moment(k):%Y-%m-%dT%H:%M:%S.%f}".rstrip("0").rstrip(".") + "+02:00"],
            ("time", *HEADS[1:]),
        ),
        {},
    ),
    "basic ISO 8601": (table(lambda k: [f"{moment(k):%Y%m%dT%H%M%S.%f}"], ("time", *HEADS[1:])), {}),
    "German columns of date and clock": (
        table(
            lambda k: [
                f"{moment(k):%d.%m.%Y}",
                f"{moment(k):%H:%M:%S},{moment(k).microsecond // 1000:03d}",
                *german(k)[1:],
            ],
            ("Datum", "Uhrzeit", *HEADS[1:]),
            ";",
        ),
        {},
    ),
    "columns of date, clock and ms": (
        table(
            lambda k: [
                f"{moment(k):%d.%m.%y}",
                f"{moment(k):%H:%M:%S}",
                str(moment(k).microsecond // 1000),
                *german(k)[1:],
            ],
            ("Datum", "Zeit", "Millisekunden", *HEADS[1:]),
            ";",
        ),
        {},
    ),
    "columns of year to second": (
        table(
            lambda k: [
                *f"{moment(k):%Y %m %d %H %M} {moment(k).second + moment(k).microsecond / 1e6:.3f}".split()
            ],
            ("Year", "Month", "Day", "Hour", "Minute", "Second", *HEADS[1:]),
        ),
        {},
    ),
    "clock with a colon before ms, over midnight": (
        table(lambda k: [f"{moment(k):%H:%M:%S}:{moment(k).microsecond // 1000:03d}"], ("Time", *HEADS[1:])),
        {},
    ),
    "12 hours with AM and PM, over midnight": (
        table(
            lambda k: [f"{moment(k):%I:%M:%S}.{moment(k).microsecond // 1000:03d} {moment(k):%p}"],
            ("Time", *HEADS[1:]),
        ),
        {},
    ),
    "Excel shows mm:ss.000, over the hour": (
        table(lambda k: [f"{moment(k):%M:%S}.{moment(k).microsecond // 1000:03d}"], ("Time", *HEADS[1:])),
        {},
    ),
    "US dates over midnight": (
        table(lambda k: [f"{moment(k):%m/%d/%Y %H:%M:%S.%f}"], ("time", *HEADS[1:])),
        {},
    ),
    "month by its name": (table(lambda k: [f"{moment(k):%d-%b-%Y %H:%M:%S.%f}"], ("time", *HEADS[1:])), {}),
    "newest row first": (
        "\n".join([lines[0], *lines[:0:-1]])
        if (lines := table(lambda k: [f"{moment(k)}.000"[:23]], ("time", *HEADS[1:])).splitlines())
        else "",
        {},
    ),
    "ms since 1970 without a unit": (
        table(lambda k: [str(1687211980000 + 20 * k)], ("Timestamp", *HEADS[1:])),
        {"time": "Timestamp"},
    ),
    "micros() of 32 bits begins anew": (
        table(lambda k: [str((4294967296 - 700000 + 20000 * k) % 2**32)], ("time [us]", *HEADS[1:])),
        {},
    ),
    "clock of 0.1 s": (table(lambda k: [f"{T[k] - T[k] % 0.1 + 1e-9:.1f}" if k % 5 else f"{T[k]:.1f}"]), {}),
    "quotes around all cells": (
        re.sub(
            r"[^,;\n]+(?=[;\n])|[\d,]+(?=[;\n])",
            lambda m: f'"{m[0]}"',
            table(lambda k: [f"{T[k]:.3f}"], mark=";"),
        ),
        {},
    ),
    "Excel, all in quotes, empty rows below": (
        "\n".join(
            ";".join(f'"{cell}"' for cell in line.split(";")) for line in table(german, mark=";").splitlines()
        )
        + "\n;;;\n;;;\n",
        {},
    ),
    "Swiss thousands": (table(lambda k: [*plain(k), grouped(TAU[k], "'", ".")], mark=";"), {}),
    "French thousands": (
        table(lambda k: [german(k)[0], grouped(TAU[k], "\u202f", ","), *german(k)[2:]], mark=";"),
        {},
    ),
    "US thousands in quotes": (table(lambda k: [*plain(k), f'"{TAU[k]:,.2f}"']), {}),
    "bars": (table(plain, mark="|"), {}),
    "blanks, date and clock": (
        table(lambda k: [f"{moment(k):%Y-%m-%d %H:%M:%S.%f}"], ("time", *HEADS[1:]), " "),
        {},
    ),
    "signs of Unicode": (table(lambda k: [*plain(k), f"{TAU[k]:.2f}".replace("-", "\u2212")]), {}),
    "booleans in German": (table(lambda k: [*german(k)[:3], ("FALSCH", "WAHR")[MARK[k]]], mark=";"), {}),
    "a Fortran program, exponents with D": (
        table(lambda k: [*plain(k), f"{TAU[k]:.8E}".replace("E", "D")]),
        {},
    ),
    "columns of one width": (
        "\n".join(
            [
                "   time [s] crank.tau [N m] crank.w [rad/s] mark [1]",
                *(f"{T[k]:11.3f}{TAU[k]:16.2f}{W[k]:16.5f}{MARK[k]:9d}" for k in range(COUNT)),
            ]
        ),
        {},
    ),
    "clock backwards over midnight": (
        "\n".join([*lines[:1], *lines[:0:-1]])
        if (lines := table(lambda k: [f"{moment(k):%H:%M:%S.%f}"], ("Time", *HEADS[1:])).splitlines())
        else "",
        {},
    ),
    "the name of a zone": (
        table(lambda k: [f"{moment(k):%Y-%m-%d %H:%M:%S.%f} CEST"], ("time", *HEADS[1:])),
        {},
    ),
    "days of a spreadsheet without a unit": (
        table(lambda k: [f"{45096.99 + T[k] / 86400.0:.12f}"], ("Time", *HEADS[1:])),
        {},
    ),
    "ms beside a clock that has them": (
        table(
            lambda k: [f"{moment(k):%H:%M:%S.%f}", str(moment(k).microsecond // 1000)],
            ("Time", "ms", *HEADS[1:]),
        ),
        {},
    ),
    "sep of tabs": (table(plain, mark="\t", before="sep=\t"), {}),
    "no unit of a mark in brackets": (table(plain, (*HEADS[:3], "mark [bool]")), {}),
    "unit after a stroke": (table(plain, ("time / s", "crank.tau / N m", "crank.w / rad/s", "mark")), {}),
    "unit after in": (table(plain, ("time in s", "crank.tau in N m", "crank.w in rad/s", "mark")), {}),
    "no sign at numbers of three decimals": (
        table(lambda k: [f"{1000 * T[k]:.0f}", f"{TAU[k]:.2f}"], ("time [ms]", *HEADS[1:])),
        {},
    ),
    "footer with statistics": (table(plain, after="Average,1,2,3\nNumber of samples: 120\n"), {}),
    "repeated head after each page": (
        table(plain)
        .replace("\n0.400", f"\n{','.join(HEADS)}\n0.400")
        .replace("\n1.000", f"\n{','.join(HEADS)}\n1.000"),
        {},
    ),
    "LabVIEW, a preamble of pairs and a head for remarks without cells": (
        table(
            plain,
            (*HEADS[:3], "mark"),
            "\t",
            before="LabVIEW Measurement\t\n"
            + "".join(f"Date{k}\t2023/06/19 23:59:59 a\n" for k in range(12))
            + "***End_of_Header***\t",
        ).replace("mark\n", "mark\tComment\n"),
        {},
    ),
    "Tektronix TDS, settings beside the first rows": (
        table(
            lambda k: [
                *(("Record Length", "120", ""), ("Vertical Units", "N m", ""), ("", "", ""))[min(k, 2)],
                f"{T[k]:.3f}",
            ],
            ("a", "b", "c", *HEADS),
        ),
        {},
    ),
    "Rockwell, ms in a column without zeros": (
        table(
            lambda k: [
                f"{moment(k):%m/%d/%Y}",
                f"{moment(k):%H:%M:%S}",
                str(moment(k).microsecond // 1000),
                " ",
            ],
            ("Date", "Time", "Millitm", "Marker", *HEADS[1:]),
            ";",
        ),
        {},
    ),
    "a fraction of a second in a column": (
        table(
            lambda k: [f"{moment(k):%H:%M:%S}", f"0.{moment(k).microsecond // 1000:03d}"],
            ("Time", "Fractional Seconds", *HEADS[1:]),
        ),
        {},
    ),
    "AM and PM in a column": (
        table(
            lambda k: [f"{moment(k):%m/%d/%Y}", f"{moment(k):%I:%M:%S.%f}", f"{moment(k):%p}"],
            ("Date", "Time", "AM/PM", *HEADS[1:]),
        ),
        {},
    ),
    "a clock without zeros before its parts": (
        table(
            lambda k: [
                f"{moment(k).hour}:{moment(k).minute}:{moment(k).second}.{moment(k).microsecond // 1000:03d}"
            ],
            ("time", *HEADS[1:]),
        ),
        {},
    ),
    "exponents with d": (table(lambda k: [*plain(k), f"{TAU[k]:.8e}".replace("e", "d")]), {}),
    "true as -1": (table(lambda k: [*plain(k), f"{TAU[k]:.2f}", f"{W[k]:.5f}", str(-MARK[k])]), {}),
    "booleans in French": (table(lambda k: [*german(k)[:3], ("FAUX", "VRAI")[MARK[k]]], mark=";"), {}),
    "booleans of a database": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}", f"{W[k]:.5f}", "ft"[MARK[k]]]),
        {},
    ),
    "passes of the mark alone": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}", f"{W[k]:.5f}", "1"[: MARK[k]]]),
        {},
    ),
    "a table of channels with numbers": (
        f"Channel,Gain,Offset,Range\n1,1.0,0.0,10\n2,1.0,0.0,10\n\n{table(plain)}",
        {},
    ),
    "a long preamble": ("".join(f"setting {k}\n" for k in range(900)) + table(plain), {}),
    "lines of zeros by a loss of power": (table(plain).replace("\n0.400", "\n" + 40 * "\0" + "\n0.400"), {}),
    "a date where it changes": (
        table(
            lambda k: [
                f"{moment(k):%d.%m.%Y}" if k == 0 or moment(k).day != moment(k - 1).day else "",
                f"{moment(k):%H:%M:%S.%f}",
            ],
            ("Date", "Time", *HEADS[1:]),
        ),
        {},
    ),
    "seconds of the day, over midnight": (table(lambda k: [f"{(86399.0 + T[k]) % 86400.0:.3f}"]), {}),
    "titles of pages, heads and units again": (
        re.sub(
            r"^(0\.400|1\.000),",
            "\nPage 2, drive 1\n\ntime,crank.tau,crank.w,mark\ns,N m,rad/s,\n\\1,",
            table(plain, ("time", "crank.tau", "crank.w", "mark"), units=("s", "N m", "rad/s", "")),
            flags=re.MULTILINE,
        ),
        {},
    ),
    "a torque in in-lb and a speed in Upm": (
        table(
            lambda k: [*plain(k), f"{TAU[k] / 0.1129848290276167:.9f}", f"{W[k] * 30 / np.pi:.12f}"],
            (HEADS[0], "crank.tau [in-lb]", "crank.w [Upm]", HEADS[3]),
        ),
        {},
    ),
    "doubled rows": (
        table(plain).replace("\n0.400", f"\n0.380,{TAU[19]:.2f},{W[19]:.5f},{MARK[19]}\n0.400"),
        {},
    ),
}
"""By name, the text of a file, and the heads of its columns."""


def check(recording, keep=slice(None), tol=2e-6):
    np.testing.assert_allclose(recording.time - recording.time[0], T[keep] - T[keep][0], atol=tol)
    np.testing.assert_allclose(recording.columns["crank.tau"], TAU[keep], rtol=1e-6)
    np.testing.assert_allclose(recording.columns["crank.w"], W[keep], rtol=1e-12)
    np.testing.assert_array_equal(recording.columns["mark"], MARK[keep])


@pytest.mark.parametrize("name", FORMATS)
def test_formats_of_manuals(name, tmp_path):
    text, names = FORMATS[name]
    recording = read_recording(written(tmp_path, text), names)
    check(recording, tol=0.011 if name == "clock of 0.1 s" else 3e-6)
    assert f", {COUNT} rows, 50 Hz" in recording.understood


@pytest.mark.parametrize(
    ("encoding", "mark"),
    [("utf-16", b""), ("utf-16-le", b""), ("utf-16-be", b"\xfe\xff"), ("utf-8-sig", b""), ("cp1252", b"")],
)
def test_encodings_by_their_marks(tmp_path, encoding, mark):
    text = table(lambda k: [f"{1e6 * T[k]:.0f}"], ("Zeit für µ [µs]", *HEADS[1:]), "\t")
    check(read_recording(written(tmp_path, mark + text.encode(encoding)), {"time": "Zeit für µ"}))
    packed = written(tmp_path, gzip.compress(mark + text.encode(encoding)), name="run.csv.gz")
    check(read_recording(packed, {"time": "Zeit für µ"}))


@pytest.mark.parametrize(
    "cell",
    [
        *(
            "",
            "NaN",
            "OL",
            "-OL",
            "#N/A",
            "---",
            "9.9E+37",
            "1.#QNAN",
            "inf",
            "Overload",
            "+++++++",
            "BURNOUT",
        ),
        *(
            "O.L",
            "OVLD",
            "UNDER",
            "No Data",
            "n.a.",
            "Bad Input",
            "Timeout",
            "<null>",
            "Out of range",
            "Comm Fail",
        ),
        *("-99999.99", "99999", "1.0E+30"),
    ],
)
def test_cells_without_a_number_are_left_out_and_counted(tmp_path, cell):
    lines = table(plain).splitlines()
    for k in (10, 50, 51):
        lines[k + 1] = lines[k + 1].replace(f",{TAU[k]:.2f},", f",{cell},")
    recording = read_recording(written(tmp_path, "\n".join(lines)))
    check(recording, ~np.isin(np.arange(COUNT), (10, 50, 51)))
    assert f"left out: 3 rows without a number ({cell or 'empty'})" in recording.understood


@pytest.mark.parametrize(
    ("begin", "kind"),
    [
        (b"PK\x03\x04", "a workbook of a spreadsheet; must"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", r"a workbook of a spreadsheet \(XLS\)"),
        (b"TDSm\x0e\0\0\0", "a TDMS file"),
        (b"MDF     4.10    ", r"a measurement data file \(MDF\)"),
        (b"MATLAB 5.0 MAT-file", "a MAT file"),
        ("time [s]".encode("utf-32"), "is not UTF-8 text; save it as UTF-8, or export a table as CSV"),
    ],
)
def test_files_of_instruments_that_are_no_text_are_named(tmp_path, begin, kind):
    with pytest.raises(InputError, match=kind):
        read_recording(written(tmp_path, begin + 500 * b"\0"))


def test_a_line_has_a_largest_length(tmp_path):
    """Before it is searched for marks and heads."""
    with pytest.raises(InputError, match=r"line 2: has more than 50000 characters"):
        read_recording(written(tmp_path, "time [s] motor.i [A]\n" + 2 * (30_000 * "1 " + "\n")))


def test_a_time_without_a_number_is_counted(tmp_path):
    recording = read_recording(written(tmp_path, table(plain).replace("\n0.400,", "\nnan,")))
    check(recording, np.arange(COUNT) != 20)
    assert "left out: 1 row without a number (nan)" in recording.understood


@pytest.mark.parametrize("order", [1, -1])
def test_a_mark_in_a_row_without_a_number_stands_in_the_next_one(tmp_path, order):
    """In time, also if the newest row is the first one."""
    head, *rows = table(plain).splitlines()
    passed = int(np.flatnonzero(MARK)[1])
    rows[passed] = rows[passed].replace(f",{TAU[passed]:.2f},", ",NaN,")
    recording = read_recording(written(tmp_path, "\n".join([head, *rows[::order]])))
    moved = np.roll(MARK, 1) * (np.arange(COUNT) == passed + 1) + MARK
    keep = np.arange(COUNT) != passed
    np.testing.assert_array_equal(recording.columns["mark"], moved[keep])
    np.testing.assert_array_equal(recording.columns["crank.tau"], TAU[keep])


@pytest.mark.parametrize("written_as", ["{0}-", "({0})", "-{0}", "- {0}", "\u2212{0}"])
def test_signs_of_accounts(tmp_path, written_as):
    """Behind the number, and in parentheses; between bars and rules, as SAP lists have them."""
    numbers = TAU - 7000.0
    cells = [grouped(abs(x), ".", ",") for x in numbers]
    cells = [written_as.format(cell) if x < 0.0 else cell for x, cell in zip(numbers, cells, strict=True)]
    rows = [f"|{comma(f'{T[k]:.3f}')}|{cell:>12}|" for k, cell in enumerate(cells)]
    rule = "-" * 40
    text = "\n".join([rule, "|time [s]|crank.tau [N m]|", rule, *rows, rule])
    recording = read_recording(written(tmp_path, text))
    np.testing.assert_allclose(recording.columns["crank.tau"], numbers, atol=1e-9)
    np.testing.assert_allclose(recording.time, T, atol=1e-9)


def test_large_numbers_of_nines_are_measurements_among_their_like(tmp_path):
    text = table(lambda k: [*plain(k), "9999.00" if k == 40 else f"{TAU[k]:.2f}"])
    assert read_recording(written(tmp_path, text)).columns["crank.tau"][40] == 9999.0


def replaced(text, *changes):
    for old, new in changes:
        assert re.search(old, text, re.MULTILINE), old
        text = re.sub(old, new, text, flags=re.MULTILINE)
    return text


THOUSANDS = table(lambda k: [*german(k)[:1], f"{TAU[k] / 1000 + 2:.3f}", *german(k)[2:]], mark=";")
REMEDIES = {
    "more cells than heads, by a text": (
        table(lambda k: [*plain(k), "ok, fine" if k == 8 else "ok"], (HEADS[0], "note", *HEADS[1:])),
        "line 10: has 6 cells, and the head 5: a comma stands within a number or a text",
        "put the cell in quotation marks",
        lambda text: replaced(text, ("ok, fine", '"ok, fine"')),
    ),
    "decimal commas between commas": (
        table(german),
        "has 7 cells, and the head 4: a comma stands within a number",
        "put semicolons between the columns",
        lambda _: table(german, mark=";"),
    ),
    "a mark left out": (
        replaced(table(plain), (r"^(0\.100),", r"\1 ")),
        "line 7: has 3 cells, and the head 4: a mark between columns is left out",
        "mend this row, or delete it",
        lambda text: replaced(text, (r"^(0\.100) ", r"\1,")),
    ),
    "one head twice, with other units": (
        table(lambda k: [*plain(k), f"{TAU[k] / 1000:.5f}"], (HEADS[0], "crank.tau [kN m]", *HEADS[1:])),
        "columns 2 and 3 have the head crank.tau",
        'columns = { "crank.tau" = "crank.tau [kN m]" }',
        {"crank.tau": "crank.tau [kN m]"},
    ),
    "one head twice": (
        table(lambda k: [*plain(k), "1"], (HEADS[0], *HEADS[1:2], *HEADS[1:])),
        "columns 2 and 3 have the head crank.tau",
        "give all but one of them another head",
        lambda text: replaced(text, (r"^(time \[s\]),crank\.tau", r"\1,other")),
    ),
    "maybe thousands": (
        THOUSANDS,
        "may be",
        "without a mark of thousands",
        lambda _: table(german, mark=";"),
    ),
    "maybe thousands, with another number of decimals": (
        table(
            lambda k: [f"{1000 * T[k]:.0f}", f"{TAU[k] / 1000 + 2:.3f}", str(k)],
            ("time [ms]", *HEADS[1:]),
            ";",
        ),
        "may be",
        "or with another number of decimals",
        lambda _: table(
            lambda k: [f"{1000 * T[k]:.0f}", f"{TAU[k] / 1000:.6f}"],
            ("time [ms]", "crank.tau [kN m]", *HEADS[2:]),
            ";",
        ),
    ),
    "two decimal signs": (
        table(
            lambda k: [*german(k)[:1], comma(f"{TAU[k]:.2f}") if k % 2 else f"{TAU[k]:.2f}", *german(k)[2:]],
            mark=";",
        ),
        "have different decimal signs",
        "write all with the same one",
        lambda _: table(german, mark=";"),
    ),
    "no head": (
        "\n".join(table(plain).splitlines()[1:]),
        "has no head: its first row has values",
        "write the heads of the columns into a line above it",
        lambda text: f"{','.join(HEADS)}\n{text}",
    ),
    "a long table": (
        "\n".join(
            f"{name},{moment(k)},{x}" for k in range(COUNT) for name, x in (("tau", TAU[k]), ("w", W[k]))
        ),
        "has no head",
        "needs a column for each quantity",
        lambda _: table(plain),
    ),
    "no unit": (
        table(plain, ("time [s]", "crank.tau", *HEADS[2:])),
        "column crank.tau: has no unit",
        "write [N.m] behind its name",
        lambda text: replaced(text, (r"crank\.tau", "crank.tau [N.m]")),
    ),
    "no unit of the time": (
        table(plain, ("time", *HEADS[1:])),
        "column time: has no unit",
        "write [s] behind its name",
        lambda text: replaced(text, ("^time", "time [s]")),
    ),
    "no column of the time": (
        table(plain, ("Zeit [s]", *HEADS[1:])),
        "has no column time [s]",
        'columns = { "time" = "Zeit" }',
        {"time": "Zeit"},
    ),
    "the unit in each cell": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f} Nm"], ("time [s]", "crank.tau", *HEADS[2:])).replace(
            "tau", "tau [Nm]"
        ),
        "is no number alone",
        "take it out of all cells",
        lambda text: replaced(text, (r"(\d) Nm", r"\1")),
    ),
    "a word": (
        replaced(table(plain), (r"^0\.100,[\d.]+", "0.100,high")),
        "line 7, column 2, crank.tau [N m]: high is no number",
        "write nan for a missing measurement",
        lambda text: replaced(text, ("high", "nan")),
    ),
    "a decimal sign left out": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}".replace(".", "" if k == 30 else ".")]),
        "line 32, column 2, crank.tau [N m]: 1343590 has no decimal sign",
        "mend it, or write nan",
        lambda _: table(plain),
    ),
    "an event between rows": (
        replaced(table(plain), (r"^0\.100,", "Logger restarted\n0.100,")),
        "line 7: has 1 cell",
        "or delete it",
        lambda text: replaced(text, ("Logger restarted\n", "")),
    ),
    "a quotation mark": (
        table(plain).replace("crank.tau", '"crank.tau', 1),
        "line 1: a quotation mark",
        "take it out",
        lambda text: text.replace('"', ""),
    ),
    "the clock set back": (
        table(lambda k: [f"{T[k] - (1.0 if k > 104 else 0.0):.3f}"]),
        "line 107: time = 1.1 s: must be later than 2.08 s",
        "delete the rows before this line, or those from it on",
        lambda text: "\n".join(text.splitlines()[:106]),
    ),
    "one time twice": (
        replaced(table(plain), (r"^0\.120,", "0.100,")),
        "line 8: time = 0.1 s: must be later than 0.1 s of the line before",
        "delete one of the two rows",
        lambda text: "\n".join(text.splitlines()[:7] + text.splitlines()[8:]),
    ),
    "one time for all": (
        table(lambda k: ["1687212032.000"]),
        "all rows have one time (a number of 32 bits",
        "write the time of each row",
        lambda _: table(plain),
    ),
    "hours and minutes": (
        table(lambda k: [f"{moment(k):%H:%M}"], ("time", *HEADS[1:])),
        "may be hh:mm or mm:ss",
        "write hh:mm:ss.fff",
        lambda _: table(lambda k: [f"{moment(k):%H:%M:%S.%f}"], ("time", *HEADS[1:])),
    ),
    "many cells without a number": (
        table(
            lambda k: [*plain(k), "1.0" if k % 2 else "", f"{TAU[k]}"], (HEADS[0], "motor.i [A]", *HEADS[1:])
        ),
        "60 of 120 rows have no number (empty)",
        "give the column another head",
        lambda text: replaced(text, (r"motor\.i", "other")),
    ),
    "two zones": (
        table(
            lambda k: [f"{moment(k):%Y-%m-%dT%H:%M:%S.%f}{'Z' if k < 60 else '+02:00'}"], ("time", *HEADS[1:])
        ),
        "has times of 2 zones",
        "write all in one",
        lambda text: replaced(text, (r"\+02:00", "Z")),
    ),
    "a head with a comma": (
        table(plain, (HEADS[0], "shaft, torque", *HEADS[2:])),
        "line 1: the head has 5 cells, and the rows 4",
        "put a head with commas in it into quotation marks",
        lambda text: replaced(text, ("shaft, torque", '"crank.tau, N m"')),
    ),
    "units that differ from cell to cell": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f} Nm" if k % 2 else f"{TAU[k] / 1000:.5f} kNm"]),
        "is no number alone, and the units differ (kNm, Nm)",
        "write all in one, which stands in the head",
        lambda _: table(plain),
    ),
    "commas in the last rows": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}".replace(".", "," if k > 100 else ".")]),
        "line 103: has 5 cells, and the head 4",
        "write decimal points",
        lambda _: table(plain),
    ),
    "rows of another mark than the head": (
        table(plain).replace(",", ";", 3),
        "has no head: its first row has values",
        "write the heads of the columns into a line",
        lambda _: table(plain),
    ),
    "two columns of times": (
        table(lambda k: [f"{moment(k)}.000"[:23], f"{moment(k)}.000"[:23]], ("start", "end", *HEADS[1:])),
        "has no column time [s]",
        'columns = { "time" = "start" }',
        {"time": "start"},
    ),
    "thousands beside a clock with a point": (
        table(lambda k: [f"{moment(k):%H:%M:%S.%f}", f"{TAU[k] / 1000 + 2:.3f}"], ("time", HEADS[1]), ";"),
        "may be",
        "without a mark of thousands",
        lambda _: table(lambda k: [f"{T[k]:.3f}"], mark=";"),
    ),
    "a long table with heads": (
        "name;time [s];crank.tau [N m]\n"
        + "".join(f"{n};{T[k]};{x}\n" for k in range(COUNT) for n, x in (("tau", TAU[k]), ("w", W[k]))),
        "column name: changes from tau to w at one time",
        "needs a column for each quantity",
        lambda _: table(plain),
    ),
    "a long table with one quantity below the other": (
        "name;time [s];crank.tau [N m]\n"
        + "".join(f"{n};{T[k]};{x[k]}\n" for n, x in (("tau", TAU), ("w", W)) for k in range(COUNT)),
        "column name: changes from tau to w at one time",
        "needs a column for each quantity",
        lambda _: table(plain),
    ),
    "frames of a clock": (
        table(lambda k: [f"12:00:{k // 25:02d}:{k % 25:02d}"], ("time", *HEADS[1:])),
        "12:00:00:00 may end with hundredths, with frames or with ms",
        "write hh:mm:ss.fff",
        lambda _: table(plain),
    ),
    "ms without zeros": (
        table(lambda k: [f"{moment(k):%H:%M:%S}.{moment(k).microsecond // 1000}"], ("time", *HEADS[1:])),
        "has parts of a second of 1 to 3 digits, and the times run backwards",
        "write ms with zeros before them, such as .024",
        lambda _: table(lambda k: [f"{moment(k):%H:%M:%S.%f}"], ("time", *HEADS[1:])),
    ),
    "a time that no reader knows": (
        table(lambda k: [f"{moment(k):%d/%m/%Y %Hh%Mm%S.%f}"], ("time", *HEADS[1:])),
        "is no number and no time that can be read",
        "write it as 2023-06-19 23:59:40.024",
        lambda text: replaced(text, (r"(\d\d)/06/2023 (\d\d)h(\d\d)m", r"2023-06-\1 \2:\3:")),
    ),
    "a semicolon within a clock": (
        table(
            lambda k: [
                "Data",
                f"{moment(k):%m/%d/%Y}",
                f"{moment(k):%H:%M:%S};{moment(k).microsecond // 1000:03d}",
            ],
            ("Header", "Date", "Time", *HEADS[1:]),
        ),
        "23:59:59;000 is no number and no time that can be read",
        "write it as 2023-06-19 23:59:40.024",
        lambda text: replaced(text, (r";(\d)", r".\1")),
    ),
    "prefixes behind numbers": (
        table(lambda k: [*plain(k), f"{TAU[k] / 1000:.5f}k"]),
        "k is no number alone",
        "write all numbers of this column in full, in the unit of the head, N m",
        lambda _: table(plain),
    ),
    "cells in percent": (
        table(lambda k: [*plain(k), f"{TAU[k] / 140:.5f} %"]),
        " % is no number alone",
        "in the unit of the head, N m",
        lambda _: table(plain),
    ),
    "numbers without the E of their exponents": (
        table(lambda k: [*plain(k), f"{TAU[k]:.6e}".replace("e", "")]),
        "is no number as in most rows",
        "write numbers",
        lambda _: table(plain),
    ),
    "a mark of other words": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}", f"{W[k]:.5f}", "-x"[MARK[k]]]),
        "x is no number",
        "write 0 and 1, off and on",
        lambda text: replaced(text, ("-$", "0"), ("x$", "1")),
    ),
    "rows in another order than their times": (
        table(lambda k: [f"{T[k] + 0.05 * (k % 4 == 2):.3f}"]),
        "the times run backwards at 30 rows",
        "sort the rows by time",
        lambda text: table(plain),
    ),
    "one name for two times": (
        table(lambda k: [f"{T[k]:.3f}", f"{1000 * T[k]:.0f}"], (HEADS[0], "Time [ms]", *HEADS[1:])),
        "columns 1 and 2 have the head time",
        'columns = { "time" = "time [s]" }',
        {"time": "time [s]"},
    ),
    "times of a database": (
        table(
            lambda k: ["0", f"{START}", f"{START}", f"{moment(k)}.000"[:23]],
            ("table", "_start", "_stop", "_time", *HEADS[1:]),
        ),
        'was "_time" meant?',
        'columns = { "time" = "_time" }',
        {"time": "_time"},
    ),
    "no time at all": (
        table(lambda k: [f"{TAU[k]:.2f}"], HEADS[1:]),
        "its heads are: crank.tau [N m], crank.w [rad/s], mark [1]",
        "; add it",
        lambda _: table(plain),
    ),
    "row names without a head": (
        table(lambda k: [str(k), *plain(k)], ("", *HEADS))[1:],
        "has 5 cells, and the head 4: a comma stands within a number or a text, or a head is missing",
        "or, if no number has a comma, write a head for each column",
        lambda text: f"row,{text}",
    ),
    "a coarse clock and missing rows": (
        table(lambda k: [f"{(k + 12 * (k > 60)) // 10 / 5:.1f}"]),
        "the time goes on 13 times in 120 rows, and not evenly",
        "write the time of each row",
        lambda _: table(plain),
    ),
    "rows swapped at midnight": (
        "\n".join([*lines[:50], lines[51], lines[50], *lines[52:]])
        if (lines := table(lambda k: [f"{moment(k):%H:%M:%S.%f}"], ("time", *HEADS[1:])).splitlines())
        else "",
        "s: must be later than 1 s of the line before",
        "delete the rows before this line, or those from it on",
        lambda _: table(plain),
    ),
    "rows swapped where a counter begins anew": (
        "\n".join([*lines[:35], lines[36], lines[35], *lines[37:]])
        if (
            lines := table(
                lambda k: [str((4294967296 - 700000 + 20000 * k) % 2**32)], ("time [us]", *HEADS[1:])
            ).splitlines()
        )
        else "",
        "must be later than",
        "delete the rows before this line, or those from it on",
        lambda _: table(plain),
    ),
    "one sign behind a number": (
        table(lambda k: [*plain(k), f"{TAU[k]:.2f}{'-' * (k == 20)}"]),
        "line 22, column 2, crank.tau [N m]: 13058.66- is no number",
        "delete this row, or write nan",
        lambda _: table(plain),
    ),
    "an unknown date": (
        table(lambda k: [f"{19 + k // 50}-Xyz-2023 00:00:{T[k]:06.3f}"], ("time", *HEADS[1:])),
        "is no date that can be read",
        "write it as 2023-06-19",
        lambda text: replaced(text, (r"^\d\d-Xyz-2023", "2023-06-19")),
    ),
}


@pytest.mark.parametrize("name", REMEDIES)
def test_a_remedy_that_is_printed_leads_to_the_goal(name, tmp_path):
    text, cause, remedy, followed = REMEDIES[name]
    with pytest.raises(InputError) as refusal:
        read_recording(written(tmp_path, text))
    (line,) = str(refusal.value).splitlines()
    assert cause in line and remedy in line
    names = followed if isinstance(followed, dict) else {}
    recording = read_recording(written(tmp_path, text if names else followed(text)), names)
    keep = {
        "one time twice": np.arange(COUNT) != 6,
        "the clock set back": np.arange(COUNT) < 105,
        "a word": np.arange(COUNT) != 5,
    }
    check(recording, keep.get(name, slice(None)))


def test_a_clock_that_stands_at_some_rows(tmp_path):
    """Rows at 1.1 kHz by a clock of 1 ms: a tenth of them has the time of the row before."""
    time = np.arange(1000) / 1100.0
    lines = ["time [ms],motor.i [A]", *(f"{np.floor(1000.0 * t):.0f},{np.sin(t):.4f}" for t in time)]
    recording = read_recording(written(tmp_path, "\n".join(lines)))
    np.testing.assert_allclose(recording.time - recording.time[0], time, atol=1e-4)
    assert "a coarse clock, up to 2 rows at one time: spread evenly" in recording.understood


@pytest.mark.parametrize("name", ["Swiss thousands", "French thousands", "US thousands in quotes"])
def test_marks_of_thousands_are_said(name, tmp_path):
    assert "marks of thousands" in read_recording(written(tmp_path, FORMATS[name][0])).understood
    assert "thousands" not in read_recording(written(tmp_path, FORMATS["bars"][0])).understood


def test_a_count_of_16_bits_that_begins_anew(tmp_path):
    count = 65000 + 97 * np.arange(COUNT)
    text = table(lambda k: [*plain(k), str(count[k] % 65536)], (HEADS[0], "motor.count [counts]", *HEADS[1:]))
    recording = read_recording(written(tmp_path, text))
    np.testing.assert_array_equal(recording.columns["motor.count"], count)
    assert "the count begins anew 1 time: joined" in recording.understood
    decimal = table(
        lambda k: [*plain(k), str(count[k] % 10000)], (HEADS[0], "motor.count [counts]", *HEADS[1:])
    )
    np.testing.assert_array_equal(
        read_recording(written(tmp_path, decimal)).columns["motor.count"] - 5000, count - 65000
    )
    # a counter that is set back by hand is left to the inspection
    back = read_recording(written(tmp_path, replaced(text, (f",{count[80] % 65536},", ",5,"))))
    assert np.min(np.diff(back.columns["motor.count"])) < 0.0


RATE, SUPPLY, TURN = 1000.0, 50.0, 2.1


def phase_currents(seconds=12.0):
    """The RMS of a motor's current over time, and the currents of its phases."""
    time = np.arange(round(RATE * seconds)) / RATE
    size = 2.0 + 0.3 * np.sin(2.0 * np.pi * time / TURN)
    angle = 2.0 * np.pi * SUPPLY * time
    return time, size, [np.sqrt(2.0) * size * np.cos(angle - k * 2.0 * np.pi / 3.0) for k in range(3)]


@pytest.mark.parametrize("phases", ["abc", "ac"])
def test_phase_currents_make_the_rms(tmp_path, phases):
    """With the third phase from the sum of two, as without a neutral."""
    time, size, currents = phase_currents()
    heads = ["time [s]", *(f"motor.i{name} [A]" for name in phases)]
    rows = zip(time, *(currents["abc".index(name)] for name in phases), strict=True)
    lines = [",".join(heads), *(",".join(f"{x:.9f}" for x in row) for row in rows)]
    recording = read_recording(written(tmp_path, "\n".join(lines)))
    np.testing.assert_allclose(recording.columns["motor.i"], size, rtol=1e-6)
    assert recording.columns.keys() == {"motor.i"}
    assert f"motor.i is the RMS of {', '.join(f'motor.i{name}' for name in phases)}" in recording.understood


def currents_of(folder, currents, step=1):
    """A recording of these columns over the time of `phase_currents`."""
    time = phase_currents()[0][::step]
    heads = ["time [s]", *(f"{name} [A]" for name in currents)]
    rows = zip(time, *(x[::step] for x in currents.values()), strict=True)
    lines = [",".join(heads), *(",".join(f"{x:.9f}" for x in row) for row in rows)]
    return read_recording(written(folder, "\n".join(lines)))


def test_rms_values_of_two_phases_are_no_instantaneous_currents(tmp_path):
    """They are positive, and their sum is not the third one."""
    _, size, _ = phase_currents()
    recording = currents_of(tmp_path, {"motor.ia": size, "motor.ib": 1.02 * size})
    np.testing.assert_allclose(recording.columns["motor.i"], np.sqrt(0.5 * (1 + 1.02**2)) * size, rtol=1e-6)
    both = currents_of(tmp_path, {"motor.i": size, "motor.ia": 2.0 * size})
    np.testing.assert_allclose(both.columns["motor.i"], size, rtol=1e-6)
    assert "motor.ia left out beside motor.i" in both.understood


@pytest.mark.parametrize(
    ("second", "likeness"), [(lambda i: -i[1], "0.5"), (lambda i: i[0], "1"), (lambda i: -i[0], "-1")]
)
def test_currents_that_are_not_those_of_two_phases_are_named(tmp_path, second, likeness):
    """A sensor turned round, and one phase twice; the remedy for the first one."""
    _, size, currents = phase_currents()
    with pytest.raises(
        InputError, match=rf"columns motor.ia \[A\] and motor.ib \[A\]: have .* of {likeness}, and"
    ):
        currents_of(tmp_path, {"motor.ia": currents[0], "motor.ib": second(currents)})
    mended = currents_of(tmp_path, {"motor.ia": currents[0], "motor.ib": currents[1]})
    np.testing.assert_allclose(mended.columns["motor.i"], size, rtol=1e-6)


def test_a_current_of_a_dc_motor_that_reverses_is_never_squared(tmp_path):
    """It swings about zero with the third order of a fast crank, as a current of 30 Hz does."""
    time, *_ = phase_currents()
    recording = currents_of(tmp_path, {"motor.i": 5.0 * np.sin(2.0 * np.pi * 30.0 * time) + 0.1})
    assert with_rms(recording, 0.1, DcMotor) is recording
    assert len(with_rms(recording, 0.1, InductionMotor).time) < 400
    phase = currents_of(tmp_path, {"motor.ia": np.cos(time)})
    with pytest.raises(
        InputError, match=r"motor.ia \[A\]: is the current of a phase, and the motor is a DcMotor; name"
    ):
        with_rms(phase, TURN, DcMotor)


def test_a_current_of_both_signs_is_no_rms(tmp_path):
    """At 41 rows a second a current of 50 Hz has no periods; an offset hides none that are resolved."""
    _, size, (current, *_) = phase_currents()
    slow = currents_of(tmp_path, {"motor.i": current}, step=24)
    with pytest.raises(
        InputError, match=r"motor.i \[A\]: goes from -.* the RMS of a phase is positive.*record >= 8 rows"
    ):
        with_rms(slow, TURN, InductionMotor)
    shifted = with_rms(currents_of(tmp_path, {"motor.i": current + 1.0}), TURN, InductionMotor)
    assert "motor.i is instantaneous, of 50 Hz" in shifted.understood
    assert np.mean(shifted.columns["motor.i"]) == pytest.approx(np.mean(size), rel=0.01)
    rms = currents_of(tmp_path, {"motor.i": size})
    assert with_rms(rms, TURN, InductionMotor) is rms


def test_an_instantaneous_current_makes_a_row_for_each_period(tmp_path):
    """A mark stays in the first row after its pass; a current of a DC motor is left as it is."""
    time, size, (current, *_) = phase_currents()
    noisy = current + 0.02 * np.random.default_rng(3).standard_normal(len(time))
    mark = np.append(0.0, np.diff(np.floor(time / TURN + 0.5)))
    lines = ["time [s],motor.i [A],mark"]
    lines += [f"{t:.4f},{i:.6f},{m:.0f}" for t, i, m in zip(time, noisy, mark, strict=True)]
    recording = with_rms(read_recording(written(tmp_path, "\n".join(lines))), TURN)
    assert len(recording.time) == pytest.approx(SUPPLY * time[-1], abs=1.0)
    np.testing.assert_allclose(recording.columns["motor.i"], np.interp(recording.time, time, size), rtol=0.02)
    marked, passes = recording.time[recording.columns["mark"] > 0.5], time[mark > 0.5]
    assert len(marked) == len(passes) and np.all((marked >= passes) & (marked < passes + 1.01 / SUPPLY))
    assert "motor.i is instantaneous, of 50 Hz: its RMS over each of 600 periods" in recording.understood
    slow = recording.part()
    assert with_rms(slow, TURN) is slow


def test_periods_that_are_not_resolved_are_refused(tmp_path):
    time, _, (current, *_) = phase_currents()
    lines = [
        "time [s],motor.i [A]",
        *(f"{t:.4f},{i:.6f}" for t, i in zip(time[::4], current[::4], strict=True)),
    ]
    recording = read_recording(written(tmp_path, "\n".join(lines)))
    with pytest.raises(
        InputError, match=r"is the instantaneous current of a phase, of 50 Hz, with 5 rows in a "
    ):
        with_rms(recording, TURN)


UNITS = {"crank.tau": {"N m": 1.0, "kN m": 1e3, "Nm": 1.0}, "motor.i": {"A": 1.0, "mA": 1e-3}}
STYLES = ("{0} [{1}]", "{0} ({1})", "{0}_{1}", "{0} / {1}", "{0} in {1}")


@pytest.mark.second
@settings(max_examples=150, deadline=None)
@given(
    series=st.lists(st.floats(-1e6, 1e6, allow_nan=False), min_size=12, max_size=12),
    digits=st.integers(1, 9).filter(lambda n: n != 3),
    mark=st.sampled_from([",", ";", "\t", "|"]),
    decimal=st.sampled_from(".,"),
    thousands=st.booleans(),
    unit=st.sampled_from([(name, unit) for name, units in UNITS.items() for unit in units]),
    style=st.sampled_from(STYLES),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]),
    before=st.integers(0, 3),
)
def test_what_is_written_is_read(
    series, digits, mark, decimal, thousands, unit, style, end, encoding, before, tmp_path_factory
):
    """For random numbers, marks, signs, units, heads, ends of lines and encodings."""
    name, of = unit

    def number(x):
        text = f"{x:,.{digits}f}" if thousands else f"{x:.{digits}f}"
        text = text.translate(str.maketrans({",": "." if decimal == "," else ",", ".": decimal}))
        return f'"{text}"' if mark in text else text

    lines = [f"Logger {k}" for k in range(before)] + [mark.join(["time [s]", style.format(name, of)])]
    lines += [mark.join([number(0.01 * k), number(x)]) for k, x in enumerate(series * 9)]
    file = tmp_path_factory.getbasetemp() / "property.csv"
    file.write_bytes((end.join(lines) + end).encode(encoding))
    if digits == 1:
        return  # the times do not rise
    recording = read_recording(file)
    exact = [float(f"{x:.{digits}f}") * UNITS[name][of] for x in series * 9]
    np.testing.assert_allclose(recording.columns[name], exact, rtol=1e-15)


MARKS = ",;\t|. "


@pytest.mark.second
@settings(max_examples=200, deadline=None)
@given(
    name=st.sampled_from(sorted(FORMATS)),
    row=st.integers(3, COUNT - 3),
    share=st.floats(0.0, 0.999),
    change=st.sampled_from(["left out", "added", "another one", "cut", "quote"]),
    mark=st.sampled_from(MARKS),
)
@example(name=".NET TimeSpan", row=70, share=0.984375, change="added", mark=".")
@example(name="AM and PM in a column", row=66, share=0.62, change="added", mark=":")
@example(name="bars", row=60, share=0.57, change="added", mark="-")
def test_one_wrong_mark_is_never_misread_in_silence(name, row, share, change, mark, tmp_path_factory):
    """Of each file, all rows that are read are right, or it is refused."""
    text, names = FORMATS[name]
    lines = text.splitlines()
    k = len(lines) - COUNT + row - 3
    line = lines[k]
    marks = [i for i, sign in enumerate(line) if sign in MARKS]
    i = (
        int(share * len(line))
        if change in ("added", "cut", "quote") or not marks
        else marks[int(share * len(marks))]
    )
    lines[k] = {
        "left out": line[:i] + line[i + 1 :],
        "added": line[:i] + mark + line[i:],
        "another one": line[:i] + mark + line[i + 1 :],
        "cut": line[:i],
        "quote": line[:i] + '"' + line[i:],
    }[change]
    file = tmp_path_factory.getbasetemp() / "marks.csv"
    file.write_bytes("\n".join(lines).encode())
    try:
        recording = read_recording(file, names)
    except InputError:
        return
    true = set(zip(TAU.tolist(), W.tolist(), MARK.tolist(), strict=True))
    columns = (recording.columns[name].round(6).tolist() for name in ("crank.tau", "crank.w", "mark"))
    assert set(zip(*columns, strict=True)) <= true
    np.testing.assert_allclose(np.ptp(recording.time), T[-1], atol=0.1)


def test_a_rare_fraction_among_whole_numbers_is_refused_and_its_remedy_works(tmp_path):
    """As for a number without its decimal sign; a fraction with more digits is a measurement."""

    def rows(cell):
        cells = [str(10 + k % 80) for k in range(200)]
        cells[120] = cell
        return "time [s],crank.tau [N.m]\n" + "".join(
            f"{k / 100:.2f},{cell}\n" for k, cell in enumerate(cells)
        )

    file = tmp_path / "whole.csv"
    file.write_text(rows("1.7"))
    with pytest.raises(
        InputError, match=r"line 122, column 2, crank.tau .*: 1.7 .*a sign is added; .* write 1.70 if"
    ):
        read_recording(file)
    file.write_text(rows("1.70"))
    assert read_recording(file).columns["crank.tau"][120] == 1.7
