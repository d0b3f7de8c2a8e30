"""For schedulers of Dask that live for days: ``dask scheduler --preload sss_tools.long_lived_scheduler``.

Dask keeps for ever what each client that ever connected did, for people who look at it: a span with its groups of tasks
at the scheduler, some sums for each span at every worker, and a topic, empty in the end, of its messages. Commands that
come and go are clients that come and go, so all that is left out here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from distributed import Scheduler


class NoSpans:
    """Takes the place of the scheduler's extension for spans and keeps nothing; workers then have no spans either."""

    def observe_tasks(self, *_: Any, **__: Any) -> Mapping[str, Any]:
        """No annotations for any task."""
        return {}

    def heartbeat(self, *_: Any) -> None:
        """What workers would add to spans."""


def dask_setup(scheduler: Scheduler) -> None:
    """What Dask calls when the scheduler starts."""
    if "spans" in scheduler.extensions:
        scheduler.extensions["spans"] = NoSpans()
    if hasattr(scheduler, "_broker"):
        _drop_empty_topics(scheduler._broker)


def _drop_empty_topics(broker: Any) -> None:
    """Let a topic that is emptied, as is done some time after its client has gone, go as well."""
    empty = broker.truncate

    def drop(topic: str | None = None) -> None:
        empty(topic)
        if topic in broker._topics and not broker._topics[topic].subscribers:
            del broker._topics[topic]

    broker.truncate = drop
