"""Experiments on a Dask cluster that already exists: the same tasks, the same answers, on other machines.

Dask hands the tasks out and finds out that a worker died; the computing is done by a fresh process for each task, beside
the worker. So a worker that has run for weeks computes with the sources as they are on its disk now, and code that ends
its process ends no worker.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from replication.audit.pool import KILLED
from replication.audit.worker import Answer, Task
from replication.errors import AuditError

TIMEOUT = 20
"""Seconds to wait for the scheduler, and for a first worker."""


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """A task with what the machine that computes it must have: sources by checksum, Python, versions of packages."""

    name: str
    function: str
    inputs: str
    sources: dict[str, str]
    python: str
    packages: dict[str, str]


@dataclass(frozen=True)
class Cluster:
    """The cluster whose scheduler is at `address`, for example `tcp://10.0.0.1:8786`.

    Its workers need this package at the same sources, with the same versions of Python and packages; each task is
    compared before it is computed. A task whose worker is lost is given to another one, three times at most.
    """

    address: str

    def compute(self, tasks: Sequence[Task]) -> Iterator[Answer]:
        """Yield the answer of each task as it comes.

        Raises AuditError if Dask is not installed or no scheduler or worker answers.
        """
        try:
            from distributed import Client, as_completed
        except ModuleNotFoundError:
            raise AuditError("a cluster needs Dask; install it with `pip install distributed`") from None
        try:
            client: Any = Client(self.address, timeout=TIMEOUT, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise AuditError(f"no scheduler answers at {self.address!r}: {error}; start one with `dask scheduler`") from None
        futures: list[Any] = []
        try:
            _wait_for_worker(client, self.address)
            orders = [msgspec.json.encode(_order(task)) for task in tasks]
            futures = [client.submit(compute_apart, order, pure=False, key=_key(task)) for task, order in zip(tasks, orders)]
            names = {future.key: task.name for future, task in zip(futures, tasks, strict=True)}
            for future in as_completed(futures):
                yield _answer(names[future.key], future)
        finally:
            client.cancel(futures)
            client.close()
