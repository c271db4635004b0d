"""`Study`: a study from Python, as ``chainunit study`` runs one from its file."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..core.declared_numbers import as_text
from ..core.errors import InputError, RemarkWarning, check_kind, near_name, shown
from ..core.files import named_file, scratch, write_file
from ..core.named import Named
from ..core.quantities import Layout
from ..fmu.backends import Backend
from ..fmu.backends import export as write_fmu
from ..fmu.script import Names
from ..machines.machine import Machine
from ..reading.tables import TOO_DEEP, in_file, nested_deeply
from ..reading.text import number, shown_in
from ..reading.toml_lines import lines_of
from ..report import html, series
from ..report import study as contents
from ..report.blocks import Report
from ..report.drawing import drawing
from ..report.live.page import live_page_of_config
from ..report.notebook import shown_progress
from ..report.reported_result import ReportedResult
from ..report.study_task import TASK
from ..study import config as study_files
from ..study.config import Config
from ..study.foreign_machine import ForeignMachine
from ..study.linear import At, linearize
from ..study.measures import Answers, measures_of
from ..study.package import drive_to_export, export_study, remarks_on_export, whole_system
from ..study.parts import over_example, parts_of
from ..study.record import StudyRecord
from ..study.result import as_dict
from ..study.window import Phase
from ..system.linear import LinearModel
from ..work.progress import TaskProgress
from .study_methods import StudyMethods

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_TABLES, _TEXT = "tables in Python", "text in Python"


class Study(StudyMethods):
    """A machine with its motor, and the runs that are to be made.

    Parameters
    ----------
    **tables : the keys and tables of a study file (``chainunit keys`` shows them), by the same names and with the
        same checks: tables are mappings, events a list of them. A number is in the declared SI unit; a text or a
        quantity of pint has its unit. A key that is left out has the value of the example. Paths of files are
        relative to the working folder.

    Raises
    ------
    InputError
        with a line for each value that is not allowed, each with its key.

    Warns
    -----
    UserWarning
        for a value that looks like a slip of its unit.

    Examples
    --------
    >>> jam = {"type": "jam", "side": "left", "force": "2 kN"}
    >>> study = Study(machine={"r": "160 mm"}, run={"crank_speed": "30 rev/min"}, event=[jam])
    >>> study.machine.p.r, list(study.config.events)
    (0.16, ['jam_left'])
    """

    config: Config
    """The configuration of the study, checked."""

    def __init__(self, **tables: Any) -> None:
        if nested_deeply(tables):
            raise InputError(TOO_DEEP)
        self._take(study_files.of_tables(_plain(tables), _TABLES), _TABLES)

    @classmethod
    def from_file(cls, path: str | Path | None = None) -> Self:
        """The study of a TOML file; without one, the packaged example.

        Raises
        ------
        InputError
            with a line of text for each fault, which begins with the file and its line number.
        """
        check_kind("path", path, str | Path | None, "the path of a study file")
        config = study_files.load(None if path is None else Path(path))
        return cls.__new__(cls)._take(config, config.file.source)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """The study of a TOML text; paths in it are relative to the working folder.

        Raises
        ------
        InputError
            as `from_file`.
        """
        check_kind("text", text, str, "a text in TOML")
        with in_file(_TEXT, lambda: lines_of(text)):
            config = study_files.parse(text, _TEXT)
        return cls.__new__(cls)._take(config, _TEXT)

    def of_tables(self, tables: dict[str, Any], source: str) -> Self:
        """A study of the same kind with other `tables` of a study file; paths in them are relative to `source`.

        Raises
        ------
        InputError
            as the class.
        """
        return type(self).__new__(type(self))._take(study_files.of_tables(tables, source), source)

    def _take(self, config: Config, source: str, changes: Mapping[str, Any] | None = None) -> Self:
        """Become the study `config`, which has `changes` against its `source`; paths in it are relative to
        the source. Methods call it in place of `__init__`, which would read tables."""
        self._source, self._changes = source, dict(changes or {})
        if self._changes:
            config = config.with_file(source=f"{source} with {self._changed}")
        self.config = config
        for value in config.file.slips:
            warnings.warn(value.sentence, RemarkWarning, stacklevel=3)
        return self

    def with_values(self, values: Mapping[str, Any]) -> Self:
        """The same study with other values, by their full names.

        Parameters
        ----------
        values : such as ``{"machine.r": "170 mm", "event.jam_left.force": "3 kN", "start": "direct"}``; an
            event is called by the name of its run. The name of a table stands for the whole table:
            ``{"event": []}``.

        Raises
        ------
        InputError
            as the class.
        """
        check_kind("values", values, Mapping, 'a mapping such as {"machine.r": "170 mm"}')
        tables = copy.deepcopy(dict(self.config.file.tables))
        for name, value in values.items():
            if not isinstance(name, str):
                raise InputError(f'{shown(name)}: must be the name of a key, such as "machine.r"')
            path = name.split(".")
            if path[0] == "event" and len(path) > 1:
                path[1] = self._place(name, path[1], tables)
            _put(tables, path, _plain(value))
        config = study_files.of_tables(tables, self._source)
        changes = {name: _plain(value) for name, value in values.items()}
        return type(self).__new__(type(self))._take(config, self._source, self._changes | changes)

    @property
    def _changed(self) -> str:
        return ", ".join(f"{name} = {shown(value)}" for name, value in self._changes.items())

    def _place(self, name: str, run: str, tables: dict[str, Any]) -> str:
        """The index of the event with the name `run` in the list of events. Events of the example are written
        into the `tables` first."""
        runs = list(self.config.events)
        if run not in runs:
            hint = near_name(run, runs) or f"; there are {', '.join(runs) or 'none'}"
            raise InputError(f"{name}: no such event{hint}", key=name)
        if "event" not in tables:
            tables["event"] = over_example(tables, parts_of(tables, self._source))["event"]
        return str(runs.index(run))

    @property
    def machine(self) -> Machine:
        """The machine, with its parameters."""
        return self.config.machine

    def run(
        self,
        folder: str | Path | None = None,
        check: bool = False,
        backend: Backend | None = None,
        progress: TaskProgress | None = None,
        scheduler: str | None = None,
    ) -> StudyResult:
        """Run the study: start-up, steady running, every event. The packaged example takes half a minute.

        Parameters
        ----------
        folder : the folder to which the files of ``chainunit study -o`` are written; without it only
            `StudyResult.save` leaves files on the disk
        check : whether every run is also compared with the monolithic solution
        backend : backend of the FMUs, "native" or "python"; by default native where there is a C compiler
        progress : a function that is called with the task, the amount of work that is complete, and the total
            amount; without one a notebook shows a bar
        scheduler : address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``, whose workers make the random
            overloads in place of local processes

        Raises
        ------
        InputError
            for a fault that only a run shows, such as a foreign motor that does not fit.
        RunError
            for a run that stopped early; its `partial` is the `StudyResult` up to there.
        WriteError
            for a file that cannot be written; the others are written.
        """
        options = {"check": check, "backend": backend, "scheduler": scheduler}
        return StudyResult.made(self.config, folder, progress, **options)

    def linearize(self, at: At = None) -> LinearModel:
        """The linear model of the whole drive at a point, by default in steady running; see `chainunit.linearize`."""
        return linearize(self, at)

    def export(
        self,
        file: str | Path,
        *,
        backend: Backend | None = None,
        fmi: int = 2,
        platforms: Sequence[str] = (),
        names: Names = "structured",
        progress: TaskProgress | None = None,
    ) -> Path:
        """Write the whole system as one FMU, as ``chainunit export`` does; returns the file.

        Parameters
        ----------
        file : a name that ends in .fmu
        backend, fmi, platforms, names : see `chainunit.fmu.backends.export`
        progress : as of `run`

        Raises
        ------
        InputError
            for a wrong name or option, and where motor or machine is a foreign FMU.
        RunError
            where no motor is found, and where the FMU cannot be made.

        Warns
        -----
        UserWarning
            on the parts of the study that the FMU does not have, and on the limits of its model.
        """
        path = named_file(file, ".fmu")
        with shown_progress(progress) as shown, self.config.file.refusals():
            say = _as_words(shown)
            drive = drive_to_export(self.config, backend, say)
            model, start = whole_system(
                drive, self.config.operation, self.config.title, self.config.file.labels
            )
            write_fmu(
                model, path, start, backend=backend, fmi=fmi, platforms=platforms, names=names, progress=say
            )
        self._warn_of_export()
        return path

    def export_ssp(
        self,
        file: str | Path,
        *,
        all_inputs: bool = False,
        names: Names = "structured",
        backend: Backend | None = None,
        progress: TaskProgress | None = None,
    ) -> Path:
        """Write motor and machine, connected, as an SSP 1.0 package of FMUs 2.0; returns the file.

        Parameters
        ----------
        file : a name that ends in .ssp
        all_inputs, names, backend : see `chainunit.system.ssp.export`
        progress : as of `run`

        Raises
        ------
        InputError, RunError
            as of `export`.

        Warns
        -----
        UserWarning
            as of `export`.
        """
        path = named_file(file, ".ssp")
        with shown_progress(progress) as shown, self.config.file.refusals():
            export_study(
                self.config,
                path,
                all_inputs=all_inputs,
                names=names,
                backend=backend,
                progress=_as_words(shown),
            )
        self._warn_of_export()
        return path

    def _warn_of_export(self) -> None:
        for sentence in remarks_on_export(self.config):
            warnings.warn(sentence, RemarkWarning, stacklevel=3)

    def live(self, file: str | Path = "live.html") -> Path:
        """Write a page in which the machine runs, as ``chainunit live`` does, without a run here; returns the file.

        Raises
        ------
        InputError
            for a name that does not end in .html, and for an equation that cannot run in a page.
        WriteError
            for a file that cannot be written.
        """
        path = named_file(file, ".html")
        with scratch() as folder:
            page = html.render(live_page_of_config(self.config, self._source, folder))
        write_file(path, page)
        return path

    def __repr__(self) -> str:
        config = self.config
        with shown_in(config.units):
            speed = number(config.run.crank_speed, "rad/s", "speed")
        motor = "a motor that sizing chooses" if config.motor is None else config.file.choices["system.motor"]
        changes = f" with {self._changed}" if self._changes else ""
        machine = config.file.choices["system.machine"]
        return (
            f"<Study {config.title or self._source!r}{changes}: {machine} with {motor}, "
            f"crank at {speed}; events: {', '.join(config.events) or 'none'}>"
        )

    def _repr_html_(self) -> str:
        """The text of `repr` with a drawing of the machine, for notebooks."""
        text = f"<p>{escape(repr(self)[1:-1])}</p>"
        if isinstance(self.machine, ForeignMachine):
            return text
        # the lines of the drawing are dark, and the page of a notebook may be dark, too
        return f'{text}<div style="background: white; max-width: 60em">{drawing(self.machine)}</div>'


class StudyResult(ReportedResult[Config, StudyRecord]):
    """The result of a study. Its `repr` shows the title, the verdicts and the main answers of every run."""

    _task = TASK

    @property
    def record(self) -> StudyRecord:
        """All computed values, as the report reads them."""
        return self._outcome

    @cached_property
    def _numbers(self) -> dict[str, Any]:
        return as_dict(self.record)

    @property
    def _report(self) -> Report:
        # the numbers are computed once; the report with its figures is large, and not kept
        return contents.report(self.record, self._numbers)

    @cached_property
    def _shown(self) -> Report:
        return contents.summary(self.record, self._numbers)

    @cached_property
    def answers(self) -> pd.DataFrame:
        """A table with a row for each answer, by its name in result.json, and a column of numbers for each run. The
        column "unit" gives the SI unit. A number is NaN where the answer has no meaning in the run."""
        import pandas as pd

        record = self.record
        runs: dict[str, tuple[Any, set[str]]] = {
            name: (answers, set(Layout(Answers).names)) for name, answers in record.runs.answers.items()
        }
        for name, phase, begin in (
            ("settling", Phase.SETTLING, record.runs.settling),
            ("start_up", Phase.START_UP, record.runs.start),
        ):
            if begin is not None:
                runs = {name: (begin, {v.name for v in measures_of(phase)}), **runs}
        variables = Layout(Answers).variables
        table = pd.DataFrame({"unit": [v.unit for v in variables]}, [v.name for v in variables])
        for name, (answers, names) in runs.items():
            values = (getattr(answers, v.name) if v.name in names else None for v in variables)
            table[name] = [np.nan if x is None else float(x) for x in values]
        return table.dropna(how="all", subset=list(runs))

    @cached_property
    def runs(self) -> Mapping[str, xr.Dataset]:
        """The time series of every run by its name, Datasets over ``time``: ``runs["jam_left"]["machine.tau"]``, with
        units in ``attrs``; ``runs["steady"]`` has the turns in steady running. The file result.nc holds the runs."""
        runs = {name: node.to_dataset() for name, node in series.tree(self.record).children.items()}
        ran = self.record.runs
        return Named(runs | ({"steady": ran.steady} if "steady" in ran.answers else {}))

    @property
    def verdict(self) -> str:
        """The verdicts, a line each: on the model, on the motor, and, where no motor fits, on
        the choice of the drive."""
        verdicts = self._numbers["verdict"].values()
        lines = [verdict["text"] for verdict in verdicts if verdict is not None]
        return "\n".join([*lines, self.record.setup.insufficient]).rstrip()


def _as_words(progress: TaskProgress) -> Callable[[str], None]:
    """The function by which an export reports its work, which has no amount."""
    return lambda what: progress(what, 0.0, 1.0)


def _plain(value: Any) -> Any:
    """A value from Python in the form that a TOML file would give."""
    if isinstance(value, Mapping):
        return {str(name): _plain(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.longdouble):  # which Python lacks
        return float(value)
    if isinstance(value, np.ndarray | np.generic):
        plain = value.tolist()
        return value if type(plain) is type(value) else _plain(plain)
    value = as_text(value)
    return str(value) if isinstance(value, Path) else value


def _put(tree: Any, path: list[str], value: Any) -> None:
    """Set the value at a path in nested tables; a value on the path that is no table is replaced by a table."""
    name, *inner = path
    if isinstance(tree, list) and not (name.isdecimal() and int(name) < len(tree)):
        raise InputError(f"{name}: must be the place of an entry, from 0 to {len(tree) - 1}")
    key: Any = int(name) if isinstance(tree, list) else name
    if not inner:
        tree[key] = value
        return
    if not isinstance(tree, list) and not isinstance(tree.get(key), dict | list):
        tree[key] = {}
    _put(tree[key], inner, value)
