"""A scheduler does not remember clients that have gone."""

import time

import pytest

pytest.importorskip("distributed")

from benchmarks.local_cluster import ADVISED, LocalCluster
from sss_tools.scheduler import connected

PATIENCE = 20.0
"""Seconds in which clients are surely forgotten, on a busy machine as well."""


def known_to_scheduler(dask_scheduler):
    """Groups of tasks, finished ones included, and topics of clients."""
    import gc

    from distributed.scheduler import TaskGroup

    gc.collect()
    groups = sum(type(thing) is TaskGroup for thing in gc.get_objects())
    return groups, sum(topic.startswith("Client") for topic in dask_scheduler._broker._topics)


def known_to_worker(dask_worker):
    """Sums of what tasks took."""
    return {name for name in dask_worker.digests_total if isinstance(name, tuple)}


def come_and_go(cluster, times):
    """Clients, one after the other, as commands are."""
    for _ in range(times):
        with connected(cluster.address) as client:
            numbers = client.map(abs, range(-4, 0), pure=False)
            assert client.gather(numbers) == [4, 3, 2, 1]


def look(cluster):
    """What the scheduler and its worker know."""
    with connected(cluster.address) as client:
        return client.run_on_scheduler(known_to_scheduler), *client.run(known_to_worker).values()


def test_neither_the_scheduler_nor_its_workers_keep_anything_of_clients_that_have_gone(tmp_path):
    soon = {
        "DASK_DISTRIBUTED__SCHEDULER__EVENTS_CLEANUP_DELAY": "100ms",
        "DASK_DISTRIBUTED__DIAGNOSTICS__COMPUTATIONS__MAX_HISTORY": "1",
    }
    with LocalCluster(tmp_path, 1, environment=ADVISED | soon) as cluster:
        cluster.wait_for_workers(1)
        come_and_go(cluster, 1)
        _, first = look(cluster)
        come_and_go(cluster, 6)
        deadline = time.monotonic() + PATIENCE
        while True:
            (groups, topics), sums = look(cluster)
            # the group of the last computation, and the topics of the client that asks and of one that did just now
            if (groups <= 1 and topics <= 2) or time.monotonic() > deadline:
                break
            time.sleep(0.5)
        assert groups <= 1 and topics <= 2
        # what tasks take may be summed under a few names more, but not under new ones for each client
        assert first and len(sums) <= len(first) + 2
