"""A connection to a Dask cluster, or one line that says why there is none."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from .errors import InputError

if TYPE_CHECKING:
    from distributed import Client

CONNECT = 10.0
"""Seconds to wait for the scheduler to answer."""


@contextmanager
def connected(address: str) -> Iterator[Client]:
    """A client of the scheduler at ``address``, closed in the end; what it asked for and nobody fetched is dropped.

    Raises InputError where distributed is not installed or no scheduler answers. Dask's own log stays silent: what
    goes wrong is said by who uses the client.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError(
            "--scheduler", f"needs the package {error.name}", "install it: pip install 'sss-tools[cluster]'"
        ) from error
    # it sets levels for some of its modules, so the parent's alone says nothing
    for name in [*logging.root.manager.loggerDict, "tornado", "asyncio"]:
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            # one line of a table's many; that results agree is checked where they come in
            warnings.filterwarnings("ignore", category=_version_warning())
            client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(
            f"--scheduler {address}", "no Dask scheduler answers there", "use for example tcp://HOST:8786"
        ) from error
    with client:
        yield client


def is_gone(error: BaseException, client: Client) -> bool:
    """Whether an error of a client means that its scheduler can no longer be asked."""
    import asyncio
    import concurrent.futures

    gone = asyncio.CancelledError, concurrent.futures.CancelledError, OSError
    return isinstance(error, gone) or client.status != "running"


def _version_warning() -> type[Warning]:
    from distributed.versions import VersionMismatchWarning

    return VersionMismatchWarning
