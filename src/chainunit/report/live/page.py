"""The page of a live machine alone: of a study file or a linkage file, without a run of it."""

from __future__ import annotations

from pathlib import Path

from ... import __version__
from ...core.errors import InputError
from ...machines.machine import Machine
from ...models import linkage_named
from ...study.choice import choose
from ...study.config import Config
from ...study.config import load as load_study
from ...study.linkage_turn import speed_of_driver
from .. import blocks as b
from ..lines import line
from .machine import of_linkage
from .runs import whole_of
from .study import of_study, without_drive


def live_of_config(config: Config, folder: Path) -> b.LiveMachine:
    """The live machine of a study before any run; a drive that a capability has to choose is not known."""
    if config.motor is None:
        return without_drive(config)
    choice = choose(config, folder)
    return of_study(config, choice.drive, choice.tables, choice.proposal)


def live_page_of_config(config: Config, source: str, folder: Path) -> b.Report:
    """The report with the live machine of a study from the `source`; errors as of `live_page`."""
    live = live_of_config(config, folder)
    return _report(config.title or "Study", "Live study", whole_of(live.data.get("organs", "")), live, source)


def live_page(file: Path | None, speed: str | None, folder: Path) -> b.Report:
    """The report with the live machine of a study file or a linkage file, or of the packaged study without a file;
    `speed` is that of the driver of a linkage.

    Raises
    ------
    InputError
        for a file that is refused, an equation that cannot run in a page, and a speed for a study.
    """
    linkage = None if file is None else linkage_named(str(file))
    if file is None or linkage is None:
        config = load_study(file)
        if speed is not None:
            raise InputError(
                "--speed is for a linkage; leave it out: the speed of a study is run.crank_speed in its file"
            )
        return live_page_of_config(config, str(file or "packaged example"), folder)
    machine = Machine(linkage)
    live = of_linkage(machine, speed_of_driver(machine, speed), file.name)
    return _report(machine.model.description, "Live linkage", "the file", live, str(file))


def _report(title: str, kind: str, changed: str, live: b.LiveMachine, source: str) -> b.Report:
    """The report whose only section is a live machine; `changed` is the noun of the thing whose values its reader
    changes, `source` the file that it is from."""
    return b.Report(
        title,
        kind,
        result={"chainunit": __version__, "source": source},
        opening=(),
        sections=(b.Section("live", "Try it", (b.Live(lambda: live, changed),)),),
        source=line(f"{source} · chainunit {__version__}"),
        status="no run was made",
    )
