"""Runs a job: makes the batches that its store does not have, in this process, in local processes, or on a cluster.

A kill loses the batches in work, at most one for each worker; the next run makes these and the others that are
missing. Each worker has one batch at a time, and a finished batch is written before the next one is taken from the
workers: the memory does not grow with the number of points.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import logging
import multiprocessing
import multiprocessing.connection
import os
import pickle
import threading
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from .. import __version__
from ..core import temporary_folders
from ..core.errors import InputError, InterruptedRunError, RunError, printable
from ..core.files import folder as make_folder
from .job import Job
from .progress import TaskProgress
from .store import BatchStore

if TYPE_CHECKING:
    import xarray as xr

Made: TypeAlias = Generator[tuple[int, Any], None, None]
"""Batches with their results, in the order in which they are finished."""
PATIENCE = 3.0
"""Time in which a scheduler and its workers must answer [s]."""


@dataclass(frozen=True)
class Outcome:
    """The results of a job, complete."""

    store: BatchStore = field(repr=False)
    earlier_points: int
    """number of points that the store had before"""
    damaged_batches: int
    """number of batches that the store had in part or with other bytes than were written; they were made anew"""

    @property
    def file(self) -> Path:
        """The store, a file."""
        return self.store.path

    @property
    def dataset(self) -> xr.Dataset:
        """The results of all points, opened lazily; see `BatchStore.open`."""
        return self.store.open()


def run(
    job: Job, folder: Path, progress: TaskProgress, workers: int | None = None, scheduler: str | None = None
) -> Outcome:
    """Make the missing batches of the job, and write each into the store in `folder` when it is finished.

    Parameters
    ----------
    job : the work; of its store see `BatchStore`
    folder : where the store is, or is made, by its `Job.store_name`; this process alone writes there, see
        `chainunit.core.files.claim`
    progress : a function that is called with the title of the job and the numbers of complete and of all points
    workers : number of local processes; by default one for each processor. One worker, or a single batch, runs in
        this process itself
    scheduler : address of a Dask scheduler, such as ``tcp://10.0.0.5:8786``, whose workers make the batches in
        place of local processes. They need this package in the same version, and no files in common with this
        process

    Raises
    ------
    InputError
        where the scheduler or its workers do not answer.
    RunError
        where `work` fails, or a worker ends; the message names the batch. Earlier batches are in the store.
    InterruptedRunError
        after Ctrl-C; likewise.
    WriteError
        where the store cannot be written; likewise.
    """
    store = BatchStore(job, make_folder(folder) / job.store_name)
    progress(job.title, 0, job.points)
    gaps, damaged = store.missing(lambda complete: progress(job.title, complete, job.points))
    complete = earlier = job.points - sum(_size(store, batch) for batch in gaps)
    workers = min(workers or os.cpu_count() or 1, len(gaps))
    try:
        with contextlib.closing(_batches(store, gaps, workers, scheduler)) as batches:
            for batch, results in batches:
                store.write(batch, results)
                complete += _size(store, batch)
                progress(job.title, complete, job.points)
    except (KeyboardInterrupt, InterruptedRunError) as error:
        words = f"interrupted after {complete} of {job.points} {job.title}"
        raise InterruptedRunError(words) from error
    except _BatchError as error:
        begin, end = store.extent(error.batch)
        raise RunError(
            f"{job.title}: batch {error.batch} ({job.dimension} {begin} to {end - 1}) {error}; {complete} of "
            f"{job.points} are in {store.path}: run it again to go on"
        ) from error.__cause__
    return Outcome(store, earlier, damaged)


def _size(store: BatchStore, batch: int) -> int:
    """The number of points of a batch that the job asks for."""
    begin, end = store.extent(batch)
    return min(end, store.job.points) - begin


class _BatchError(Exception):
    """A batch failed; the message is the end of a sentence."""

    def __init__(self, batch: int, words: str) -> None:
        super().__init__(words)
        self.batch = batch


def _batches(store: BatchStore, gaps: list[int], workers: int, scheduler: str | None) -> Made:
    if not gaps or (scheduler is None and workers == 1):
        return _in_this_process(store, gaps)
    if scheduler is None:
        return _on_processes(store, gaps, workers)
    return _on_cluster(store, gaps, scheduler)


def _in_this_process(store: BatchStore, gaps: list[int]) -> Made:
    """Make batches in this process."""
    job = store.job
    try:
        for batch in gaps:
            try:
                results = job.work(job.task, *store.extent(batch))
            except InterruptedRunError:
                raise
            except Exception as error:
                raise _BatchError(batch, _failure(error)) from error
            yield batch, results
    finally:
        if job.close is not None:
            job.close()


def _failure(error: BaseException) -> str:
    words = str(error) if isinstance(error, RunError | InputError) else repr(error)
    return f"failed: {printable(words, 500)}"


# -- on workers


class _Worker:
    """A local process that makes one batch at a time. Its pipe closes when it ends, and its own end of the pipe when
    this process does: so the batch in work is known, and no worker is left over. An executor of the standard library
    has neither."""

    def __init__(self, parcel: bytes) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, end = context.Pipe()
        self._process = context.Process(target=_serve, args=(end, parcel), daemon=True)
        self._process.start()
        end.close()

    def end(self) -> None:
        """End the process at once, without the batch that it makes."""
        self.pipe.close()
        self._process.terminate()
        self._process.join()


def _serve(pipe: Any, parcel: bytes) -> None:
    """Make the batches that come through the pipe, until it closes."""
    temporary_folders.end_at_signals()
    work, task, close = pickle.loads(parcel)
    try:
        pipe.send(None)
        while True:
            begin, end = pipe.recv()
            results, failure = None, None
            try:
                results = work(task, begin, end)
            except Exception as error:
                failure = error if isinstance(error, InterruptedRunError) else _failure(error)
            pipe.send((results, failure))
    except (EOFError, OSError):
        if close is not None:
            close()


def _on_processes(store: BatchStore, gaps: list[int], workers: int) -> Made:
    """Make batches in local processes. A process gets its next batch when the last one is finished; the finished one
    is then yielded."""
    job = store.job
    parcel = pickle.dumps((job.work, job.task, job.close))
    processes: list[_Worker] = []
    try:
        try:
            processes.extend(_Worker(parcel) for _ in range(workers))
            for process in processes:
                process.pipe.recv()
        except (EOFError, RuntimeError, OSError) as error:
            raise RunError(
                f"the local processes cannot be started ({_reason(error)}); a script must have its calls below "
                'if __name__ == "__main__":'
            ) from error
        waiting = iter(gaps)
        batch_of: dict[Any, int] = {}

        def send(pipe: Any) -> None:
            if (batch := next(waiting, None)) is not None:
                batch_of[pipe] = batch
                with contextlib.suppress(OSError):  # the process has ended, which `wait` tells
                    pipe.send(store.extent(batch))

        for process in processes:
            send(process.pipe)
        while batch_of:
            pipe: Any
            for pipe in multiprocessing.connection.wait(batch_of):
                batch = batch_of.pop(pipe)
                try:
                    results, failure = pipe.recv()
                except (EOFError, OSError) as error:
                    raise _BatchError(batch, "was lost, as its worker process ended") from error
                if isinstance(failure, InterruptedRunError):
                    raise failure
                if failure is not None:
                    raise _BatchError(batch, failure)
                send(pipe)
                yield batch, results
    finally:
        for process in processes:
            process.end()


# -- on a cluster, by the extra of this name

_at_work = threading.Lock()
"""Held by the thread that makes a batch: a worker with several threads makes one batch at a time."""
_jobs: dict[str, Any] = {}
"""The job of this worker, by its digest."""


def _made_on_worker(version: str, digest: str, parcel: bytes, begin: int, end: int) -> Any:
    """Make a batch in a worker process. The parcel of a job is unpacked once."""
    with _at_work:
        if version != __version__:
            raise RunError(f"the worker has chainunit {__version__}, and must have {version}")
        if digest not in _jobs:
            _close()
            _jobs[digest] = pickle.loads(parcel)
        work, task, _ = _jobs[digest]
        return work(task, begin, end)


def _close() -> None:
    """Release what the job of this worker keeps."""
    while _jobs:
        _, _, close = _jobs.popitem()[1]
        if close is not None:
            close()


def _finish() -> None:
    """Release it at the end of the job, unless the worker is already at another one."""
    if _at_work.acquire(blocking=False):
        try:
            _close()
        finally:
            _at_work.release()


def _on_cluster(store: BatchStore, gaps: list[int], scheduler: str) -> Made:
    """Make batches on the workers of a scheduler, as `_on_processes` does in processes."""
    from distributed import as_completed
    from distributed.scheduler import KilledWorker

    job = store.job
    digest = job.layout().decode()
    parcel = pickle.dumps((job.work, job.task, job.close))
    with _silent(), _connection(scheduler) as client:
        sent = client.scatter(parcel, broadcast=True, hash=False)
        waiting = iter(gaps)
        batch_of: dict[str, int] = {}
        finished = as_completed(loop=client.loop)

        def refill() -> None:
            while len(batch_of) < len(client.nthreads()) and (batch := next(waiting, None)) is not None:
                future = client.submit(
                    _made_on_worker, __version__, digest, sent, *store.extent(batch), pure=False
                )
                batch_of[future.key] = batch
                finished.add(future)

        refill()
        for future in finished:
            batch = batch_of.pop(future.key)
            try:
                results = future.result()
            except (KilledWorker, asyncio.CancelledError, concurrent.futures.CancelledError) as error:
                # a worker that held the data of a batch cancels it, too, when it ends
                words = f"was lost, as its worker or the scheduler {scheduler} ended"
                raise _BatchError(batch, words) from error
            except InterruptedRunError:
                raise
            except Exception as error:
                raise _BatchError(batch, _failure(error)) from error
            del future
            refill()
            yield batch, results
        client.run(_finish)


_LOGS = ("distributed", "distributed.client", "tornado.application")


@contextmanager
def _silent() -> Iterator[None]:
    """No lines of Dask on the terminal: every failure becomes an error of this package."""
    try:
        import distributed  # noqa: F401 - it sets the levels when it is imported
    except ImportError as error:
        raise InputError("a scheduler needs Dask: pip install 'chainunit[cluster]'") from error
    before = {name: logging.getLogger(name).level for name in _LOGS}
    for name in _LOGS:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _connection(scheduler: str) -> Iterator[Any]:
    """A client of the scheduler at that address."""
    from distributed import Client

    _ask(scheduler)
    with Client(scheduler, timeout=PATIENCE, set_as_default=False) as client:
        yield client


def _not_dask(address: str) -> InputError:
    return InputError(
        f"scheduler {address}: answers, but is no Dask scheduler; give the address that it prints, such as "
        "tcp://10.0.0.5:8786"
    )


def _ask(scheduler: str) -> None:
    """Ask a scheduler for its workers. A client that cannot connect would go on trying in the background."""
    import distributed

    async def ask() -> Any:
        async with distributed.rpc(scheduler) as remote:
            return await remote.identity()

    async def ask_in_time() -> Any:
        return await asyncio.wait_for(ask(), PATIENCE)

    address = printable(scheduler)
    try:
        # in a thread, as the caller may have a loop that runs, such as that of a notebook
        with concurrent.futures.ThreadPoolExecutor(1) as thread:
            answer = thread.submit(lambda: asyncio.run(ask_in_time())).result()
    except Exception as error:
        if not isinstance(error, OSError | TimeoutError | ValueError):
            # bytes that are no message of Dask: the length of a message is then any number
            raise _not_dask(address) from error
        words = f"within {PATIENCE:g} s" if isinstance(error, TimeoutError) else f"({_reason(error)})"
        raise InputError(
            f'scheduler {address}: does not answer {words}; start it by "dask scheduler", and give the address that '
            "it prints, such as tcp://10.0.0.5:8786"
        ) from error
    if answer.get("type") != "Scheduler":
        raise _not_dask(address)
    if not answer.get("workers"):
        raise InputError(f'scheduler {address}: has no workers; start them by "dask worker {address}"')


def _reason(error: BaseException) -> str:
    return printable(str(error).splitlines()[0] if str(error) else type(error).__name__)


def check_scheduler(scheduler: str) -> None:
    """Find out whether a scheduler and its workers answer, before long work that comes first.

    Raises
    ------
    InputError
        where they do not answer within a few seconds.
    """
    with _silent():
        _ask(scheduler)
