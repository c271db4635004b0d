"""Runs a job: makes the batches that its store does not have, in this process, in local processes, or on a cluster.

A kill loses the batches in work; the next run makes these and the others that are missing. A finished batch is
written before the next one is handed out: the memory does not grow with the number of points.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import multiprocessing
import os
import pickle
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from .. import __version__
from ..core.errors import InputError, InterruptedRunError, RunError, check_kind, printable
from ..core.files import folder as make_folder
from ..core.files import scratch
from .job import BatchStore, Job
from .progress import TaskProgress

_Hands = tuple[Callable[[int, int], Future], Callable[[], int]]
"""Those who make batches: the function that gives them the points from one number to another, and the number of
batches that they may have."""
PATIENCE = 3.0
"""Time in which a scheduler and its workers must answer [s]."""


def run(
    job: Job, folder: Path, progress: TaskProgress, workers: int | None = None, scheduler: str | None = None
) -> BatchStore:
    """Make the missing batches of the job, and write each into the store in `folder` when it is finished.

    Parameters
    ----------
    folder : this process alone writes there, see `chainunit.core.files.claim`
    progress : a function that is called with the title of the job and the numbers of complete and of all points
    workers : number of local processes; by default one for each processor. One worker, or a single batch, runs in
        this process itself
    scheduler : address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``, whose workers make the batches in
        place of local processes. They need this package in the same version, and no files in common with this
        process

    Raises
    ------
    InputError
        if the scheduler or its workers do not answer.
    RunError
        if `work` fails, or a worker ends; the message names the batch. Earlier batches are in the store.
    InterruptedRunError
        after Ctrl-C; likewise.
    WriteError
        if the store cannot be written; likewise.
    """
    store = BatchStore(job, make_folder(folder))
    progress(job.title, 0, job.points)
    gaps = store.missing(lambda complete: progress(job.title, complete, job.points))
    complete = store.earlier_points
    workers = min(workers or os.cpu_count() or 1, len(gaps))
    team: contextlib.AbstractContextManager[_Hands]
    if not gaps or (scheduler is None and workers == 1):
        team = contextlib.nullcontext((partial(_made_here, job), lambda: 1))
    else:
        team = _processes(job, workers) if scheduler is None else _cluster(job, scheduler)
    try:
        with team as hands:
            for batch, future in _finished(store, gaps, hands):
                try:
                    results = future.result()
                except InterruptedRunError:
                    raise
                except Exception as error:
                    begin, end = store.extent(batch)
                    message = str(error)
                    if not isinstance(error, RunError):
                        cause = printable(message or type(error).__name__, 300)
                        message = f"was lost, as a worker ended ({cause})"
                    raise RunError(
                        f"{job.title}: batch {batch} ({job.dimension} {begin} to {end - 1}) {message}; {complete} of "
                        f"{job.points} are in {store.file}: run it again to go on"
                    ) from error
                store.write(batch, results)
                complete += store.size(batch)
                progress(job.title, complete, job.points)
    except (KeyboardInterrupt, InterruptedRunError) as error:
        message = f"interrupted after {complete} of {job.points} {job.title}"
        raise InterruptedRunError(message) from error
    return store


def _finished(store: BatchStore, gaps: list[int], hands: _Hands) -> Iterator[tuple[int, Future]]:
    """The batches in the order in which they are finished."""
    (submit, room), waiting, batch_of = hands, iter(gaps), dict[Future, int]()
    while True:
        while len(batch_of) < room() and (batch := next(waiting, None)) is not None:
            batch_of[submit(*store.extent(batch))] = batch
        if not batch_of:
            return
        done = wait(batch_of, return_when=FIRST_COMPLETED).done
        for future in sorted(done, key=batch_of.__getitem__):
            yield batch_of.pop(future), future


def _results(work: Any, task: Any, begin: int, end: int) -> Any:
    """The results of a batch; an error of `work` becomes a RunError, which passes between processes."""
    try:
        return work(task, begin, end)
    except InterruptedRunError:
        raise
    except Exception as error:
        # an error of a library need not survive the way between processes
        message = str(error) if isinstance(error, RunError | InputError) else repr(error)
        raise RunError(f"failed: {printable(message, 500)}") from error


def _made_here(job: Job, begin: int, end: int) -> Future:
    """A batch that was made at once, in this process."""
    future: Future = Future()
    try:
        future.set_result(_results(job.work, job.task, begin, end))
    except RunError as error:
        future.set_exception(error)
    return future


_at_work = threading.Lock()
"""Held by the thread that makes a batch: a worker with several threads makes one batch at a time."""
_unpacked = lru_cache(maxsize=1)(pickle.loads)
"""Work and task of the job of this worker."""


def _made(version: str, parcel: bytes, begin: int, end: int) -> Any:
    """Make a batch in a worker."""
    if version != __version__:
        raise RunError(f"failed: the worker has chainunit {__version__}, and must have {version}")
    with _at_work:
        work, task = _unpacked(parcel)
        return _results(work, task, begin, end)


@contextmanager
def _processes(job: Job, workers: int) -> Iterator[_Hands]:
    """Local processes. Each ends with the pipe, which closes at the end of the work, after Ctrl-C, and at a kill of
    this process; their temporary folders lie in one that goes then, too."""
    context = multiprocessing.get_context("spawn")
    end, wire = context.Pipe(duplex=False)
    parcel = pickle.dumps((job.work, job.task))
    with scratch() as place, end:
        pool = ProcessPoolExecutor(workers, context, _begin, (end, str(place)))
        try:
            try:
                for begun in [pool.submit(os.getpid) for _ in range(workers)]:
                    begun.result()
            except (RuntimeError, OSError) as error:
                raise RunError(
                    f"the local processes cannot be started ({printable(str(error))}); a script must have its calls "
                    'below if __name__ == "__main__":'
                ) from error
            # one batch waits for the first worker that is free
            yield lambda *extent: pool.submit(_made, __version__, parcel, *extent), lambda: workers + 1
        finally:
            wire.close()
            pool.shutdown()


def _begin(end: Any, place: str) -> None:
    """Begin a worker process. It leaves signals to the process that started it."""

    def close() -> None:
        with contextlib.suppress(EOFError, OSError):
            end.recv()
        shutil.rmtree(place, ignore_errors=True)
        os._exit(1)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=close, daemon=True).start()
    tempfile.tempdir = place


@contextmanager
def _cluster(job: Job, scheduler: str) -> Iterator[_Hands]:
    """The workers of a scheduler, by the extra of this name."""
    check_scheduler(scheduler)
    with _silent():
        from distributed import Client

        with Client(scheduler, timeout=PATIENCE, set_as_default=False) as client:
            sent = client.scatter(pickle.dumps((job.work, job.task)), broadcast=True, hash=False)
            submit = partial(client.get_executor(pure=False).submit, _made, __version__, sent)
            yield submit, lambda: max(1, len(client.nthreads()))


@contextmanager
def _silent() -> Iterator[None]:
    """No lines of Dask on the terminal: every failure becomes an error of this package."""
    try:
        import distributed  # noqa: F401 - it sets the levels when it is imported
    except ImportError as error:
        raise InputError("a scheduler needs Dask: pip install 'chainunit[cluster]'") from error
    loggers = [
        logging.getLogger(name) for name in ("distributed", "distributed.client", "tornado.application")
    ]
    levels = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def check_scheduler(scheduler: str) -> None:
    """Find out whether a scheduler and its workers answer, before long work that comes first. A client that cannot
    connect would go on trying in the background.

    Raises
    ------
    InputError
        if they do not answer within a few seconds.
    """
    check_kind("scheduler", scheduler, str, "the address of a Dask scheduler")

    async def ask() -> Any:
        import distributed

        async with distributed.rpc(scheduler) as remote:
            return await remote.identity()

    async def ask_in_time() -> Any:
        return await asyncio.wait_for(ask(), PATIENCE)

    address, answer = printable(scheduler), {}
    with _silent(), contextlib.suppress(Exception), ThreadPoolExecutor(1) as thread:
        # in a thread, as the caller may have a loop that runs, such as that of a notebook
        answer = thread.submit(lambda: asyncio.run(ask_in_time())).result()
    if answer.get("type") != "Scheduler":
        raise InputError(
            f"scheduler {address}: does not answer as a Dask scheduler within {PATIENCE:g} s; start one by "
            '"dask scheduler", and give the address that it prints, such as tcp://10.0.0.5:8786'
        )
    if not answer.get("workers"):
        raise InputError(f'scheduler {address}: has no workers; start them by "dask worker {address}"')
